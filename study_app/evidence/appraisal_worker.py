"""The worker process that measures computation time and accuracy of scenes.

It has the lowest priority of the computer, so that it takes no time from a servo.
"""

from dataclasses import dataclass, replace
from typing import TypeAlias

from study_app.evidence.appraisal import Costs, Errors
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.scene import Scene
from study_app.protocol.trials.tasks import Stroke
from study_app.workers.client import WorkerClient
from study_app.workers.server import Send, Stop


@dataclass(frozen=True, slots=True)
class Question:
    """A scene to appraise, and optionally a stroke in it, on a device of these dynamics."""

    scene: Scene
    stroke: Stroke | None = None
    dynamics: Dynamics = UNKNOWN


AppraisalClient: TypeAlias = WorkerClient[Question, Costs | Errors | None]


def start_appraisal_worker() -> AppraisalClient:
    """Start a worker process for questions; a new question cancels the last one."""
    return WorkerClient("study_app.evidence.appraisal_worker:appraise", name="appraisal", background=True)


def appraise(question: Question, send: Send, stop: Stop) -> Errors | None:
    """Send the `Costs` of a scene, then return its `Errors`; None if another question waits.

    Raises
    ------
    StudyError
        They cannot be measured.
    """
    if stop():
        return None
    from study_app.evidence import appraisal_measurement as measured  # noqa: PLC0415 - the compiler: only in that process

    send(measured.costs(question.scene))
    if stop():
        return None
    stroke = question.stroke
    share = measured.withheld_share(question.scene, stroke, question.dynamics) if stroke is not None else None
    velocity = measured.velocity_errors(question.scene, question.dynamics) if question.dynamics.unknown else None
    return replace(measured.errors(question.scene), withheld=share, velocity=velocity)
