"""Designs of a trial: its intervals, their arrangements, the answers, and which answer is correct.

A kind is a subclass of `Design` whose ``kind`` is a ``Literal`` with a default, in `DESIGN_KINDS`. The study file's
key, the page, the tables, d′, the report and simulated observers follow from its values and methods.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Literal, Protocol, TypeAlias, get_args

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.questionnaires import Questionnaire
from study_app.protocol.questions import POSITIVE, Choice, Number, Option, Question, Rating
from study_app.protocol.source.table import Id, Localised, Table
from study_app.protocol.wording.languages import words_or_english
from study_app.psychophysics import detection
from study_app.psychophysics.detection import Sensitivity

_Feedback: TypeAlias = Literal["never", "practice", "always"]
Reply: TypeAlias = Literal["choice", "rating", "number", "setting"]
_Arrangement: TypeAlias = tuple[bool, ...]
"""For each interval, in the order of presentation, whether it presents the comparison."""
_AnswerCounts: TypeAlias = Mapping[tuple[int, str], int]
"""The number of times that each answer was given to each arrangement."""
Model: TypeAlias = Literal["differencing", "independent"]
ANSWER_S: Final = 6.0
_CHOICE_S: Final = 2.0
"""Time to answer a statement, and to choose an interval [s], for the expected duration. [choice]"""
COMPARISON_CHOSEN: Final = "comparison chosen"
"""The name of a success if no answer is correct."""
ORDINALS: Final = ("first", "second", "third", "fourth")


class Attention(Protocol):
    """The perception of a simulated observer in the intervals of a trial."""

    @property
    def smallest(self) -> bool:
        """Whether the weaker interval is asked for."""

    def distinct(self, difference: float, about: float) -> bool:
        """Return whether a difference between two values around ``about`` is noticed."""


class Varied(Protocol):
    """The stimulus of a block with a design."""

    @property
    def level_kind(self) -> str:
        """The meaning of its levels; "value" if a level may be above or below the standard."""


class Modulus(Table):
    """The level of a block's first trial and the number assigned to it; this trial is not analysed."""

    level: float = Field(description="The level presented.")
    number: Annotated[float, within(1e-6, 1e9, "participants use numbers in this range")] = Field(
        description="The number assigned to this level."
    )


