"""A rating on a scale of 2 to 11 points."""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal

from pydantic import Field

from study_app.protocol.forms.scale import Scale
from study_app.protocol.forms.show_if import Value
from study_app.protocol.questions.question import OPINION_POINTS, Context, Draw, ItemView, Question, ValueType
from study_app.protocol.texts import Id


@dataclass(frozen=True, slots=True)
class RatingView(ItemView):
    """A rating as shown: ``labels`` name the points, lowest first; ``cannot_judge`` the answer off the scale."""

    widget: ClassVar[str] = "rating"

    labels: tuple[str, ...] = field(default=(), kw_only=True)
    cannot_judge: str | None = field(default=None, kw_only=True)

    @property
    def keys(self) -> str:
        """The digits of its points; beyond 9 the arrows reach them."""
        return f"1–{min(len(self.labels), 9)}"

    def simulated(self, opinion: float, draw: Draw) -> Value:
        """Return the nearest point."""
        points = len(self.labels)
        place = opinion if points == OPINION_POINTS else 1 + (opinion - 1) * (points - 1) / (OPINION_POINTS - 1)
        return min(points, max(1, math.floor(place + 0.5)))

    def nearby(self, answer: Value) -> Value:
        """Return a neighbouring point."""
        if not isinstance(answer, int):
            return answer
        return answer - 1 if answer == len(self.labels) else answer + 1


class Rated(Question):
    """What a statement and a rating have in common: a scale."""

    widget: ClassVar[str] = "rating"
    measure: ClassVar[str] = "rating"
    figure: ClassVar[str | None] = "rating"
    value_type: ClassVar[ValueType] = "integer"

    def scale_of(self, context: Context) -> Scale:
        """Return the scale that it is rated on."""
        raise NotImplementedError

    def view(self, number: int, context: Context) -> ItemView:
        """Return the points with their names."""
        scale = self.scale_of(context)
        return RatingView(
            *self._shown(number, context),
            show_if=self.show_if,
            labels=scale.labels[context.language],
            cannot_judge=None if scale.cannot_judge is None else context.text(scale.cannot_judge),
        )

    def problem(self, answer: Value, context: Context) -> str | None:
        """Return why something is not a point of the scale."""
        scale = self.scale_of(context)
        if answer is None:
            if scale.cannot_judge is not None:
                return None
            return "this questionnaire has no answer off the scale: choose one of its points"
        if isinstance(answer, int) and 1 <= answer <= scale.points:
            return None
        return f"answer {answer} is not on the scale: choose 1 to {scale.points}"

    def bounds(self, context: Context) -> tuple[float, float] | None:
        """Return the first and the last point."""
        return 1, self.scale_of(context).points

    def levels(self, context: Context) -> dict[str, str]:
        """Return the points with their names."""
        labels = self.scale_of(context).labels[context.language]
        return {str(point): label for point, label in enumerate(labels, start=1)}


class Rating(Rated):
    """A rating on one of the protocol's scales."""

    kind: Literal["rating"] = "rating"
    scale: Id = Field(description="The scale, of 2 to 11 points.")

    def scale_of(self, context: Context) -> Scale:
        """Return its own scale."""
        return context.scales[self.scale]


KIND: Final = Rating
