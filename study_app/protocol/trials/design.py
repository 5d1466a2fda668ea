"""What every design of a trial has: its intervals, its arrangements, its answers, and which answer is correct."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Protocol, TypeAlias

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.table import Table
from study_app.protocol.texts import Id, Localised

if TYPE_CHECKING:
    from study_app.psychophysics.detection import Sensitivity

Feedback: TypeAlias = Literal["never", "practice", "always"]
Reply: TypeAlias = Literal["choice", "rating", "number", "setting"]
Arrangement: TypeAlias = tuple[bool, ...]
"""Per interval whether it presents the comparison, in the order of presentation."""

Counted: TypeAlias = Mapping[tuple[int, str], int]
"""How often each answer was given to each arrangement."""


class Modulus(Table):
    """The level of a block's first trial and the number that the participant is given for it; it is not analysed."""

    level: float = Field(description="The level that is presented.")
    number: Annotated[float, within(1e-6, 1e9, "a number that a person can name")] = Field(
        description="The number that stands for it."
    )


class Attention(Protocol):
    """What a simulated observer attends to in the intervals of a trial."""

    @property
    def smallest(self) -> bool:
        """Whether the weaker one is asked for."""

    def distinct(self, difference: float, about: float) -> bool:
        """Return whether a difference between two around ``about`` is noticed."""


