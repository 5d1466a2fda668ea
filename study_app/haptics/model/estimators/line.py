"""The slope of the least-squares line through the newest positions."""

from typing import Literal

from pydantic import Field

from study_app.haptics.model.estimator import WINDOWS, EstimatorKind, line_share
from study_app.haptics.model.ranges import Frozen

CODE = 2
MAX_WINDOW = 16


class Line(Frozen):
    """The slope of the least-squares line through the newest positions."""

    kind: Literal["line"] = "line"
    samples: int = Field(default=15, ge=2, le=MAX_WINDOW, description="Number of positions.")


ESTIMATOR = EstimatorKind(
    name="line",
    label="Line",
    code=CODE,
    model=Line,
    passed_share=lambda velocity, period_s, omega_per_s: line_share(velocity.samples, period_s, omega_per_s),
    samples=lambda velocity: int(velocity.samples),
    parameter="samples",
    measured=WINDOWS,
)
