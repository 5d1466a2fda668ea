"""The kinds of questions, the scales they are rated on, and when they are shown."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, Literal, Self, TypeAlias, TypeVar

from pydantic import ConfigDict, Discriminator, Field, Tag, field_validator, model_validator

from study_app.discovery import Registry, Returns, instance_of
from study_app.haptics.model.ranges import later, within
from study_app.protocol.source.table import (
    DIRECTIONS,
    Id,
    Localised,
    OfKinds,
    Printable,
    Table,
    characters,
    invalid,
    text_in,
    unprintable_character,
)
from study_app.protocol.wording.languages import language_name

POINTS = 7
"""Number of points of the scale for statements."""

FEWEST_POINTS, MOST_POINTS = 2, 11


class Scale(Table):
    """The points of an answer, lowest first: seven for statements, 2 to 11 for other ratings."""

    labels: dict[str, Annotated[tuple[Printable, ...], Field(min_length=FEWEST_POINTS, max_length=MOST_POINTS)]] = (
        Field(description=("Labels for the scale points (2 to 11) in each language, lowest first."))
    )
    cannot_judge: Localised | None = Field(
        default=None, description="Label for an answer that is not on the scale, such as “cannot judge”; default: none."
    )

    @field_validator("labels", mode="before")
    @classmethod
    def _check_label_counts(cls, labels: Any) -> Any:
        """Reject labels without a language, and a language with fewer labels than another one."""
        if isinstance(labels, tuple):
            hint = "write labels.en = […], or labels in the study's languages"
            raise invalid("must be a table with an array for each language, not an array", hint=hint)
        items = labels.items() if isinstance(labels, Mapping) else ()
        tuples = {code: texts for code, texts in items if isinstance(texts, tuple)}
        count = max(map(len, tuples.values()), default=0)
        for code, texts in tuples.items():
            if len(texts) < count:
                filled = sum(isinstance(text, str) and bool(text.strip()) for text in texts)
                message = f"lacks {count - filled} of {count} labels in {language_name(code)}"
                raise invalid(message, code, hint="the scale must have the same number of points in every language")
        return labels

    @property
    def points(self) -> int:
        return max(map(len, self.labels.values()), default=0)


Value: TypeAlias = int | float | str | tuple[str, ...] | None
"""An answer: a number, a text, one option or several; None if the participant could not judge."""


class ShowIf(Table):
    """An answer to an earlier item: one of several values, or a number within bounds."""

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True)

    item: Id = Field(description="The earlier item that determines whether this item is shown.")
    values: int | float | str | tuple[int | float | str, ...] | None = Field(
        default=None, alias="is", description="The answer, or a list of answers, for which the item is shown."
    )
    at_least: float | None = Field(default=None, description="Smallest number.")
    at_most: float | None = Field(default=None, description="Largest number.")

    @property
    def permitted(self) -> tuple[int | float | str, ...]:
        """The answers for which the question is shown; empty if it has bounds instead."""
        return self.values if isinstance(self.values, tuple) else () if self.values is None else (self.values,)

    def holds(self, answer: Value) -> bool:
        if self.values is not None:
            answers = answer if isinstance(answer, tuple) else (answer,)
            return any(value in self.permitted for value in answers)
        if not isinstance(answer, int | float):
            return False
        return (self.at_least is None or answer >= self.at_least) and (self.at_most is None or answer <= self.at_most)

    @model_validator(mode="after")
    def _check_rule(self) -> Self:
        has_bounds = self.at_least is not None or self.at_most is not None
        if (self.values is not None) == has_bounds:
            raise invalid('needs the key "is", or one or both of "at_least" and "at_most"', "is")
        return self


def shown_questions(items: Iterable[Question | ItemView], answers: Mapping[str, Value]) -> tuple[str, ...]:
    """Return the IDs of the shown items in order; ``answers`` are the current answers by item.

    Answers to hidden items are ignored.
    """
    shown_ids: dict[str, None] = {}
    for item in items:
        rule = item.show_if
        if rule is None or (rule.item in shown_ids and rule.item in answers and rule.holds(answers[rule.item])):
            shown_ids[item.id] = None
    return tuple(shown_ids)


Draw: TypeAlias = Callable[[], float]
ValueType: TypeAlias = Literal["integer", "number", "text"]

_MAX_CHARACTERS: Final = 5000
"""Greatest number of characters of an answer."""
POSITIVE: Final = 1e-9
"""The minimum of a question that permits only numbers above 0."""

_MAX_NUMBER: Final = 1e12
"""Greatest number that an answer can be."""
_Bound: TypeAlias = Annotated[float, within(-_MAX_NUMBER, _MAX_NUMBER, "answers cannot be larger")]

_OPINION_POINTS = 7
"""A simulated observer's opinions range from 1 to this number."""


