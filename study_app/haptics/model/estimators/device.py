"""The velocity that the device measures."""

import math
from typing import Final, Literal

from study_app.haptics.model.estimator import EstimatorKind
from study_app.haptics.model.estimators.line import MAX_WINDOW, Line
from study_app.haptics.model.ranges import Frozen

CODE = 7

MOST_LAG_TICKS: Final = (MAX_WINDOW - 1) / 2
"""Greatest lag of a velocity that is used: beyond it no stable force is known."""
_ROUNDING_TICKS: Final = 1e-6


class DeviceVelocity(Frozen):
    """The velocity is the device's own measurement, which lags by ``lag_s`` on average.

    No scene file names it: `haptics.runtime.pack` puts it in place of the scene's estimator where a device measures its
    velocity.
    """

    kind: Literal["device"] = "device"
    lag_s: float = 0.0

    def window(self, period_s: float) -> Line:
        """Return the least-squares line of the same lag, whose slope limits hold for this velocity.

        How a device computes its velocity is not known; a line of n positions lags by (n - 1)/2 periods and has the
        noise of encoders. [choice]
        """
        samples = math.ceil(2 * self.lag_s / period_s - _ROUNDING_TICKS) + 1
        return Line(samples=min(max(samples, 2), MAX_WINDOW))


def _passed_share(velocity: DeviceVelocity, _period_s: float, omega_per_s: float) -> float:
    """Return the share of a mean over twice the lag."""
    angle = 2 * omega_per_s * velocity.lag_s
    return math.sin(angle) / angle if angle else 1.0


ESTIMATOR = EstimatorKind(
    name="device", label="Device", code=CODE, model=DeviceVelocity, passed_share=_passed_share, of_device=False
)
