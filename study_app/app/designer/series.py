"""Asking for a series: of which element, which number differs, its values, and what they make while they are typed."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from PySide6.QtCore import QObject, Qt, QTimer

from study_app.app.designer.editing import Editing
from study_app.app.designer.element_steps import series
from study_app.authoring.changes.series import series_starts
from study_app.authoring.writer.refused import Refused
from study_app.gui.designer.prompts import SeriesCard
from study_app.gui.designer.view import DesignerPlace
from study_app.viewmodels.designer.prompts import refused_plan, series_plan, series_prompt
from study_app.viewmodels.designer.requests import AskSeries, MakeSeries

REST_MS: Final = 300


class SeriesPrompts(QObject):
    """Shows the card that asks for the values of a series."""

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.editing, self.place = editing, place
        self._asked: tuple[SeriesCard, MakeSeries]
        self._resting = QTimer(self)
        self._resting.setInterval(REST_MS)
        self._resting.setSingleShot(True)
        self._resting.timeout.connect(self._check)
        place.series_asked.connect(self.ask)

    def ask(self, asked: AskSeries) -> None:
        """Ask for the values of a series, of a section also for its element, or say why there can be none."""
        if (opened := self.editing.opened) is None:
            return
        among = asked.among or series_starts(opened.study.document, asked.path)
        prompt = series_prompt(opened.study, replace(asked, among=among))
        if prompt is None or opened.read_only:
            why = opened.read_only or "This element has no numeric field."
            self.place.message.emit("There can be no series of this element", why)
            return
        if prompt.fields:
            self.editing.select(prompt.path)
        card = SeriesCard(prompt)
        card.typed.connect(lambda asked: self._plan(card, asked))
        card.make_asked.connect(lambda asked: self._make(card, asked))
        card.chosen.connect(lambda path: self._choose(card, AskSeries(path, among)))
        card.answered.connect(self.editing.ask)
        self.place.show_prompt(card, card.first)

    def _choose(self, card: SeriesCard, asked: AskSeries) -> None:
        """Ask for a series of the element that was chosen in the card; values stay if it has the same number."""
        number, values = card.number.currentText(), card.values.text()
        self.ask(asked)
        if isinstance(shown := self.place.prompt, SeriesCard):
            shown.elements.setFocus(Qt.FocusReason.OtherFocusReason)
            if not number or shown.number.findText(number) >= 0:
                shown.take_values(number, values)

    def _plan(self, card: SeriesCard, asked: MakeSeries) -> None:
        """Show what the values make; whether the study can take it is checked once typing pauses."""
        if (opened := self.editing.writable) is None:
            return
        card.show_plan(series_plan(opened.study, asked.path, asked.field, asked.values))
        self._resting.stop()
        if card.plan.lines:
            self._asked = card, asked
            self._resting.start()

    def _check(self) -> bool:
        """Show why the study cannot take what the values make; return whether it can."""
        self._resting.stop()
        card, asked = self._asked
        if (opened := self.editing.writable) is None or self.place.prompt is not card:
            return False
        try:
            series(opened.study, asked)
        except Refused as refusal:
            card.show_plan(refused_plan(refusal))
            return False
        return True

    def _make(self, card: SeriesCard, asked: MakeSeries) -> None:
        """Make a series that the study can take."""
        self._asked = card, asked
        if self._check():
            card.answered.emit(asked)
