"""Rating scales."""

from typing import Annotated

from pydantic import Field

from study_app.protocol.table import Table
from study_app.protocol.texts import Localised, Printable

POINTS = 7
"""Of the scale of statements."""

FEWEST_POINTS, MOST_POINTS = 2, 11


class Scale(Table):
    """The points of an answer, lowest first: seven for statements, 2 to 11 for other ratings."""

    labels: dict[str, Annotated[tuple[Printable, ...], Field(min_length=FEWEST_POINTS, max_length=MOST_POINTS)]] = (
        Field(description="Per language the names of the points, lowest first: 7 in format 1, 2 to 11 in format 2.")
    )
    cannot_judge: Localised | None = Field(
        default=None, description="Label of an answer off the scale; left out: none."
    )

    @property
    def points(self) -> int:
        """How many points the scale has."""
        return max(map(len, self.labels.values()), default=0)
