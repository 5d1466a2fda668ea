"""What a velocity estimator makes of an even swing: the share of a damper's force that is in phase with the motion."""

from __future__ import annotations

import math

from study_app.haptics.model.estimators import NAMED
from study_app.haptics.model.scene import Velocity


def passed_share(velocity: Velocity, rate_hz: float, frequency_hz: float) -> float:
    """Return Re V/(jωX), the estimated velocity over the true one in a swing of ``frequency_hz``, sampled evenly.

    Of "ewma" and "lead" from the recursion, of windows from the weights of their least-squares slope at full length, of
    "kalman" from its lag.
    """
    return NAMED[velocity.kind].passed_share(velocity, 1 / rate_hz, 2 * math.pi * frequency_hz)


def fastest_hz(velocity: Velocity, rate_hz: float, share: float) -> float:
    """Return the highest frequency [Hz] up to which an estimator passes this share, to 1 mHz; at most 20 Hz."""
    low_hz, high_hz = 0.0, 20.0
    while high_hz - low_hz > 1e-3:
        middle_hz = (low_hz + high_hz) / 2
        low_hz, high_hz = (
            (middle_hz, high_hz) if passed_share(velocity, rate_hz, middle_hz) >= share else (low_hz, middle_hz)
        )
    return low_hz
