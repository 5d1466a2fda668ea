"""The velocity estimators: their tables in files, and their properties for packing, checks, lab and sweeps.

An estimator is a model and a row of `ESTIMATORS` here, and a branch of ``kernels.estimators.estimate_velocity``.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal

from study_app.haptics.model.effect import FLOAT, INT, Fields
from study_app.haptics.model.ranges import Alpha, Frozen

_NOMINAL_S: Final = 1e-3
"""Weights of EWMA apply to differences over this time."""
EWMA, GIVEN, RAW, KALMAN, DEVICE = 0, 1, 4, 5, 7
"""Codes of estimators in compiled code."""
_KALMAN_LAG_S: Final = 2e-3
"""Lag of the filter at abrupt changes of motion; in smooth motion it is less."""
LINES: Final[tuple[float, ...]] = (2, 3, 5, 8, 11, 15, 16)
"""Least-squares lines through so many positions have rows in the table of slope limits, for `DeviceVelocity`."""
MOST_LAG_TICKS: Final = (LINES[-1] - 1) / 2
"""Greatest lag of a measured velocity that is used: beyond it no stable force is known."""
_ROUNDING_TICKS: Final = 1e-6


class Ewma(Frozen):
    """Exponentially weighted moving average of position differences, the filter used in the thesis.

    A least-squares line through 15 positions has less lag and less noise while the hand leads (7.0 ms and 0.64 mm/s
    instead of 9.5 ms and 1.37 mm/s). At 1 kHz with one tick of delay, however, a free 0.1 kg handle is stable only up
    to 23 N·s/m with the line, and up to 71 N·s/m with EWMA: the lag of the line is pure delay, whereas the lag of the
    filter is mostly a lower gain at frequencies where a loop would oscillate. Honey needs 31, light oil 55 at 8 N.
    [choice]
    """

    kind: Literal["ewma"] = "ewma"
    alpha: Alpha = 0.1


class Kalman(Frozen):
    """A Kalman filter whose input includes the force just sent; it estimates the mass that this force moves.

    The encoder resolution, the delay and the minimum mass are taken from the device. If the device does not measure its
    delay, or while the innovations are too large, the velocity is that of ``ewma`` with its default weight.
    """

    kind: Literal["kalman"] = "kalman"


class Raw(Frozen):
    """The latest change of position divided by its duration, without smoothing."""

    kind: Literal["raw"] = "raw"


class Given(Frozen):
    """The velocity is given with the motion: for recorded or programmed motions, never for a device."""

    kind: Literal["given"] = "given"


class Withdrawn(Frozen):
    """An estimator of earlier versions: sessions that used it can be read, but it no longer computes forces."""

    kind: Literal["line", "foaw", "lead"]
    samples: int | None = None
    tolerance_m: float | None = None

    @property
    def refusal(self) -> tuple[str, str]:
        """The reason why no force is computed, and the remedy."""
        return (
            f'the velocity estimator "{self.kind}" has been removed from the program',
            'write "ewma", "kalman" or "raw"',
        )


class DeviceVelocity(Frozen):
    """The velocity is the device's own measurement, which lags by ``lag_s`` on average.

    No scene file names it: `haptics.runtime.pack` puts it in place of the scene's estimator where a device measures its
    velocity.
    """

    kind: Literal["device"] = "device"
    lag_s: float = 0.0

    def line(self, period_s: float) -> int:
        """Return through how many positions a least-squares line lags as much: its slope limits hold here.

        How a device computes its velocity is not known; a line of n positions lags by (n - 1)/2 periods and has the
        noise of encoders. [choice]
        """
        samples = math.ceil(2 * self.lag_s / period_s - _ROUNDING_TICKS) + 1
        return int(min(max(samples, LINES[0]), LINES[-1]))


_KALMAN_STATE: Fields = (
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
    ("smoothed_before_mps", FLOAT, (3,)),  # ``smoothed_mps`` at the sample before
    ("samples", INT),  # number of samples since the reset
    ("elapsed_s", FLOAT),  # their duration
    ("checked", FLOAT, (2, 10)),  # at the last two checks: position, velocity, lead (by axis, in the scene), time
    ("lead_m2ps2", FLOAT),  # mean of Σ lead²
    ("false_lead_m2ps2", FLOAT),  # mean of Σ lead · error of the velocity
    ("false_share", FLOAT),  # of the lead, times its gain
    ("assumed_ticks", INT),  # delay of the loop assumed at this sample
    ("delay_ticks", INT),  # the same at the sample before
    ("on_ewma", INT),  # 1 while EWMA is used
    ("surprise", FLOAT),  # mean of squared innovations over their variance
    ("quiet_s", FLOAT),  # time since the last fault
    ("repeated", INT),  # 1 if the last sample counted as a repeated one
    ("hand_motion", FLOAT, (4, 3)),  # offset, velocity, acceleration, jerk of the handle by the hand (`known_force`)
    ("response_motion", FLOAT, (4, 3)),  # response of these to the force on 1 kg
    ("motion_covariance", FLOAT, (10,)),  # of these four on one axis, the same for all
    ("gains", FLOAT, (4,)),  # of these four
    ("late", FLOAT, (2, 3)),  # integrals of the fast part of ``force_n``, of the first and second order
    ("ahead", FLOAT, (2, 3)),  # the same of the force last sent
    ("compliance_per_kg", FLOAT),  # θ of `known_force`
    ("compliance_variance", FLOAT),
    ("trust", FLOAT),  # fraction of the known force in inertial forces; at most 0 after a surprise (`known_force`)
    ("sent_n", FLOAT, (3,)),  # the force last sent
    ("asked_n", FLOAT, (3,)),  # the force of the effects in the tick before
)


@dataclass(frozen=True, slots=True)
class _EstimatorKind:
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
        Write the parameters of ``velocity`` into a record of ``layout.PARAMETERS``.
    state : Fields, optional
        The fields of its own state.
    measured : tuple of float
        The weights at which the table of slope limits is measured.
    of_device : bool
        Whether it uses a device's positions, so that files may name it.
    """

    name: str
    label: str
    code: int
    model: type[Frozen]
    passed_share: Callable[[Any, float, float], float]
    fill: Callable[[Any, Any], None] = lambda _record, _velocity: None
    state: Fields | None = None
    measured: tuple[float, ...] = ()
    of_device: bool = True


