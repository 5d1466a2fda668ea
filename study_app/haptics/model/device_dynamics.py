"""A device's properties that the loop needs besides the force limit: delay, encoder count and least mass."""

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

MOST_DELAY: Final = 4
"""Greatest delay of a force [ticks]: beyond this no stable force is known."""
ASSUMED_TICKS: Final = 1
"""The delay assumed if a device does not measure its own."""
_ROUNDING_TICKS: Final = 1e-6


class Dynamics(NamedTuple):
    """The dynamics of a device within the control loop.

    ``delay_s`` is the measured time from the writing of a force to the reading of a position that it could have
    changed, minus the tick in which it is written [s]; None if the device does not measure it. ``count_m`` is one
    encoder count at the handle [m], ``mass_kg`` the least effective mass there [kg]. ``velocity_lag_s`` is the mean lag
    of the velocity that the device measures and gives with every new sample [s]; None if it measures none.
    ``assumed`` names those of ``count_m`` and ``mass_kg`` that neither the device reports nor a bench measured.
    ``force_error_n`` is the most by which the force sent may exceed the force asked, because the device rounds it [N].
    """

    delay_s: float | None = None
    count_m: float = 38e-6
    mass_kg: float = 0.1
    velocity_lag_s: float | None = None
    assumed: tuple[str, ...] = ()
    force_error_n: float = 0.0

    def delay_ticks(self, rate_hz: float) -> int:
        """Return the delay in whole ticks, rounded up; `ASSUMED_TICKS` where it is not measured."""
        return ASSUMED_TICKS if self.delay_s is None else math.ceil(self.delay_s * rate_hz - _ROUNDING_TICKS)

    @property
    def unknown(self) -> tuple[str, ...]:
        """The names of the unknown values: the delay if it was not measured, and the assumed values."""
        return (*(("delay_s",) if self.delay_s is None else ()), *self.assumed)

    def describe(self) -> dict[str, Any]:
        """Return the dynamics for a receipt; ``force_error_n`` only of a device that rounds."""
        described = {**self._asdict(), "assumed": list(self.assumed)}
        if not self.force_error_n:
            del described["force_error_n"]
        return described


UNKNOWN: Final = Dynamics(assumed=("count_m", "mass_kg"))
"""Defaults of a device that reports nothing: a Falcon's count, a light handle, one tick of delay."""


def dynamics_from(described: Mapping[str, Any]) -> Dynamics:
    """Return the device dynamics that a receipt records; `UNKNOWN` for receipts of earlier versions."""
    recorded = described.get("dynamics")
    return UNKNOWN if recorded is None else Dynamics(**{**recorded, "assumed": tuple(recorded.get("assumed", ()))})
