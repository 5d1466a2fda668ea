"""First-order adaptive windowing: the slope of the longest line that fits."""

from typing import Annotated, Any, Literal

from pydantic import Field

from study_app.haptics.model.estimator import WINDOWS, EstimatorKind, line_share
from study_app.haptics.model.estimators.line import MAX_WINDOW
from study_app.haptics.model.ranges import Frozen, within

CODE = 3


class Foaw(Frozen):
    """First-order adaptive windowing: the slope of the longest line that is within a tolerance of all its positions."""

    kind: Literal["foaw"] = "foaw"
    samples: int = Field(default=16, ge=2, le=MAX_WINDOW, description="Largest number of positions.")
    tolerance_m: Annotated[
        float,
        within(
            0,
            0.01,
            "10 mm is a third of a hand's stroke",
            what="Largest distance of a position from the line, hand frame [m]; default: an encoder count of a Falcon.",
        ),
    ] = 38e-6


def _fill(record: Any, velocity: Foaw, scale: float) -> None:
    record.tolerance_m = velocity.tolerance_m * scale


ESTIMATOR = EstimatorKind(
    name="foaw",
    label="Adaptive window",
    code=CODE,
    model=Foaw,
    passed_share=lambda velocity, period_s, omega_per_s: line_share(velocity.samples, period_s, omega_per_s),
    fill=_fill,
    samples=lambda velocity: int(velocity.samples),
    parameter="samples",
    measured=WINDOWS,
)
