"""What every simulated participant does with a page of questions: notice, answer by what was felt, and confirm.

Trials of intervals are answered by an observer who compares what was felt or seen, never a level. What reaches the
observer is a resistance (mean force over speed) or a delay, with Gaussian noise: in proportion to the resistance
(Weber's law), of constant spread for a delay; `Observer` plants both thresholds. Estimates follow a power law with
exponent 1/2 (Stevens 1957, Psychological Review 64, 153) unless another is planted. Settings are adjusted until the
strength equals the remembered one, as it is taken. The observer's numbers are plausible, not measured **[choice]**.
Only sums, products, quotients and square roots are used, but for planted exponents, so that answers are the same on
every machine.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, stream
from study_app.protocol.questions import ChoiceView, ItemView, RatingView, Value, plain_number
from study_app.protocol.simulated_observer import TrialFeatures, rater
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.stimuli import DELAYS, FORCE_DELAY, OF_LINK
from study_app.protocol.trials.tracks import design_of, stimulus_of
from study_app.session.pages import ChoicePage, DesignPage, Page, QuestionnairePage
from study_app.session.simulated.observers import Choice, Draw, choices, filled_in, newly_shown
from study_app.session.transitions.events import Chosen, Event, ItemShown, Submitted

_Z_75: Final = 0.6745
LEAST_SPEED_MPS: Final = 0.01
MODULUS: Final = 10.0
"""The number that the first stimulus is given."""
LOOK_AT_SETTING_S: Final = 0.5
"""How long the observer judges before the next steps [s]: half a swing of a target at 1 Hz."""
FAST: Final = 4
"""Steps at once, until the remembered strength was crossed. [choice]"""
MOST_LOOKS: Final = 60
"""Then the observer leaves a setting as it is: what is remembered may lie beyond the levels."""


@dataclass(frozen=True, slots=True)
class Observer:
    """What a simulated participant can discriminate.

    Attributes
    ----------
    weber_fraction : float
        Of resistance, at 75 % correct in two intervals without lapses.
    delay_jnd_s : float
        Of a delay, likewise [s].
    lapses : float
        So often an answer is given at random.
    estimates : tuple of float, optional
        Exponent of estimates over resistance, and the standard deviation of their logarithm; None: 1/2 of the noisy
        resistance.
    """

    weber_fraction: float = 0.24
    delay_jnd_s: float = 0.025
    lapses: float = 0.02
    estimates: tuple[float, float] | None = None

    @property
    def resistance_noise(self) -> float:
        """The standard deviation of what a resistance is taken for, as a share of it."""
        return self.weber_fraction / (_Z_75 * math.sqrt(1 + (1 + self.weber_fraction) ** 2))

    @property
    def delay_noise_s(self) -> float:
        """The standard deviation of what a delay is taken for [s]."""
        return self.delay_jnd_s / (math.sqrt(2) * _Z_75)


OBSERVER: Final = Observer()


@dataclass(frozen=True, slots=True)
class Comparison:
    """What an observer attends to in a block, and whether the smaller one is asked for.

    These are delays, or resistances; of a force that is sent with jitter or loss how rough it is.
    """

    delays: bool
    smallest: bool
    observer: Observer
    vary: str | None = None

    @classmethod
    def of(cls, protocol: Protocol, block: Block, observer: Observer) -> Comparison:
        """Return what the question of a block is about."""
        if block.stimulus is not None:
            stimulus = stimulus_of(protocol, block)
            return cls(stimulus.vary in DELAYS, stimulus.direction == "down", observer, stimulus.vary)
        delays = {protocol.conditions[name].delay_ms for name in block.conditions}
        return cls(len(delays) > 1, smallest=False, observer=observer)

    def sensed(self, felt: TrialFeatures) -> float:
        """Return what is attended to: a delay [s], a roughness [N], or a resistance [N·s/m]."""
        if self.vary == FORCE_DELAY:
            return felt.force_delay_s
        if self.vary in OF_LINK:
            return felt.roughness_n
        return felt.delay_s if self.delays else felt.force_mean_n / max(felt.speed_rms_mps, LEAST_SPEED_MPS)

    def noisy(self, sensed: float, draw: Draw) -> float:
        """Return what the observer takes it for."""
        noise = sum(draw() for _ in range(12)) - 6  # nearly normal
        observer = self.observer
        return (
            sensed + observer.delay_noise_s * noise if self.delays else sensed * (1 + observer.resistance_noise * noise)
        )

    def distinct(self, difference: float, about: float) -> bool:
        """Return whether a difference is taken for one."""
        observer = self.observer
        return abs(difference) > (observer.delay_jnd_s if self.delays else observer.weber_fraction * abs(about))

    def choose(self, design: Design, sensed: Sequence[float], mean: float, draw: Draw) -> str:
        """Return the answer of a design with choices to what was sensed; ``mean`` is that of the block so far."""
        taken = [self.noisy(one, draw) for one in sensed]
        if draw() < self.observer.lapses:
            return design.answers[int(len(design.answers) * draw())]
        return design.simulated(taken, mean, self)


def answer(
    protocol: Protocol,
    block: Block,
    item: ItemView,
    sensed: Sequence[float],
    before: Sequence[float],
    draw: Draw,
    observer: Observer,
) -> Value:
    """Return the answer to a trial of intervals."""
    attended = Comparison.of(protocol, block, observer)
    known = [*before, *sensed]
    mean, first = sum(known) / len(known), known[0]
    if isinstance(item, ChoiceView):
        return attended.choose(design_of(protocol, block), sensed, mean, draw)
    if observer.estimates is not None and not isinstance(item, RatingView) and first > 0 and sensed[-1] > 0:
        return plain_number(max(0.01, round(estimate(observer, sensed[-1] / first, draw), 2)))
    taken = [attended.noisy(one, draw) for one in sensed]
    ratio = taken[-1] / (first if not isinstance(item, RatingView) else mean) if mean > 0 and first > 0 else 1.0
    if isinstance(item, RatingView):
        points = len(item.labels)
        middle = (points + 1) / 2
        return min(points, max(1, math.floor(middle + (ratio - 1) * (points - 1) + 0.5)))
    return plain_number(max(0.01, round(MODULUS * math.sqrt(max(ratio, 0.0)), 2)))


def estimate(observer: Observer, ratio: float, draw: Draw) -> float:
    """Return the number for a resistance that is ``ratio`` times the block's first, which is called `MODULUS`."""
    assert observer.estimates is not None  # noqa: S101 - planted
    exponent, spread = observer.estimates
    noise = sum(draw() for _ in range(12)) - 6  # nearly normal
    return MODULUS * math.exp(exponent * math.log(ratio) + spread * noise)


