"""A question: a place in a grid of two feelings (Russell, Weiss & Mendelsohn 1989, J. Pers. Soc. Psychol. 57, 493).

It loads neither Qt nor pandas: the field of its page and its statistic are named, and loaded where they are used.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import Field

from study_app.protocol.questions import Context, Draw, ItemView, Question, Value, ValueType
from study_app.protocol.source.table import Localised


@dataclass(frozen=True, slots=True, kw_only=True)
class GridView(ItemView):
    """The question as shown: words at the left, right, lower and upper edge."""

    widget: ClassVar[str] = "liquid_study_template.question_field:GridField"
    keys: ClassVar[str] = "← → ↑ ↓"

    edges: tuple[str, str, str, str]
    cells: int

    def simulated(self, opinion: float, draw: Draw) -> Value:
        column = round(1 + (min(max(opinion, 1.0), 7.0) - 1) / 6 * (self.cells - 1))
        return f"{column} {1 + int(self.cells * draw())}"


class Grid(Question):
    """A place in a grid of two feelings."""

    measure: ClassVar[str] = "liquid_study_template.question_measure:PLACES"
    value_type: ClassVar[ValueType] = "text"

    kind: Literal["liquid-study-template:grid"] = "liquid-study-template:grid"
    left: Localised = Field(description="Words at the left edge.")
    right: Localised = Field(description="Words at the right edge.")
    lower: Localised = Field(description="Words at the lower edge.")
    upper: Localised = Field(description="Words at the upper edge.")
    cells: int = Field(default=9, ge=3, le=15, description="Number of cells in each direction.")

    def view(self, number: int, context: Context) -> ItemView:
        edges = tuple(map(context.text, (self.left, self.right, self.lower, self.upper)))
        return self._make_view(GridView, number, context, edges=edges, cells=self.cells)

    def problem(self, answer: Value, context: Context) -> str | None:
        cells = {f"{x} {y}" for x in range(1, self.cells + 1) for y in range(1, self.cells + 1)}
        return None if answer in cells else f"answer {answer} is no cell: give two numbers from 1 to {self.cells}"
