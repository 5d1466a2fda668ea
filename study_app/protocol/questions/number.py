"""A number that is typed."""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal, Self

from pydantic import ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.protocol.forms.show_if import Value
from study_app.protocol.questions.question import (
    MOST,
    OPINION_POINTS,
    Bound,
    Context,
    Draw,
    ItemView,
    Question,
    ValueType,
    plain_number,
)
from study_app.protocol.texts import Localised


@dataclass(frozen=True, slots=True)
class NumberView(ItemView):
    """A field for a number as shown; ``least`` and ``most`` are None where nothing bounds it."""

    widget: ClassVar[str] = "number"

    least: float | None = field(default=None, kw_only=True)
    most: float | None = field(default=None, kw_only=True)
    whole: bool = field(default=False, kw_only=True)
    unit: str = field(default="", kw_only=True)

    @property
    def keys(self) -> str:
        """The digits."""
        return "0–9"

    def permits(self, number: float) -> bool:
        """Return whether a number answers it."""
        return (
            (self.least is None or number >= self.least)
            and (self.most is None or number <= self.most)
            and abs(number) <= MOST
            and (not self.whole or number == math.floor(number))
        )

    def simulated(self, opinion: float, draw: Draw) -> Value:
        """Return a number within its bounds, or within 0 to 100 where it has none."""
        least = self.least if self.least is not None else min(0.0, self.most if self.most is not None else 0.0)
        most = self.most if self.most is not None else least + 100.0
        share = min(1.0, max(0.0, (opinion - 1) / (OPINION_POINTS - 1)))
        number = least + share * (most - least)
        if self.whole:
            return min(math.floor(most), max(math.ceil(least), round(number)))
        return plain_number(min(most, max(least, round(number, 3))))


class Number(Question):
    """A number."""

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True)

    widget: ClassVar[str] = "number"
    measure: ClassVar[str] = "distribution"
    figure: ClassVar[str | None] = "distribution"
    value_type: ClassVar[ValueType] = "number"

    kind: Literal["number"] = "number"
    least: Bound | None = Field(default=None, alias="from", description="Smallest number; left out: any.")
    most: Bound | None = Field(default=None, alias="to", description="Largest number; left out: any.")
    whole: bool = Field(default=False, description="Whether only whole numbers are permitted.")
    unit: Localised | None = Field(default=None, description="Unit, shown after the field.")

    @model_validator(mode="after")
    def _range_has_numbers(self) -> Self:
        if self.least is not None and self.most is not None:
            least = math.ceil(self.least) if self.whole else self.least
            if self.most < least:
                raise PydanticCustomError(
                    "range",
                    "{most} is less than from = {least}",
                    {"most": f"{self.most:g}", "least": f"{self.least:g}", "place": "to"},
                )
        return self

    def view(self, number: int, context: Context) -> ItemView:
        """Return the field."""
        return NumberView(
            *self._shown(number, context),
            show_if=self.show_if,
            least=self.least,
            most=self.most,
            whole=self.whole,
            unit="" if self.unit is None else context.text(self.unit),
        )

    def problem(self, answer: Value, context: Context) -> str | None:
        """Return why something is not a permitted number."""
        view = self.view(0, context)
        if isinstance(view, NumberView) and isinstance(answer, int | float) and view.permits(answer):
            return None
        least = "" if self.least is None else f" from {self.least:g}"
        most = "" if self.most is None else f" to {self.most:g}"
        return f"answer {answer} is not permitted: give a {'whole ' if self.whole else ''}number{least}{most}"

    def bounds(self, context: Context) -> tuple[float, float] | None:
        """Return smallest and largest number, where both are given."""
        return None if self.least is None or self.most is None else (self.least, self.most)


KIND: Final = Number
