"""A velocity that comes with the motion."""

from typing import Literal

from study_app.haptics.model.estimator import EstimatorKind
from study_app.haptics.model.ranges import Frozen

CODE = 1


class Given(Frozen):
    """The velocity comes with the motion: for recorded or programmed motions, never for a device."""

    kind: Literal["given"] = "given"


ESTIMATOR = EstimatorKind(
    name="given",
    label="Given",
    code=CODE,
    model=Given,
    passed_share=lambda _velocity, _period_s, _omega_per_s: 1.0,
    of_device=False,
)
