"""Scores: numbers computed from the answers to a standard questionnaire."""

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.haptics.model.ranges import within
from study_app.protocol.table import Table
from study_app.protocol.texts import Id

Weight = Annotated[float, within(-1e6, 1e6, "no instrument has larger weights")]


class Score(Table):
    """One score: ``offset`` + ``factor`` × the sum or mean of the items' answers, some of them reversed or weighted.

    A reversed answer a of an item from l to h counts as l + h − a, times −1 where the item has no bounds. With
    ``weights_from`` an item's weight is how often its id was chosen in these items (Hart & Staveland 1988, paired
    comparisons), and a ``mean`` is divided by the sum of the weights.
    """

    items: Annotated[tuple[Id, ...], Field(min_length=1)] = Field(description="The items that are combined.")
    reverse: tuple[Id, ...] = Field(default=(), description="Of these, the items whose answers are reversed.")
    combine: Literal["mean", "sum"] = Field(default="mean", description="mean: their mean; sum: their sum.")
    factor: Weight = Field(default=1, description="Factor by which the result is multiplied.")
    offset: Weight = Field(default=0, description="Number that is then added.")
    weights: dict[Id, Weight] = Field(default_factory=dict, description="Weight of an item; left out: 1.")
    weights_from: tuple[Id, ...] = Field(
        default=(), description="Choices between items: each item's weight is how often it was chosen."
    )

    @model_validator(mode="after")
    def _names_its_items(self) -> Self:
        for key in ("reverse", "weights"):
            for name in getattr(self, key):
                if name not in self.items:
                    raise PydanticCustomError(
                        "score", '"{name}" is not among the items of the score', {"name": name, "place": key}
                    )
        return self


def score(
    asked: Score, answers: Mapping[str, float | str], bounds: Mapping[str, tuple[float, float] | None]
) -> float | None:
    """Return a score; None where an answer that it needs is missing.

    Parameters
    ----------
    asked : Score
        How the score is computed.
    answers : mapping of str to float or str
        Item id → the number it was answered with, or the option that was chosen.
    bounds : mapping of str to (float, float) or None
        Item id → its smallest and largest answer, for reversed items.
    """
    if any(name not in answers for name in (*asked.items, *asked.weights_from)):
        return None
    chosen = [answers[name] for name in asked.weights_from]
    total = weight_sum = 0.0
    for name in asked.items:
        value = float(answers[name])
        if name in asked.reverse:
            ends = bounds.get(name)
            value = -value if ends is None else ends[0] + ends[1] - value
        weight = float(chosen.count(name)) if asked.weights_from else asked.weights.get(name, 1.0)
        total += weight * value
        weight_sum += weight
    if asked.combine == "mean":
        if weight_sum == 0:
            return None
        total /= weight_sum
    return asked.factor * total + asked.offset
