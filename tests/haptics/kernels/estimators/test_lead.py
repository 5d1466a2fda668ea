"""EWMA with lead: exact in even motion, what it lags by, its noise, and the response that checks compute of it."""

import numpy as np
import pytest

from study_app.haptics.model.estimators.lead import ALPHA, LEAD_S, SMOOTHING_S
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Ewma, Lead
from study_app.haptics.runtime.offline import simulate
from study_app.protocol.checks.estimator_response import passed_share
from tests.haptics.scenes import COMPILED, UNBENT, Hand, scene, vectors

COUNT_M = 38e-6


def found(velocity, x_m, interval_s=1e-3):
    """Return the velocities (n,) found in positions (n,) along x, hand frame."""
    motion = Motion(np.arange(len(x_m)) * interval_s, np.column_stack([x_m, 0 * x_m, 0 * x_m]))
    return vectors(simulate(scene(scale=1, velocity=velocity, knee=UNBENT), motion), "velocity")[:, 0]


@pytest.mark.parametrize("interval_s", [0.5e-3, 1e-3, 4e-3])
def test_even_motion_is_exact_at_any_tick(interval_s):
    v = found(Lead(), 0.3 * interval_s * np.arange(400), interval_s)
    assert v[0] == 0.0
    assert v[-100:] == pytest.approx(0.3, rel=1e-5 if interval_s > 0.6e-3 else 1e-3)


def test_a_parabola_lags_by_the_lag_of_ewma_less_the_lead():
    t_s = np.arange(600) / 1000
    lag_s = (2.0 * t_s - found(Lead(), t_s**2))[-100:] / 2.0
    assert lag_s == pytest.approx(0.5e-3 + (1 - ALPHA) / ALPHA * 1e-3 - LEAD_S, abs=1e-8)
    usual_s = (2.0 * t_s - found(Ewma(alpha=ALPHA), t_s**2))[-100:] / 2.0
    assert usual_s == pytest.approx(4.5e-3, abs=1e-8)


def test_it_is_its_definition():
    random = np.random.default_rng(2)
    x_m = np.cumsum(random.normal(0, 1e-4, 300))
    e = a = 0.0
    expected = [0.0]
    for u in np.diff(x_m) / 1e-3:
        before, e = e, e + ALPHA * (u - e)
        a += -np.expm1(-1e-3 / SMOOTHING_S) * ((e - before) / 1e-3 - a)
        expected.append(e + LEAD_S * a)
    assert found(Lead(), x_m) == pytest.approx(np.array(expected), rel=1e-6, abs=1e-9)


@pytest.mark.skipif(not COMPILED, reason="thousands of ticks")
def test_its_noise_is_that_of_its_weight_raised_by_the_lead():
    """Differences of white counts: 1 + L w/Δt = 1.17 of the newest change passes at once."""
    x_m = np.round((0.005 * np.arange(6000) / 1000 + 1.23e-5) / COUNT_M) * COUNT_M
    lead, usual = (found(it, x_m)[1000:].std() for it in (Lead(), Ewma(alpha=ALPHA)))
    assert 1.05 < lead / usual < 1.25


@pytest.mark.parametrize("hz", [1.0, 3.0, 8.0])
def test_checks_know_what_it_passes_of_a_swing(hz):
    t_s, w = np.arange(3000) / 1000, 2 * np.pi * hz
    v, true = found(Lead(), 0.01 * np.sin(w * t_s))[1000:], 0.01 * w * np.cos(w * t_s)[1000:]
    assert passed_share(Lead(), 1000, hz) == pytest.approx((v @ true) / (true @ true), abs=2e-3)


def test_what_was_before_a_loss_of_the_body_is_forgotten():
    hand = Hand(scene(scale=1, velocity=Lead()))
    hand.sweep(0.2, 50)
    for _ in range(5):
        hand.tick((np.nan, 0, 0))
    assert not hand.tick((0.03, 0, 0)).velocity_mps.any()
    assert not hand.tick((0.03, 0, 0)).velocity_mps.any()
