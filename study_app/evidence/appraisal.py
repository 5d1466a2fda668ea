"""Computation time and accuracy of a scene, measured by a worker process.

It has the lowest priority of the computer, so that it takes no time from a servo.
"""

from dataclasses import dataclass
from typing import TypeAlias

from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.scene import Scene
from study_app.protocol.model import Protocol
from study_app.protocol.trials import Stroke
from study_app.session.preflight import PredictedDelivery
from study_app.workers.client import WorkerClient


@dataclass(frozen=True, slots=True)
class EffectCost:
    """The computation time of an effect per tick [ns], or None and the reason why the effect is absent."""

    effect: str
    ns: float | None
    why: str = ""


@dataclass(frozen=True, slots=True)
class Costs:
    """The computation time per tick [ns] of a scene, of a scene without liquids, and of each effect."""

    tick_ns: float
    rest_ns: float
    effects: tuple[EffectCost, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """The errors of a scene along programmed paths, against the exact definition (``evidence.reference_model``).

    ``wake`` is the largest wake error as a fraction of Σ|e|/S and ``force_n`` the largest force error [N]; None without
    a reference. ``lag_s`` is the lag of the velocity filter under constant acceleration. ``left_out`` lists effects
    that were not compared. ``withheld`` is the fraction of the force that the safety layer withholds in the requested
    stroke (``evidence.appraisal_measurement``), None without a stroke. ``velocity`` holds the relative velocity error
    on the device and on a device with fully known dynamics; None if the dynamics are known.
    """

    wake: float | None
    force_n: float | None
    lag_s: float
    left_out: tuple[str, ...]
    withheld: float | None = None
    velocity: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Question:
    """A scene to appraise and, optionally, a stroke in it, on a device with these dynamics."""

    scene: Scene
    stroke: Stroke | None = None
    dynamics: Dynamics = UNKNOWN


@dataclass(frozen=True, slots=True)
class DeliveryQuestion:
    """A study whose undelivered trials are to be predicted for a device delay [ticks]."""

    protocol: Protocol
    delay_ticks: int


AppraisalClient: TypeAlias = WorkerClient[Question | DeliveryQuestion, Costs | Errors | PredictedDelivery | None]


def start_appraisal_worker() -> AppraisalClient:
    """Start a worker process that answers questions; a new question cancels the previous one."""
    return WorkerClient("study_app.evidence.appraisal_measurement:appraise", name="appraisal", background=True)
