"""A slider between two words; it has no handle before it is first touched."""

from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal, Self

from pydantic import ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.protocol.forms.show_if import Value
from study_app.protocol.questions.question import (
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

MOST_STEPS = 10_000


@dataclass(frozen=True, slots=True)
class SliderView(ItemView):
    """A slider as shown, from ``least`` at the end called ``low`` to ``most`` at the end called ``high``."""

    widget: ClassVar[str] = "slider"

    low: str = field(default="", kw_only=True)
    high: str = field(default="", kw_only=True)
    least: float = field(default=0.0, kw_only=True)
    most: float = field(default=100.0, kw_only=True)
    step: float = field(default=1.0, kw_only=True)

    @property
    def keys(self) -> str:
        """The arrows."""
        return "← →"

    @property
    def steps(self) -> int:
        """How many steps lead from end to end."""
        return round((self.most - self.least) / self.step)

    def at(self, step: int) -> int | float:
        """Return the number at a step, counted from 0."""
        return plain_number(self.least + step * self.step)

    def simulated(self, opinion: float, draw: Draw) -> Value:
        """Return the nearest step."""
        share = min(1.0, max(0.0, (opinion - 1) / (OPINION_POINTS - 1)))
        return self.at(round(share * self.steps))


class Slider(Question):
    """A number on a line between two words."""

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True)

    widget: ClassVar[str] = "slider"
    measure: ClassVar[str] = "distribution"
    figure: ClassVar[str | None] = "distribution"
    value_type: ClassVar[ValueType] = "number"

    kind: Literal["slider"] = "slider"
    low: Localised = Field(description="Words at the lower end.")
    high: Localised = Field(description="Words at the upper end.")
    least: Bound = Field(default=0, alias="from", description="The number at the lower end.")
    most: Bound = Field(default=100, alias="to", description="The number at the upper end.")
    step: float = Field(default=1, gt=0, description="Difference between neighbouring numbers.")

    @model_validator(mode="after")
    def _whole_steps(self) -> Self:
        if self.most <= self.least:
            raise PydanticCustomError(
                "range",
                "{most} is not more than from = {least}",
                {"most": f"{self.most:g}", "least": f"{self.least:g}", "place": "to"},
            )
        steps = (self.most - self.least) / self.step
        if abs(steps - round(steps)) > 1e-6 or not 1 <= round(steps) <= MOST_STEPS:
            raise PydanticCustomError(
                "steps",
                "is {step}: {steps} steps from end to end; it must be a whole number of 1 to {most}",
                {"step": f"{self.step:g}", "steps": f"{steps:g}", "most": MOST_STEPS, "place": "step"},
            )
        return self

    def view(self, number: int, context: Context) -> ItemView:
        """Return the line with its ends."""
        return SliderView(
            *self._shown(number, context),
            show_if=self.show_if,
            low=context.text(self.low),
            high=context.text(self.high),
            least=self.least,
            most=self.most,
            step=self.step,
        )

    def problem(self, answer: Value, context: Context) -> str | None:
        """Return why something is not a step of the slider."""
        if isinstance(answer, int | float) and self.least <= answer <= self.most:
            steps = (answer - self.least) / self.step
            if abs(steps - round(steps)) <= 1e-6:
                return None
        return f"answer {answer} is not on the slider: choose {self.least:g} to {self.most:g} in steps of {self.step:g}"

    def bounds(self, context: Context) -> tuple[float, float] | None:
        """Return the numbers of both ends."""
        return self.least, self.most


KIND: Final = Slider