def ewma_response(alpha: float, period_s: float, omega_per_s: float) -> complex:
    """Return V/(jωX) of EWMA in a steady oscillation."""
    keep = math.pow(1 - alpha, period_s / _NOMINAL_S)
    back = cmath.exp(-1j * omega_per_s * period_s)
    return (1 - keep) * (1 - back) / period_s / (1 - keep * back) / (1j * omega_per_s)


def _fill_ewma(record: Any, velocity: Ewma) -> None:
    keep = 1 - velocity.alpha
    record.log_keep_per_s = math.log(keep) / _NOMINAL_S if keep > 0 else -math.inf
    record.filter_lag_s = record.fallback_lag_s = keep / velocity.alpha * _NOMINAL_S


def _fill_kalman(record: Any, _velocity: Kalman) -> None:
    _fill_ewma(record, Ewma())
    record.filter_lag_s = _KALMAN_LAG_S


def _difference_share(_velocity: Raw, period_s: float, omega_per_s: float) -> float:
    back = cmath.exp(-1j * omega_per_s * period_s)
    return float(((1 - back) / period_s / (1j * omega_per_s)).real)


def _mean_share(velocity: DeviceVelocity, _period_s: float, omega_per_s: float) -> float:
    """Return the gain of a moving average over twice the lag."""
    angle = 2 * omega_per_s * velocity.lag_s
    return math.sin(angle) / angle if angle else 1.0


ESTIMATORS: Final = (
    _EstimatorKind(
        "ewma",
        "EWMA (thesis)",
        EWMA,
        Ewma,
        lambda velocity, period_s, omega_per_s: ewma_response(velocity.alpha, period_s, omega_per_s).real,
        fill=_fill_ewma,
        measured=(0.005, 0.02, 0.05, 0.1, 0.12, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0),
    ),
    _EstimatorKind("given", "Given", GIVEN, Given, lambda _velocity, _period_s, _omega_per_s: 1.0, of_device=False),
    _EstimatorKind("raw", "Raw difference", RAW, Raw, _difference_share),
    _EstimatorKind(
        "kalman",
        "Kalman",
        KALMAN,
        Kalman,
        lambda _velocity, _period_s, omega_per_s: math.cos(omega_per_s * _KALMAN_LAG_S),
        fill=_fill_kalman,
        state=_KALMAN_STATE,
    ),
    _EstimatorKind("device", "Device", DEVICE, DeviceVelocity, _mean_share, of_device=False),
)
"""Every estimator, in the order of its code."""

NAMED: Final = {estimator.name: estimator for estimator in ESTIMATORS}
"""The same by name."""
