"""What can happen in a session. The machine takes these; nothing else moves it.

``at_s`` is seconds on the session's monotonic clock (0 = the session's clock origin).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from study_app.errors import DeviceError, ServoFault, StudyError
from study_app.protocol.forms.show_if import Value
from study_app.session.transitions.commands import Command


@dataclass(frozen=True, slots=True)
class Begin:
    """Everything is open; show the first page."""

    at_s: float


@dataclass(frozen=True, slots=True)
class Continue:
    """The participant goes on from a text page, or ends an exploration after its least time."""

    at_s: float


@dataclass(frozen=True, slots=True)
class LanguageChosen:
    """The participant wants to read in another of the study's languages; possible until a consent is given."""

    at_s: float
    language: str


@dataclass(frozen=True, slots=True)
class TaskDone:
    """The task of the running trial is over; ``summary`` is what its row records (see ``store.tables.columns``).

    ``invalid`` names the limits that an interval breaks, so that it was not delivered as requested.
    """

    at_s: float
    outcome: Literal["complete", "timeout"]
    summary: dict[str, Any]
    invalid: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ItemShown:
    """A statement became visible to the participant."""

    at_s: float
    item: str


@dataclass(frozen=True, slots=True)
class Chosen:
    """The participant answered ``item`` with ``value``, None for "cannot judge"; may come again."""

    at_s: float
    item: str
    value: Value


@dataclass(frozen=True, slots=True)
class Retracted:
    """The participant took the answer to ``item`` back: an entry was emptied."""

    at_s: float
    item: str


@dataclass(frozen=True, slots=True)
class Stepped:
    """The participant wants more of what an adjustment sets by some steps, or less where ``steps`` is below 0."""

    at_s: float
    steps: int


@dataclass(frozen=True, slots=True)
class Submitted:
    """The participant confirms the questionnaire, or a setting."""

    at_s: float


@dataclass(frozen=True, slots=True)
class TimeUp:
    """A rest between two intervals, or a feedback, has lasted long enough; only the clock says so."""

    at_s: float


@dataclass(frozen=True, slots=True)
class PauseAsked:
    """Esc, the operator's pause, or the program's when it is ended from outside or stood still."""

    at_s: float
    by: Literal["participant", "operator", "program"]


@dataclass(frozen=True, slots=True)
class ResumeAsked:
    """Go on from the pause; a trial under way starts again. What the operator stopped is the operator's to resume."""

    at_s: float
    by: Literal["participant", "operator"]


@dataclass(frozen=True, slots=True)
class ForceStopped:
    """The force was switched off (the servo already sends zero); the session pauses."""

    at_s: float
    by: Literal["participant", "operator", "device", "program"]


@dataclass(frozen=True, slots=True)
class Note:
    """The operator's note, or a mark (empty text allowed) at a moment."""

    at_s: float
    kind: Literal["note", "mark"]
    text: str


@dataclass(frozen=True, slots=True)
class RepeatAsked:
    """The operator wants the running trial again, with a reason."""

    at_s: float
    reason: str


@dataclass(frozen=True, slots=True)
class EndAsked:
    """The operator ends the session early, or the participant does not consent."""

    at_s: float
    status: Literal["withdrawn", "aborted"]
    reason: str


@dataclass(frozen=True, slots=True)
class Broke:
    """Device, servo or program failed; ``what`` is for the operator and the journal, not for the participant.

    After a failure ``by`` the device (or its servo) the session can go on, see `Reconnected`.
    """

    at_s: float
    what: str
    by: Literal["device", "program"] = "program"


@dataclass(frozen=True, slots=True)
class Reconnected:
    """The device that failed is open and homed again, its servo runs at zero force; the journal keeps ``described``."""

    at_s: float
    described: dict[str, Any]


@dataclass(frozen=True, slots=True)
class WriteFailed:
    """The disk did not take a command, for a reason; it and those after it, of moment ``at_s``, are ``left``."""

    at_s: float
    reason: str
    left: tuple[Command, ...]


@dataclass(frozen=True, slots=True)
class WriteRetried:
    """What the disk did not take is tried again."""

    at_s: float


@dataclass(frozen=True, slots=True)
class WriteCompleted:
    """The disk took all that was left."""

    at_s: float


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
    return Broke(at_s, what, "device" if isinstance(error, DeviceError | ServoFault) else "program")