@dataclass(frozen=True, slots=True)
class ItemView:
    """One question of a form as shown: ``number`` counts from 1 in the order of presentation.

    ``show_if`` is the condition under which it is shown, None for always.
    """

    widget: ClassVar[str] = ""

    id: str
    number: int
    text: str
    required: bool
    show_if: ShowIf | None = field(default=None, kw_only=True)

    @property
    def keys(self) -> str:
        """The keyboard keys that answer the question, as text."""
        raise NotImplementedError

    def simulated(self, opinion: float, draw: Draw) -> Value:
        """Return the answer of a simulated observer with an opinion from 1 to 7, or slightly beyond."""
        raise NotImplementedError

    def nearby(self, answer: Value) -> Value:
        """Return an answer that a person might give before ``answer``; the same one if there is no other."""
        return answer


@dataclass(frozen=True, slots=True)
class Context:
    """The context of a question: the protocol's scales, the questionnaire's scale, and the participant's language."""

    scales: Mapping[str, Scale]
    scale: str | None
    language: str

    def text(self, value: str | dict[str, str]) -> str:
        return text_in(value, self.language)


_V = TypeVar("_V", bound=ItemView)


class Question(Table):
    """One question."""

    widget: ClassVar[str]
    measure: ClassVar[str]
    figure: ClassVar[str | None] = None
    value_type: ClassVar[ValueType]

    id: Id = Field(
        description="Name of the item in every table. Do not change the name after data collection has begun."
    )
    text: Localised = Field(description="The statement shown to the participant.")
    short: Localised = Field(description="Short label for figures and tables (one to three words).")
    required: bool = Field(default=True, description="Whether an answer is required to continue.")
    show_if: ShowIf | None = later(
        default=None,
        description="The answer to an earlier item that causes this item to be shown; default: always shown.",
    )

    @property
    def kind_id(self) -> str:
        return kind_id(type(self))

    def view(self, number: int, context: Context) -> ItemView:
        raise NotImplementedError

    def problem(self, answer: Value, context: Context) -> str | None:
        """Return a sentence on why a value is not a valid answer; None if it is valid."""
        raise NotImplementedError

    def bounds(self, context: Context) -> tuple[float, float] | None:
        """Return the smallest and the largest answer; None without bounds."""
        return None

    def levels(self, context: Context) -> dict[str, str]:
        """Return all possible answers in order, as table value and label; empty if there are too many."""
        return {}

    @property
    def names_several(self) -> bool:
        """Whether a table cell may contain several of the `levels`, separated by spaces."""
        return False

    def counted(self, response: str) -> tuple[str, ...]:
        """Return the `levels` for which an answer counts; a ranking may count only for the first one."""
        return tuple(response.split()) if self.names_several else (response,)

    def _make_view(self, kind: type[_V], number: int, context: Context, **fields: Any) -> _V:
        """Return the view of a kind with the common fields and its own ones."""
        return kind(self.id, number, context.text(self.text), self.required, show_if=self.show_if, **fields)


