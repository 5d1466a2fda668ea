"""The events and commands of a session. Only events change the state machine; the runner executes the commands.

``at_s`` is the time on the session's monotonic clock [s since its origin]. All side effects are commands, in this
order: first the safety of the hand (``StopForce``, ``StopTrial``, ``Rest``), then writing to the disk (``Write``,
``WriteTables``), then force and display (``FadeIn``, ``StartTrial``, ``ShowPage``).
"""

from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias

from study_app.errors import DeviceError, ServoFault, StudyError, VideoError
from study_app.protocol.questions import Value
from study_app.protocol.trials import AnyTask, Stimulated
from study_app.session.pages import Page
from study_app.store.journals.journal_events import Event as Line
from study_app.store.journals.journal_events import Stepped as SteppedLine

Status: TypeAlias = Literal["completed", "withdrawn", "aborted", "broken"]


class Command:
    """A command of the state machine, executed by the runner."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class ShowPage(Command):
    """Show a page to the participant."""

    page: Page


@dataclass(frozen=True, slots=True, kw_only=True)
class StartTrial(Command):
    """Prepare a trial or one of its intervals; ``presented`` is loaded when the tank's first frame is painted.

    The tank remains visible for ``linger_s`` after the task, so that its end is seen. This is the longest delay of the
    block and equal for all its trials, so that neither the participant nor a recorded time can reveal the delay.
    ``interval`` counts from 1, and is None in a trial without a design; with ``adjusts`` the participant sets its level
    and ends it. Contents and delays must not be printed.
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
    """Change the varied number within the current interval, and write the event of its steps.

    The force continues from its value; the event contains the scene's new number in recordings.
    """

    presented: Stimulated = field(repr=False)
    delay_s: float = field(repr=False)
    line: SteppedLine


@dataclass(frozen=True, slots=True)
class LeaveTask(Command):
    """End the task at the participant's request, if that is allowed."""


@dataclass(frozen=True, slots=True)
class StopTrial(Command):
    """Stop tracking the task; its measurements are kept until the next trial starts."""


@dataclass(frozen=True, slots=True)
class Rest(Command):
    """Remove the liquid: the force fades to zero."""


@dataclass(frozen=True, slots=True)
class StopForce(Command):
    """Set the force to zero with the next tick, until ``FadeIn``."""


@dataclass(frozen=True, slots=True)
class FadeIn(Command):
    """Fade the force in."""


@dataclass(frozen=True, slots=True)
class Write(Command):
    """Write one line to the journal; with ``waits``, as for answers and notes, wait until it is on the disk.

    Other lines are flushed in the background, so that drawing does not wait for the disk. With ``measured`` the runner
    adds the measures of the stopped trial.
    """

    line: Line
    measured: bool = False
    waits: bool = False


@dataclass(frozen=True, slots=True)
class CheckFlushed(Command):
    """Fail if journal lines written without waiting could not be flushed."""


@dataclass(frozen=True, slots=True)
class WriteTables(Command):
    """Update the tables from the journal."""


@dataclass(frozen=True, slots=True)
class Finish(Command):
    """Close the session: last line, tables, receipt."""

    status: Status
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Event:
    """An event at time ``at_s``."""

    at_s: float


@dataclass(frozen=True, slots=True)
class Begin(Event):
    """Start with the first page; all devices and files are open."""


@dataclass(frozen=True, slots=True)
class Continue(Event):
    """The participant continues from a text page, or ends an exploration after its least time."""


@dataclass(frozen=True, slots=True)
class LanguageChosen(Event):
    """The participant chose another language of the study; possible until consent is given."""

    language: str


@dataclass(frozen=True, slots=True)
class TaskDone(Event):
    """The task of the running trial is over; ``summary`` has the columns of its row (see ``store.files.columns``).

    ``invalid`` names the limits that an interval violated, so that it was not delivered as requested.
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
    """The participant chose ``value`` for ``item``, None for "cannot judge"; the last choice counts."""

    item: str
    value: Value


@dataclass(frozen=True, slots=True)
class Retracted(Event):
    """The participant removed the answer to ``item`` by emptying its field."""

    item: str


STEP_S: Final = 0.125
"""Interval between the steps of an adjustment while a button or key is held [s]."""


@dataclass(frozen=True, slots=True)
class Stepped(Event):
    """The participant adjusted the level by ``steps``, negative for less."""

    steps: int


@dataclass(frozen=True, slots=True)
class Submitted(Event):
    """The participant confirms the questionnaire, or a setting."""


@dataclass(frozen=True, slots=True)
class TimeUp(Event):
    """The time of a rest between intervals, or of a feedback, is over."""


@dataclass(frozen=True, slots=True)
class PauseRequested(Event):
    """A pause by Esc, by the operator, or by the program when it was terminated or suspended."""

    by: Literal["participant", "operator", "program"]


@dataclass(frozen=True, slots=True)
class ResumeRequested(Event):
    """The end of a pause; an interrupted trial starts again. Only the operator ends a pause by a person."""

    by: Literal["participant", "operator"]


@dataclass(frozen=True, slots=True)
class ForceStopped(Event):
    """The force was switched off (the servo already sends zero); the session pauses."""

    by: Literal["participant", "operator", "device", "program"]


@dataclass(frozen=True, slots=True)
class Note(Event):
    """The operator's note, or a mark without a text."""

    kind: Literal["note", "mark"]
    text: str


@dataclass(frozen=True, slots=True)
class RepeatRequested(Event):
    """The operator requests to repeat the running trial, with a reason."""

    reason: str


@dataclass(frozen=True, slots=True)
class EndRequested(Event):
    """The operator ends the session early, or the participant does not consent."""

    status: Literal["withdrawn", "aborted"]
    reason: str


@dataclass(frozen=True, slots=True)
class Broke(Event):
    """Device, servo or program failed; ``what`` is for the operator and the log, not for the participant.

    After a failure ``by`` the device (its servo, or a video) the session can continue, see `Reconnected`.
    """

    what: str
    by: Literal["device", "program"] = "program"


@dataclass(frozen=True, slots=True)
class Reconnected(Event):
    """The failed device or video is open again and the servo runs at zero force; ``described`` is journalled."""

    described: dict[str, Any]


@dataclass(frozen=True, slots=True)
class WriteFailed(Event):
    """Writing failed for a reason; ``pending`` are the failed command and the later ones, of time ``at_s``."""

    reason: str
    pending: tuple[Command, ...]


@dataclass(frozen=True, slots=True)
class WriteRetried(Event):
    """The pending writes are retried."""


@dataclass(frozen=True, slots=True)
class WriteCompleted(Event):
    """All pending writes succeeded."""


def broken(at_s: float, error: BaseException) -> Broke:
    """Return the `Broke` event for an ``error`` that stops the session."""
    what = str(error) if isinstance(error, StudyError) else f"{type(error).__name__}: {error}"
    return Broke(at_s, what, "device" if isinstance(error, DeviceError | ServoFault | VideoError) else "program")
