"""Loops whose device measures the velocity: its lag is the stated one, and its limits apply."""

import dataclasses

import numpy as np
import pytest

from study_app.evidence.stability.bench import Bench, lasts_s, new_trace
from study_app.evidence.stability.stability_cases import DAMPER, DEVICE, FILTERS, Case
from study_app.evidence.stability.verdict import judge
from tests.haptics.scenes import COMPILED

pytestmark = pytest.mark.slow
compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")


@compiled
def test_the_tick_uses_the_velocity_that_the_device_measures() -> None:
    case = Case(estimator=DEVICE, velocity_lag=2.0, hand="firm", liquid="water")
    bench, trace = Bench(case), new_trace(case)
    bench.begin()
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
    assert not verdict.reasons, verdict
    assert lag == 0.0 or filter_name == "first-order" or judge(case, safe=False).reasons
