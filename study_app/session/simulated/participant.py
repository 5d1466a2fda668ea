"""What every simulated participant does with a page of questions: notice, answer by what was felt, and confirm."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, stream
from study_app.protocol.questions import Value
from study_app.protocol.simulated_observer import TrialFeatures, rater
from study_app.protocol.trials.tracks import design_of
from study_app.session.pages import ChoicePage, DesignPage, Page, QuestionnairePage
from study_app.session.simulated.adjusting_observer import AdjustingObserver
from study_app.session.simulated.design_observer import Comparison, Observer, answer
from study_app.session.simulated.observers import Choice, Draw, choices, filled_in, newly_shown
from study_app.session.transitions.events import Chosen, Event, ItemShown, Submitted


class SimulatedParticipant(ABC):
    """Answers the pages of a session; how time passes and where events go is the subclass's affair.

    Parameters
    ----------
    study : Protocol
        What is run.
    schedule : Schedule
        In what order.
    observer : Observer
        Discriminates the intervals of a trial.
    """

    def __init__(self, study: Protocol, schedule: Schedule, observer: Observer) -> None:
        self.answers = 0
        self.page: Page | None = None
        self._study = study
        self._seed, self._who = schedule.seed, schedule.participant
        self._trials = {trial.number: trial for trial in schedule.trials}
        self.observer = observer
        self._person = rater(self._stream("person"))

    @abstractmethod
    def _seconds(self) -> float:
        """Return the time on the session's clock."""

    @abstractmethod
    def _pass(self, seconds: float) -> None:
        """Let time pass while nothing is done."""

    @abstractmethod
    def _post(self, event: Event) -> None:
        """Give the session an event."""

    @abstractmethod
    def _felt(self, trial: int | None) -> TrialFeatures:
        """Return what was felt last in a trial; on a page of no trial nothing."""

    @abstractmethod
    def _sensed(self, block: Block) -> Mapping[int, Sequence[float]]:
        """Return what was sensed in the trials of a block with a design so far, by trial, interval by interval."""

    def _stream(self, name: str) -> Draw:
        return stream(self._seed, f"rehearsal/{self._who}/{name}").random

    def _attended(self, trial: int) -> Comparison:
        """Return what is attended to in a trial of a block with a design."""
        return Comparison.of(self._study, self._study.blocks[self._trials[trial].block], self.observer)

    def _adjusting(self, trial: int) -> AdjustingObserver:
        """Return who sets the level of a trial."""
        return AdjustingObserver(self._attended(trial), self._stream(f"{trial}/answers"))

    def _remembered(self, trial: int, sensed: float) -> float:
        """Return what a setting is compared with: the interval before, else the mean of earlier ones, else itself."""
        block = self._study.blocks[self._trials[trial].block]
        known = self._sensed(block)
        if design_of(self._study, block).intervals > 1:
            return known[trial][0]
        earlier = [one for number in sorted(known) if number < trial for one in known[number]]
        return sum(earlier) / len(earlier) if earlier else sensed

    def _fill_in(self, page: QuestionnairePage | DesignPage) -> None:
        """Answer every question by what was felt, and confirm."""
        answers: dict[str, Value] = {}
        seen = self._notice_questions(page, answers, ())
        for choice in self._answers_to(page):
            self._pass(choice.after_s)
            if page is not self.page:
                return
            self._post(Chosen(self._seconds(), choice.item, choice.value))
            answers[choice.item] = choice.value
            seen += self._notice_questions(page, answers, seen)
        if not isinstance(page, ChoicePage):  # there the press that answers goes on
            self._pass(1.0)
        self._post(Submitted(self._seconds()))
        self.answers += len(answers)

    def _answers_to(self, page: QuestionnairePage | DesignPage) -> list[Choice]:
        """Return how a page is answered by what was felt."""
        draw, trial = self._stream(page.stream), page.trial
        block = None if trial is None else self._study.blocks[self._trials[trial].block]
        if trial is not None and block is not None and block.design is not None:
            sensed = self._sensed(block)
            before = [one for number in sorted(sensed) if number < trial for one in sensed[number]]
            given = answer(self._study, block, page.items[0], sensed[trial], before, draw, self.observer)
            return choices(page.items, {page.items[0].id: given}, draw, changes_mind=not isinstance(page, ChoicePage))
        assert isinstance(page, QuestionnairePage)  # noqa: S101 - only designs have other pages
        return filled_in(page, self._felt(trial), self._person, draw)

    def _notice_questions(
        self, page: QuestionnairePage | DesignPage, answers: Mapping[str, Value], seen: Collection[str]
    ) -> tuple[str, ...]:
        """Notice the questions that appeared; return them."""
        appeared = newly_shown(page, answers, seen)
        for item in appeared:
            self._post(ItemShown(self._seconds(), item))
        return appeared
