"""What the machine wants done. The runner carries commands out in the order given; nothing else acts.

The order of every list: safety of the hand first (``StopForce``, ``StopTrial``, ``Rest``), then what must be on disk
(``Write``, ``WriteTables``), then what the participant feels and sees (``FadeIn``, ``StartTrial``, ``ShowPage``).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tasks import AnyTask
from study_app.session.pages import Page

Status: TypeAlias = Literal["completed", "withdrawn", "aborted", "broken"]


@dataclass(frozen=True, slots=True)
class ShowPage:
    """Put a page before the participant."""

    page: Page


@dataclass(frozen=True, slots=True)
class StartTrial:
    """Prepare a trial, or one of its intervals: what is ``presented`` is loaded with its tank's first painted frame.

    The tank stays for ``linger_s`` after the task, so that its end is seen. That goes by the longest delay of the
    block, the same for all its trials: neither the participant nor any time on the disk can tell the delay from it.
    ``interval`` counts from 1, None in a trial without a design; with ``adjusts`` the participant sets what it
    presents, and ends it. What is presented and delays are never printed.
    """

    trial: int
    attempt: int
    task: AnyTask
    presented: Stimulated = field(repr=False)
    delay_s: float = field(repr=False)
    linger_s: float = field(repr=False)
    interval: int | None = None
    adjusts: bool = False


@dataclass(frozen=True, slots=True)
class Adjust:
    """Present another value of the varied number within the interval under way, and write the line of its steps.

    The force goes on from what it is; the line has the number by which recordings know the scene from then on.
    """

    presented: Stimulated = field(repr=False)
    delay_s: float = field(repr=False)
    fields: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class LeaveTask:
    """End the task because the participant wants to go on, if it may end so already."""


@dataclass(frozen=True, slots=True)
class StopTrial:
    """Follow the task no longer; what was measured until now stays until the next trial starts."""


@dataclass(frozen=True, slots=True)
class Rest:
    """Take the liquid away: the force fades to zero."""


@dataclass(frozen=True, slots=True)
class StopForce:
    """Zero force with the next tick, and until ``FadeIn``."""


@dataclass(frozen=True, slots=True)
class FadeIn:
    """Let the force come back gently."""


@dataclass(frozen=True, slots=True)
class Write:
    """Put one line into the journal; with ``waits``, as for answers and notes, on the disk before the next command.

    Other lines are flushed in the background, so that nothing drawn waits for the disk. With ``measured`` the runner
    adds what it measured of the trial that was stopped (``fields`` win).
    """

    event: str
    fields: Mapping[str, Any]
    measured: bool = False
    waits: bool = False


@dataclass(frozen=True, slots=True)
class CheckFlushed:
    """Stop here while journal lines that were written without waiting could not be flushed."""


@dataclass(frozen=True, slots=True)
class WriteTables:
    """Bring the tables up to date with the journal."""


@dataclass(frozen=True, slots=True)
class Finish:
    """Close the session: last line, tables, receipt."""

    status: Status
    reason: str = ""


Command: TypeAlias = (
    ShowPage
    | StartTrial
    | Adjust
    | LeaveTask
    | StopTrial
    | Rest
    | StopForce
    | FadeIn
    | Write
    | CheckFlushed
    | WriteTables
    | Finish
)
