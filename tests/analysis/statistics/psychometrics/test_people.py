"""Thresholds and their intervals hold for people: published answers, and people whose functions differ in width."""

import math

import numpy as np
import pytest

from study_app.protocol.trials import Stimulus
from study_app.psychophysics.grid import MANY_LAPSES
from study_app.psychophysics.people import Person
from tests.benchmarks.analysis import people, threshold_coverage


@pytest.mark.slow
def test_the_interval_of_a_difference_holds_for_people_and_for_stationary_observers(capsys) -> None:
    people.main("2")
    for row in capsys.readouterr().out.splitlines()[1:]:
        coverage, wider, stationary = (float(row.split()[at]) for at in (2, -2, -1))
        assert coverage >= 90, row
        assert wider <= 1.3, row
        assert stationary >= 93 - 2 * 1.8, row  # of 196 pairs, two standard errors


@pytest.mark.slow
def test_without_a_spread_between_sessions_it_does_not(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setattr(people, "STUDIES", ("checkerboard",))
    monkeypatch.setattr(Stimulus.analysis_grid, "__defaults__", (math.inf,))
    assert people.main("1") == 3


@pytest.mark.slow
@pytest.mark.parametrize(("width", "chance"), [(0.5, 0.04), (2.5, 0.13)])
def test_levels_and_widths_of_others_leave_thresholds_unbiased(width: float, chance: float) -> None:
    draw = np.random.default_rng(2)
    planted = 0.2 * 1.2 ** draw.normal(size=100)
    person = threshold_coverage.KINDS["as assumed"]._replace(width=width)
    presented = threshold_coverage.answered(threshold_coverage.Case(person), planted, draw, 80)
    thresholds_found = [
        fit.threshold for _, *own in threshold_coverage.studies(threshold_coverage.STIMULUS, *presented) for fit in own
    ]
    assert np.log(thresholds_found / planted).mean() == pytest.approx(0.0, abs=0.05 + chance)


@pytest.mark.slow
def test_the_threshold_for_many_lapses_is_unbiased_for_frequent_lapses() -> None:
    """Levels near the threshold do not show lapses: the estimate is too high unless the lapse rate is known."""
    case, draw = threshold_coverage.Case(Person(lapse=2 * MANY_LAPSES)), np.random.default_rng(3)
    presented = threshold_coverage.answered(case, np.full(60, 0.2), draw, 80)
    groups = [group for group, *_ in threshold_coverage.studies(case.stimulus, *presented)]
    known = [(group.threshold, group.if_many_lapses) for group in groups if group.if_many_lapses is not None]
    estimate, for_lapses = np.log10(known).mean(axis=0) - np.log10(0.2)
    assert len(known) >= 0.8 * len(groups)
    assert estimate > 0.05
    assert abs(for_lapses) < 0.5 * estimate