def plain_number(value: float) -> int | float:
    """Return a number rounded to nine decimals, as an integer if it is whole."""
    rounded = round(value, 9)
    return int(rounded) if rounded == int(rounded) else rounded


def answer_problem(question: Question, answer: Value, context: Context) -> str | None:
    """Return a sentence on why a value is not a valid answer; None if it is valid."""
    if isinstance(answer, bool):
        return f"answer {answer} is neither a number nor text: specify a number or text"
    texts = answer if isinstance(answer, tuple) else (answer,) if isinstance(answer, str) else ()
    if (letters := sum(map(len, texts))) > _MAX_CHARACTERS:
        return (
            f"an answer to {question.kind_id} {question.id} has {letters:,} characters: "
            f"at most {_MAX_CHARACTERS:,} are permitted"
        )
    return question.problem(answer, context)


def kind_id(kind: type[Question]) -> str:
    """Return the ID of a kind of question; a question without a kind is a statement."""
    field_ = kind.model_fields.get("kind")
    return "statement" if field_ is None else str(field_.default)


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingView(ItemView):
    """A rating as shown: ``labels`` are those of the points, lowest first; ``cannot_judge`` is the other answer."""

    widget: ClassVar[str] = "rating"

    labels: tuple[str, ...] = ()
    cannot_judge: str | None = None

    @property
    def keys(self) -> str:
        return f"1–{min(len(self.labels), 9)}"

    def simulated(self, opinion: float, draw: Draw) -> Value:
        points = len(self.labels)
        position = opinion if points == _OPINION_POINTS else 1 + (opinion - 1) * (points - 1) / (_OPINION_POINTS - 1)
        return min(points, max(1, math.floor(position + 0.5)))

    def nearby(self, answer: Value) -> Value:
        if not isinstance(answer, int):
            return answer
        return answer - 1 if answer == len(self.labels) else answer + 1


class Rated(Question):
    """Base class of statements and ratings, which have a scale."""

    widget: ClassVar[str] = "rating"
    measure: ClassVar[str] = "rating"
    figure: ClassVar[str | None] = "rating"
    value_type: ClassVar[ValueType] = "integer"

    def scale_of(self, context: Context) -> Scale:
        raise NotImplementedError

    def view(self, number: int, context: Context) -> ItemView:
        scale = self.scale_of(context)
        off_scale = None if scale.cannot_judge is None else context.text(scale.cannot_judge)
        labels = scale.labels[context.language]
        return self._make_view(RatingView, number, context, labels=labels, cannot_judge=off_scale)

    def problem(self, answer: Value, context: Context) -> str | None:
        scale = self.scale_of(context)
        if answer is None:
            if scale.cannot_judge is not None:
                return None
            return (
                "this questionnaire does not permit an answer that is not on the scale: choose one of the scale's "
                "points"
            )
        if isinstance(answer, int) and 1 <= answer <= scale.points:
            return None
        return f"answer {answer} is not on the scale: choose 1 to {scale.points}"

    def bounds(self, context: Context) -> tuple[float, float] | None:
        return 1, self.scale_of(context).points

    def levels(self, context: Context) -> dict[str, str]:
        labels = self.scale_of(context).labels[context.language]
        return {str(point): label for point, label in enumerate(labels, start=1)}


class Rating(Rated):
    """A rating on one of the protocol's scales."""

    kind: Literal["rating"] = "rating"
    scale: Id = Field(description="The scale, which has 2 to 11 points.")

    def scale_of(self, context: Context) -> Scale:
        return context.scales[self.scale]


class Statement(Rated):
    """A statement; if a questionnaire has only statements, they form a grid."""

    def scale_of(self, context: Context) -> Scale:
        return context.scales[context.scale or ""]


FEWEST_OPTIONS, MOST_OPTIONS = 2, 12


