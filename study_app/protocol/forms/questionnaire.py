"""Questionnaires: what is answered after a trial, or as a form on its own."""

from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field

from study_app.protocol.forms.kinds import AnyQuestion
from study_app.protocol.forms.scale import Scale
from study_app.protocol.instruments.scores import Score
from study_app.protocol.questions.question import Context, Question
from study_app.protocol.questions.statement import Statement
from study_app.protocol.table import ExtendedTable
from study_app.protocol.texts import Id, Localised


class Questionnaire(ExtendedTable):
    """Questions that are answered after a trial, or on their own where ``sequence`` names the questionnaire."""

    LATER: ClassVar[frozenset[str]] = frozenset({"instrument", "scores"})

    title: Localised | None = Field(default=None, description="Heading; left out: the name of the setting.")
    intro: Localised = Field(description="The question above the statements.")
    scale: Id | None = Field(default=None, description="The scale of all statements; left out where there are none.")
    item_order: Literal["fixed", "shuffled"] = Field(
        default="fixed", description="fixed: as written; shuffled: anew in every trial."
    )
    items: tuple[AnyQuestion, ...] = Field(
        min_length=1, description="The questions; one without kind is a statement on the questionnaire's scale."
    )
    instrument: str | None = Field(
        default=None, description="The standard questionnaire whose items and scoring are used."
    )
    scores: dict[Id, Score] = Field(default_factory=dict, description="Numbers computed from the answers.")

    @property
    def statements(self) -> tuple[Question, ...]:
        """The items that are rated on the questionnaire's scale."""
        return tuple(item for item in self.items if isinstance(item, Statement))

    def item(self, item_id: str) -> Question:
        """Return the item of that id (KeyError if there is none)."""
        for item in self.items:
            if item.id == item_id:
                return item
        raise KeyError(item_id)

    def context(self, scales: Mapping[str, Scale], language: str) -> Context:
        """Return what its items are asked with."""
        return Context(scales, self.scale, language)
