"""EWMA: the exponentially weighted velocity of the thesis.

`Line` has less lag and less noise while the hand leads (7.0 ms and 0.64 mm/s against 9.5 ms and 1.37 mm/s), but at
1 kHz with one tick of delay a free handle of 0.1 kg is stable only to 23 N·s/m with it, and to 71 with EWMA: the lag of
a line is all delay, that of a filter mostly a lower gain where a loop would oscillate. Honey needs 31, light oil 55 at
8 N. [choice]
"""

from typing import Any, Literal

from study_app.haptics.model.estimator import EstimatorKind, ewma_response, fill_ewma
from study_app.haptics.model.ranges import Alpha, Frozen

CODE = 0


class Ewma(Frozen):
    """Exponentially weighted average of the differences of positions, the filter of the thesis."""

    kind: Literal["ewma"] = "ewma"
    alpha: Alpha = 0.1


def _fill(record: Any, velocity: Ewma, _scale: float) -> None:
    record.filter_lag_s = fill_ewma(record, velocity.alpha)


ESTIMATOR = EstimatorKind(
    name="ewma",
    label="EWMA (thesis)",
    code=CODE,
    model=Ewma,
    passed_share=lambda velocity, period_s, omega_per_s: ewma_response(velocity.alpha, period_s, omega_per_s).real,
    fill=_fill,
    parameter="alpha",
    measured=(0.005, 0.02, 0.05, 0.1, 0.12, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0),
)
