"""Loops whose device measures the velocity: its lag is the one that is stated, and the limits of that lag are kept."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from study_app.haptics.kernels.tick_schedule import new_schedule
from study_app.haptics.model.layout import records
from study_app.validation.stability.case_groups import DEVICE_CASES, groups
from study_app.validation.stability.closed_loop import begin
from study_app.validation.stability.device_bench import lasts_s, new_bench, new_trace
from study_app.validation.stability.measured_velocity import MEASURED, measure_velocity
from study_app.validation.stability.stability_cases import DAMPER, DEVICE, FILTERS, OF_DEVICE, Case, parse
from study_app.validation.stability.verdict import judge
from tests.haptics.scenes import COMPILED

pytestmark = pytest.mark.slow
compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")


def measured(velocities_mps: Any, filter_name: str, lag: float, **fields: float) -> Any:
    """Return what a device with this filter says of velocities along x, one each tick."""
    device, pace = records(MEASURED, 1)[0], new_schedule(1e-3)
    device.filter, device.lag = 1 + FILTERS.index(filter_name), lag
    for name, value in fields.items():
        setattr(device, name, value)
    found = []
    for velocity_mps in velocities_mps:
        measure_velocity(device, np.array([velocity_mps, 0.0, 0.0]), 1, pace)
        found.append(float(device.seen_mps[0]))
    return np.array(found)


@pytest.mark.parametrize("lag", [0.0, 0.5, 1.0, 2.0, 4.0, 7.5])
@pytest.mark.parametrize("filter_name", FILTERS)
def test_a_ramp_is_late_by_the_stated_lag(filter_name: str, lag: float) -> None:
    ramp = np.arange(200.0)
    assert (ramp - measured(ramp, filter_name, lag))[150:] == pytest.approx(np.full(50, lag))
    assert measured(np.ones(5), filter_name, lag) == pytest.approx(np.ones(5))  # it has always been that


def test_noise_and_counts_are_those_asked_for() -> None:
    noisy = measured(np.full(4000, 0.1), "average", 0.0, noise_mps=0.01)
    assert 0.0095 < np.ptp(noisy) <= 0.01
    assert noisy.mean() == pytest.approx(0.1, abs=3e-4)
    counted = measured(np.linspace(0.0, 0.1, 500), "late", 0.0, count_mps=0.005)
    assert counted / 0.005 == pytest.approx(np.round(counted / 0.005))
    assert np.abs(counted - np.linspace(0.0, 0.1, 500)).max() <= 0.0025 + 1e-12


def test_the_line_of_a_case_reproduces_it_and_other_cases_keep_theirs() -> None:
    case = Case(estimator=DEVICE, velocity_lag=2.0, velocity_filter="late", velocity_noise_mmps=2.0)
    assert parse(str(case)) == case
    assert not any(name in str(Case()) for name in OF_DEVICE)


@pytest.mark.nightly
def test_the_group_has_each_lag_and_filter() -> None:
    (cases,) = (group.cases for group in groups() if group.name == "velocity measured by the device")
    assert len(cases) == len(set(cases)) == DEVICE_CASES >= 300
    assert {case.estimator for case in cases} == {DEVICE}
    assert {(case.velocity_lag, case.velocity_filter) for case in cases} == {
        (lag, name) for lag in (0.0, 0.5, 1.0, 2.0, 4.0, 7.5) for name in FILTERS
    }
    assert sum(case.liquid == DAMPER for case in cases) > 0.4 * len(cases)


@compiled
def test_the_tick_uses_what_the_device_measures() -> None:
    case = Case(estimator=DEVICE, velocity_lag=2.0, hand="firm", liquid="water")
    bench, trace = new_bench(case, safe=True), new_trace(case)
    begin(bench.loop, bench.handle)
    rows = bench.run(trace, 0, 0.2 * lasts_s(case))
    assert bench.sample[0].velocity_mps == pytest.approx(case.scale * bench.loop.velocity.seen_mps)
    assert np.linalg.norm(trace.velocity_mps[:rows], axis=1).max() > 0.1


DAMPED = Case(liquid=DAMPER, estimator=DEVICE, mass_kg=0.1, delay=1, hand="light", velocity_filter="late")


@compiled
@pytest.mark.parametrize("filter_name", FILTERS)
@pytest.mark.parametrize("lag", [0.0, 2.0, 7.5])
def test_the_strongest_damper_is_stable_at_the_limits_of_its_lag(lag: float, filter_name: str) -> None:
    case = dataclasses.replace(DAMPED, velocity_lag=lag, velocity_filter=filter_name)
    verdict = judge(case, safe=True)
    assert verdict.stable, verdict
    assert lag == 0.0 or filter_name == "first-order" or not judge(case, safe=False).stable
