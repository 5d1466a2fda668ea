"""What a trial may show at most, and what an interval must deliver, to be valid."""

from typing import Annotated, ClassVar

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.table import ExtendedTable


class Limits(ExtendedTable):
    """Limits within which a trial is valid."""

    LATER: ClassVar[frozenset[str]] = frozenset(
        {"targets_percent", "level_error_percent", "level_error_ms", "pace_error_percent", "attempts"}
    )

    lateness_ms: Annotated[float, within(0.01, 1000, "no servo is more punctual, and 1 s is a failure")] = Field(
        default=2, description="99th percentile of the lateness of ticks [ms]."
    )
    worst_gap_ms: Annotated[float, within(0.25, 1000, "from a tick at 4 kHz to a second, which is a failure")] = Field(
        default=20, description="Longest time between two ticks [ms]."
    )
    delay_error_ms: Annotated[float, within(1, 1000, "no screen is more punctual, and 1 s is a failure")] = Field(
        default=25, description="95th percentile of achieved − requested delay [ms]."
    )
    frame_gap_ms: Annotated[float, within(1, 1000, "no screen is faster, and 1 s is a failure")] = Field(
        default=250, description="Longest time before the first frame or between two, or before the trial's end [ms]."
    )
    withheld_percent: Annotated[float, within(0.01, 100, "a share of the force; none withheld at all is rare")] = Field(
        default=5, description="Share of the force that slope limits, passivity controller and slew limit withhold [%]."
    )
    targets_percent: Annotated[float, within(0.01, 100, "a share of the targets; left out, any is enough")] | None = (
        Field(default=None, description="Least share of a reaching task's targets that must be reached [%].")
    )
    level_error_percent: Annotated[float, within(0.1, 100, "encoder counts alone give 0.2 %")] | None = Field(
        default=None, description="Error of an interval's delivered level [%]; default: 2."
    )
    level_error_ms: Annotated[float, within(0.1, 100, "frames of 120 Hz last 8 ms")] | None = Field(
        default=None, description="Error of a trial's delivered difference of delays [ms]; default: 2."
    )
    pace_error_percent: Annotated[float, within(1, 1000, "no hand keeps a pace to 1 %")] | None = Field(
        default=None, description="Error of the hand's RMS speed against a followed target's [%]; default: 40."
    )
    attempts: Annotated[int, Field(ge=1, le=100)] | None = Field(
        default=None, description="How often a trial of intervals is presented until it is delivered; default: 3."
    )
