"""The accuracy of velocity estimators: measured values agree with closed forms."""

import math

import numpy as np
import pytest

from study_app.evidence.stability.velocity import COUNT_M, PARTS, Stroke, errors, held_error, noise_mmps, plain_forces
from study_app.haptics.model.estimators import Ewma, Kalman, Raw, ewma_response
from tests.haptics.scenes import COMPILED

compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")


@compiled
@pytest.mark.slow
@pytest.mark.parametrize("alpha", [0.05, 0.1])
def test_the_error_of_ewma_follows_its_frequency_response(alpha):
    stroke_errors = errors(Ewma(alpha=alpha))
    for stroke in (it for it in stroke_errors if it.frequency_hz and it.amplitude_m == 0.03):
        w, t_s = 2 * math.pi * stroke.frequency_hz, np.linspace(0, 1, 10_000)
        passed = ewma_response(alpha, 1e-3, w)
        true = np.cos(w * t_s)
        estimated = abs(passed) * np.cos(w * t_s + np.angle(passed))
        expected = np.sqrt(np.mean((estimated * abs(estimated) - true * abs(true)) ** 2) / np.mean(true**4))
        assert stroke_errors[stroke] == pytest.approx(100 * expected, rel=0.03), stroke


@compiled
@pytest.mark.slow
def test_the_noise_of_the_raw_difference_follows_from_its_counts():
    """At v each tick has one count with probability p = v T/count, else none: count/T √(p (1 - p)), nearly all fast."""
    noise_by_speed = noise_mmps(Raw())
    for speed_mps in (0.005, 0.02):
        p = speed_mps * 1e-3 / COUNT_M
        assert noise_by_speed[speed_mps] == pytest.approx(1e3 * COUNT_M / 1e-3 * math.sqrt(p * (1 - p)), rel=0.05)


@compiled
@pytest.mark.slow
def test_a_held_handle_has_the_error_of_the_imposed_motion():
    """Quadratic drag in a firm hand, 3 Hz: the handle follows a sine closely, and EWMA lags by the same."""
    _, quadratic = plain_forces()
    held = held_error(quadratic, Ewma(), "firm", Stroke(0.02, 3.0))
    passed = ewma_response(0.1, 1e-3, 2 * math.pi * 3)
    assert held == pytest.approx(100 * 2 / math.sqrt(3) * abs(passed - 1), rel=0.1)
    assert held_error(quadratic, Kalman(), "firm", Stroke(0.02, 3.0)) < 0.25 * held


@pytest.mark.nightly
@compiled
@pytest.mark.slow
@pytest.mark.parametrize("part", [name for name in PARTS if name != "cost"])
def test_the_kalman_filter_meets_its_limits(part):
    rows = tuple(PARTS[part]())
    assert any(row.goal is not None for row in rows)
    assert [row.name for row in rows if not row.met] == []
