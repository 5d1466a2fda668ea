"""Planted observers: what they show is what was planted, with the error that ``check`` expects."""

from __future__ import annotations

import pytest

from study_app.authoring.measures.observers import GivenUp, Planted, _longest, measurable, observe
from study_app.authoring.new_study import template
from study_app.protocol.checks.expected_precision import ThresholdPlan, expected, threshold_plan


def plan_of(trials: int = 40) -> ThresholdPlan:
    protocol = template("viscosity-jnd").protocol
    assert protocol is not None
    plan = threshold_plan(protocol, protocol.blocks["viscosity"])
    assert plan is not None
    return plan.with_trials(trials)


@pytest.mark.slow
def test_planted_observers_are_found_as_precisely_as_check_expects() -> None:
    plan = plan_of()
    found = observe(plan, 0.2, 0.02)
    assert found is not None
    low, middle, high = (found.course[-1][1][at] for at in (0, 2, 4))
    assert low < 0.2 < high
    assert middle == pytest.approx(0.2, rel=0.1)
    assert found.course[-1][0] == plan.trials == found.trials
    known = expected(plan)
    assert known is not None
    assert found.error == pytest.approx(2.303 * known.spread, rel=0.25)
    spreads = [quantiles[4] / quantiles[0] for _, quantiles in found.course]
    assert spreads[-1] < 0.6 * max(spreads)
    assert sum(share for _, share in found.asked) == pytest.approx(1.0)
    assert [one.trial for one in found.one] == list(range(1, plan.trials + 1))
    assert {one.track for one in found.one} == {1, 2}
    grid = {round(level, 9) for level in plan.stimulus.grid}
    assert {round(one.level, 9) for one in found.one} <= grid
    assert found.at_threshold == pytest.approx(0.5 + 0.48 / 2, abs=1e-6)  # half the way from guessing to lapsing
    assert found.found[0][30] > found.planted[30] > found.found[4][30]  # a lower threshold is a higher function


@pytest.mark.slow
def test_more_lapses_lower_the_function_and_raise_the_error() -> None:
    plan = plan_of(24)
    few, many = observe(plan, 0.2, 0.0), observe(plan, 0.2, 0.15)
    assert few is not None
    assert many is not None
    assert few.planted[-1] > many.planted[-1] + 0.1
    assert many.error > few.error


@pytest.mark.nightly
@pytest.mark.slow
def test_thresholds_beyond_the_levels_are_not_measurable_and_none_below_the_error_of_a_trial() -> None:
    found = measurable(plan_of(60), 0.02, least=0.1)
    assert found is not None
    assert found.ends is not None
    assert min(one.threshold for one in found.planted) >= 0.1 == pytest.approx(found.ends[0], rel=0.5)
    assert all(one.coverage > 0.9 for one in found.planted)


def test_the_range_is_the_longest_row_without_a_gap() -> None:
    good, biased, uncovered = (Planted(1.0, 0.05, 0.95), Planted(1.0, 0.2, 0.99), Planted(1.0, 0.0, 0.8))
    assert [one.measurable for one in (good, biased, uncovered)] == [True, False, False]
    listed = [Planted(float(at), 0.0, 0.95 if at not in {2, 6} else 0.5) for at in range(8)]
    assert _longest(listed) == (3.0, 5.0)
    assert _longest([biased]) is None


def test_a_simulation_is_given_up_when_asked() -> None:
    with pytest.raises(GivenUp):
        observe(plan_of(), 0.2, 0.02, lambda: True)
    with pytest.raises(GivenUp):
        measurable(plan_of(), 0.02, 0.0, lambda: True)
