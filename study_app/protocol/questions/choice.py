"""One of several options, or any number of them."""

from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.protocol.forms.show_if import Value
from study_app.protocol.questions.question import Context, Draw, ItemView, Question, ValueType
from study_app.protocol.table import Table
from study_app.protocol.texts import Id, Localised

FEWEST_OPTIONS, MOST_OPTIONS = 2, 12


@dataclass(frozen=True, slots=True)
class ChoiceView(ItemView):
    """Options as shown: their ids and words; of ``several`` any number can be chosen."""

    widget: ClassVar[str] = "choice"

    options: tuple[tuple[str, str], ...] = field(default=(), kw_only=True)
    several: bool = field(default=False, kw_only=True)

    @property
    def keys(self) -> str:
        """The digits of its options; beyond 9 the arrows reach them."""
        return f"1–{min(len(self.options), 9)}"

    def simulated(self, opinion: float, draw: Draw) -> Value:
        """Return an option by chance; of several, each with probability one half, and the first where none is."""
        if self.several:
            chosen = tuple(option for option, _ in self.options if draw() < 0.5)
            return chosen or (self.options[0][0],)
        return self.options[int(len(self.options) * draw())][0]


class Option(Table):
    """One answer that can be chosen."""

    id: Id = Field(description="Name of the option in every table.")
    text: Localised = Field(description="The option as the participant reads it.")


class Choice(Question):
    """A choice between options."""

    widget: ClassVar[str] = "choice"
    measure: ClassVar[str] = "counts"
    figure: ClassVar[str | None] = "counts"
    value_type: ClassVar[ValueType] = "text"

    kind: Literal["choice"] = "choice"
    options: tuple[Option, ...] = Field(
        min_length=FEWEST_OPTIONS, max_length=MOST_OPTIONS, description="The options, in the order shown."
    )
    several: bool = Field(default=False, description="Whether any number of options can be chosen.")

    @model_validator(mode="after")
    def _options_differ(self) -> Self:
        ids = [option.id for option in self.options]
        for number, name in enumerate(ids):
            if name in ids[:number]:
                raise PydanticCustomError(
                    "options", 'option "{name}" is listed twice', {"name": name, "place": "options"}
                )
        return self

    def view(self, number: int, context: Context) -> ItemView:
        """Return the options."""
        return ChoiceView(
            *self._shown(number, context),
            show_if=self.show_if,
            options=tuple((option.id, context.text(option.text)) for option in self.options),
            several=self.several,
        )

    def problem(self, answer: Value, context: Context) -> str | None:
        """Return why something is not a choice of the options."""
        ids = [option.id for option in self.options]
        if self.several:
            permitted = isinstance(answer, tuple) and 0 < len(set(answer)) == len(answer) and set(answer) <= set(ids)
        else:
            permitted = answer in ids
        return None if permitted else f"answer {answer} is not among the options: choose {' or '.join(ids)}"

    @property
    def names_several(self) -> bool:
        """Whether several options can be chosen."""
        return self.several

    def levels(self, context: Context) -> dict[str, str]:
        """Return the options."""
        return {option.id: context.text(option.text) for option in self.options}


KIND: Final = Choice
