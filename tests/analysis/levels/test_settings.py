"""Levels that participants set: found, reported, drawn and exported."""

import math
import re
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from study_app import figure_style as style
from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.figures.level_figures import _draw_settings
from study_app.analysis.levels.answers import SettingEstimate, Settings, setting_estimates
from study_app.analysis.levels.statistic import digits
from study_app.analysis.page_layout import Look
from study_app.analysis.report.write_report import report
from study_app.analysis.results import LevelsResult
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
    return frame.assign(block="set", standard=standard, analysed=True, response="1", outcome="complete")


def test_settings_that_do_not_count_and_trials_without_one_are_left_out() -> None:
    table = rows(("A", 3.0, 5.0), ("A", 17.0, 7.0), ("A", 3.0, 18.0), ("A", 17.0, math.nan))
    table.loc[2, "analysed"] = False
    table["setting"] = table["setting"].astype("Float64").where(table["setting"].notna())
    _, a = setting_estimates(block(), table)
    assert a.levels == (5.0, 7.0)


def setting_texts(standard: bool, *outcomes: str) -> tuple[str, str, list[str]]:
    """Return the section, the limitations and the methods of settings at 2, 6 and 18 with these outcomes."""
    table = rows(("A", 3.0, 2.0), ("A", 17.0, 6.0), ("B", 3.0, 18.0), standard=6.0 if standard else None)
    set_block = block(standard=standard)
    result = LevelsResult(
        block="set", title="Set", design="adjustment", revealed=True, times=(), summary="settings", counts="",
        quantity="damping", unit="N·s/m", level_kind="value", spacing="log",
        statistics={Settings.key: tuple(setting_estimates(set_block, table.assign(outcome=outcomes)))},
    )  # fmt: skip
    settings = Settings(result)
    methods = [*settings.methods(set_block), *Settings.common_methods([result])]
    return "".join(settings.section()), " ".join(settings.limits()), methods


def test_settings_without_a_standard_are_not_described_as_matches() -> None:
    matched = " ".join(map(str, setting_texts(True, "complete", "complete", "complete")))
    assert all(words in matched for words in ("PSE", "JND", "equal", "constant error", "point of subjective equality"))
    section, limits, methods = setting_texts(False, "complete", "complete", "complete")
    described = f"{section} {limits} {' '.join(methods)}"
    assert not [words for words in ("PSE", "JND", "equal", "constant error", "standard and") if words in described]
    assert "mean setting [N·s/m]" in section
    assert "own criterion" in limits
    assert "the mean of the settings, their standard deviation and the hysteresis" in methods[-1]


def test_settings_that_timed_out_or_lie_at_an_end_of_the_range_are_counted() -> None:
    section, limits, methods = setting_texts(True, "timeout", "complete", "complete")
    counts = "1 of 3 settings was ended by the time limit and 2 lie at an end of the range"
    assert f"Set: {counts}. They are included, so means may be biased and intervals too narrow." in limits
    assert f"In “Set”, {counts}; these settings were included." in methods
    assert "timed out" in section
    assert "at an end of the range" in section
    group, a, b = setting_estimates(block(), rows(("A", 3.0, 2.0), ("A", 17.0, 6.0), ("B", 3.0, 18.0)))
    assert [(row.timed_out, row.at_ends) for row in (group, a, b)] == [(0, 2), (0, 1), (0, 1)]
    assert [digits(value) for value in (-14.2, 70.7, None)] == ["−14.2", "70.7", "–"]


