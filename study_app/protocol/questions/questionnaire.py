"""What is answered after a trial: statements, and the scale of seven points."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from study_app.protocol.table import Table
from study_app.protocol.texts import Id, Localised


class Item(Table):
    """One statement."""

    id: Id = Field(description="Name of the item in every table; never change it once data exist.")
    text: Localised = Field(description="The statement as the participant reads it.")
    short: Localised = Field(description="One to three words for figures and tables.")
    required: bool = Field(default=True, description="Whether the participant can go on without an answer.")


class Questionnaire(Table):
    """The statements that are answered after a trial."""

    title: Localised | None = Field(default=None, description="Heading; left out: the name of the setting.")
    intro: Localised = Field(description="The question above the statements.")
    scale: Id = Field(description="The scale of all items.")
    item_order: Literal["fixed", "shuffled"] = Field(default="fixed", description="As written, or anew in every trial.")
    items: tuple[Item, ...] = Field(min_length=1, description="The statements.")

    def item(self, item_id: str) -> Item:
        """Return the item of that id (KeyError if there is none)."""
        for item in self.items:
            if item.id == item_id:
                return item
        raise KeyError(item_id)
