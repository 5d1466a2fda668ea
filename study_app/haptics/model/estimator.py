"""The descriptor of a velocity estimator: its properties for files, packing, checks, lab and sweeps.

An estimator is a descriptor in ``haptics.model.estimators``, a kernel in ``haptics.kernels.estimators`` with a line in
``velocity.estimate_velocity``, and its model in ``scene.Velocity``. Descriptors are found by importing the modules of
their folder (``haptics.model.estimators.ESTIMATORS``).
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from study_app.haptics.model.effect import Fields
from study_app.haptics.model.ranges import Frozen

NOMINAL_S: Final = 1e-3
"""Weights of EWMA apply to differences over this time."""


WINDOWS: Final = (2, 3, 5, 8, 11, 15, 16)
"""Windows [samples] that slope limits are measured for."""


@dataclass(frozen=True, slots=True)
class EstimatorKind:
    """The properties of one velocity estimator.

    Parameters
    ----------
    name : str
        ``kind`` in files.
    label : str
        Name in the lab.
    code : int
        Its number in compiled code.
    model : Frozen subclass
        Its table in files; its values are the ``velocity`` of the callables below.
    passed_share : callable
        Re V/(jωX) of ``velocity`` in a steady oscillation at ω [rad/s], sampled every ``period_s``.
    fill : callable
        Write the parameters of ``velocity`` into a record of ``layout.PARAMETERS``, in a scene of some scale.
    samples : callable
        Number of past samples that it uses; 0 if it stores none.
    state : Fields, optional
        The fields of its own state.
    parameter : str, optional
        The field of ``model`` over which the table of slope limits is measured.
    measured : tuple of float
        The values at which it is measured.
    of_device : bool
        Whether it uses a device's positions, so that files may name it.
    """

    name: str
    label: str
    code: int
    model: type[Frozen]
    passed_share: Callable[[Any, float, float], float]
    fill: Callable[[Any, Any, float], None] = lambda _record, _velocity, _scale: None
    samples: Callable[[Any], int] = lambda _velocity: 0
    state: Fields | None = None
    parameter: str | None = None
    measured: tuple[float, ...] = ()
    of_device: bool = True


def fill_ewma(record: Any, alpha: float) -> float:
    """Write the weight of EWMA into a record; return the part of its lag [s] that stores energy."""
    keep = 1 - alpha
    record.log_keep_per_s = math.log(keep) / NOMINAL_S if keep > 0 else -math.inf
    record.fallback_lag_s = keep / alpha * NOMINAL_S
    return float(record.fallback_lag_s)


def ewma_response(alpha: float, period_s: float, omega_per_s: float) -> complex:
    """Return V/(jωX) of EWMA in a steady oscillation."""
    keep = math.pow(1 - alpha, period_s / NOMINAL_S)
    back = cmath.exp(-1j * omega_per_s * period_s)
    return (1 - keep) * (1 - back) / period_s / (1 - keep * back) / (1j * omega_per_s)


def line_share(samples: int, period_s: float, omega_per_s: float) -> float:
    """Return Re V/(jωX) of the least-squares slope through ``samples`` samples in a steady oscillation."""
    back = cmath.exp(-1j * omega_per_s * period_s)
    middle = (samples - 1) / 2
    squares = sum((k - middle) ** 2 for k in range(samples))
    slope = sum((middle - k) * back**k for k in range(samples)) / squares / period_s
    return float((slope / (1j * omega_per_s)).real)
