"""The participant's page in the designer, as a value."""

from dataclasses import dataclass
from typing import Final

from study_app.protocol.orders.schedule import PageStep, Step, Trial
from study_app.protocol.wording.languages import Words, language_name, words
from study_app.session.pages import Page
from study_app.session.transitions.page_builder import Moment, Preview


@dataclass(frozen=True, slots=True)
class ScreenSize:
    """A screen that the page is shown for: name, words, size [logical px], and how much larger words are at least."""

    name: str
    words: str
    width: int
    height: int
    text_scale: float = 1.0


SIZES: Final = (
    ScreenSize("small", "1366 × 768", 1366, 768),
    ScreenSize("full", "1920 × 1080", 1920, 1080),
    ScreenSize("touch", "Touch, 1280 × 800", 1280, 800),
)


@dataclass(frozen=True, slots=True)
class ParticipantView:
    """What the tab shows.

    Attributes
    ----------
    page : Page or None
        The page; None where it cannot be shown.
    language : str
        The language of the page.
    languages : tuple of str
        The study's languages.
    step : str
        Which step it is, as "Liquids, trial 1 of 6".
    trial, trials : int
        Which trial of its block it is, from 1, and how many the block has; 0 where it is none.
    has_before, has_after : bool
        Whether there is a step before and after it.
    moments : tuple of (Moment, str)
        The pages of the step, with their words.
    moment : Moment or None
        The one that is shown.
    focused : str or None
        The id of the question that is selected.
    note : str
        What cannot be shown and why; "" where all is.
    photodiode : bool
        Whether the tank has a corner for a photodiode.
    """

    page: Page | None = None
    language: str = "en"
    languages: tuple[str, ...] = ()
    step: str = ""
    has_before: bool = False
    has_after: bool = False
    moments: tuple[tuple[Moment, str], ...] = ()
    moment: Moment | None = None
    focused: str | None = None
    note: str = ""
    photodiode: bool = True
    trial: int = 0
    trials: int = 0

    @property
    def around_trial(self) -> tuple[str, str]:
        """The words of the step before and after the number of its trial: "Liquids, trial", "of 6"."""
        before, _, after = self.step.rpartition(f" {self.trial} of ")
        return before, f"of {after}"

    @property
    def words(self) -> Words:
        """The interface's words in the language of the page."""
        return words(self.language)

    @property
    def name(self) -> str:
        """What the page is called for a screen reader."""
        named = language_name(self.language)
        return f"Participant's page, {named}"


def step_words(shown: Preview, step: Step, language: str) -> str:
    """Return what a step is called: "Welcome", "Liquids, trial 3 of 6"."""
    protocol = shown.protocol
    if isinstance(step, Trial):
        title = protocol.text(protocol.blocks[step.block].title, language)
        return title if step.of == 1 else f"{title}, trial {step.index} of {step.of}"
    if isinstance(step, PageStep):
        return protocol.text(protocol.pages[step.page_id].title, language)
    form = protocol.questionnaires[step.form].title
    return step.form.replace("_", " ").capitalize() if form is None else protocol.text(form, language)


def moment_words(moments: tuple[Moment, ...]) -> tuple[tuple[Moment, str], ...]:
    """Return the pages of a step with their words; none where there is no choice."""
    tanks = sum(moment.kind == "tank" for moment in moments)
    named = {
        "tank": "Tank",
        "questions": "Questions" if tanks < 2 else "Question",
        "feedback": "Feedback",
        "text": "Text",
    }
    if len(moments) < 2:
        return ()
    return tuple(
        (moment, f"Interval {moment.interval}" if moment.kind == "tank" and tanks > 1 else named[moment.kind])
        for moment in moments
    )
