"""A target that swings to and fro and is followed: a motion of known pace."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.table import Table
from study_app.protocol.texts import Localised
from study_app.protocol.trials.tasks.stroke import Point, Radius, Stroke


class Follow(Table):
    """A target that moves as A r(t) sin 2πft along an axis, with a raised-cosine ramp r over lead_s.

    The task ends after the lead and ``cycles`` whole periods; only the periods after the lead are judged.
    """

    kind: Literal["follow"]
    axis: Literal["x"] = Field(default="x", description="Axis along which the target moves, hand frame.")
    amplitude_mm: Annotated[float, within(1, 250, "the tank is 10 to 1000 mm wide, and a hand trembles")] = Field(
        default=20, description="From the middle to either end, hand frame [mm]."
    )
    frequency_hz: Annotated[float, within(0.05, 5, "a hand follows no faster swing, and a slower one is none")] = Field(
        default=1, description="Frequency of the target [Hz]."
    )
    cycles: int = Field(default=3, ge=1, le=1000, description="Number of periods after the lead, which are judged.")
    radius_mm: Radius = Field(default=6, description="Radius of the target [mm].")
    lead_s: Annotated[float, within(0.1, 10, "a hand needs 0.2 s to react; nothing of the lead is judged")] = Field(
        default=1, description="Time over which the amplitude rises before the judged periods [s]."
    )
    instruction: Localised | None = Field(
        default=None, description="One sentence shown under the tank; default: the program's own words."
    )

    activity: ClassVar[str] = "following a target"

    @property
    def summary(self) -> str:
        """What is done, for those who read the study."""
        swings = f"{self.cycles} swing" if self.cycles == 1 else f"{self.cycles} swings"
        return (
            f"follow a target of {self.radius_mm:g} mm that swings ±{self.amplitude_mm:g} mm at {self.frequency_hz:g} "
            f"Hz: {swings} after {self.lead_s:g} s"
        )

    @property
    def limit_s(self) -> float:
        """When the task ends by itself [s]."""
        return self.lead_s + self.cycles / self.frequency_hz

    @property
    def expected_s(self) -> float:
        """How long it takes [s]."""
        return self.limit_s

    @property
    def radius_m(self) -> float:
        """Radius of the target [m]."""
        return self.radius_mm / 1000

    @property
    def start_m(self) -> Point:
        """Where the target starts, hand frame [m]: the ball must be there before an interval begins."""
        return self.target_m(0.0)

    @property
    def amplitude_m(self) -> float:
        """From the middle to either end [m]."""
        return self.amplitude_mm / 1000

    @property
    def rms_speed_mps(self) -> float:
        """Root mean square of the target's speed over what is judged, A 2πf / √2 [m/s]."""
        return 2 * math.pi * self.frequency_hz * self.amplitude_m / math.sqrt(2)

    def fastest_stroke(self, _workspace_m: Point) -> Stroke:
        """Return the swing of the target."""
        return Stroke(self.frequency_hz, self.amplitude_m)

    def target_m(self, t_s: float) -> Point:
        """Return where the target is ``t_s`` after the task began, hand frame [m]; before it in the middle."""
        return self.amplitude_m * self._ramp(t_s) * math.sin(2 * math.pi * self.frequency_hz * t_s), 0.0, 0.0

    def _ramp(self, t_s: float) -> float:
        """Return the ramp r, 0 … 1."""
        if t_s <= 0:
            return 0.0
        return 1.0 if t_s >= self.lead_s else (1 - math.cos(math.pi * t_s / self.lead_s)) / 2