class Design(Table):
    """The structure of a trial and its answer: the common keys, and the properties that each kind defines.

    ``answers`` can be chosen, in temporal order, empty if the reply is not a choice; all ``arrangements`` of standard
    and comparison are equally frequent. ``guess_rate`` is the probability of a correct answer by chance, None if it is
    a free parameter or no answer is correct. ``roving`` means that standards vary between trials, so that intervals can
    only be compared with each other.
    """

    if TYPE_CHECKING:
        kind: str

    item: Id | None = Field(
        default=None, description="The answer's name in tables; default: the kind, such as choice_2ifc or yesno."
    )
    question: Localised | None = Field(default=None, description="The question; default: the program's own text.")
    pause_s: Annotated[float, within(0.3, 10, "hands need 0.3 s to settle; memory fades within seconds")] = Field(
        default=0.6, description="Interstimulus interval, during which the force is zero [s]."
    )
    between_s: Annotated[float, within(0.0, 60, "use a break page for a minute or more")] = Field(
        default=0.8, description="Time between an answer and the next trial, during which the force is zero [s]."
    )
    feedback: _Feedback | None = Field(
        default=None,
        description="When participants see whether an answer was correct. practice: only in practice (the default); "
        "always: after every answer; never: not at all (the default if answers cannot be correct).",
    )
    feedback_s: Annotated[float, within(0.2, 10, "people need 0.2 s to notice feedback")] = Field(
        default=0.6, description="How long feedback is shown [s]."
    )

    answers: ClassVar[tuple[str, ...]] = ()
    arrangements: ClassVar[tuple[_Arrangement, ...]] = ((True,),)
    guess_rate: ClassVar[float | None] = None
    reply: ClassVar[Reply] = "choice"
    has_standard: ClassVar[bool] = True  # otherwise there is one interval with the level itself
    has_correct_answer: ClassVar[bool] = True
    has_noise: ClassVar[bool] = False  # whether some slots present the standard alone
    asks_for_more: ClassVar[bool] = False  # whether the interval with more (or less) is correct
    success_name: ClassVar[str] = "correct"  # the name of a success
    adaptive: ClassVar[bool] = True  # whether answers can determine the next level; otherwise the method is "constant"
    paper_name: ClassVar[str]
    """Its name in publications."""
    first: ClassVar[Modulus | None] = None
    """The level and the number of a block's first trial, which is not analysed."""

    @property
    def adjusts(self) -> bool:
        """Whether the participant sets the level of the last interval while it is presented."""
        return self.reply == "setting"

    @property
    def answer_s(self) -> float:
        """The expected time to answer [s]."""
        return _CHOICE_S if self.reply == "choice" else ANSWER_S

    @property
    def name(self) -> str:
        """The answer's name in tables."""
        return self.item or (self.kind if self.kind[:1].isalpha() else f"choice_{self.kind}")

    @property
    def wording(self) -> str:
        """The name of its question among the program's own texts."""
        return self.kind

    @property
    def intervals(self) -> int:
        return len(self.arrangements[0])

    def noise(self, comparisons: int) -> int:
        """Return the number of slots with only the standard, in addition to ``comparisons``."""
        return 0

    def correct(self, arrangement: int) -> str | None:
        """Return the correct answer to an arrangement; None if no answer is correct."""
        return None

    def is_correct(self, arrangement: int, answer: str) -> bool | None:
        """Return whether an answer to an arrangement is correct; None if no answer can be."""
        correct = self.correct(arrangement)
        return None if correct is None else answer == correct

    def can_be_correct(self, stimulus: Varied | None) -> bool:
        """Return whether answers about a stimulus (None: about conditions) can be correct.

        A level that is a value may be above or below the standard: then an interval can still differ from the others,
        or be the same as another, but a forced choice between more and less has no correct answer.
        """
        is_value = stimulus is not None and stimulus.level_kind == "value"
        return self.has_correct_answer and not (is_value and self.asks_for_more)

    def success_of(self, stimulus: Varied | None) -> str:
        """Return the name of a success: "correct", "yes", or `COMPARISON_CHOSEN` if no answer is correct."""
        has_no_correct_answer = self.has_correct_answer and not self.can_be_correct(stimulus)
        return COMPARISON_CHOSEN if has_no_correct_answer else self.success_name

    def arrangement_text(self, arrangement: int) -> str:
        """Return an arrangement for the journal: S for the standard, C for the comparison, such as "SC"."""
        return "".join("C" if is_comparison else "S" for is_comparison in self.arrangements[arrangement])

    def arrangement_of(self, text: str) -> int:
        """Return the arrangement with this text in the journal; raise ValueError if there is none."""
        return self.arrangements.index(tuple(letter == "C" for letter in text))

    def correct_of(self, answers: _AnswerCounts) -> tuple[int, int]:
        """Return the number of correct answers, and of all answers."""
        return sum(count for pair, count in answers.items() if self.is_correct(*pair)), sum(answers.values())

    def success(self, arrangement: int, answer: str) -> bool | None:
        """Return whether an answer is a success of the psychometric function; None if it does not count."""
        return self.is_correct(arrangement, answer)

    def sensitivity(self, answers: _AnswerCounts, *, roving: bool) -> Sensitivity | None:
        """Return d′ and bias of one observer; None if the answers do not determine them."""
        return self._sensitivity(answers, "differencing" if roving else "independent")

    def _sensitivity(self, answers: _AnswerCounts, model: Model) -> Sensitivity | None:
        return detection.from_correct(self.kind, *self.correct_of(answers)) if self.has_correct_answer else None

    def proportion_correct(self, d_prime: float, *, roving: bool) -> float:
        """Return P(correct) of an unbiased observer at a d′ of 0 or more, if answers can be correct."""
        model = f" {'differencing' if roving else 'independent'}" if self.kind in {"abx", "samedifferent"} else ""
        return detection.proportion_correct(f"{self.kind}{model}", d_prime)

    def simulated(self, perceived: Sequence[float], mean: float, attention: Attention) -> str:
        """Return the answer of a simulated observer, for designs with a choice.

        Each interval is ``perceived`` as a number; ``mean`` is that of all intervals of the block so far.
        """
        raise NotImplementedError

    def shows_feedback(self, practice: bool) -> bool:
        """Return whether participants see whether an answer was correct."""
        when = self.feedback or ("practice" if self.has_correct_answer else "never")
        return when == "always" or (when == "practice" and practice)


def _answer_counts(answers: _AnswerCounts, arrangements: Collection[int], answer: str) -> tuple[int, int]:
    """Return how often an answer was given to some arrangements, and the number of all answers to them."""
    counts = {pair: count for pair, count in answers.items() if pair[0] in arrangements}
    return sum(count for (_, given), count in counts.items() if given == answer), sum(counts.values())


def _odd_one_arrangements(count: int, *, odd_value: bool) -> tuple[_Arrangement, ...]:
    """Return the arrangements of ``count`` intervals of which exactly one has the value ``odd_value``."""
    return tuple(tuple((index == odd) is odd_value for index in range(count)) for odd in range(count))


