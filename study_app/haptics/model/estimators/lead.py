"""EWMA with lead: a light EWMA plus a share of its smoothed acceleration."""

import cmath
from typing import Any, Final, Literal

from study_app.haptics.model.effect import FLOAT, Fields
from study_app.haptics.model.estimator import EstimatorKind, ewma_response, fill_ewma
from study_app.haptics.model.ranges import Frozen

CODE = 6
ALPHA: Final = 0.2
LEAD_S: Final = 3.4e-3
SMOOTHING_S: Final = 20e-3


class Lead(Frozen):
    """EWMA of weight 0.2 plus 3.4 ms of its acceleration, smoothed over 20 ms; for comparison with ``kalman``.

    It lags by 1.1 ms in slow motion, EWMA of this weight by 4.5 ms. It does not use the force.
    """

    kind: Literal["lead"] = "lead"


STATE: Fields = (
    ("smoothed_mps", FLOAT, (3,)),  # by EWMA
    ("previous_mps", FLOAT, (3,)),  # the same at the sample before
    ("acceleration_mps2", FLOAT, (3,)),  # smoothed
)


def _fill(record: Any, _velocity: Lead, _scale: float) -> None:
    record.filter_lag_s = fill_ewma(record, ALPHA)  # at high frequency, at which smoothing removes the lead


def _passed_share(_velocity: Lead, period_s: float, omega_per_s: float) -> float:
    x = period_s / SMOOTHING_S
    weight = x / (1 + x * (0.5 + x / 12))
    back = cmath.exp(-1j * omega_per_s * period_s)
    lead = LEAD_S * weight * (1 - back) / period_s / (1 - (1 - weight) * back)
    return float((ewma_response(ALPHA, period_s, omega_per_s) * (1 + lead)).real)


ESTIMATOR = EstimatorKind(
    name="lead", label="EWMA with lead", code=CODE, model=Lead, passed_share=_passed_share, fill=_fill, state=STATE
)
