"""Levels that participants set: found, reported, drawn and exported."""

import csv
import math
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.designs.adjustment_settings import settings
from study_app.analysis.designs.level_summaries import levels_found
from study_app.analysis.export.export import export
from study_app.analysis.report.answers.level_limits import level_limits
from study_app.analysis.report.write_report import report
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.analysis.tables.study_tables import load_study
from study_app.protocol.trials.designs import Adjusted
from study_app.protocol.trials.kinds import default_method
from study_app.protocol.trials.stimuli import Stimulus
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.blinding import read_key
from study_app.store.blinded.sealing import opened
from study_app.store.blinded.unblinding import unblind
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.tables.column import header
from study_app.store.tables.level_columns import SETTINGS
from tests.analysis.report.read_report import numbers, run_in_r
from tests.protocol.trials.matching import text_of

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]
LOG = Stimulus(vary="damping_nspm", level="value", levels=(2, 18), standards=(6,))


def block(stimulus: Stimulus = LOG, *, standard: bool = True) -> LevelBlock:
    return LevelBlock("set", "Set", "main", Adjusted(standard=standard), stimulus, (), default_method("adjustment"))


def rows(*held: tuple[str, float, float], standard: float | None = 6.0) -> pd.DataFrame:
    """Return the rows of `tracks` of participant, starting level and setting."""
    frame = pd.DataFrame(held, columns=["participant", "level", "setting"])
    return frame.assign(block="set", standard=standard, analysed=True, response="1")


def test_settings_on_log_spacing_are_averaged_as_logarithms() -> None:
    table = rows(("A", 2.1, 4.0), ("A", 17.0, 9.0), ("B", 2.2, 6.0), ("B", 16.0, 6.0))
    group, a, b = settings(block(), table)
    assert (a.participant, b.participant, group.participant, group.n) == ("A", "B", None, 2)
    assert a.pse == pytest.approx(6.0)
    assert a.jnd == pytest.approx(np.std(np.log10([4, 9]), ddof=1))
    assert a.hysteresis == pytest.approx(math.log10(9 / 4))
    assert (a.constant_error, b.constant_error) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert (a.levels, a.started_high) == ((4.0, 9.0), (False, True))
    assert group.pse == pytest.approx(6.0)
    assert group.hysteresis == pytest.approx(math.log10(9 / 4) / 2)


def test_without_an_interval_of_the_standard_there_is_no_constant_error() -> None:
    _, a = settings(block(standard=False), rows(("A", 3.0, 5.0), ("A", 17.0, 7.0)))
    assert a.constant_error is None
    _, alone = settings(block(standard=False), rows(("A", 3.0, 5.0), ("A", 17.0, 7.0), standard=None))
    assert (alone.standard, alone.n) == (None, 2)


def test_settings_that_do_not_count_and_trials_without_one_are_left_out() -> None:
    table = rows(("A", 3.0, 5.0), ("A", 17.0, 7.0), ("A", 3.0, 18.0), ("A", 17.0, math.nan))
    table.loc[2, "analysed"] = False
    table["setting"] = table["setting"].astype("Float64").where(table["setting"].notna())
    _, a = settings(block(), table)
    assert a.levels == (5.0, 7.0)


@pytest.fixture(scope="module")
def sealed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("matching")
    (folder / "matching.toml").write_text(text_of())
    return rehearse_answers(folder / "matching.toml", participants=3, seed=3, results=folder / "study", felt={})


