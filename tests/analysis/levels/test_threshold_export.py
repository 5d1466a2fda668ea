"""The table of thresholds, the reversals of tracks, and times to answer by level, of a rehearsed study."""

import csv
import json
import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.analysis.export.export import export
from study_app.protocol.trials.methods.updown import UpDown
from study_app.protocol.trials.stimuli import Stimulus
from study_app.store.blinded.blinding import read_key
from study_app.store.blinded.sealing import opened
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.tables.column import header
from study_app.store.tables.level_columns import THRESHOLDS
from tests.compiled import needs_servo

pytestmark = [pytest.mark.nightly, pytest.mark.slow, needs_servo]
STIMULUS = Stimulus(vary="damping_nspm", levels=(0.02, 0.6), standards=(4, 8))
STEPS = UpDown(tracks=2, trials=24, step_up=2)
PEOPLE = ("P001", "P002", "P003")
ODD = {"SC": "second", "CS": "first"}


@pytest.fixture(scope="module")
def exported(opened_adaptive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    to = tmp_path_factory.mktemp("export")
    export(opened_adaptive, to, extras={"sav", "parquet", "psych-ds"})
    return to


def rows(folder: Path, name: str, study: str = "adaptive") -> list[dict[str, str]]:
    with (folder / f"study-{study}_description-{name}_data.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def tracks_of(folder: Path) -> dict[tuple[str, str], list[tuple[int, float, bool]]]:
    """Return trial, level and whether the answer was correct, by participant and track, straight from the journals."""
    key = read_key(folder)
    found: dict[tuple[str, str], list[tuple[int, float, bool]]] = defaultdict(list)
    for session in StudyFolder(folder).sessions():
        started: dict[int, dict[str, Any]] = {}
        for line in opened(journal.read(session.journal), key):
            if line["event"] == "trial_started" and line["block"] == "staircase":
                started[line["trial"]] = line
            elif line["event"] == "responses" and line["trial"] in started:
                trial = started[line["trial"]]
                right = line["items"][0]["value"] == ODD[trial["arrangement"]]
                track = key.codes["staircase"][trial["code"]]
                found[session.participant, track].append((line["trial"], trial["level"], right))
    return found


def test_thresholds_have_a_row_per_participant_and_standard_with_the_numbers_of_the_report(
    exported: Path, reported_adaptive: Path
) -> None:
    table = rows(exported, "thresholds")
    assert [(row["block"], row["standard"], row["participant"]) for row in table] == [
        *(("staircase", standard, person) for standard in ("4.0", "8.0") for person in PEOPLE),
        *(("quest", "8.0", person) for person in PEOPLE),
    ]
    assert list(table[0])[5:] == list(header(THRESHOLDS))
    held = json.loads((reported_adaptive / "report.json").read_text())["results"]["levels"]
    own = [one for block in held for one in block["thresholds"] if one["participant"]]
    sensitive = [one for block in held for one in block["sensitivities"] if one["participant"]]
    for row, one, other in zip(table, own, sensitive, strict=True):
        for name in ("threshold", "low", "high", "width", "lapse", "fit_p", "drift", "reversal_mean", "target_percent"):
            expected = "n/a" if one[name] is None else pytest.approx(one[name], rel=1e-9)
            assert (row[name] if one[name] is None else float(row[name])) == expected, name
        assert float(row["flat_width_threshold"]) == pytest.approx(one["flat_width"])
        assert float(row["d_prime"]) == pytest.approx(other["d_prime"])
        assert row["criterion"] == ("n/a" if row["block"] == "quest" else str(other["criterion"]))
        assert float(row["share_first"]) == pytest.approx(other["shares"]["first"])
        assert int(row["n"]) == one["n"] == (9 if row["block"] == "quest" else 24)


def test_reversals_are_those_of_the_tracks_as_they_ran(opened_adaptive: Path, exported: Path) -> None:
    exported_rows = {(row["participant"], int(row["trial"])): row for row in rows(exported, "tracks")}
    assert {row["reversal"] for row in exported_rows.values() if row["block"] == "quest"} == {"n/a"}
    means: dict[tuple[str, str], list[float]] = defaultdict(list)
    for (person, track), answers in tracks_of(opened_adaptive).items():
        staircase = STEPS.staircase(STIMULUS, int(track[-1]))
        heard = [(math.log10(level), right) for _, level, right in answers]
        at = staircase.reversals_at(heard)
        marked = [exported_rows[person, trial]["reversal"] for trial, _, _ in answers]
        assert marked == ["true" if place in at else "false" for place in range(len(answers))]
        mean = staircase.mean_of_reversals(heard, STEPS.average)
        means[person, track.partition("/")[0]] += [] if mean is None else [mean]
    for row in rows(exported, "thresholds"):
        if row["block"] == "staircase":
            own = means[row["participant"], f"{float(row['standard']):g}"]
            expected = "n/a" if not own else pytest.approx(10 ** np.mean(own))
            assert (row["reversal_mean"] if not own else float(row["reversal_mean"])) == expected
    assert any(means.values())


def test_blocks_without_a_threshold_have_their_sensitivity(opened_levels: Path, tmp_path: Path) -> None:
    export(opened_levels, tmp_path)
    table = rows(tmp_path, "thresholds", "levels")
    of = {block: [row for row in table if row["block"] == block] for block in ("pairs", "equal", "detect", "rate")}
    assert [(row["condition"], row["threshold"]) for row in of["pairs"]] == [
        (name, "n/a") for name in ("late", "other") for _ in PEOPLE
    ]
    assert all(row["d_prime"] != "n/a" and row["share_first"] != "n/a" for row in of["pairs"])
    assert {(row["d_prime"], row["threshold"] == "n/a") for row in of["equal"]} == {("n/a", False)}
    assert all(row["criterion"] != "n/a" for row in of["detect"])
    assert of["rate"] == []


def test_a_sealed_study_has_no_table_of_thresholds(sealed_levels: Path, tmp_path: Path) -> None:
    export(sealed_levels, tmp_path)
    assert not list(tmp_path.glob("*thresholds*"))


def test_times_to_answer_by_level_are_medians_of_correct_and_of_other_answers(
    exported: Path, reported_adaptive: Path
) -> None:
    held = json.loads((reported_adaptive / "report.json").read_text())["results"]["levels"]
    table = [row for row in rows(exported, "tracks") if row["block"] == "staircase"]
    block = next(one for one in held if one["block"] == "staircase")
    assert sum(one["right_n"] + one["wrong_n"] for one in block["level_times"]) == len(table)
    for one in block["level_times"]:
        here = [
            row
            for row in table
            if float(row["standard"]) == one["standard"] and one["low"] <= float(row["level_asked"]) <= one["high"]
        ]
        for name, right in (("right", "true"), ("wrong", "false")):
            seconds = [float(row["response_s"]) for row in here if row["right"] == right]
            assert one[f"{name}_n"] == len(seconds)
            assert one[f"{name}_s"] == (pytest.approx(np.median(seconds)) if seconds else None)
