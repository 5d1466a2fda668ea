"""The events of a session. They alone change the state machine.

``at_s`` is seconds on the session's monotonic clock (0 = the session's clock origin).
"""

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from study_app.errors import DeviceError, ServoFault, StudyError, VideoError
from study_app.protocol.questions import Value
from study_app.session.transitions.commands import Command


@dataclass(frozen=True, slots=True)
class _Timed:
    at_s: float


@dataclass(frozen=True, slots=True)
class Begin(_Timed):
    """Everything is open; show the first page."""


@dataclass(frozen=True, slots=True)
class Continue(_Timed):
    """The participant goes on from a text page, or ends an exploration after its least time."""


@dataclass(frozen=True, slots=True)
class LanguageChosen(_Timed):
    """The participant wants to read in another of the study's languages; possible until a consent is given."""

    language: str


@dataclass(frozen=True, slots=True)
class TaskDone(_Timed):
    """The task of the running trial is over; ``summary`` is what its row records (see ``store.tables.columns``).

    ``invalid`` names the limits that an interval breaks, so that it was not delivered as requested.
    """

    outcome: Literal["complete", "timeout"]
    summary: dict[str, Any]
    invalid: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ItemShown(_Timed):
    """A statement became visible to the participant."""

    item: str


@dataclass(frozen=True, slots=True)
class Chosen(_Timed):
    """The participant answered ``item`` with ``value``, None for "cannot judge"; may come again."""

    item: str
    value: Value


@dataclass(frozen=True, slots=True)
class Retracted(_Timed):
    """The participant took the answer to ``item`` back: an entry was emptied."""

    item: str


@dataclass(frozen=True, slots=True)
class Stepped(_Timed):
    """The participant wants more of what an adjustment sets by some steps, or less where ``steps`` is below 0."""

    steps: int


@dataclass(frozen=True, slots=True)
class Submitted(_Timed):
    """The participant confirms the questionnaire, or a setting."""


@dataclass(frozen=True, slots=True)
class TimeUp(_Timed):
    """A rest between two intervals, or a feedback, has lasted long enough; only the clock says so."""


@dataclass(frozen=True, slots=True)
class PauseAsked(_Timed):
    """Esc, the operator's pause, or the program's when it is ended from outside or stood still."""

    by: Literal["participant", "operator", "program"]


@dataclass(frozen=True, slots=True)
class ResumeAsked(_Timed):
    """The pause ends; an interrupted trial starts again. Only the operator resumes what the operator stopped."""

    by: Literal["participant", "operator"]


@dataclass(frozen=True, slots=True)
class ForceStopped(_Timed):
    """The force was switched off (the servo already sends zero); the session pauses."""

    by: Literal["participant", "operator", "device", "program"]


@dataclass(frozen=True, slots=True)
class Note(_Timed):
    """The operator's note, or a mark (empty text allowed) at a moment."""

    kind: Literal["note", "mark"]
    text: str


@dataclass(frozen=True, slots=True)
class RepeatAsked(_Timed):
    """The operator wants the running trial again, with a reason."""

    reason: str


@dataclass(frozen=True, slots=True)
class EndAsked(_Timed):
    """The operator ends the session early, or the participant does not consent."""

    status: Literal["withdrawn", "aborted"]
    reason: str


@dataclass(frozen=True, slots=True)
class Broke(_Timed):
    """Device, servo or program failed; ``what`` is for the operator and the log, not for the participant.

    After a failure ``by`` the device (its servo, or a video) the session can go on, see `Reconnected`.
    """

    what: str
    by: Literal["device", "program"] = "program"


@dataclass(frozen=True, slots=True)
class Reconnected(_Timed):
    """What failed is open again and the servo runs at zero force; the journal keeps ``described``, of the device."""

    described: dict[str, Any]


@dataclass(frozen=True, slots=True)
class WriteFailed(_Timed):
    """The disk did not take a command, for a reason; it and those after it, of moment ``at_s``, are ``left``."""

    reason: str
    left: tuple[Command, ...]


@dataclass(frozen=True, slots=True)
class WriteRetried(_Timed):
    """What the disk did not take is tried again."""


@dataclass(frozen=True, slots=True)
class WriteCompleted(_Timed):
    """The disk took all that was left."""


Event: TypeAlias = (
    Begin
    | Continue
    | LanguageChosen
    | TaskDone
    | ItemShown
    | Chosen
    | Retracted
    | Stepped
    | Submitted
    | TimeUp
    | PauseAsked
    | ResumeAsked
    | ForceStopped
    | Note
    | RepeatAsked
    | EndAsked
    | Broke
    | Reconnected
    | WriteFailed
    | WriteRetried
    | WriteCompleted
)


def broken(at_s: float, error: BaseException) -> Broke:
    """Return that ``error`` broke the session."""
    what = str(error) if isinstance(error, StudyError) else f"{type(error).__name__}: {error}"
    return Broke(at_s, what, "device" if isinstance(error, DeviceError | ServoFault | VideoError) else "program")