@dataclass(frozen=True, slots=True, kw_only=True)
class ChoiceView(ItemView):
    """Options as shown: their ids and texts; with ``several`` any number can be chosen."""

    widget: ClassVar[str] = "choice"

    options: tuple[tuple[str, str], ...] = ()
    several: bool = False

    @property
    def keys(self) -> str:
        return f"1–{min(len(self.options), 9)}"

    def simulated(self, opinion: float, draw: Draw) -> Value:
        """Return a random option; with ``several``, each with probability ½, and the first if none is drawn."""
        if self.several:
            chosen = tuple(option for option, _ in self.options if draw() < 0.5)
            return chosen or (self.options[0][0],)
        return self.options[int(len(self.options) * draw())][0]


class Option(Table):
    """One of the answers to choose from."""

    id: Id = Field(description="Name of the option in every table.")
    text: Localised = Field(description="The option shown to the participant.")


class Choice(Question):
    """A choice between options."""

    widget: ClassVar[str] = "choice"
    measure: ClassVar[str] = "counts"
    figure: ClassVar[str | None] = "counts"
    value_type: ClassVar[ValueType] = "text"

    kind: Literal["choice"] = "choice"
    options: tuple[Option, ...] = Field(
        min_length=FEWEST_OPTIONS,
        max_length=MOST_OPTIONS,
        description=("The options, in the order in which they are shown."),
    )
    several: bool = Field(default=False, description="Whether participants can choose several options.")

    @model_validator(mode="after")
    def _check_options(self) -> Self:
        ids = [option.id for option in self.options]
        for number, name in enumerate(ids):
            if name in ids[:number]:
                raise invalid(f'option "{name}" is listed twice', "options")
        return self

    def view(self, number: int, context: Context) -> ItemView:
        options = tuple(self.levels(context).items())
        return self._make_view(ChoiceView, number, context, options=options, several=self.several)

    def problem(self, answer: Value, context: Context) -> str | None:
        ids = [option.id for option in self.options]
        if self.several:
            permitted = isinstance(answer, tuple) and 0 < len(set(answer)) == len(answer) and set(answer) <= set(ids)
        else:
            permitted = answer in ids
        return None if permitted else f"answer {answer} is not among the options: choose {' or '.join(ids)}"

    @property
    def names_several(self) -> bool:
        return self.several

    def levels(self, context: Context) -> dict[str, str]:
        return {option.id: context.text(option.text) for option in self.options}


@dataclass(frozen=True, slots=True, kw_only=True)
class NumberView(ItemView):
    """A number field as shown; ``least`` and ``most`` are None without a bound."""

    widget: ClassVar[str] = "number"
    keys: ClassVar[str] = "0–9"

    least: float | None = None
    most: float | None = None
    whole: bool = False
    unit: str = ""

    def permits(self, number: float) -> bool:
        return (
            (self.least is None or number >= self.least)
            and (self.most is None or number <= self.most)
            and abs(number) <= _MAX_NUMBER
            and (not self.whole or number == math.floor(number))
        )

    def simulated(self, opinion: float, draw: Draw) -> Value:
        """Return a number within its bounds, or within 0 to 100 without bounds."""
        minimum = self.least if self.least is not None else min(0.0, self.most if self.most is not None else 0.0)
        maximum = self.most if self.most is not None else minimum + 100.0
        fraction = min(1.0, max(0.0, (opinion - 1) / (_OPINION_POINTS - 1)))
        number = minimum + fraction * (maximum - minimum)
        if self.whole:
            return min(math.floor(maximum), max(math.ceil(minimum), round(number)))
        return plain_number(min(maximum, max(minimum, round(number, 3))))