class AdjustingObserver:
    """Remembers the standard with noise, takes what is adjusted with noise, and goes on until the two cross.

    The noise of a setting is drawn once, so that settings scatter as the difference of two single impressions does.
    """

    def __init__(self, attended: Comparison, draw: Draw) -> None:
        self._attended = attended
        self._remembered_noise, self._noise = (attended.noisy(self._neutral, draw) for _ in range(2))
        self._hop = FAST
        self._way = 0
        self._looks = 0

    def steps(self, sensed: float, standard: float) -> int:
        """Return the next steps by what is sensed, 0 where the setting is done; ``standard`` is what was sensed of it.

        Both are those of `Comparison.sensed`.
        """
        self._looks += 1
        short = self._taken(standard, self._remembered_noise) - self._taken(sensed, self._noise)
        way = 1 if short > 0 else -1
        crossed = self._way not in {0, way}
        if short == 0 or self._looks > MOST_LOOKS or (crossed and self._hop == 1):
            return 0
        if crossed:
            self._hop = 1
        self._way = way
        return way * self._hop

    @property
    def _neutral(self) -> float:
        return 0.0 if self._attended.delays else 1.0

    def _taken(self, sensed: float, noise: float) -> float:
        return sensed + noise if self._attended.delays else sensed * noise


class SimulatedParticipant(ABC):
    """Answers the pages of a session; how time passes and where events go is the subclass's affair."""

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
