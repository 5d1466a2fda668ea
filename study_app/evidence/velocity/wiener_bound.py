"""The least error of a force that a causal linear estimator computes from encoder counts: that of a Wiener filter.

The filter knows the spectrum of the motion, the count and the delay. The motion is noise about strokes of 1.6 Hz with
the power of ±20 mm: X ~ 1/(ω₀² − ω² + 2iζω₀ω)², ζ = 0.85. [choice] Counts are white noise of the variance count²/12.
The law is the scene's, made linear: damping, added mass and history.
"""

import math
from typing import Any, Final

import numpy as np
from scipy.linalg import solve_toeplitz

from study_app.evidence.hand_motions import along_x
from study_app.evidence.velocity.imposed_motions import Stroke
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.offline import simulate

STROKE: Final = Stroke(0.02, 1.6)
DAMPING_RATIO: Final = 0.85
ROWS: Final = 2**15
"""Rows of a period of the motion."""
TAPS: Final = 400
"""Positions that the filter uses."""


def wiener_bound(scene: Scene, count_m: float, delay_s: float) -> float:
    """Return the least RMS error of the force at the time ``delay_s`` after a sample [s], over the RMS of the force.

    ``count_m`` is one encoder count at the hand [m].
    """
    turns, power_m2 = _spectrum(scene.rate_hz)
    response = turns * _linear_law(scene, turns, np.sqrt(power_m2))
    variance_n2 = float(np.sum(np.abs(response) ** 2 * power_m2))
    covariance_m2 = _course(power_m2)[:TAPS]
    covariance_m2[0] += count_m**2 / 12
    covariance_nm = _course(response * np.exp(turns * delay_s) * power_m2)[:TAPS]
    explained_n2 = float(solve_toeplitz(covariance_m2, covariance_nm) @ covariance_nm)
    return math.sqrt(max(1 - explained_n2 / variance_n2, 0.0))


def _spectrum(rate_hz: float) -> tuple[Any, Floats]:
    """Return iω [1/s] and the motion's power [m²] at each frequency above 0."""
    frequency_hz = np.fft.rfftfreq(ROWS, 1 / rate_hz)[1:-1]
    ratio = frequency_hz / STROKE.frequency_hz
    power_m2 = 1 / ((1 - ratio**2) ** 2 + (2 * DAMPING_RATIO * ratio) ** 2) ** 2
    return 2j * math.pi * frequency_hz, STROKE.amplitude_m**2 / 2 * power_m2 / power_m2.sum()


def _course(values: Any) -> Floats:
    """Return the real course (`ROWS`,) of sines whose amplitude and phase at each frequency above 0 are given."""
    found: Floats = np.fft.irfft(np.concatenate([[0], values, [0]]), ROWS) * ROWS / 2
    return found


def _linear_law(scene: Scene, turns: Any, size_m: Floats) -> Any:
    """Return the force of the linear law closest to the scene's over the hand's velocity [N·s/m], at each frequency.

    It has damping, added mass and history, fitted along one course of the motion, in the second of two periods.
    """
    phase = np.random.default_rng(1).uniform(0, 2 * math.pi, len(turns))
    x_m = np.sqrt(2) * size_m * np.exp(1j * phase)
    v_mps = turns * x_m
    places_m, speeds_mps = (scene.scale * np.tile(_course(it), 2) for it in (x_m, v_mps))
    law_n = simulate(scene, along_x(np.arange(2 * ROWS) / scene.rate_hz, places_m, speeds_mps)).fx_n[ROWS:]
    parts = np.stack([np.ones_like(turns), turns, np.sqrt(turns)])
    courses = np.column_stack([_course(it * v_mps) for it in parts])
    return np.linalg.lstsq(courses, law_n - law_n.mean(), rcond=None)[0] @ parts