@pytest.mark.parametrize(
    ("standards", "error", "names", "ends"),
    [
        ((20.0, 40.0), 1.0, ["A", "standard 20 N·s/m", "A", "standard 40 N·s/m"], (2.0, 40.0)),
        ((20.0, 20.0), 1.0, ["A", "A"], (2.0, 20.0)),
        ((20.0, 40.0), None, ["A", "standard 20 N·s/m", "A", "standard 40 N·s/m"], (2.0, 14.0)),
        ((None, 40.0), None, ["A", "A", "standard 40 N·s/m"], (2.0, 14.0)),
    ],
)
def test_settings_are_drawn_with_their_mean_interval_and_the_standard_they_are_compared_with(
    standards: tuple[float | None, float], error: float | None, names: list[str], ends: tuple[float, float]
) -> None:
    places = ((5.0, 9.0), 7.0, 6.0, 14.0), ((2.0, 8.0, 4.0), 4.7, None, None)
    own = [
        SettingEstimate(
            participant="A", standard=standard, n=len(levels), pse=pse, low=low, high=high, jnd=None,
            constant_error=error, hysteresis=None, levels=levels, started_high=(True, False, False)[: len(levels)],
        )
        for standard, (levels, pse, low, high) in zip(standards, places, strict=True)
    ]  # fmt: skip
    result = LevelsResult(
        block="set", title="Set", design="adjustment", revealed=True, times=(), summary="mean", counts="",
        quantity="damping", unit="N·s/m", level_kind="value", statistics={Settings.key: tuple(own)},
    )  # fmt: skip
    figure = _draw_settings(result, Look("Set", [], ["n = 1"], style.FALLBACK_FONTS)).figure
    texts = [text.get_text() for text in figure.texts]
    assert [text for text in texts if text == "A" or text.startswith("standard")] == names
    margin = 0.08 * (ends[1] - ends[0])
    for axes, estimate in zip(figure.axes, own, strict=True):
        assert axes.get_ylim() == pytest.approx((ends[0] - margin, ends[1] + margin))
        assert axes.get_xlim() == pytest.approx((0.4, estimate.n + 0.6))
        compared = [] if error is None else [estimate.standard]
        assert [line.get_ydata()[0] for line in axes.lines] == [estimate.pse, *compared]
        bands = [(patch.get_y(), patch.get_y() + patch.get_height()) for patch in axes.patches]
        assert bands == ([] if estimate.low is None else [(estimate.low, estimate.high)])
        filled, hollow = (marks.get_offsets().tolist() for marks in axes.collections[-2:])
        assert filled == [[1.0, estimate.levels[0]]]
        assert hollow == [[float(at), level] for at, level in enumerate(estimate.levels[1:], start=2)]


@pytest.fixture(scope="module")
def sealed_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("matching")
    return rehearse_answers(matching_file(folder), participants=3, seed=3, results=folder / "study", features={})


@pytest.fixture(scope="module")
def study(sealed_study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("opened") / "study"
    shutil.copytree(sealed_study, folder)
    assert unblind(folder, "AB", "to analyse").left == ()
    return folder


@pytest.fixture(scope="module")
def report_folder(study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    to = tmp_path_factory.mktemp("report")
    report(study, to, failed=pytest.fail)
    return to


def test_r_computes_the_same_settings(report_folder: Path) -> None:
    process = run_in_r(report_folder)
    assert (process.returncode, process.stderr) == (0, "")
    *_, counts, verdict = process.stdout.splitlines()
    assert verdict == "all numbers that R computed agree with the report"
    matching, of = re.findall(r"\d+", counts)
    assert matching == of == "18"  # three people: PSE, two ends, JND, error, hysteresis
    assert "matching, P002 at 6.0: hysteresis" in process.stdout


@pytest.mark.usefixtures("png_figures_only")
def test_levels_are_not_written_before_unblinding(sealed_study: Path, tmp_path: Path) -> None:
    report(sealed_study, tmp_path, failed=pytest.fail)
    assert not list(tmp_path.glob("settings-*"))
    assert not list(tmp_path.glob("*settings_data*"))
    text = (tmp_path / "report.html").read_text(encoding="utf-8") + (tmp_path / "report.json").read_text("utf-8")
    key = read_key(sealed_study)
    levels: list[Any] = []
    for session in StudyFolder(sealed_study).sessions():
        levels += [
            line["setting"] for line in raw(open_events(journal.read(session.journal), key)) if line.get("setting")
        ]
    assert levels
    assert not [level for level in levels if f"{level:.5g}" in text]
    assert "appear here after unblinding" in text
