"""What the report says of thresholds in words: what they cannot show, and the methods paragraph."""

import re
from dataclasses import replace

import pandas as pd
import pytest

from study_app.analysis.designs.level_conduct import catch_answers, level_conduct
from study_app.analysis.report.answers import level_conduct_section
from study_app.analysis.report.answers.level_limits import level_limits
from study_app.analysis.report.answers.level_methods import level_methods
from study_app.analysis.report.answers.threshold_section import section
from study_app.analysis.report.answers.withheld_section import withheld
from study_app.analysis.report.findings_summary import level_findings
from study_app.analysis.results.level_results import (
    CatchAnswers,
    ExponentFound,
    LevelAnswers,
    LevelConduct,
    LevelsFound,
    OwnDynamics,
    ThresholdFound,
    WithheldForce,
)
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.protocol.trials.kinds import default_design
from study_app.protocol.trials.methods.constant import Constant
from study_app.protocol.trials.methods.questplus import QuestPlus
from study_app.protocol.trials.methods.updown import UpDown
from tests.analysis.levels.level_studies import STIMULUS, block

GOOD = ThresholdFound(
    "P001", 8.0, 100, 0.2, 0.15, 0.27, width=1.4, lapse=0.01, guess=0.5, flat_width=0.205, fit_p=0.4, drift=0.05
)
DEVICE = (
    "Block: the device's own damping, friction and mass are unknown, since they were not measured; Weber fractions are "
    "of what the motors delivered, and smaller ones of the sum with the device's own."
)
MOTORS = "Block: motors are audible and were not masked: participants may have used their sound."


def found(*ones: ThresholdFound, standards: tuple[float, ...] = (8.0,)) -> LevelsFound:
    group = [ThresholdFound(None, standard, 3, 0.2, None, None) for standard in standards]
    answers = tuple(LevelAnswers("P001", standard, 0.2, 9.0, 5, 1, 3, 0.6, 0.2, 0.9) for standard in standards)
    return LevelsFound(
        "b", "Block", "2ifc", True, (), "share", "correct", vary="damping_nspm", quantity="damping", unit="N·s/m",
        level_kind="weber", spacing="log",
        answers=answers, thresholds=(*group, *ones), family="weibull",
    )  # fmt: skip


def people(*changed: ThresholdFound) -> list[ThresholdFound]:
    return [*changed, *(replace(GOOD, participant=f"P10{number}") for number in range(3))]


def test_good_thresholds_have_the_limits_of_the_device_alone() -> None:
    good = found(*people())
    assert list(level_limits(good)) == [DEVICE, MOTORS]
    assert list(level_limits(replace(good, level_kind="difference"))) == [MOTORS]


def test_measured_dynamics_of_the_device_are_stated_with_the_weber_fraction_of_the_sum() -> None:
    own = OwnDynamics(2.0, 0.1, 0.25, 3, 4)
    good = replace(found(*people()), device=own)
    sentence, motors = level_limits(good)
    assert motors == MOTORS
    assert sentence == (
        "Block: the device's own damping of 2 N·s/m, friction of 0.1 N and mass of 0.25 kg (measured for 3 of 4 "
        "sessions) add to what the motors delivered; Weber fractions are of the latter. With the device's damping in "
        "the standard, those of the group are 0.16 in place of 0.2 at 8 N·s/m."
    )
    assert "with device damping</th>" in "".join(section(good, {}))
    assert "with device" not in "".join(section(replace(good, device=None), {}))
    other = replace(good, vary="delay_ms", device=replace(own, sessions=4))
    assert next(iter(level_limits(other))).endswith("Weber fractions are of the latter.")


