"""The estimators that look back, line and foaw, the plain difference, and EWMA with lead."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.errors import StudyError
from study_app.haptics.model.estimators.lead import ALPHA, LEAD_S, SMOOTHING_S
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Ewma, Foaw, Lead, Line, Raw
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import pack, pack_into
from tests.haptics.scenes import COMPILED, UNBENT, examples, scene, vectors

COUNT_M = 38e-6
PEAK_MPS = 0.03 * 2 * np.pi * 1.5


def felt(velocity, position_m, interval_s=None):
    """Return the velocities (n, 3) that an estimator finds in positions (n, 3) or (n,) along x, hand frame."""
    position_m = np.asarray(position_m, float)
    if position_m.ndim == 1:
        position_m = np.column_stack([position_m, 0 * position_m, 0 * position_m])
    t_s = np.cumsum(np.full(len(position_m), 1e-3) if interval_s is None else interval_s)
    return vectors(simulate(scene(scale=1, velocity=velocity, knee=UNBENT), Motion(t_s, position_m)), "velocity")


def quantised(x_m):
    """Return what an encoder of 38 µm reports."""
    return np.round(np.asarray(x_m) / COUNT_M) * COUNT_M


def late(velocity, seconds=4):
    """Return lag [ms] and noise [mm/s] on a quantised sinusoid of ±30 mm at 1.5 Hz, without the first 0.5 s."""
    t_s = np.arange(seconds * 1000) / 1000
    v = felt(velocity, quantised(0.03 * np.sin(3 * np.pi * t_s + 0.3)))[500:, 0]
    lags_s = np.arange(0, 12.1, 0.25) / 1000
    errors = [np.sqrt(np.mean((v - PEAK_MPS * np.cos(3 * np.pi * (t_s[500:] - lag) + 0.3)) ** 2)) for lag in lags_s]
    best = int(np.argmin(errors))
    return 1e3 * lags_s[best], 1e3 * errors[best]


@pytest.mark.skipif(not COMPILED, reason="thousands of ticks")
@pytest.mark.parametrize(
    ("velocity", "lag_ms", "noise_mmps"),
    [(Raw(), 0.5, 15.9), (Ewma(), 9.5, 1.39), (Line(), 7.0, 0.64), (Foaw(), 4.5, 2.9)],
    ids=lambda value: getattr(value, "kind", value),
)
def test_lag_and_noise_on_a_quantised_sinusoid(velocity, lag_ms, noise_mmps):
    lag, noise = late(velocity)
    assert lag == pytest.approx(lag_ms, abs=0.3)
    assert noise == pytest.approx(noise_mmps, rel=0.1)


@pytest.mark.compiled
def test_the_line_is_quieter_and_sooner_than_ewma_and_foaw_ticks_first():
    def turned(velocity):
        t_s = np.arange(300) / 1000
        v = felt(velocity, quantised(np.where(t_s < 0.15, 0.1 * t_s, 0.1 * (0.3 - t_s))))[150:, 0]
        return int(np.flatnonzero(abs(v + 0.1) > 0.02).max()) + 1

    assert turned(Foaw()) <= 3
    assert 10 <= turned(Line()) <= 13
    assert 20 <= turned(Ewma()) <= 24


@pytest.mark.slow
@settings(max_examples=examples(60), deadline=None)
@given(
    x_m=st.lists(st.floats(-0.01, 0.01), min_size=2, max_size=40),
    interval_s=st.lists(st.floats(0.2e-3, 5e-3), min_size=40, max_size=40),
    samples=st.integers(2, 16),
)
def test_the_line_is_that_of_least_squares_through_the_newest_samples(x_m, interval_s, samples):
    interval_s = np.array(interval_s[: len(x_m)])
    t_s = np.cumsum(interval_s)
    v = felt(Line(samples=samples), x_m, interval_s)[:, 0]
    for k in range(1, len(x_m)):
        first = max(0, k + 1 - samples)
        slope = np.polyfit(t_s[first : k + 1] - t_s[k], x_m[first : k + 1], 1)[0]
        assert v[k] == pytest.approx(slope, rel=1e-6, abs=1e-9)


def longest_line(t_s, p_m, samples, tolerance_m):
    """Return the slope (3,) by the definition: the best-fit line over the longest window that misses no sample."""
    slope = np.zeros(3)
    for count in range(2, min(samples, len(t_s)) + 1):
        t, p = t_s[-count:] - t_s[-1], p_m[-count:]
        trial = np.array([np.polyfit(t, p[:, axis], 1)[0] for axis in range(3)])
        inside = p[1:-1] - (p[-1] + np.outer(t[1:-1], trial))
        if (np.linalg.norm(inside, axis=1) > tolerance_m).any():
            break
        slope = trial
    return slope


@pytest.mark.parametrize("seed", range(3))
def test_foaw_is_its_definition_in_space(seed):
    random = np.random.default_rng(seed)
    interval_s = random.uniform(0.5e-3, 2e-3, 200)
    p_m = np.cumsum(random.normal(0, 3e-6, (200, 3)).cumsum(axis=0), axis=0)
    t_s = np.cumsum(interval_s)
    v = felt(Foaw(samples=12, tolerance_m=2e-5), p_m, interval_s)
    expected = [longest_line(t_s[: k + 1], p_m[: k + 1], 12, 2e-5) for k in range(1, 200)]
    assert v[1:] == pytest.approx(np.array(expected), rel=1e-6, abs=1e-9)


def test_a_window_that_is_too_small_is_refused():
    with pytest.raises(StudyError, match=r'"line" looks at 15 samples.*room for 5'):
        pack_into(pack(scene(velocity=Line(samples=5))), scene(velocity=Line()))


def test_with_lead_a_parabola_lags_by_the_lag_of_ewma_less_the_lead():
    t_s = np.arange(600) / 1000
    lag_s = (2.0 * t_s - felt(Lead(), t_s**2)[:, 0])[-100:] / 2.0
    assert lag_s == pytest.approx(0.5e-3 + (1 - ALPHA) / ALPHA * 1e-3 - LEAD_S, abs=1e-8)
    usual_s = (2.0 * t_s - felt(Ewma(alpha=ALPHA), t_s**2)[:, 0])[-100:] / 2.0
    assert usual_s == pytest.approx(4.5e-3, abs=1e-8)


def test_lead_is_its_definition():
    random = np.random.default_rng(2)
    x_m = np.cumsum(random.normal(0, 1e-4, 300))
    e = a = 0.0
    expected = [0.0]
    for u in np.diff(x_m) / 1e-3:
        before, e = e, e + ALPHA * (u - e)
        a += -np.expm1(-1e-3 / SMOOTHING_S) * ((e - before) / 1e-3 - a)
        expected.append(e + LEAD_S * a)
    assert felt(Lead(), x_m)[:, 0] == pytest.approx(np.array(expected), rel=1e-6, abs=1e-9)
