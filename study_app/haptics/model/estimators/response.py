"""What a velocity estimator makes of an even swing: the share of a damper's force that is in phase with the motion."""

from __future__ import annotations

import cmath
import math
from typing import Final

from study_app.haptics.model.scene import Ewma, Foaw, Given, Kalman, Line, Velocity

KALMAN_LAG_S: Final = 2e-3
"""What the Kalman filter lags by where a motion changes abruptly; in smooth ones less."""


def passed_share(velocity: Velocity, rate_hz: float, frequency_hz: float) -> float:
    """Return Re V/(jωX), the estimated velocity over the true one in a swing of ``frequency_hz``, sampled evenly.

    Of "ewma" from its recursion, of windows from the weights of their least-squares slope at full length, of "kalman"
    from its lag.
    """
    omega_per_s = 2 * math.pi * frequency_hz
    period_s = 1 / rate_hz
    back = cmath.exp(-1j * omega_per_s * period_s)
    true = 1j * omega_per_s
    match velocity:
        case Given():
            return 1.0
        case Kalman():
            return math.cos(omega_per_s * KALMAN_LAG_S)
        case Ewma():
            keep = math.pow(1 - velocity.alpha, period_s / 1e-3)
            return (((1 - keep) * (1 - back) / period_s / (1 - keep * back)) / true).real
        case Line() | Foaw():
            samples = velocity.samples
        case _:
            samples = 2
    middle = (samples - 1) / 2
    squares = sum((k - middle) ** 2 for k in range(samples))
    slope = sum((middle - k) * back**k for k in range(samples)) / squares / period_s
    return (slope / true).real


def fastest_hz(velocity: Velocity, rate_hz: float, share: float) -> float:
    """Return the highest frequency [Hz] up to which an estimator passes this share, to 1 mHz; at most 20 Hz."""
    low_hz, high_hz = 0.0, 20.0
    while high_hz - low_hz > 1e-3:
        middle_hz = (low_hz + high_hz) / 2
        low_hz, high_hz = (
            (middle_hz, high_hz) if passed_share(velocity, rate_hz, middle_hz) >= share else (low_hz, middle_hz)
        )
    return low_hz
