"""The fastest stroke that a task asks for, and the units that tasks share."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple, TypeAlias

from study_app.haptics.model.ranges import within

Seconds: TypeAlias = Annotated[float, within(0.1, 3600, "a hand moves within 0.1 s, no trial takes an hour")]
Radius: TypeAlias = Annotated[float, within(0.5, 100, "a hand at rest trembles by a few tenths of a millimetre")]
Point: TypeAlias = tuple[float, float, float]


class Stroke(NamedTuple):
    """A straight stroke to and fro: x = A cos 2πft in the hand frame."""

    frequency_hz: float
    amplitude_m: float

    @property
    def speed_mps(self) -> float:
        """The greatest speed [m/s]."""
        return 2.0 * math.pi * self.frequency_hz * self.amplitude_m

    @property
    def acceleration_mps2(self) -> float:
        """The greatest acceleration [m/s²]."""
        return 2.0 * math.pi * self.frequency_hz * self.speed_mps
