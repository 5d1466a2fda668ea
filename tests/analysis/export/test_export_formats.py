"""Exports for other programs: what is written comes back, with every trap that such formats have."""

import csv
import io
import json
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from study_app.analysis.export.psychds_dataset import FOLDER
from study_app.analysis.export.table_files import Extra
from study_app.analysis.export_study import export
from study_app.errors import AnalysisError, MissingExtra, naming_the_extra
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.simulated import NO_FEATURES
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.unblinding import unblind
from tests.analysis.conftest import HIDDEN, SMALL, Results
from tests.analysis.export.described import undescribed

pytestmark = pytest.mark.slow

pyreadstat = pytest.importorskip("pyreadstat", reason="the extra analysis is not installed")

NOTE = '=1+1, "so" — naïve 😀\nnew line'
ALL: tuple[Extra, ...] = ("wide", "parquet", "sav", "psych-ds")


@pytest.fixture
def to(tmp_path: Path) -> Path:
    return tmp_path / "out"


def table(to: Path, study: str, name: str, ending: str) -> Path:
    return to / f"study-{study}_description-{name}_data.{ending}"


def cells(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8")), strict=True))


def sav(path: Path, *, missing: bool = False) -> tuple[pd.DataFrame, Any]:
    frame: tuple[pd.DataFrame, Any] = pyreadstat.read_sav(str(path), user_missing=missing)
    return frame


def half_answered(small: Results) -> Results:
    """Fill the small study with rated, "cannot judge" and missing answers, two of each in every setting."""
    small.add("A", lambda condition, item: {"smooth": 7, "warm": None}[item], changes={"notes": NOTE})
    small.add("B", lambda condition, item: {"smooth": "cannot judge", "warm": 4}[item], changes={"notes": None})
    small.add("C", lambda condition, item: 3 if condition == "heavyzembla" else 6)
    return small


def test_a_statement_and_a_form_that_give_one_name_have_a_column_each_and_long_names_stay_apart(
    tmp_path: Path, to: Path
) -> None:
    item, heavy, light = "s" * 40, f"{'h' * 39}a", f"{'h' * 39}b"
    form = """
[questionnaires.smooth]
intro = { nl = "Nog iets. (nl)", en = "One more." }
[[questionnaires.smooth.items]]
id = "heavyzembla"
kind = "number"
from = 1
to = 3
text = { nl = "Hoe vaak?", en = "How often?" }
short = { nl = "Vaak", en = "Often" }
"""
    text = SMALL.replace('"try", "feel"]', '"try", "feel", "smooth"]')
    text = text.replace("[blocks.try]", f"{form}[blocks.try]", 1)
    text = text.replace("smooth", item).replace("heavyzembla", heavy).replace("lightquorn", light)
    (tmp_path / "small.toml").write_text(text, encoding="utf-8", newline="\n")
    features = dict.fromkeys((("try", "learn"), ("feel", heavy), ("feel", light)), (NO_FEATURES,))
    folder = rehearse_answers(
        tmp_path / "small.toml", participants=2, seed=1, results=tmp_path / "r", features=features
    )
    unblind(folder, "AB", "to analyse")
    export(folder, to, extras=["wide", "sav"])
    rows = cells(table(to, "small", "wide", "csv"))
    assert {f"{item}__{heavy}", f"feel__{item}__{heavy}", f"{item}__{light}"} <= rows[0].keys()
    assert all(row[f"{item}__{heavy}"] == "n/a" or float(row[f"{item}__{heavy}"]) <= 3 for row in rows)
    names = sav(table(to, "small", "wide", "sav"))[0].columns
    assert len(names) == len(rows[0])
    assert max(map(len, names)) == 64


def test_texts_of_any_script_and_length_survive_in_sav(small: Results, to: Path) -> None:
    long = "πρόβλημα 😀 " * 900  # over 255 bytes, where SPSS begins to cut texts into pieces; ends in a space
    small.add("A", lambda *_: 5)
    small.exclude("A", trial=1, reason=long.strip())
    small.exclude("A", trial=2, reason="kürzer")
    export(small.folder, to, extras=["sav"])
    frame, _ = sav(table(to, "small", "responses", "sav"))
    assert set(frame["exclusion_reason"]) == {long.strip(), "kürzer", ""}
    assert set(frame["participant"]) == {"A"}


def test_a_text_that_sav_cannot_hold_is_cut_at_a_letter(small: Results, to: Path) -> None:
    small.add("A", lambda *_: 5)
    small.exclude("A", reason="é" * 20_000)
    export(small.folder, to, extras=["sav"])
    frame, _ = sav(table(to, "small", "responses", "sav"))
    (reason,) = set(frame["exclusion_reason"])
    assert reason == "é" * 16_382 + "…"


def test_the_wide_table_for_spss_states_why_an_answer_is_missing(small: Results, to: Path) -> None:
    half_answered(small)
    for trial in build_schedule(small.protocol, "C", seed=1).trials:
        if small.key.condition(trial.block, trial.code) == "heavyzembla":
            small.exclude("C", trial=trial.number)
    small.open()
    export(small.folder, to, extras=["sav", "wide"])
    frame, about = sav(table(to, "small", "wide", "sav"), missing=True)
    cells = frame.set_index("participant")[["smooth__heavyzembla", "warm__heavyzembla", "smooth__lightquorn"]]
    assert cells.to_numpy().tolist() == [[7, 99, 7], [98, 4, 98], [97, 97, 6]]
    words = about.variable_value_labels["smooth__heavyzembla"]
    assert (words[97], words[99]) == ("Excluded", "No answer")
    hidden, _ = sav(table(to, "small", "wide", "sav"))
    assert hidden["smooth__heavyzembla"].isna().tolist() == [False, True, True]


def test_without_its_library_sav_is_refused_in_one_line_before_anything_is_read(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "pyreadstat", None)
    with pytest.raises(MissingExtra, match=r"needs pyreadstat.*pip install 'liquid-study\["), naming_the_extra():
        export(tmp_path / "nothing", tmp_path / "out", extras=["sav"])


@pytest.mark.parametrize("opened", [False, True])
def test_the_psych_ds_folder_keeps_the_rules(small: Results, to: Path, opened: bool) -> None:
    half_answered(small)
    if opened:
        small.open()
    export(small.folder, to, extras=["psych-ds"])
    assert undescribed(to / FOLDER) == set()
    variables = json.loads((to / FOLDER / "dataset_description.json").read_bytes())
    assert (variables["name"], variables["alternateName"]) == ("small", "A small study")
    tables = [path.name for path in (to / FOLDER).rglob("*.csv")]
    assert sorted(set(tables)) == sorted(tables), "no table is there twice"
    responses = to / FOLDER / "data" / table(to, "small", "responses", "csv").name
    assert responses.read_bytes() == table(to, "small", "responses", "csv").read_bytes()
    assert b"All participants are simulated" in (to / FOLDER / "README.md").read_bytes()


def test_sealed_values_are_in_no_format_before_unblinding(small: Results, to: Path) -> None:
    half_answered(small)
    exported_files = export(small.folder, to, extras=ALL)
    assert len(exported_files) == len(set(exported_files)) == len([path for path in to.rglob("*") if path.is_file()])
    for path in exported_files:
        content = path.read_bytes().lower()
        if path.suffix == ".parquet":
            content = str(pd.read_parquet(path).to_dict()).lower().encode()
        for word in HIDDEN:
            assert word.encode() not in content, path.name


def test_a_study_without_counted_participants_is_exported(small: Results, to: Path) -> None:
    small.add("A", lambda *_: 5, status="unfinished", trials=2)
    export(small.folder, to, extras=ALL)
    assert cells(table(to, "small", "wide", "csv")) == []
    assert len(sav(table(to, "small", "wide", "sav"))[0]) == 0


def test_a_failed_write_leaves_no_file_of_any_format(small: Results, to: Path) -> None:
    half_answered(small)
    to.mkdir()
    (to / FOLDER).write_text("in the way", encoding="utf-8", newline="\n")
    with pytest.raises(AnalysisError, match="cannot be written"):
        export(small.folder, to, extras=["psych-ds"])
    assert [path.name for path in to.iterdir()] == [FOLDER]