class Number(Question):
    """A number."""

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True)

    widget: ClassVar[str] = "number"
    measure: ClassVar[str] = "distribution"
    figure: ClassVar[str | None] = "distribution"
    value_type: ClassVar[ValueType] = "number"

    kind: Literal["number"] = "number"
    least: _Bound | None = Field(
        default=None, alias="from", description="Smallest number permitted; default: no minimum."
    )
    most: _Bound | None = Field(default=None, alias="to", description="Largest number permitted; default: no maximum.")
    whole: bool = Field(default=False, description="Whether only whole numbers are permitted.")
    unit: Localised | None = Field(default=None, description="Unit shown after the field.")

    @model_validator(mode="after")
    def _check_range(self) -> Self:
        if self.least is not None and self.most is not None:
            minimum = math.ceil(self.least) if self.whole else self.least
            if self.most < minimum:
                raise invalid(f"{self.most:g} is less than from = {self.least:g}", "to")
        return self

    def view(self, number: int, context: Context) -> NumberView:
        unit = "" if self.unit is None else context.text(self.unit)
        limits = {"least": self.least, "most": self.most, "whole": self.whole}
        return self._make_view(NumberView, number, context, unit=unit, **limits)

    def problem(self, answer: Value, context: Context) -> str | None:
        if isinstance(answer, int | float) and self.view(0, context).permits(answer):
            return None
        minimum = "" if self.least is None else " above 0" if self.least == POSITIVE else f" from {self.least:g}"
        maximum = "" if self.most is None else f" to {self.most:g}"
        return f"answer {answer} is not permitted: specify a {'whole ' if self.whole else ''}number{minimum}{maximum}"

    def bounds(self, context: Context) -> tuple[float, float] | None:
        return None if self.least is None or self.most is None else (self.least, self.most)


_MAX_STEPS = 10_000


@dataclass(frozen=True, slots=True, kw_only=True)
class SliderView(ItemView):
    """A slider as shown, from ``least`` at the end called ``low`` to ``most`` at the end called ``high``."""

    widget: ClassVar[str] = "slider"
    keys: ClassVar[str] = "← →"

    low: str = ""
    high: str = ""
    least: float = 0.0
    most: float = 100.0
    step: float = 1.0

    @property
    def steps(self) -> int:
        """The number of steps from end to end."""
        return round((self.most - self.least) / self.step)

    def at(self, step: int) -> int | float:
        """Return the number at a step, counted from 0."""
        return plain_number(self.least + step * self.step)

    def simulated(self, opinion: float, draw: Draw) -> Value:
        fraction = min(1.0, max(0.0, (opinion - 1) / (_OPINION_POINTS - 1)))
        return self.at(round(fraction * self.steps))


class Slider(Question):
    """A number on a line between two labels."""

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True)

    widget: ClassVar[str] = "slider"
    measure: ClassVar[str] = "distribution"
    figure: ClassVar[str | None] = "distribution"
    value_type: ClassVar[ValueType] = "number"

    kind: Literal["slider"] = "slider"
    low: Localised = Field(description="Label for the lower end.")
    high: Localised = Field(description="Label for the upper end.")
    least: _Bound = Field(default=0, alias="from", description="The number at the lower end.")
    most: _Bound = Field(default=100, alias="to", description="The number at the upper end.")
    step: float = Field(default=1, gt=0, description="Difference between neighbouring numbers.")

    @model_validator(mode="after")
    def _check_steps(self) -> Self:
        if self.most <= self.least:
            raise invalid(f"{self.most:g} must be greater than from = {self.least:g}", "to")
        steps = (self.most - self.least) / self.step
        if abs(steps - round(steps)) > 1e-6 or not 1 <= round(steps) <= _MAX_STEPS:
            permitted = f"a whole number from 1 to {_MAX_STEPS}"
            raise invalid(
                f"is {self.step:g}, which gives {steps:g} steps from end to end; this number must be {permitted}",
                "step",
            )
        return self

    def view(self, number: int, context: Context) -> ItemView:
        ends = {"low": context.text(self.low), "high": context.text(self.high)}
        numbers = {"least": self.least, "most": self.most, "step": self.step}
        return self._make_view(SliderView, number, context, **ends, **numbers)

    def problem(self, answer: Value, context: Context) -> str | None:
        if isinstance(answer, int | float) and self.least <= answer <= self.most:
            steps = (answer - self.least) / self.step
            if abs(steps - round(steps)) <= 1e-6:
                return None
        return f"answer {answer} is not on the slider: choose {self.least:g} to {self.most:g} in steps of {self.step:g}"

    def bounds(self, context: Context) -> tuple[float, float] | None:
        return self.least, self.most