def test_findings_state_threshold_interval_n_and_exponent() -> None:
    group = ThresholdFound(None, 8.0, 3, 0.2041, 0.15, 0.27)
    exponents = (ExponentFound(None, 3, 0.91, 0.58, 1.234), ExponentFound("P001", 4, 0.9))
    block = replace(found(*people()), thresholds=(group, GOOD), exponents=exponents, guess_rate=0.5)
    threshold, exponent = level_findings(block)
    assert threshold == (
        "Block, standard 8 N·s/m: threshold 0.204 at 75 % correct (Weber fraction of damping; "
        "95 % interval 0.15 to 0.27; three participants)."
    )
    assert exponent == (
        "Block: Weber exponent 0.91 (95 % interval 0.58 to 1.23; three participants); "
        "1 is Weber’s law, 0 a constant JND."
    )
    assert list(level_findings(replace(block, thresholds=(), exponents=()))) == []
    (alone,) = level_findings(replace(block, thresholds=(replace(group, low=None, high=None),), exponents=()))
    assert "no interval" in alone


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"flat_width": 0.23}, "the prior of the width shifts a threshold by more than 10 %"),
        ({"flat_width": 0.17}, "the prior of the width shifts a threshold by more than 10 %"),
        ({"beyond": "above"}, "a threshold lies above the highest level presented"),
        ({"beyond": "below"}, "a threshold lies below the lowest level presented"),
        ({"fit_p": 0.049}, "the function does not fit the answers"),
        ({"drift": -0.3}, "answers became better or worse over the trials"),
        ({"n": 39}, "fewer than 40 answers"),
    ],
)
def test_each_limit_names_whose_threshold_it_is(changes: dict[str, float | str], words: str) -> None:
    first, *rest = level_limits(found(*people(replace(GOOD, **changes))))  # type: ignore[arg-type]  # any field
    assert first.startswith(f"Block: {words}")
    assert first.endswith("(P001).")
    assert rest == [DEVICE, MOTORS]


def test_several_standards_are_named_and_many_thresholds_counted() -> None:
    two = found(*people(replace(GOOD, fit_p=0.01)), replace(GOOD, standard=4.0), standards=(4.0, 8.0))
    assert "(P001 at 8)" in next(iter(level_limits(two)))
    many = [replace(GOOD, participant=f"P{number:03}", n=10) for number in range(9)]
    assert "(9 of 9 thresholds)" in next(iter(level_limits(found(*many))))


def test_two_participants_give_no_group_interval() -> None:
    *_, few, device, motors = level_limits(found(GOOD, replace(GOOD, participant="P002")))
    assert few.startswith("Block: two participants; below 3 the group has no interval, since differences between")
    assert (device, motors) == (DEVICE, MOTORS)
    assert list(level_limits(replace(found(), thresholds=()))) == []


@pytest.mark.parametrize(
    ("method", "words"),
    [
        (QuestPlus(), "QUEST+, which minimises the expected entropy of the threshold (Watson 2017; Prins 2013)"),
        (QuestPlus(learn="all"), "QUEST+, which minimises the expected entropy of all parameters (Watson 2017)"),
        (
            UpDown(rule="3down1up"),
            "(3down1up, steps down 0.7393 of those up; García-Pérez 1998), which converge to 83.2 %",
        ),
        (Constant(), "the method of constant stimuli"),
    ],
)
def test_methods_name_design_method_function_and_prior(method: QuestPlus | UpDown | Constant, words: str) -> None:
    block = LevelBlock("b", "Block", "main", default_design("2ifc"), STIMULUS, (), method)
    first, second, third = level_methods([block], [found(GOOD)])
    assert first.startswith(
        "In “Block” damping was judged by two-interval forced choice, at Weber fractions of 8 N·s/m"
    )
    assert words in first
    assert second == (
        "A Weibull function of the logarithm of the level was fitted, with a flat prior on the threshold, a log-normal "
        "one on the width (median 1.4 decades, factor 1.5) and lapse rates up to 5 %."
    )
    for name in ("Wichmann & Hill 2001", "Paule and Mandel (1982)", "Hartung and Knapp (2001)", "posterior medians"):
        assert name in third


def page(*rows: tuple[float | None, float, float]) -> str:
    """Return the section of comparisons in which at most so many percent were withheld, by standard and level."""
    found = tuple(WithheldForce(standard, level, level, 4, most / 2, most) for standard, level, most in rows)
    levels = LevelsFound(
        "b", "Block", "2ifc", True, (), "share", "correct", unit="ms", level_kind="difference", withheld=found
    )
    return re.sub(r"<[^>]+>", " ", "".join(withheld(levels)))


@pytest.mark.parametrize(
    ("most", "words"),
    [
        ((1.0, 4.9, 5.0), "in every comparison up to 80 ms."),
        ((1.0, 5.1, 0.0), "in every comparison up to 20 ms."),
        ((6.0, 0.0, 0.0), "in every comparison at no level presented."),
    ],
)
def test_the_longest_delay_ends_before_the_first_level_that_loses_more(most: tuple[float, ...], words: str) -> None:
    text = page(*((None, level, share) for level, share in zip((20.0, 40.0, 80.0), most, strict=True)))
    assert f"At most 5 % was withheld {words}" in text


