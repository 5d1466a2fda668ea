"""The newest difference of positions."""

from typing import Literal

from study_app.haptics.model.estimator import EstimatorKind, line_share
from study_app.haptics.model.ranges import Frozen

CODE = 4


class Raw(Frozen):
    """The newest difference of positions over its time, without smoothing."""

    kind: Literal["raw"] = "raw"


ESTIMATOR = EstimatorKind(
    name="raw",
    label="Raw difference",
    code=CODE,
    model=Raw,
    passed_share=lambda _velocity, period_s, omega_per_s: line_share(2, period_s, omega_per_s),
)
