"""What the participant sees at one moment, as values: a machine makes them, a widget draws them.

Texts are already in the participant's language. Lengths are metres in the hand frame, times seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from study_app.protocol.model import Explore, Reach


@dataclass(frozen=True, slots=True)
class Progress:
    """Where we are: part ``part`` of ``parts``; within it setting ``index`` of ``of`` under a neutral label.

    ``part`` is None outside the parts, as in a practice; a page to read has no label, and the settings before
    ``index`` are done, all of them where it is ``of + 1``.
    """

    part: int | None
    parts: int
    label: str
    index: int
    of: int


@dataclass(frozen=True, slots=True)
class TaskPage:
    """The tank: move the ball. Nothing of the condition is here: how late the tank is drawn is the runner's to know.

    ``workspace_m`` holds the full sizes of the tank along x, y, z, centred on the device's middle.
    """

    trial: int
    instruction: str
    task: Explore | Reach
    workspace_m: tuple[float, float, float]
    body_radius_m: float
    progress: Progress | None


@dataclass(frozen=True, slots=True)
class TextPage:
    """A text to read and a button to go on: consent, instructions, announcements, breaks, the debrief.

    ``language`` is the one all pages are in from here on; ``languages`` are those that may be chosen instead, with it
    among them, none where there is no choice. ``stays_until_s`` is when the page may be left at the earliest [s,
    session's clock], None at once. ``coming`` is the next task, so that it can be made ready while one reads.
    """

    id: str
    kind: Literal["consent", "instructions", "break", "debrief"]
    title: str
    paragraphs: tuple[str, ...]
    button: str
    progress: Progress | None = None
    language: str = "en"
    languages: tuple[str, ...] = ()
    stays_until_s: float | None = None
    coming: TaskPage | None = None


@dataclass(frozen=True, slots=True)
class ItemView:
    """One statement of a questionnaire as shown: ``number`` counts from 1 in the order of presentation."""

    id: str
    number: int
    text: str
    required: bool


@dataclass(frozen=True, slots=True)
class QuestionnairePage:
    """The statements of one setting; ``labels`` name the points of the scale, lowest first.

    ``chosen`` holds (item id, value) of the choices already made, when the page comes back after a pause.
    """

    trial: int
    title: str
    intro: str
    items: tuple[ItemView, ...]
    labels: tuple[str, ...]
    cannot_judge: str | None
    progress: Progress | None
    chosen: tuple[tuple[str, int | None], ...] = ()


@dataclass(frozen=True, slots=True)
class PausePage:
    """The session waits; ``force_off`` says that the force was stopped and fades in only when asked for.

    ``held`` says what the operator stopped: then the operator alone resumes, and there is nothing to press. ``coming``
    is the task that may come after it, so that it can be made ready.
    """

    force_off: bool
    held: Literal["pause", "force"] | None = None
    coming: TaskPage | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class TroublePage:
    """Something broke and the operator is called: a calm sentence, no reason that could unsettle or unblind."""

    title: str
    paragraph: str


@dataclass(frozen=True, slots=True)
class EndPage:
    """The session is over, one way or another."""

    title: str
    paragraph: str


Page: TypeAlias = TextPage | TaskPage | QuestionnairePage | PausePage | TroublePage | EndPage
