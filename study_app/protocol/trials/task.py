"""The task of a trial: one of the kinds in ``tasks``."""

from __future__ import annotations

import math
from typing import Annotated, TypeAlias

from pydantic import Field

from study_app.protocol.trials.tasks.explore import Explore
from study_app.protocol.trials.tasks.follow import Follow
from study_app.protocol.trials.tasks.reach import Reach

AnyTask: TypeAlias = Explore | Reach | Follow
Task: TypeAlias = Annotated[AnyTask, Field(discriminator="kind")]


def lasting(task: AnyTask, most_s: float) -> AnyTask:
    """Return a task that time alone ends: after ``most_s``, or the first whole swing of a target after it [s]."""
    match task:
        case Explore():
            return task.model_copy(update={"min_s": most_s, "max_s": most_s})
        case Reach():
            return task.model_copy(update={"count": None, "duration_s": most_s, "timeout_s": most_s})
        case Follow():
            swings = math.ceil((most_s - task.lead_s) * task.frequency_hz)
            return task.model_copy(update={"cycles": max(swings, task.cycles)})