class ForcedChoice(Design):
    """The answer is the interval that contained the comparison.

    Green & Swets 1966, Signal Detection Theory and Psychophysics: an observer who guesses is correct in 1/m of the
    trials with m intervals.
    """

    kind: Literal["2ifc", "3ifc", "4ifc"] = "2ifc"
    asks_for_more: ClassVar = True
    paper_name = property(lambda self: f"{('two', 'three', 'four')[self.intervals - 2]}-interval forced choice")
    answers = property(lambda self: ORDINALS[: self.intervals])
    arrangements = property(lambda self: _odd_one_arrangements(int(self.kind[0]), odd_value=True))
    guess_rate = property(lambda self: 1 / self.intervals)

    @property
    def wording(self) -> str:
        return "forced_choice" if self.intervals == 2 else "forced_choice_of_many"

    def correct(self, arrangement: int) -> str:
        return ORDINALS[self.arrangements[arrangement].index(True)]

    def _sensitivity(self, answers: _AnswerCounts, model: Model) -> Sensitivity | None:
        """Return d′, and for two intervals the criterion, which is positive if the second one is preferred."""
        if self.kind != "2ifc":
            return super()._sensitivity(answers, model)
        return detection.two_intervals(*_answer_counts(answers, {0}, "first"), *_answer_counts(answers, {1}, "first"))

    def simulated(self, perceived: Sequence[float], mean: float, attention: Attention) -> str:
        return ORDINALS[perceived.index(min(perceived) if attention.smallest else max(perceived))]


class Oddity(Design):
    """Which one differed? The odd one is the comparison or the standard (Frijters 1979, J. Math. Psychol. 20)."""

    kind: Literal["oddity"] = "oddity"
    paper_name: ClassVar = "oddity (triangle test)"
    answers: ClassVar = ORDINALS[:3]
    arrangements: ClassVar = _odd_one_arrangements(3, odd_value=True) + _odd_one_arrangements(3, odd_value=False)
    guess_rate: ClassVar = 1 / 3

    def correct(self, arrangement: int) -> str:
        presented = self.arrangements[arrangement]
        return self.answers[presented.index(presented.count(True) == 1)]

    def simulated(self, perceived: Sequence[float], mean: float, attention: Attention) -> str:
        """Return the interval that is farthest from the mean of the others."""
        total = sum(perceived)
        distances = [abs(value - (total - value) / (len(perceived) - 1)) for value in perceived]
        return self.answers[distances.index(max(distances))]


class Abx(Design):
    """Which of the first two was repeated as the third? (Munson & Gardner 1950, J. Acoust. Soc. Am. 22, 675)."""

    kind: Literal["abx"] = "abx"
    paper_name: ClassVar = "ABX"
    answers: ClassVar = ("like_first", "like_second")
    arrangements: ClassVar = ((False, True, False), (False, True, True), (True, False, True), (True, False, False))
    guess_rate: ClassVar = 0.5

    def correct(self, arrangement: int) -> str:
        first, _, third = self.arrangements[arrangement]
        return self.answers[first != third]

    def _sensitivity(self, answers: _AnswerCounts, model: Model) -> Sensitivity | None:
        return detection.abx(*self.correct_of(answers), model)

    def simulated(self, perceived: Sequence[float], mean: float, attention: Attention) -> str:
        first, second, third = perceived
        return self.answers[abs(third - first) >= abs(third - second)]


class SameDifferent(Design):
    """Were the two the same? (Macmillan & Creelman 2005, Detection Theory, chapter 9)."""

    kind: Literal["samedifferent"] = "samedifferent"
    paper_name: ClassVar = "same–different"
    answers: ClassVar = ("same", "different")
    arrangements: ClassVar = ((False, False), (True, True), (False, True), (True, False))
    adaptive: ClassVar = False

    def correct(self, arrangement: int) -> str:
        first, second = self.arrangements[arrangement]
        return self.answers[first != second]

    def _sensitivity(self, answers: _AnswerCounts, model: Model) -> Sensitivity | None:
        hits, false_alarms = _answer_counts(answers, {2, 3}, "different"), _answer_counts(answers, {0, 1}, "different")
        return detection.same_different(*hits, *false_alarms, model)

    def simulated(self, perceived: Sequence[float], mean: float, attention: Attention) -> str:
        first, second = perceived
        return self.answers[attention.distinct(first - second, (first + second) / 2)]


