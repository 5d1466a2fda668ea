"""A Kalman filter of velocity that uses the force: its state, at the hand."""

import math
from typing import Any, Final, Literal

from study_app.haptics.model.effect import FLOAT, INT, Fields
from study_app.haptics.model.estimator import EstimatorKind, fill_ewma
from study_app.haptics.model.estimators.ewma import Ewma
from study_app.haptics.model.ranges import Frozen

CODE = 5
LAG_S: Final = 2e-3
"""Lag of the filter at abrupt changes of motion; in smooth motion it is less."""


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
    ("offset_m", FLOAT, (3,)),  # estimated less measured position, of a filter without the force
    ("velocity_mps", FLOAT, (3,)),
    ("acceleration_mps2", FLOAT, (3,)),
    ("response_m", FLOAT, (3,)),  # response of these three to the force on 1 kg [1/kg · m …]
    ("response_mps", FLOAT, (3,)),
    ("response_mps2", FLOAT, (3,)),
    ("covariance", FLOAT, (6,)),  # of one axis, the same for all: pp, pv, pa, vv, va, aa
    ("per_kg", FLOAT),  # θ, the inverse of the mass that the force moves
    ("per_kg_variance", FLOAT),
    ("estimate_mps", FLOAT, (3,)),  # velocity estimated with the force
    ("smoothed_mps", FLOAT, (3,)),  # by EWMA, in the scene: used after a fault of the filter
    ("carried_mps", FLOAT, (3,)),  # in the scene: the remaining difference after a change between the two
    ("believed_ticks", INT),  # delay of the loop assumed at this sample
    ("delay_ticks", INT),  # the same at the sample before
    ("distrusted", INT),  # 1 while EWMA is used
    ("surprise", FLOAT),  # mean of squared innovations over their variance
    ("quiet_s", FLOAT),  # time since the last fault
    ("repeated", INT),  # 1 if the last sample counted as a repeated one
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
