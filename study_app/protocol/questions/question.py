"""A question: what every kind has in common, and what others ask of a kind.

A kind is a subclass of `Question` with a field ``kind``, in a module of this folder, and the value that its page shows,
a subclass of `ItemView`. It names its widget, measure and figure by their ids, which are looked up where these are.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Final, Literal, TypeAlias

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.forms.scale import Scale
from study_app.protocol.forms.show_if import ShowIf, Value
from study_app.protocol.table import ExtendedTable
from study_app.protocol.texts import Id, Localised, text_in

Draw: TypeAlias = Callable[[], float]
ValueType: TypeAlias = Literal["integer", "number", "text"]

MOST: Final = 1e12
"""No greater number can be given as an answer."""
Bound: TypeAlias = Annotated[float, within(-MOST, MOST, "no greater number can be given as an answer")]

OPINION_POINTS = 7
"""Opinions of the simulated observer go from 1 to so many points."""


@dataclass(frozen=True, slots=True)
class ItemView:
    """One question of a form as shown: ``number`` counts from 1 in the order of presentation.

    ``show_if`` says when it is shown, None always.
    """

    widget: ClassVar[str] = ""

    id: str
    number: int
    text: str
    required: bool
    show_if: ShowIf | None = field(default=None, kw_only=True)

    @property
    def keys(self) -> str:
        """The keys that answer the question, as labelled on the keyboard."""
        raise NotImplementedError

    def simulated(self, opinion: float, draw: Draw) -> Value:
        """Return the answer of a simulated observer whose opinion is from 1 to 7, or a little beyond."""
        raise NotImplementedError

    def nearby(self, answer: Value) -> Value:
        """Return an answer that is chosen first by who then changes their mind; the same where there is none."""
        return answer


@dataclass(frozen=True, slots=True)
class Context:
    """What a question is asked with: the protocol's scales, its questionnaire's own, and the participant's language."""

    scales: Mapping[str, Scale]
    scale: str | None
    language: str

    def text(self, value: str | dict[str, str]) -> str:
        """Return a localised text in the language."""
        return text_in(value, self.language)


class Question(ExtendedTable):
    """One question."""

    LATER: ClassVar[frozenset[str]] = frozenset({"show_if"})

    widget: ClassVar[str]
    measure: ClassVar[str]
    figure: ClassVar[str | None] = None
    value_type: ClassVar[ValueType]

    id: Id = Field(description="Name of the item in every table; never change it once data exist.")
    text: Localised = Field(description="The statement as the participant reads it.")
    short: Localised = Field(description="One to three words for figures and tables.")
    required: bool = Field(default=True, description="Whether an answer is needed to continue.")
    show_if: ShowIf | None = Field(
        default=None, description="The answer to an earlier item that shows this one; left out: always shown."
    )

    @property
    def kind_id(self) -> str:
        """The id of its kind."""
        return kind_id(type(self))

    def view(self, number: int, context: Context) -> ItemView:
        """Return what its page shows."""
        raise NotImplementedError

    def problem(self, answer: Value, context: Context) -> str | None:
        """Return why a value is not an answer to it, as a sentence; None where it is one."""
        raise NotImplementedError

    def bounds(self, context: Context) -> tuple[float, float] | None:
        """Return the smallest and the largest number that it can be answered with; None where it has none."""
        return None

    def levels(self, context: Context) -> dict[str, str]:
        """Return all answers in their order, where these are few: as a table holds them, with their words."""
        return {}

    @property
    def names_several(self) -> bool:
        """Whether an answer names several of `levels`, with spaces between them in a table."""
        return False

    def counted(self, response: str) -> tuple[str, ...]:
        """Return which of `levels` an answer counts for, as a table holds it: of a ranking, say, the first alone."""
        return tuple(response.split()) if self.names_several else (response,)

    def _shown(self, number: int, context: Context) -> tuple[str, int, str, bool]:
        """Return the fields that the views of all kinds have."""
        return self.id, number, context.text(self.text), self.required


def plain_number(value: float) -> int | float:
    """Return a number without the digits that binary fractions add, whole ones as integers."""
    rounded = round(value, 9)
    return int(rounded) if rounded == int(rounded) else rounded


def kind_id(kind: type[Question]) -> str:
    """Return the id of a kind; a question without a field ``kind`` is a statement."""
    field_ = kind.model_fields.get("kind")
    return "statement" if field_ is None else str(field_.default)