class YesNo(Design):
    """Was it there? (Green & Swets 1966): the answer "yes" to a comparison is a hit, to a standard a false alarm."""

    kind: Literal["yesno"] = "yesno"
    noise_share: Annotated[
        float, within(0.05, 0.5, "with fewer noise trials, the false-alarm rate is unknown; 0.5 is balanced")
    ] = Field(
        default=0.3,
        description="Proportion of trials in which the standard is presented; they are added to the method's trials.",
    )
    paper_name: ClassVar = "yes–no"
    answers: ClassVar = ("yes", "no")
    arrangements: ClassVar = ((True,), (False,))
    has_noise: ClassVar = True
    success_name: ClassVar = "yes"

    def noise(self, comparisons: int) -> int:
        return round(comparisons * self.noise_share / (1 - self.noise_share))

    def correct(self, arrangement: int) -> str:
        return self.answers[arrangement]

    def success(self, arrangement: int, answer: str) -> bool:
        """Return whether the answer was yes, to any presentation."""
        return answer == "yes"

    def _sensitivity(self, answers: _AnswerCounts, model: Model) -> Sensitivity | None:
        return detection.yes_no(*_answer_counts(answers, {0}, "yes"), *_answer_counts(answers, {1}, "yes"))

    def simulated(self, perceived: Sequence[float], mean: float, attention: Attention) -> str:
        return "yes" if perceived[0] > mean else "no"


class _JudgementDesign(Design):
    """Designs whose reply is a scale point, a number or an adjustment."""

    has_standard: ClassVar = False
    has_correct_answer: ClassVar = False
    adaptive: ClassVar = False


class Rated(_JudgementDesign):
    """How strong was it? Each level is rated on a scale."""

    kind: Literal["rating"] = "rating"
    scale: Id = Field(description="The scale for the answer.")
    paper_name: ClassVar = "ratings"
    reply: ClassVar = "rating"


class Estimation(_JudgementDesign):
    """How strong was it, as a number? (Stevens 1957, Psychological Review 64, 153)."""

    kind: Literal["estimation"] = "estimation"
    modulus: Modulus | None = Field(
        default=None,
        description="The level presented in the first trial and the number assigned to it; default: "
        "participants choose their own scale.",
    )
    paper_name: ClassVar = "magnitude estimation"
    reply: ClassVar = "number"
    first = property(lambda self: self.modulus)


class Adjusted(_JudgementDesign):
    """The standard, then an interval that the participant adjusts to it (Gescheider 1997, Psychophysics, ch. 3)."""

    kind: Literal["adjustment"] = "adjustment"
    standard: bool = Field(
        default=True, description="Whether the adjusted interval is preceded by an interval with the standard."
    )
    paper_name: ClassVar = "the method of adjustment"
    reply: ClassVar = "setting"
    arrangements = property(lambda self: ((False, True),) if self.standard else ((True,),))

    @property
    def wording(self) -> str:
        return self.kind if self.standard else "adjustment_alone"


DESIGN_KINDS: Final[dict[str, type[Design]]] = {
    kind: design
    for design in (Abx, Adjusted, Estimation, ForcedChoice, Oddity, Rated, SameDifferent, YesNo)
    for kind in get_args(design.model_fields["kind"].annotation)
}

if TYPE_CHECKING:
    AnyDesign: TypeAlias = Design
else:
    AnyDesign = Annotated[reduce(or_, dict.fromkeys(DESIGN_KINDS.values())), Field(discriminator="kind")]


def default_design(kind: str) -> Design:
    """Return the design of a kind with all its defaults; raise KeyError for an unknown kind."""
    return DESIGN_KINDS[kind].model_validate({"kind": kind})


def question_of(design: Design, languages: Sequence[str]) -> Questionnaire:
    """Return the question of a design, by default with the program's own text."""
    text: Localised = design.question or {
        language: words_or_english(language).design_questions[design.wording] for language in languages
    }
    return Questionnaire(intro=text, items=(_item(design, text, languages),))


def _item(design: Design, text: Localised, languages: Sequence[str]) -> Question:
    short: Localised = {language: words_or_english(language).design_short for language in languages}
    if design.item is not None:
        short = design.item.replace("_", " ").capitalize()
    common = {"id": design.name, "text": text, "short": short}
    if design.reply == "rating":
        return Rating(**common, scale=str(getattr(design, "scale", "")))
    if design.reply == "number":
        return Number(**common, least=POSITIVE)
    if design.reply == "setting":
        return Number(**common, whole=True, unit="steps")
    answer_texts = {
        answer: {language: words_or_english(language).design_answers[answer] for language in languages}
        for answer in design.answers
    }
    return Choice(**common, options=tuple(Option(id=answer, text=label) for answer, label in answer_texts.items()))