_SIMULATED: Final = "Simulated answer."


@dataclass(frozen=True, slots=True, kw_only=True)
class TextView(ItemView):
    """A text field as shown: ``lines`` high, for at most ``longest`` characters."""

    widget: ClassVar[str] = "text"
    keys: ClassVar[str] = "A–Z"

    lines: int = 1
    longest: int = 500

    def simulated(self, opinion: float, draw: Draw) -> Value:
        return _SIMULATED[: self.longest]


class Text(Question):
    """A free-text answer."""

    widget: ClassVar[str] = "text"
    measure: ClassVar[str] = "texts"
    value_type: ClassVar[ValueType] = "text"

    kind: Literal["text"] = "text"
    lines: int = Field(default=1, ge=1, le=10, description="Height of the field, in lines.")
    longest: int = Field(default=500, ge=1, le=_MAX_CHARACTERS, description="Maximum number of characters.")

    def view(self, number: int, context: Context) -> ItemView:
        return self._make_view(TextView, number, context, lines=self.lines, longest=self.longest)

    def problem(self, answer: Value, context: Context) -> str | None:
        if not isinstance(answer, str) or not answer.strip():
            return "the text is empty: write an answer, or skip the question"
        if (length := len(characters(answer))) > self.longest:
            return f"the text has {length} characters: write at most {self.longest}"
        if unprintable_character(answer, f"\n{DIRECTIONS}") is not None:
            return "the text contains a character that cannot be printed: remove it"
        return None


class RecordedQuestion(Question):
    """A question of a plug-in that is not here, as a receipt holds it: its answers are listed."""

    model_config = ConfigDict(extra="allow")
    widget: ClassVar[str] = "text"
    measure: ClassVar[str] = "texts"
    value_type: ClassVar[ValueType] = "text"

    kind: str

    @property
    def kind_id(self) -> str:
        return self.kind

    def view(self, number: int, context: Context) -> ItemView:
        return self._make_view(TextView, number, context)

    def problem(self, answer: Value, context: Context) -> str | None:
        return None


STATEMENT: Final = "statement"

KINDS: Final = Registry[type[Question]](
    "question",
    {kind_id(kind): kind for kind in (Choice, Number, Rating, Slider, Statement, Text)},
    Question,
    "kind",
    {
        "view": instance_of(ItemView),
        "problem": Returns("a sentence or None", lambda value: value is None or isinstance(value, str)),
    },
)
"""The kinds of questions by ID."""


def _kind_of(value: Any) -> str:
    return str(value.get("kind", STATEMENT)) if isinstance(value, Mapping) else STATEMENT


if TYPE_CHECKING:
    AnyQuestion: TypeAlias = Question
else:
    AnyQuestion = Annotated[
        Annotated[
            reduce(or_, [Annotated[kind, Tag(name)] for name, kind in KINDS.own.items()]),
            Discriminator(
                _kind_of,
                custom_error_type="question_kind",
                custom_error_message="is not a question kind",
                custom_error_context={"place": "kind", "permitted": ", ".join(KINDS.own)},
            ),
        ],
        OfKinds(KINDS, Question, RecordedQuestion),
    ]


def question_of(table: Mapping[str, Any]) -> Question:
    """Return a receipt's question; one of a plug-in that is not installed is a `RecordedQuestion`.

    Raises KeyError if its kind is unknown, and ValueError if it is invalid.
    """
    kind = _kind_of(table)
    return (RecordedQuestion if ":" in kind and kind not in KINDS else KINDS[kind]).model_validate(table)