def test_each_standard_has_its_own_longest_delay() -> None:
    text = page((0.0, 20.0, 1.0), (0.0, 40.0, 9.0), (50.0, 20.0, 7.0))
    assert "up to 20 ms at the standard of 0 ms." in text
    assert "at no level presented at the standard of 50 ms." in text


TRIALS = [  # participant, session, trial, standard, level, level_delivered, analysed, catch, right
    ("P001", 1, 1, 8.0, 0.2, 0.21, True, False, True),
    ("P001", 1, 2, 8.0, 0.4, 0.38, True, False, False),
    ("P001", 1, 3, 8.0, 0.6, None, True, True, False),
    ("P001", 1, 4, 8.0, 0.6, 0.6, True, True, True),
    ("P002", 1, 1, 8.0, 0.6, 0.9, False, True, False),
]
COLUMNS = ["participant", "session", "trial", "standard", "level", "level_delivered", "analysed", "catch", "right"]
INTERVALS = [  # participant, session, trial, attempt, interval, counted, invalid_reasons, pace_mps, apparent_mass_kg
    ("P001", 1, 1, 1, 1, False, "pace_error_percent", 0.9, 0.9),
    ("P001", 1, 1, 2, 1, False, "level_error_percent pace_error_percent", 0.9, 0.9),
    ("P001", 1, 1, 3, 1, True, None, 0.08, -0.01),
    ("P001", 1, 2, 1, 1, True, None, 0.1, -0.03),
    ("P002", 1, 1, 1, 1, False, "pace_error_percent", 0.9, 0.9),
]


@pytest.fixture
def opened() -> pd.DataFrame:
    frame = pd.DataFrame(TRIALS, columns=COLUMNS).assign(block="b")
    return frame.astype({"level_delivered": "Float64", "catch": "boolean", "right": "boolean"})


@pytest.fixture
def intervals() -> pd.DataFrame:
    names = ["participant", "session", "trial", "attempt", "interval", "counted", "invalid_reasons"]
    frame = pd.DataFrame(INTERVALS, columns=[*names, "pace_mps", "apparent_mass_kg"]).assign(block="b")
    return frame.astype({"pace_mps": "Float64", "apparent_mass_kg": "Float64", "invalid_reasons": "string"})


def test_conduct_is_that_of_the_trials_that_are_analysed(opened: pd.DataFrame, intervals: pd.DataFrame) -> None:
    (found,) = level_conduct(block(), opened, intervals)
    assert found == LevelConduct(
        standard=8.0,
        trials=4,
        repeated=2,
        reasons={"level_error_percent": 1, "pace_error_percent": 2},
        measured=3,
        error_mean=pytest.approx((0.01 - 0.02) / 3),
        error_largest=pytest.approx(0.02),
        pace_mps=pytest.approx(0.09),
        apparent_mass_kg=pytest.approx(-0.02),
    )


def test_catch_trials_are_counted_where_they_exclude_a_session_too(opened: pd.DataFrame) -> None:
    assert list(catch_answers(block(), opened)) == []
    kept, excluded = catch_answers(replace(block(), wrong_most=0.5), opened)
    assert kept == CatchAnswers("P001", 1, 2, 1, 0.5)
    assert excluded == CatchAnswers("P002", 1, 1, 1, 0.5)
    assert (kept.excludes, excluded.excludes) == (False, True)


def test_the_report_states_errors_reasons_estimator_and_the_rule(opened: pd.DataFrame, intervals: pd.DataFrame) -> None:
    found = LevelsFound(
        "b", "Block", "2ifc", True, (), "share", "correct", vary="damping_nspm", unit="N·s/m", level_kind="weber",
        conduct=tuple(level_conduct(block(), opened, intervals)),
        catches=tuple(catch_answers(replace(block(), wrong_most=0.5), opened)),
    )  # fmt: skip
    page = "".join(level_conduct_section.section(found, "kalman"))
    for words in (
        "Standard [N·s/m]", "−0.0033", "0.0200", "0.090", "−0.020", "with the velocity estimator kalman",
        "Limits that intervals did not keep: pace error in two intervals and level error in 1 interval.",
        "kept: at most 50 %", "excluded: above 50 %",
    ):  # fmt: skip
        assert words in page
    clean = replace(found, conduct=(replace(found.conduct[0], reasons={}, apparent_mass_kg=None),), catches=())
    page = "".join(level_conduct_section.section(clean, None))
    assert "Every interval kept its limits." in page
    assert "estimator" not in page
    assert "Catch trials" not in page
