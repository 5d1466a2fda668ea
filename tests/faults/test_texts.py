"""Typed texts are stored and read unchanged by every reader."""

import csv
from pathlib import Path

import pandas as pd
import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.session.transitions.events import EndRequested, Note, RepeatRequested
from study_app.session.transitions.state import Phase
from study_app.store.exclusions import exclude, exclusions
from study_app.store.files.csv_files import unguard_formula
from study_app.store.journals import journal
from study_app.store.verification.whole_study import verify_study
from tests.faults.support.worlds import StoredWorld
from tests.journal_lines import raw

TEXTS = (
    'she said "oil, or tar"',
    "two\nlines",
    "a\ttab",
    "🌊 naïve Łukasz 水",
    "=SUM(A1:A9)",
    "n/a",
    " leading and trailing ",
    ";-@+'",
    "x" * 10_000,
)


@pytest.mark.variants(5)
@pytest.mark.slow
@pytest.mark.parametrize("text", TEXTS)
def test_a_free_text_survives_journal_tables_and_readers(tmp_path: Path, text: str) -> None:
    world = StoredWorld(tmp_path / "study")
    world.start()
    world.until(Phase.TASK)
    world.runner.post(Note(world.clock(), "note", text))
    world.runner.post(RepeatRequested(world.clock(), f"again: {text}"))
    world.runner.post(EndRequested(world.clock(), "withdrawn", text))
    lines = raw(journal.read(world.store.folder.journal))
    assert [line["text"] for line in lines if line["event"] == "note"] == [text]
    assert lines[-1]["reason"] == text
    path = world.store.folder.table("small", "trials")
    with path.open(newline="", encoding="utf-8") as file:
        first, _ = list(csv.DictReader(file))
    assert unguard_formula(first["notes"]) == f"{text}\nrepeated: again: {text}"
    assert (first["notes"][0] == "'") == (text[0] in "=+-@")
    assert pd.read_csv(path, keep_default_na=False)["notes"][0] == first["notes"]
    excluded = exclude(tmp_path / "study", "P001", 1, by="AK", reason=text)
    assert exclusions(tmp_path / "study") == (excluded,)
    assert excluded.reason == " ".join(text.split())
    assert verify_study(tmp_path / "study").errors == ()
    study = load_study(tmp_path / "study")
    assert study.trials["notes"][0] == unguard_formula(first["notes"])
    assert study.exclusions == (excluded,)
    for table in (study.trials, study.participants):
        assert set(table["exclusion_reason"]) == {excluded.reason}
