"""The tables of intervals and tracks: what is in them before and after the key is opened."""

import csv
import json
from collections import Counter
from pathlib import Path

import pytest

from study_app.analysis.export.export import export
from study_app.store.blinded.blinding import read_key
from study_app.store.blinded.sealing import opened
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.tables.columns import INTERVALS
from tests.compiled import needs_servo

pytestmark = [pytest.mark.nightly, pytest.mark.slow, needs_servo]
SEALED = {column.name for column in INTERVALS if column.sealed}
PRESENTED = {"standard": "S", "comparison": "C"}


@pytest.fixture(scope="module")
def exported(opened_levels: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    to = tmp_path_factory.mktemp("export")
    export(opened_levels, to, extras={"sav", "wide", "parquet", "psych-ds"})
    return to


def rows(folder: Path, name: str) -> list[dict[str, str]]:
    with (folder / f"study-levels_description-{name}_data.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_sealed_study_exports_its_intervals_without_what_tells_a_level(sealed_levels: Path, tmp_path: Path) -> None:
    export(sealed_levels, tmp_path)
    intervals = rows(tmp_path, "intervals")
    assert len(intervals) == 3 * (12 * 2 + 9 + 6 + 7 + 6 * 2 + 6 * 3 + 8 * 2)
    assert SEALED.isdisjoint(intervals[0])
    assert {"level", "standard", "presented", "force_mean_n"} < SEALED
    assert not (tmp_path / "study-levels_description-tracks_data.csv").exists()
    codebook = json.loads((tmp_path / "codebook.json").read_text())
    assert set(codebook["sealed_columns"]) >= SEALED
    assert [one["block"] for one in codebook["levels"]][:2] == ["viscosity", "detect"]
    assert "vary" not in codebook["levels"][0]


def test_tracks_have_a_row_per_trial_with_what_it_presented(opened_levels: Path, exported: Path) -> None:
    tracks = {(row["participant"], row["trial"]): row for row in rows(exported, "tracks")}
    key = read_key(opened_levels)
    for session in StudyFolder(opened_levels).sessions():
        for line in opened(journal.read(session.journal), key):
            row = tracks.get((session.participant, str(line.get("trial"))), {})
            if line["event"] == "trial_started":
                assert row["arrangement"] == line["arrangement"]
                assert row["track"] == key.codes[line["block"]][line["code"]]
                assert row["level_asked"] == ("n/a" if line["level"] is None else str(line["level"]))
                assert row["standard"] == ("n/a" if line["standard"] is None else str(line["standard"]))
            if line["event"] == "responses":
                (item,) = line["items"]
                assert row["response_s"] == str(round(item["first_s"] - item["onset_s"], 6))
            if line["event"] == "interval_ended":
                assert row[f"force_mean_n_{line['interval']}"] == str(line["force_mean_n"])
    assert len(tracks) == 3 * 54


def test_tracks_say_whether_answers_were_correct_and_which_rows_are_analysed(exported: Path) -> None:
    tracks = rows(exported, "tracks")
    for row in tracks:
        match row["block"]:
            case "viscosity" | "pairs":
                where = ["first", "second"].index(row["response"]) + 1
                assert row["right"] == str(where == int(row["comparison_interval"])).lower()
            case "detect":
                assert row["right"] == str((row["response"] == "yes") == (row["arrangement"] == "C")).lower()
            case "odd":
                odd = "C" if row["arrangement"].count("C") == 1 else "S"
                where = ["first", "second", "third"].index(row["response"])
                assert row["right"] == str(where == row["arrangement"].index(odd)).lower()
            case _:
                assert row["right"] == "n/a", row["block"]
        modulus = row["block"] == "number" and row["index"] == "1"
        assert row["analysed"] == str(not modulus).lower()
    slots = Counter((row["participant"], row["block"], row["code"]) for row in tracks)
    assert {int(row["slot"]) for row in tracks if row["block"] == "viscosity"} == set(range(1, 7))
    assert slots["P001", "viscosity", "A1"] == 6


def test_intervals_say_what_each_presented_and_a_track_has_neither_liquid_nor_delay(exported: Path) -> None:
    intervals, tracks = rows(exported, "intervals"), rows(exported, "tracks")
    letters: dict[tuple[str, str], str] = {}
    for row in intervals:
        letters[row["participant"], row["trial"]] = (
            letters.get((row["participant"], row["trial"]), "") + PRESENTED[row["presented"]]
        )
    assert letters == {(row["participant"], row["trial"]): row["arrangement"] for row in tracks}
    trials = rows(exported, "trials")
    assert {row["liquid"] for row in trials if row["block"] == "viscosity"} == {"n/a"}
    assert {row["delay_ms"] for row in trials if row["block"] == "viscosity"} == {"n/a"}
    assert {row["liquid"] for row in trials if row["block"] == "pairs"} == {"thin", "thick"}
