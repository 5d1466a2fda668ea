"""A Kalman filter of velocity that knows the force: its state, all at the hand."""

import math
from typing import Any, Final, Literal

from study_app.haptics.model.effect import FLOAT, INT, Fields
from study_app.haptics.model.estimator import EstimatorKind, fill_ewma
from study_app.haptics.model.estimators.ewma import Ewma
from study_app.haptics.model.ranges import Frozen

CODE = 5
LAG_S: Final = 2e-3
"""What the filter lags by where a motion changes abruptly; in smooth ones less."""


class Kalman(Frozen):
    """A Kalman filter whose input includes the force just sent; it estimates the mass that this force moves.

    Encoder count, delay and least mass come from the device. If the device does not measure its delay, and while the
    innovations are too large, the velocity is that of ``ewma`` with its default.
    """

    kind: Literal["kalman"] = "kalman"


STATE: Fields = (
    ("force_n", FLOAT, (3,)),  # mean force since the last sample, without buoyancy and weight
    ("before_n", FLOAT, (3,)),  # the same at the sample before
    ("passed_n", FLOAT, (3,)),  # output of the first high-pass filter
    ("input_n", FLOAT, (3,)),  # output of the second
    ("offset_m", FLOAT, (3,)),  # estimated less measured position, of a filter that knows no force
    ("velocity_mps", FLOAT, (3,)),
    ("acceleration_mps2", FLOAT, (3,)),
    ("response_m", FLOAT, (3,)),  # how these three would have moved with a force on 1 kg [1/kg · m …]
    ("response_mps", FLOAT, (3,)),
    ("response_mps2", FLOAT, (3,)),
    ("covariance", FLOAT, (6,)),  # of one axis, the same for all: pp, pv, pa, vv, va, aa
    ("per_kg", FLOAT),  # θ, the inverse of the mass that the force moves
    ("per_kg_variance", FLOAT),
    ("estimate_mps", FLOAT, (3,)),  # velocity with the force known
    ("smoothed_mps", FLOAT, (3,)),  # by EWMA, in the scene: what is used while the filter is not trusted
    ("carried_mps", FLOAT, (3,)),  # in the scene: left of the difference when one took over from the other
    ("believed_ticks", INT),  # delay of the loop, as believed at this sample
    ("delay_ticks", INT),  # the same at the sample before
    ("distrusted", INT),  # 1 while EWMA is used
    ("surprise", FLOAT),  # mean of squared innovations over their variance
    ("quiet_s", FLOAT),  # time since the last trouble
    ("repeated", INT),  # 1 where the last sample was taken for a repeated one
)


def _fill(record: Any, _velocity: Kalman, _scale: float) -> None:
    fill_ewma(record, Ewma().alpha)
    record.filter_lag_s = LAG_S


ESTIMATOR = EstimatorKind(
    name="kalman",
    label="Kalman",
    code=CODE,
    model=Kalman,
    passed_share=lambda _velocity, _period_s, omega_per_s: math.cos(omega_per_s * LAG_S),
    fill=_fill,
    state=STATE,
)
