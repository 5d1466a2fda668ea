"""EWMA with lead: exact in even motion, what it lags by, its noise, and the response that checks compute of it."""

import numpy as np
import pytest

from study_app.haptics.model.estimators.lead import ALPHA, LEAD_S, SMOOTHING_S
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Ewma, Lead
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import UNBENT, scene, vectors


def found(velocity, x_m, interval_s=1e-3):
    """Return the velocities (n,) found in positions (n,) along x, hand frame."""
    motion = Motion(np.arange(len(x_m)) * interval_s, np.column_stack([x_m, 0 * x_m, 0 * x_m]))
    return vectors(simulate(scene(scale=1, velocity=velocity, knee=UNBENT), motion), "velocity")[:, 0]


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
