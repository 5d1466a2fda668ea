"""The events and commands of a session. Events alone change the state machine; the runner carries commands out.

``at_s`` is seconds on the session's monotonic clock (0 = the session's clock origin). Nothing but commands acts, in the
order given: safety of the hand first (``StopForce``, ``StopTrial``, ``Rest``), then what must be on disk (``Write``,
``WriteTables``), then what the participant feels and sees (``FadeIn``, ``StartTrial``, ``ShowPage``).
"""

from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from study_app.errors import DeviceError, ServoFault, StudyError, VideoError
from study_app.protocol.questions import Value
from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tasks import AnyTask
from study_app.session.pages import Page
from study_app.store.journals.journal_events import Event as Line
from study_app.store.journals.journal_events import Stepped as SteppedLine

Status: TypeAlias = Literal["completed", "withdrawn", "aborted", "broken"]


class Command:
    """What is to be done."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class ShowPage(Command):
    """Put a page before the participant."""

    page: Page


@dataclass(frozen=True, slots=True, kw_only=True)
class StartTrial(Command):
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
class Adjust(Command):
    """Present another value of the varied number within the interval under way, and write the line of its steps.

    The force goes on from what it is; the line has the number by which recordings know the scene from then on.
    """

    presented: Stimulated = field(repr=False)
    delay_s: float = field(repr=False)
    line: SteppedLine


@dataclass(frozen=True, slots=True)
class LeaveTask(Command):
    """End the task because the participant wants to go on, if it may end so already."""


@dataclass(frozen=True, slots=True)
class StopTrial(Command):
    """Follow the task no longer; what was measured until now stays until the next trial starts."""


@dataclass(frozen=True, slots=True)
class Rest(Command):
    """Take the liquid away: the force fades to zero."""


@dataclass(frozen=True, slots=True)
class StopForce(Command):
    """Zero force with the next tick, and until ``FadeIn``."""


@dataclass(frozen=True, slots=True)
class FadeIn(Command):
    """Let the force come back gently."""


@dataclass(frozen=True, slots=True)
class Write(Command):
    """Put one line into the journal; with ``waits``, as for answers and notes, on the disk before the next command.

    Other lines are flushed in the background, so that nothing drawn waits for the disk. With ``measured`` the runner
    adds what it measured of the trial that was stopped.
    """

    line: Line
    measured: bool = False
    waits: bool = False


@dataclass(frozen=True, slots=True)
class CheckFlushed(Command):
    """Stop here while journal lines that were written without waiting could not be flushed."""


@dataclass(frozen=True, slots=True)
class WriteTables(Command):
    """Bring the tables up to date with the journal."""


@dataclass(frozen=True, slots=True)
class Finish(Command):
    """Close the session: last line, tables, receipt."""

    status: Status
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Event:
    """What happened at ``at_s``."""

    at_s: float


@dataclass(frozen=True, slots=True)
class Begin(Event):
    """Everything is open; show the first page."""


@dataclass(frozen=True, slots=True)
class Continue(Event):
    """The participant goes on from a text page, or ends an exploration after its least time."""


@dataclass(frozen=True, slots=True)
class LanguageChosen(Event):
    """The participant wants to read in another of the study's languages; possible until a consent is given."""

    language: str


@dataclass(frozen=True, slots=True)
class TaskDone(Event):
    """The task of the running trial is over; ``summary`` is what its row records (see ``store.columns``).

    ``invalid`` names the limits that an interval breaks, so that it was not delivered as requested.
    """

    outcome: Literal["complete", "timeout"]
    summary: dict[str, Any]
    invalid: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ItemShown(Event):
    """A statement became visible to the participant."""

    item: str


@dataclass(frozen=True, slots=True)
class Chosen(Event):
    """The participant answered ``item`` with ``value``, None for "cannot judge"; may come again."""

    item: str
    value: Value


@dataclass(frozen=True, slots=True)
class Retracted(Event):
    """The participant took the answer to ``item`` back: an entry was emptied."""

    item: str


@dataclass(frozen=True, slots=True)
class Stepped(Event):
    """The participant wants more of what an adjustment sets by some steps, or less where ``steps`` is below 0."""

    steps: int


@dataclass(frozen=True, slots=True)
class Submitted(Event):
    """The participant confirms the questionnaire, or a setting."""


@dataclass(frozen=True, slots=True)
class TimeUp(Event):
    """A rest between two intervals, or a feedback, has lasted long enough; only the clock says so."""


@dataclass(frozen=True, slots=True)
class PauseRequested(Event):
    """Esc, the operator's pause, or the program's when it is ended from outside or stood still."""

    by: Literal["participant", "operator", "program"]


@dataclass(frozen=True, slots=True)
class ResumeRequested(Event):
    """The pause ends; an interrupted trial starts again. Only the operator ends what a person stopped."""

    by: Literal["participant", "operator"]


@dataclass(frozen=True, slots=True)
class ForceStopped(Event):
    """The force was switched off (the servo already sends zero); the session pauses."""

    by: Literal["participant", "operator", "device", "program"]


@dataclass(frozen=True, slots=True)
class Note(Event):
    """The operator's note, or a mark (empty text allowed) at a moment."""

    kind: Literal["note", "mark"]
    text: str


@dataclass(frozen=True, slots=True)
class RepeatRequested(Event):
    """The operator wants the running trial again, with a reason."""

    reason: str


@dataclass(frozen=True, slots=True)
class EndRequested(Event):
    """The operator ends the session early, or the participant does not consent."""

    status: Literal["withdrawn", "aborted"]
    reason: str


@dataclass(frozen=True, slots=True)
class Broke(Event):
    """Device, servo or program failed; ``what`` is for the operator and the log, not for the participant.

    After a failure ``by`` the device (its servo, or a video) the session can go on, see `Reconnected`.
    """

    what: str
    by: Literal["device", "program"] = "program"


@dataclass(frozen=True, slots=True)
class Reconnected(Event):
    """What failed is open again and the servo runs at zero force; the journal keeps ``described``, of the device."""

    described: dict[str, Any]


@dataclass(frozen=True, slots=True)
class WriteFailed(Event):
    """The disk did not take a command, for a reason; it and those after it, of moment ``at_s``, are ``left``."""

    reason: str
    left: tuple[Command, ...]


@dataclass(frozen=True, slots=True)
class WriteRetried(Event):
    """What the disk did not take is tried again."""


@dataclass(frozen=True, slots=True)
class WriteCompleted(Event):
    """The disk took all that was left."""


def broken(at_s: float, error: BaseException) -> Broke:
    """Return that ``error`` broke the session."""
    what = str(error) if isinstance(error, StudyError) else f"{type(error).__name__}: {error}"
    return Broke(at_s, what, "device" if isinstance(error, DeviceError | ServoFault | VideoError) else "program")
