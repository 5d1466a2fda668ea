"""What the loop must know of a device beyond its force limit: delay, encoder count and least mass."""

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

MOST_DELAY: Final = 4
"""Ticks that a force may be late: beyond this no stable force is known."""
BELIEVED_TICKS: Final = 1
"""The delay that is taken where a device does not measure its own."""
_ROUNDING_TICKS: Final = 1e-6


class Dynamics(NamedTuple):
    """How a device closes the loop.

    ``delay_s`` is the measured time from a force being written until a position that it could have changed is read, as
    far as that is more than the tick in which it is written [s]; None where the device does not measure it. ``count_m``
    is one encoder count at the handle [m], ``mass_kg`` the least mass that the device presents there [kg].
    ``velocity_lag_s`` is the mean lag of the velocity that the device measures and gives with every new sample [s];
    None where it measures none.
    """

    delay_s: float | None = None
    count_m: float = 38e-6
    mass_kg: float = 0.1
    velocity_lag_s: float | None = None

    def delay_ticks(self, rate_hz: float) -> int:
        """Return the delay in whole ticks, rounded up; `BELIEVED_TICKS` where it is not measured."""
        return BELIEVED_TICKS if self.delay_s is None else math.ceil(self.delay_s * rate_hz - _ROUNDING_TICKS)

    def describe(self) -> dict[str, float | None]:
        """Return the numbers for the receipt."""
        return self._asdict()


UNKNOWN: Final = Dynamics()
"""A device that says nothing of itself: a Falcon's count, a light handle, one tick of delay."""


def dynamics_from(described: Mapping[str, Any]) -> Dynamics:
    """Return the dynamics that a receipt records of its device; `UNKNOWN` in receipts of earlier versions."""
    recorded = described.get("dynamics")
    return UNKNOWN if recorded is None else Dynamics(**recorded)
