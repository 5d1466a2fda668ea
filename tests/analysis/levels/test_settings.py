"""Levels that participants set: found, reported, drawn and exported."""

import math
import re
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.levels.answers import settings
from study_app.analysis.report.write_report import report
from study_app.protocol.trials.designs import Adjusted
from study_app.protocol.trials.methods import default_method
from study_app.protocol.trials.stimuli import Stimulus
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.unblinding import unblind
from tests.analysis.levels.level_studies import matching_file
from tests.analysis.report.read_report import run_in_r
from tests.journal_lines import raw

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]
LOG = Stimulus(vary="damping_nspm", level="value", levels=(2, 18), standards=(6,))


def block(stimulus: Stimulus = LOG, *, standard: bool = True) -> LevelBlock:
    return LevelBlock("set", "Set", "main", Adjusted(standard=standard), stimulus, (), default_method("adjustment"))


def rows(*held: tuple[str, float, float], standard: float | None = 6.0) -> pd.DataFrame:
    """Return the rows of `tracks` of participant, starting level and setting."""
    frame = pd.DataFrame(held, columns=["participant", "level", "setting"])
    return frame.assign(block="set", standard=standard, analysed=True, response="1")


def test_settings_that_do_not_count_and_trials_without_one_are_left_out() -> None:
    table = rows(("A", 3.0, 5.0), ("A", 17.0, 7.0), ("A", 3.0, 18.0), ("A", 17.0, math.nan))
    table.loc[2, "analysed"] = False
    table["setting"] = table["setting"].astype("Float64").where(table["setting"].notna())
    _, a = settings(block(), table)
    assert a.levels == (5.0, 7.0)


@pytest.fixture(scope="module")
def sealed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("matching")
    return rehearse_answers(matching_file(folder), participants=3, seed=3, results=folder / "study", features={})


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


def test_r_computes_the_same_settings(reported: Path) -> None:
    done = run_in_r(reported)
    assert (done.returncode, done.stderr) == (0, "")
    *_, counts, verdict = done.stdout.splitlines()
    assert verdict == "every number that R computes is the report's"
    found, of = re.findall(r"\d+", counts)
    assert found == of == "18"  # three people: PSE, two ends, JND, error, hysteresis
    assert "matching, P002 at 6.0: hysteresis" in done.stdout


@pytest.mark.usefixtures("figures_of_the_page")
def test_before_unblinding_there_are_steps_and_no_level(sealed: Path, tmp_path: Path) -> None:
    report(sealed, tmp_path, failed=pytest.fail)
    assert not list(tmp_path.glob("settings-*"))
    assert not list(tmp_path.glob("*settings_data*"))
    text = (tmp_path / "report.html").read_text(encoding="utf-8") + (tmp_path / "report.json").read_text("utf-8")
    key = read_key(sealed)
    levels: list[Any] = []
    for session in StudyFolder(sealed).sessions():
        levels += [
            line["setting"] for line in raw(open_events(journal.read(session.journal), key)) if line.get("setting")
        ]
    assert levels
    assert not [level for level in levels if f"{level:.5g}" in text]
    assert "appear here after unblinding" in text
