"""The participant's pages as data: the state machine creates them, and widgets draw them.

Texts are already in the participant's language. Lengths are in metres in the hand frame, times in seconds.
"""

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from study_app.protocol.questions import ChoiceView, ItemView, NumberView, Value
from study_app.protocol.trials import AnyTask


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """The progress shown: part ``part`` of ``parts``, and setting ``index`` of ``of`` in it, with a neutral label.

    ``part`` is None outside the parts, as in practice. A text page has no label, except for a break among trials of
    intervals. The settings before ``index`` are done; ``index`` is ``of + 1`` when all are done. With ``at_most`` the
    block may end before ``of``.
    """

    part: int | None
    parts: int
    label: str
    index: int
    of: int
    at_most: bool = False


@dataclass(frozen=True, slots=True)
class Interval:
    """The current or next interval of a trial: ``number`` (from 1) of ``of``.

    ``announced`` is its name or, in a rest, the announcement of the interval or of the repetition of the trial.
    """

    number: int
    of: int
    resting: bool
    announced: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskPage:
    """The page with the tank, in which the ball is moved. It reveals nothing about the condition, not even the delay.

    ``workspace_m`` holds the full sizes of the tank along x, y, z, centred on the device's centre; ``interval`` is None
    in a trial without a design. ``question`` is the instruction for an adjustment, "" if there is none; ``adjusts``
    means that this interval is adjusted, so that the question replaces the instruction. ``video`` tells whether a video
    replaces the drawn tank, ``overlay`` whether ball and targets are drawn over it; neither must be printed.
    """

    trial: int
    instruction: str
    task: AnyTask
    workspace_m: tuple[float, float, float]
    body_radius_m: float
    progress: Progress | None
    interval: Interval | None = None
    question: str = ""
    adjusts: bool = False
    video: bool = field(default=False, repr=False)
    overlay: bool = field(default=True, repr=False)

    @property
    def said(self) -> str:
        """The instruction to the participant."""
        return self.question if self.adjusts else self.instruction


@dataclass(frozen=True, slots=True, kw_only=True)
class TextPage:
    """A text with a button to continue: consent, instructions, announcements, breaks, the debrief.

    ``language`` is the language of all pages from here on; ``languages`` are all that can be chosen, empty without a
    choice. ``stays_until_s`` is the earliest time at which the page can be left [s, session's clock]; None if it can be
    left at once. ``coming`` is the next task, which can be prepared in the meantime.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionnairePage:
    """The questions about one setting, or a separate form.

    If all are statements, ``labels`` name the points of their scale, lowest first; otherwise it is empty. ``chosen``
    holds (item id, value) of earlier choices if the page is shown again after a pause. ``form`` is the name of a
    separate form, which is asked for the ``time``-th time; ``trial`` is then None.
    """

    trial: int | None
    title: str
    intro: str
    items: tuple[ItemView, ...]
    labels: tuple[str, ...]
    cannot_judge: str | None
    progress: Progress | None
    chosen: tuple[tuple[str, Value], ...] = ()
    form: str | None = None
    time: int = 1

    @property
    def stream(self) -> str:
        """The name of the random stream of simulated answers to this page."""
        return (
            f"{self.trial}/answers"
            if self.form is None
            else f"form/{self.form}{'' if self.time == 1 else f'/{self.time}'}/answers"
        )


@dataclass(frozen=True, slots=True)
class DesignPage:
    """The question after a trial of intervals; the first answer counts."""

    trial: int
    item: ItemView
    progress: Progress | None

    @property
    def items(self) -> tuple[ItemView, ...]:
        """The question as a tuple."""
        return (self.item,)

    @property
    def stream(self) -> str:
        """The name of the random stream of simulated answers to this page."""
        return f"{self.trial}/answers"


@dataclass(frozen=True, slots=True)
class ChoicePage(DesignPage):
    """A choice between two to four answers in temporal order: one press answers and continues."""

    item: ChoiceView


@dataclass(frozen=True, slots=True)
class NumberPage(DesignPage):
    """A question for a number above 0."""

    item: NumberView


@dataclass(frozen=True, slots=True)
class FeedbackPage:
    """Feedback on whether the answer was correct, shown for a fixed time."""

    right: bool


@dataclass(frozen=True, slots=True)
class PausePage:
    """The page of a pause; ``force_off`` means that the force was stopped and fades in only on request.

    ``held`` means that only the operator can resume; then there is no button. ``coming`` is the task that may follow,
    so that it can be prepared.
    """

    force_off: bool
    held: Literal["pause", "force"] | None = None
    coming: TaskPage | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class TroublePage:
    """The page after a failure: it calls the operator, without a reason that could unsettle or unblind."""

    title: str
    paragraph: str


@dataclass(frozen=True, slots=True)
class EndPage:
    """The page after the end of a session, regular or not."""

    title: str
    paragraph: str


Page: TypeAlias = (
    TextPage | TaskPage | QuestionnairePage | ChoicePage | NumberPage | FeedbackPage | PausePage | TroublePage | EndPage
)