class Design(Table):
    """How a trial is built and answered: the keys that all kinds share, and what each kind must say.

    A kind is a module of ``designs`` with a subclass whose ``kind`` is a ``Literal`` with a default.
    """

    if TYPE_CHECKING:
        kind: str

    item: Id | None = Field(
        default=None, description="The answer's name in tables; default: the kind, such as choice_2ifc or yesno."
    )
    question: Localised | None = Field(default=None, description="The question; default: the program's own words.")
    pause_s: Annotated[float, within(0.3, 10, "hands need 0.3 s to settle; memory fades within seconds")] = Field(
        default=0.6, description="Interstimulus interval: zero force between two intervals [s]."
    )
    between_s: Annotated[float, within(0.0, 60, "a minute is a break, which has a page")] = Field(
        default=0.8, description="Zero force between an answer and the next trial [s]."
    )
    feedback: Feedback | None = Field(
        default=None,
        description="never: the participant does not see whether an answer was correct; practice: in practice alone, "
        'the default; always: after every answer. Where no answer is correct, "never" is the default.',
    )
    feedback_s: Annotated[float, within(0.2, 10, "a sign needs 0.2 s to be seen")] = Field(
        default=0.6, description="How long the feedback is shown [s]."
    )

    reply: ClassVar[Reply] = "choice"
    has_standard: ClassVar[bool] = True
    """Whether intervals are compared with a standard; otherwise there is one interval, the level itself."""
    has_correct_answer: ClassVar[bool] = True
    has_noise: ClassVar[bool] = False
    """Whether some slots present the standard alone."""
    asks_for_more: ClassVar[bool] = False
    """Whether the correct answer is the interval with more (or less), so that levels on both sides have none."""
    success_name: ClassVar[str] = "correct"
    """What `success` counts."""
    adaptive: ClassVar[bool] = True
    """Whether answers can choose the next level; otherwise the method must be "constant"."""

    @property
    def adjusts(self) -> bool:
        """Whether the participant sets the level of the last interval while it is presented."""
        return self.reply == "setting"

    @property
    def name(self) -> str:
        """The answer's name in tables."""
        return self.item or (self.kind if self.kind[:1].isalpha() else f"choice_{self.kind}")

    @property
    def paper_name(self) -> str:
        """What a paper calls it."""
        return self.kind

    @property
    def wording(self) -> str:
        """The name of its question among the program's own words."""
        return self.kind

    @property
    @abstractmethod
    def answers(self) -> tuple[str, ...]:
        """The answers that may be chosen, in temporal order; empty where the reply is not a choice."""

    @property
    @abstractmethod
    def arrangements(self) -> tuple[Arrangement, ...]:
        """All arrangements of standard and comparison; each comes equally often."""

    @property
    @abstractmethod
    def guess_rate(self) -> float | None:
        """The probability of a correct answer at chance; None where it is free or no answer is correct."""

    @property
    def intervals(self) -> int:
        """How many intervals a trial has."""
        return len(self.arrangements[0])

    @property
    def first(self) -> Modulus | None:
        """What a block's first trial presents and names, before those that are analysed; None: nothing."""
        return None

    def noise(self, comparisons: int) -> int:
        """Return how many slots present the standard alone, in addition to so many comparisons."""
        return 0

    def correct(self, arrangement: int) -> str | None:
        """Return the correct answer to an arrangement; None where no answer is correct."""
        return None

    def is_correct(self, arrangement: int, answer: str) -> bool | None:
        """Return whether an answer to an arrangement is correct; None where no answer is."""
        correct = self.correct(arrangement)
        return None if correct is None else answer == correct

    def correct_of(self, answers: Counted) -> tuple[int, int]:
        """Return how many answers were correct, and of how many."""
        right = sum(count for pair, count in answers.items() if self.is_correct(*pair))
        return right, sum(answers.values())

    def success(self, arrangement: int, answer: str) -> bool | None:
        """Return what an answer counts as for a psychometric function; None where it does not enter one."""
        return self.is_correct(arrangement, answer)

    def sensitivity(self, answers: Counted, *, roving: bool) -> Sensitivity | None:
        """Return d′ and bias of one observer; None where the answers do not give them.

        Parameters
        ----------
        answers : mapping
            How often each answer was given to each arrangement.
        roving : bool
            Whether standards vary from trial to trial, so that intervals can only be compared with each other.
        """
        return None

    def proportion_correct(self, d_prime: float, *, roving: bool) -> float:
        """Return P(correct) of an unbiased observer, where answers can be correct.

        Parameters
        ----------
        d_prime : float
            Distance of comparison and standard in standard deviations of one observation, 0 or more.
        roving : bool
            Whether standards vary from trial to trial, so that intervals can only be compared with each other.
        """
        from study_app.psychophysics.detection import proportion_correct  # noqa: PLC0415 - loads numpy

        return proportion_correct(self.kind, d_prime)

    def simulated(self, taken: Sequence[float], mean: float, attention: Attention) -> str:
        """Return the answer of a simulated observer, where the reply is a choice.

        Parameters
        ----------
        taken : sequence of float
            What each interval was taken for.
        mean : float
            The mean of all intervals of the block so far.
        attention : Attention
            What the observer attends to.
        """
        raise NotImplementedError

    def shows_feedback(self, practice: bool) -> bool:
        """Return whether the participant sees if an answer was correct."""
        when = self.feedback or ("practice" if self.has_correct_answer else "never")
        return when == "always" or (when == "practice" and practice)


class JudgementDesign(Design):
    """Designs whose reply is a scale point, a number or a setting."""

    has_standard: ClassVar[bool] = False
    has_correct_answer: ClassVar[bool] = False
    adaptive: ClassVar[bool] = False

    @property
    def answers(self) -> tuple[str, ...]:
        """None: the reply is no choice."""
        return ()

    @property
    def arrangements(self) -> tuple[Arrangement, ...]:
        """The comparison alone."""
        return ((True,),)

    @property
    def guess_rate(self) -> None:
        """No answer is correct."""
        return


def to_arrangements(answers: Counted, arrangements: Collection[int], given: str) -> tuple[int, int]:
    """Return how often ``given`` was answered to some arrangements, and how many answers they had."""
    held = {pair: count for pair, count in answers.items() if pair[0] in arrangements}
    return sum(count for (_, answer), count in held.items() if answer == given), sum(held.values())


ORDINALS = ("first", "second", "third", "fourth")


@lru_cache
def one_differs(count: int, among: bool) -> tuple[Arrangement, ...]:
    """Return the arrangements of ``count`` intervals of which one alone is ``among``."""
    return tuple(tuple((at == odd) is among for at in range(count)) for odd in range(count))
