"""Lag and noise of estimators, and refusal of removed ones."""

import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.haptics.model.estimators import Ewma, Raw
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Withdrawn
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import pack
from tests.haptics.scenes import COMPILED, UNBENT, scene, vectors

COUNT_M = 38e-6
PEAK_MPS = 0.03 * 2 * np.pi * 1.5


def estimated_velocities(velocity, position_m, interval_s=None):
    """Return the velocities (n, 3) that an estimator finds in positions (n, 3) or (n,) along x, hand frame."""
    position_m = np.asarray(position_m, float)
    if position_m.ndim == 1:
        position_m = np.column_stack([position_m, 0 * position_m, 0 * position_m])
    t_s = np.cumsum(np.full(len(position_m), 1e-3) if interval_s is None else interval_s)
    return vectors(simulate(scene(scale=1, velocity=velocity, knee=UNBENT), Motion(t_s, position_m)), "velocity")


def quantised(x_m):
    """Return what an encoder of 38 µm reports."""
    return np.round(np.asarray(x_m) / COUNT_M) * COUNT_M


def lag_and_noise(velocity, seconds=4):
    """Return lag [ms] and noise [mm/s] on a quantised sinusoid of ±30 mm at 1.5 Hz, without the first 0.5 s."""
    t_s = np.arange(seconds * 1000) / 1000
    v = estimated_velocities(velocity, quantised(0.03 * np.sin(3 * np.pi * t_s + 0.3)))[500:, 0]
    lags_s = np.arange(0, 12.1, 0.25) / 1000
    errors = [np.sqrt(np.mean((v - PEAK_MPS * np.cos(3 * np.pi * (t_s[500:] - lag) + 0.3)) ** 2)) for lag in lags_s]
    best = int(np.argmin(errors))
    return 1e3 * lags_s[best], 1e3 * errors[best]


@pytest.mark.skipif(not COMPILED, reason="thousands of ticks")
@pytest.mark.parametrize(
    ("velocity", "lag_ms", "noise_mmps"),
    [(Raw(), 0.5, 15.9), (Ewma(), 9.5, 1.39)],
    ids=lambda value: getattr(value, "kind", value),
)
def test_lag_and_noise_on_a_quantised_sinusoid(velocity, lag_ms, noise_mmps):
    lag, noise = lag_and_noise(velocity)
    assert lag == pytest.approx(lag_ms, abs=0.3)
    assert noise == pytest.approx(noise_mmps, rel=0.1)


@pytest.mark.parametrize("kind", ["line", "foaw", "lead"])
def test_a_removed_estimator_is_refused_with_its_replacements(kind):
    with pytest.raises(
        StudyError, match=f'"{kind}" has been removed from the program: write "ewma", "kalman" or "raw"'
    ):
        pack(scene(velocity=Withdrawn(kind=kind)))
