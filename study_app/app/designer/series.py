"""Asking for a series: which number differs, its values, and what they make while they are typed."""

from __future__ import annotations

from PySide6.QtCore import QObject

from study_app.app.designer.editing import Editing
from study_app.authoring.changes.series import series_start
from study_app.gui.designer.prompts import SeriesCard
from study_app.gui.designer.view import DesignerPlace
from study_app.protocol.source.document import Path
from study_app.viewmodels.designer.prompts import series_plan, series_prompt


class SeriesPrompts(QObject):
    """Shows the card that asks for the values of a series."""

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.editing, self.place = editing, place
        place.series_asked.connect(self.ask)

    def ask(self, path: Path) -> None:
        """Ask for the values of a series of an element, or say why there can be none; of a section of its last one."""
        if (opened := self.editing.opened) is None:
            return
        path = series_start(opened.study.document, path) or path
        self.editing.select(path)
        prompt = series_prompt(opened.study, path)
        if prompt is None or opened.read_only:
            why = opened.read_only or "This element has no numeric field."
            self.place.message.emit("There can be no series of this element", why)
            return
        card = SeriesCard(prompt)
        card.typed.connect(lambda field, values: self._plan(card, field, values))
        card.answered.connect(self.editing.ask)
        self.place.show_prompt(card, card.first)

    def _plan(self, card: SeriesCard, field: Path, values: str) -> None:
        if (opened := self.editing.writable) is not None:
            card.show_plan(series_plan(opened.study, card.asked.path, field, values))
