"""Asking for a series: of which element, which number differs, its values, and what they make while they are typed."""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from PySide6.QtCore import QObject, Qt, QTimer

from study_app.app.designer.editing import Editing
from study_app.app.designer.series_steps import judged_series
from study_app.authoring.changes.series import series_starts
from study_app.gui.designer.prompts import SeriesCard
from study_app.gui.designer.view import DesignerPlace
from study_app.protocol.source.document import Path
from study_app.viewmodels.designer.prompts import SeriesPlan, series_plan, series_prompt
from study_app.viewmodels.designer.requests import AskSeries, MakeSeries

REST_MS: Final = 300
PART_S: Final = 0.03
"""So long the window may wait for parts of the check; one part alone may take longer in a large study."""


class SeriesPrompts(QObject):
    """Shows the card that asks for the values of a series.

    Whether the study can take what is typed, and what helps where it cannot, is found in parts once typing pauses;
    the window goes on between them.
    """

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.editing, self.place = editing, place
        self._typed: dict[Path, tuple[str, str]] = {}
        self._parts: Iterator[SeriesPlan | None] = iter(())
        self._asked: MakeSeries | None = None
        self._making = False
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._go_on)
        place.series_asked.connect(self.ask)
        editing.opened_other.connect(self._typed.clear)

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
        self._asked = None
        card = SeriesCard(prompt)
        card.typed.connect(lambda asked: self._plan(card, asked))
        card.make_asked.connect(self._make)
        card.chosen.connect(lambda path: self._choose(card, AskSeries(path, among)))
        card.answered.connect(self._answer)
        self.place.show_prompt(card, card.first)
        if prompt.path in self._typed:
            card.take_values(*self._typed[prompt.path])

    def _choose(self, card: SeriesCard, asked: AskSeries) -> None:
        """Ask for a series of the element that was chosen in the card; values stay if it has the same number."""
        number, values = card.number.currentText(), card.values.text()
        self.ask(asked)
        if isinstance(shown := self.place.prompt, SeriesCard):
            shown.elements.setFocus(Qt.FocusReason.OtherFocusReason)
            if values:
                shown.take_values(number, values)

    def _plan(self, card: SeriesCard, asked: MakeSeries) -> None:
        """Show what the values make; whether the study can take it is checked once typing pauses."""
        self._timer.stop()
        self._asked, self._making = None, False
        if (opened := self.editing.writable) is None:
            return
        self._typed[asked.path] = card.number.currentText(), asked.values
        card.show_plan(series_plan(opened.study, asked.path, asked.field, asked.values))
        if asked.values.strip():
            self._asked = asked
            self._parts = judged_series(opened.study, asked)
            self._timer.start(REST_MS)

    def _go_on(self) -> None:
        """Check the next parts, at least one."""
        card = self.place.prompt
        if self._asked is None or not isinstance(card, SeriesCard):
            return
        pauses = time.monotonic() + PART_S
        for plan in self._parts:
            if plan is not None:
                card.show_plan(plan)
            if time.monotonic() > pauses:
                self._timer.start(0)
                return
        if self._making and card.plan.lines:
            card.answered.emit(self._asked)

    def _make(self, asked: MakeSeries) -> None:
        """Make a series as soon as it is known that the study can take it."""
        self._making = True
        if asked == self._asked:
            self._go_on()

    def _answer(self, asked: MakeSeries) -> None:
        self._typed.pop(asked.path, None)
        self.editing.ask(asked)
