"""Rating scales."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from study_app.protocol.table import Table
from study_app.protocol.texts import Localised, Printable

POINTS = 7


class Scale(Table):
    """The seven points of an answer, lowest first."""

    labels: dict[str, Annotated[tuple[Printable, ...], Field(min_length=POINTS, max_length=POINTS)]] = Field(
        description="Per language the names of the seven points, lowest first."
    )
    cannot_judge: Localised | None = Field(
        default=None, description="Label of an answer off the scale; left out: none."
    )
