"""Points of subjective equality of two-interval blocks whose levels are values on both sides of a standard."""

import math

import numpy as np
import pandas as pd
import pytest
from statsmodels.discrete.discrete_model import Probit

from study_app.analysis.levels.thresholds import ThresholdEstimate, Thresholds, thresholds_of
from study_app.analysis.results import LevelsResult
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.stimuli import Stimulus

LEVELS = np.linspace(5.6, 10.4, 5)
PLANTED = {"P001": (8.6, 1.1), "P002": (7.7, 1.9), "P003": (8.1, 1.5), "P004": (8.9, 1.3)}
"""The PSE and the standard deviation of a comparison of each participant."""


def answers(repetitions: int) -> pd.DataFrame:
    """Return a table of drawn answers: whether the comparison was chosen at each level."""
    draw = np.random.default_rng(408)
    rows = [
        (person, float(level), bool(draw.normal(level, sd) > pse))
        for person, (pse, sd) in PLANTED.items()
        for level in draw.permuted(np.repeat(LEVELS, repetitions))
    ]
    return pd.DataFrame(rows, columns=["participant", "level", "success"])


def estimates(trials: pd.DataFrame, shift: float = 0.0) -> list[ThresholdEstimate]:
    """Return the group's and the participants' estimates if the standard and all levels are shifted."""
    ends = (float(LEVELS[0]) + shift, float(LEVELS[-1]) + shift)
    stimulus = Stimulus(vary="damping_nspm", level="value", levels=ends, standards=(8.0 + shift,), spacing="linear")
    return [*thresholds_of(trials.assign(level=trials["level"] + shift), stimulus, default_design("2ifc"))]


def half_width(estimate: ThresholdEstimate) -> float:
    assert estimate.low is not None
    assert estimate.high is not None
    return (estimate.high - estimate.low) / 2


def test_intervals_are_those_of_a_probit_fit_widened_by_the_variation_between_sessions() -> None:
    trials = answers(repetitions=40)
    _, *own = estimates(trials)
    for estimate in own:
        rows = trials[trials["participant"] == estimate.participant]
        fit = Probit(rows["success"].astype(float), np.column_stack([np.ones(len(rows)), rows["level"]])).fit(disp=0)
        (intercept, slope), covariance = np.asarray(fit.params), np.asarray(fit.cov_params())
        gradient = np.array([-1 / slope, intercept / slope**2])
        error, jnd = math.sqrt(gradient @ covariance @ gradient), 0.6745 / slope
        assert estimate.threshold == pytest.approx(-intercept / slope, abs=0.5 * error)
        between_sessions = 0.049 * math.log(10) * jnd
        assert half_width(estimate) == pytest.approx(1.96 * math.hypot(error, between_sessions), rel=0.25)


def test_a_shift_of_the_standard_and_all_levels_shifts_the_estimates_alone() -> None:
    trials = answers(repetitions=24)
    for here, there in zip(estimates(trials), estimates(trials, shift=40.0), strict=True):
        assert there.threshold - here.threshold == pytest.approx(40.0)
        assert half_width(there) == pytest.approx(half_width(here))


def test_the_table_shows_the_jnd_beside_the_width() -> None:
    result = LevelsResult(
        block="now",
        title="Now",
        design="2ifc",
        revealed=True,
        times=(),
        summary="share",
        counts="comparison chosen",
        unit="N·s/m",
        level_kind="value",
        family="normal",
        statistics={"thresholds": tuple(estimates(answers(repetitions=9)))},
    )
    columns = dict(column for column in Thresholds(result).table_columns() if column is not None)
    person = next(estimate for estimate in result.statistics["thresholds"] if estimate.participant == "P003")
    assert "PSE [N·s/m]" in columns
    assert Thresholds(result).heading() == "Points of subjective equality"
    assert float(columns["JND [N·s/m]"](person)) == pytest.approx(0.205 * person.width, rel=0.01)