@pytest.fixture(scope="module")
def study(sealed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("opened") / "study"
    shutil.copytree(sealed, folder)
    assert unblind(folder, "AB", "to analyse").left == ()
    return folder


@pytest.fixture(scope="module")
def reported(study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    to = tmp_path_factory.mktemp("report")
    report(study, to, failed=pytest.fail)
    return to


def settings_in(folder: Path) -> dict[str, list[tuple[float, float]]]:
    """Return starting level and setting of each trial by participant, straight from the journals."""
    found: dict[str, list[tuple[float, float]]] = {}
    key = read_key(folder)
    for session in StudyFolder(folder).sessions():
        start = 0.0
        for line in opened(journal.read(session.journal), key):
            if line["event"] == "trial_started":
                start = line["level"]
            elif line["event"] == "interval_ended" and line.get("setting") is not None and "invalid" not in line:
                found.setdefault(session.participant, []).append((start, line["setting"]))
    return found


def test_what_is_found_is_that_of_the_journals(study: Path) -> None:
    (found,) = levels_found(load_study(study))
    kept = settings_in(study)
    assert found.people == tuple(kept) == ("P001", "P002", "P003")
    for one in found.own_settings:
        starts, levels = zip(*kept[str(one.participant)], strict=True)
        assert one.levels == pytest.approx(levels)
        assert one.pse == pytest.approx(math.exp(np.mean(np.log(levels))))
        assert one.jnd == pytest.approx(np.std(np.log10(levels), ddof=1))
        assert one.started_high == tuple(start > 6 for start in starts)
        assert sorted(one.started_high) == [False, False, True, True]
        assert one.constant_error == pytest.approx(math.log10(one.pse / 6))
    assert all(2 <= level <= 18 for own in kept.values() for _, level in own)


def test_the_report_has_table_figure_words_and_limits(reported: Path, study: Path) -> None:
    page = (reported / "report.html").read_text(encoding="utf-8")
    text = re.sub(r"<[^>]+>", " ", page)
    for words in ("Settings", "PSE [N·s/m]", "JND [decades]", "constant error [decades]", "hysteresis [decades]"):
        assert words in text
    assert "group of 3" in text
    caption = (reported / "settings-matching.txt").read_text(encoding="utf-8")
    assert "point of subjective equality with its 95 % interval" in caption
    assert not list(reported.glob("levels-matching*"))
    assert not list(reported.glob("question-*")), "steps are no answers"
    methods = (reported / "methods.txt").read_text(encoding="utf-8")
    assert "set damping at the hand to the standard 6 N·s/m by the method of adjustment" in methods
    assert "Gescheider 1997" in methods
    (found,) = levels_found(load_study(study))
    assert any("not a threshold free of a criterion" in line for line in level_limits(found))
    (held,) = numbers(reported)["results"]["levels"]
    assert [one["participant"] for one in held["settings"]] == [None, "P001", "P002", "P003"]


def test_r_computes_the_same_settings(reported: Path) -> None:
    done = run_in_r(reported)
    assert (done.returncode, done.stderr) == (0, "")
    *_, counts, verdict = done.stdout.splitlines()
    assert verdict == "every number that R computes is the report's"
    found, of = re.findall(r"\d+", counts)
    assert found == of == "21"  # three people: PSE, two ends, JND, error, hysteresis; the group's PSE and ends
    assert "matching, P002 at 6 hysteresis" in done.stdout


def read(folder: Path, name: str) -> list[dict[str, str]]:
    with (folder / f"study-matching_description-{name}_data.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_export_has_a_table_of_settings_and_the_level_of_each_track(study: Path, tmp_path: Path) -> None:
    export(study, tmp_path)
    table = read(tmp_path, "settings")
    assert list(table[0])[5:] == list(header(SETTINGS))
    (found,) = levels_found(load_study(study))
    for row, one in zip(table, found.own_settings, strict=True):
        assert (row["n"], float(row["pse"]), float(row["jnd"])) == ("4", pytest.approx(one.pse), pytest.approx(one.jnd))
    tracks = read(tmp_path, "tracks")
    kept = {person: [level for _, level in own] for person, own in settings_in(study).items()}
    for person, levels in kept.items():
        assert [float(row["setting"]) for row in tracks if row["participant"] == person] == pytest.approx(levels)
    assert all(float(row["value"]).is_integer() for row in tracks)
    assert {float(row["value"]) > 0 for row in tracks} == {True, False}


def test_before_unblinding_there_are_steps_and_no_level(sealed: Path, tmp_path: Path) -> None:
    report(sealed, tmp_path, failed=pytest.fail)
    assert not list(tmp_path.glob("settings-*"))
    assert not list(tmp_path.glob("*settings_data*"))
    text = (tmp_path / "report.html").read_text(encoding="utf-8") + (tmp_path / "report.json").read_text()
    key = read_key(sealed)
    levels: list[Any] = []
    for session in StudyFolder(sealed).sessions():
        levels += [line["setting"] for line in opened(journal.read(session.journal), key) if line.get("setting")]
    assert levels
    assert not [level for level in levels if f"{level:.5g}" in text]
    assert "Not yet revealed" in text
