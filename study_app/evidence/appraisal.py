"""Computation time and accuracy of a scene, measured by a worker process.

It has the lowest priority of the computer, so that it takes no time from a servo.
"""

from dataclasses import dataclass
from typing import TypeAlias

from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.scene import Scene
from study_app.protocol.model import Protocol
from study_app.protocol.trials.tasks import Stroke
from study_app.session.preflight import PredictedDelivery
from study_app.workers.client import WorkerClient


@dataclass(frozen=True, slots=True)
class EffectCost:
    """The time of an effect per tick [ns]; None with the reason if it is absent."""

    effect: str
    ns: float | None
    why: str = ""


@dataclass(frozen=True, slots=True)
class Costs:
    """The time of a scene per tick, of a scene without liquids, and of each effect [ns]."""

    tick_ns: float
    rest_ns: float
    effects: tuple[EffectCost, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """The errors of a scene against the exact definition (``evidence.reference_model``), along programmed paths.

    ``wake`` is the largest difference as a share of Σ|e|/S, ``force_n`` that of the forces [N]; None where there is no
    reference. ``lag_s`` is the lag of the velocity filter under constant acceleration. ``left_out`` are effects that
    were not compared. ``withheld`` is the share of the force that safety withholds in the requested stroke
    (``evidence.appraisal_measurement``), None without one. ``velocity`` is the relative error of the velocity, and
    what it would be if nothing of the device's dynamics were unknown; None if nothing is.
    """

    wake: float | None
    force_n: float | None
    lag_s: float
    left_out: tuple[str, ...]
    withheld: float | None = None
    velocity: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Question:
    """A scene to appraise, and optionally a stroke in it, on a device of these dynamics."""

    scene: Scene
    stroke: Stroke | None = None
    dynamics: Dynamics = UNKNOWN


@dataclass(frozen=True, slots=True)
class DeliveryQuestion:
    """A study of which the trials that would not be delivered are predicted, for a delay [ticks]."""

    protocol: Protocol
    delay_ticks: int


AppraisalClient: TypeAlias = WorkerClient[Question | DeliveryQuestion, Costs | Errors | PredictedDelivery | None]


def start_appraisal_worker() -> AppraisalClient:
    """Start a worker process for questions; a new question cancels the last one."""
    return WorkerClient("study_app.evidence.appraisal_measurement:appraise", name="appraisal", background=True)
