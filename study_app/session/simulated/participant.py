"""The behaviour of all simulated participants on a page of questions: notice, answer and confirm.

In an adjustment they change the level until its perceived strength crosses that of the remembered standard.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import Final

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders import Schedule
from study_app.protocol.participants import REHEARSED
from study_app.protocol.questions import Value, plain_number
from study_app.protocol.randomization import stream
from study_app.protocol.simulated import Comparison, Course, Observer, TrialFeatures, courses_of, observer_of, rater
from study_app.session.pages import ChoicePage, DesignPage, Page, QuestionnairePage
from study_app.session.simulated.observers import Choice, Draw, answer_choices, fill_in_page, newly_shown_questions
from study_app.session.transitions.events import Chosen, Event, ItemShown, Submitted

LOOK_AT_SETTING_S: Final = 0.5
"""Time for which the observer judges a level before the next steps [s]: half a swing of a target at 1 Hz."""
_COARSE_STEPS: Final = 4
"""Size of the first steps, until the remembered strength is crossed. [choice]"""
_MAX_JUDGEMENTS: Final = 60
"""Number of judgements after which the observer stops, since the remembered strength may lie beyond the levels."""


class AdjustingObserver:
    """An observer that perceives standard and adjusted level with noise, and adjusts the level until they cross.

    The noise is drawn once per setting, so that settings vary like the difference between two single percepts.
    """

    def __init__(self, attended: Comparison, draw: Draw) -> None:
        self._attended = attended
        self._remembered_noise, self._noise = (attended.noisy(self._neutral, draw) for _ in range(2))
        self._step_size = _COARSE_STEPS
        self._direction = 0
        self._judgements = 0

    def steps(self, sensed: float, standard: float) -> int:
        """Return the next steps for a sensed level, 0 if the setting is done; ``standard`` is the sensed standard.

        Both are those of `Comparison.sensed`.
        """
        self._judgements += 1
        shortfall = self._perceived_magnitude(standard, self._remembered_noise) - self._perceived_magnitude(
            sensed, self._noise
        )
        direction = 1 if shortfall > 0 else -1
        crossed = self._direction not in {0, direction}
        if shortfall == 0 or self._judgements > _MAX_JUDGEMENTS or (crossed and self._step_size == 1):
            return 0
        if crossed:
            self._step_size = 1
        self._direction = direction
        return direction * self._step_size

    @property
    def _neutral(self) -> float:
        return 0.0 if self._attended.delays else 1.0

    def _perceived_magnitude(self, sensed: float, noise: float) -> float:
        return sensed + noise if self._attended.delays else sensed * noise


class SimulatedParticipant(ABC):
    """Answer the pages of a session; subclasses define how time passes and where events go.

    In every session with the same seed, a participant is the same observer, but with new random choices.
    """

    def __init__(
        self, study: Protocol, schedule: Schedule, observer: Observer | None = None, *, session: int = 1
    ) -> None:
        self.page: Page | None = None
        self._study = study
        self._seed, self._participant = schedule.seed, schedule.participant
        self._trials = {trial.number: trial for trial in schedule.trials}
        stream_prefix = f"rehearsal/{self._participant}"
        self._streams = stream_prefix if session == 1 else f"{stream_prefix}/session {session}"
        self.observer = observer or observer_of(stream(self._seed, f"{stream_prefix}/observer").random)
        self._person = rater(
            stream(self._seed, f"{stream_prefix}/person").random, study.simulated_participants or REHEARSED
        )
        self._courses = courses_of(schedule)
        self._answers: dict[int, str | int | float] = {}

    @abstractmethod
    def _seconds(self) -> float:
        """Return the time on the session's clock."""

    @abstractmethod
    def _wait(self, seconds: float) -> None:
        """Wait for a simulated time [s]."""

    @abstractmethod
    def _post(self, event: Event) -> None:
        """Post an event to the session."""

    @abstractmethod
    def _perceived_features(self, trial: int | None) -> TrialFeatures:
        """Return the features perceived in the trial's last presentation.

        For a form, ``trial`` is None and the features do not matter: those of the last trial or none.
        """

    @abstractmethod
    def _sensed_magnitudes(self, block: Block) -> Mapping[int, Sequence[float]]:
        """Return the sensed magnitudes of each interval by trial, for a block with a design."""

    def _stream(self, name: str) -> Draw:
        return stream(self._seed, f"{self._streams}/{name}").random

    def _comparison_of(self, trial: int) -> Comparison:
        """Return the comparison that the observer makes in a trial of a block with a design."""
        return Comparison.of(self._study, self._study.blocks[self._trials[trial].block], self.observer)

    def _adjusting_observer(self, trial: int) -> AdjustingObserver:
        """Return the observer that adjusts the level of a trial."""
        return AdjustingObserver(self._comparison_of(trial), self._stream(f"{trial}/answers"))

    def _reference_magnitude(self, trial: int, sensed: float) -> float:
        """Return the reference of a setting: the interval before, else the mean of earlier settings, else itself."""
        block = self._study.blocks[self._trials[trial].block]
        sensed_by_trial = self._sensed_magnitudes(block)
        if self._study.design_of(block).intervals > 1:
            return sensed_by_trial[trial][0]
        earlier = [
            magnitude for number in sorted(sensed_by_trial) if number < trial for magnitude in sensed_by_trial[number]
        ]
        return sum(earlier) / len(earlier) if earlier else sensed

    def _fill_in(self, page: QuestionnairePage | DesignPage) -> None:
        """Answer every question of a page and confirm, until another page is shown."""
        answers: dict[str, Value] = {}
        seen = self._notice_questions(page, answers, ())
        for choice in self._answers_to(page):
            self._wait(choice.after_s)
            if page is not self.page:
                return
            self._post(Chosen(self._seconds(), choice.item, choice.value))
            answers[choice.item] = choice.value
            seen += self._notice_questions(page, answers, seen)
        if not isinstance(page, ChoicePage):  # on a choice page the answer continues the session
            self._wait(1.0)
        if page is self.page:
            self._post(Submitted(self._seconds()))

    def _answers_to(self, page: QuestionnairePage | DesignPage) -> list[Choice]:
        """Return the choices that answer a page, according to the percept."""
        draw, trial = self._stream(page.stream), page.trial
        block = None if trial is None else self._study.blocks[self._trials[trial].block]
        if trial is not None and block is not None and block.design is not None:
            answer = self._design_answer(block, trial, draw)
            if isinstance(answer, float):
                answer = plain_number(max(0.01, round(answer, 2)))
            return answer_choices(
                page.items, {page.items[0].id: answer}, draw, changes_mind=not isinstance(page, ChoicePage)
            )
        assert isinstance(page, QuestionnairePage)  # noqa: S101 - only designs have other pages
        return fill_in_page(page, self._perceived_features(trial), self._person, draw)

    def _design_answer(self, block: Block, trial: int, draw: Draw) -> str | int | float:
        """Return the answer to a trial with a design; a resumed session repeats its earlier answers."""
        sensed, design = self._sensed_magnitudes(block), self._study.design_of(block)
        before: list[float] = []
        last: str | int | float | None = None
        for number in sorted(other for other in sensed if other <= trial):
            answered = len(sensed[number]) == design.intervals  # otherwise its last attempt was not delivered either
            if number == trial or (answered and number not in self._answers):
                source = draw if number == trial else self._stream(f"{number}/answers")
                course = Course(self._courses[number], last)
                attended = self._comparison_of(number)
                self._answers[number] = attended.answer(self._study, design, sensed[number], before, source, course)
            last = self._answers.get(number, last)
            before += sensed[number]
        return self._answers[trial]

    def _notice_questions(
        self, page: QuestionnairePage | DesignPage, answers: Mapping[str, Value], seen: Collection[str]
    ) -> tuple[str, ...]:
        appeared = newly_shown_questions(page, answers, seen)
        for item in appeared:
            self._post(ItemShown(self._seconds(), item))
        return appeared
