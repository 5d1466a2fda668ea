"""The task of a trial: one of the kinds in ``tasks``."""

from __future__ import annotations

from typing import Annotated, TypeAlias

from pydantic import Field

from study_app.protocol.trials.tasks.explore import Explore
from study_app.protocol.trials.tasks.follow import Follow
from study_app.protocol.trials.tasks.reach import Reach

AnyTask: TypeAlias = Explore | Reach | Follow
Task: TypeAlias = Annotated[AnyTask, Field(discriminator="kind")]
