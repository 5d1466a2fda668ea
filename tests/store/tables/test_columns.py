import json
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.protocol.questions import KINDS
from study_app.store.blinded.blinding import open_or_draw_key
from study_app.store.folders import StudyFolder
from study_app.store.tables.column_dictionary import SECTIONS, dictionary_markdown
from study_app.store.tables.columns import PARTICIPANTS, PARTICIPANTS_2, RESPONSES_2
from study_app.store.tables.csv_files import guarded, unguarded
from study_app.store.tables.study_files import check_study, columns_of, write_description


@pytest.mark.parametrize(
    "line",
    [
        "| `response` | a whole number from 1 to 7 or n/a | The answer on the scale, from 1 (completely disagree) to 7 "
        "(completely agree). |",
        "| `simulated` | true or false | true if participant and device were simulated (a rehearsal). |",
        "| `force_peak_n` | a number of at least 0 or n/a [N] | Largest magnitude of the force sent to the device. "
        "**Sealed until unblinding.** |",
        "| `page_shown` | `page` | A page of text was shown. |",
        "| `due_ns` | a whole number [ns] | Time when the tick was due; its lateness is time_ns - due_ns. |",
    ],
)
def test_a_line_says_kind_unit_range_and_meaning(line: str) -> None:
    assert line in dictionary_markdown().splitlines()


def test_every_table_is_one_that_renders() -> None:
    """A header, its rule and rows of as many cells, with a line free before and after, below its heading and file."""
    text = dictionary_markdown()
    tables = [block for block in text.split("\n\n") if block.startswith("| ")]
    assert len(tables) == len(SECTIONS) + 1
    for table in tables:
        header, rule, *rows = table.rstrip("\n").split("\n")
        assert set(rule) <= set("| -")
        assert rows
        assert {row.count(" | ") for row in (header, *rows)} == {2}
    headed = r"^## .+\n\n`.+`: .+\n\n(?:[^|].*\n\n)?\| "
    assert len(re.findall(headed, text, re.MULTILINE)) == len(tables)


@given(st.text(alphabet="'=+-@\t\r a1＝", max_size=6) | st.text())
@pytest.mark.slow
def test_every_text_reads_back_unchanged(text: str) -> None:
    assert unguarded(guarded(text)) == text


@pytest.mark.parametrize("text", ['=HYPERLINK("http://x")', "+1", "-2", "@SUM(1)", "\t=1", "\r=1", "＝1", "'=1"])
def test_a_formula_has_an_apostrophe_before_it(text: str) -> None:
    assert guarded(text) == "'" + text


@pytest.mark.parametrize("opened", [False, True])
@pytest.mark.parametrize(
    ("rows", "grouped"), [((), False), (({}, {"study": "s"}), False), (({}, {"group": "A"}), True)]
)
def test_groups_are_a_column_of_participants_once_the_key_of_a_study_with_groups_is_open(
    tmp_path: Path, rows: tuple[dict[str, str], ...], grouped: bool, opened: bool
) -> None:
    study = StudyFolder(tmp_path)
    if opened:
        reveal = {"at": "2026-01-05T10:00:00+01:00", "by": "AB", "reason": "closed", "key_hash": "f" * 64}
        study.reveals.parent.mkdir()
        study.reveals.write_text(json.dumps(reveal) + "\n")
    assert columns_of(study, rows) == (PARTICIPANTS_2 if grouped and opened else PARTICIPANTS)


def test_the_column_of_kinds_names_every_kind_of_question() -> None:
    (kind,) = (column for column in RESPONSES_2 if column.name == "kind")
    assert set(KINDS) == set(kind.description.rstrip(".").partition(": ")[2].split(", "))


def test_a_new_version_of_the_study_renews_it(tmp_path: Path, protocol: Protocol) -> None:
    folder = StudyFolder(tmp_path)
    write_description(folder, protocol.study)
    newer = protocol.study.model_copy(update={"version": "1.1", "description": "What liquids feel like."})
    write_description(folder, newer)
    content = json.loads(folder.description.read_text(encoding="utf-8"))
    assert (content["version"], content["description"]) == ("1.1", "What liquids feel like.")


def test_no_study_is_begun_around_or_within_others(tmp_path: Path, protocol: Protocol) -> None:
    (tmp_path / "dataset_description.json").write_text("{}")  # of a project, which may well hold results
    results = StudyFolder(tmp_path / "results")
    study = StudyFolder(results.path / "brackish")
    study.data.mkdir(parents=True)
    open_or_draw_key(study.path, protocol)
    check_study(study, "brackish")
    check_study(StudyFolder(results.path / "other"), "other")
    with pytest.raises(StoreError, match=r"holds folders of studies \(brackish\).*results.brackish"):
        check_study(results, "brackish")
    for within in (study.data, study.path / "new" / "deep"):
        with pytest.raises(StoreError, match="which is a study's folder"):
            check_study(StudyFolder(within), "brackish")


def test_a_description_that_cannot_be_read_is_named(tmp_path: Path, protocol: Protocol) -> None:
    folder = StudyFolder(tmp_path)
    folder.description.mkdir()
    for attempt in (lambda: check_study(folder, "brackish"), lambda: write_description(folder, protocol.study)):
        with pytest.raises(StoreError, match=r"dataset_description\.json cannot be read \(it is not a file\)"):
            attempt()
