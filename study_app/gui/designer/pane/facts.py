"""The cards below a tab: the most wanted measures of what is selected."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QScrollArea, QVBoxLayout, QWidget

from study_app.gui.designer.measures.page import NumbersRow
from study_app.gui.designer.measures.parts import CardGrid
from study_app.viewmodels.designer.measures.cards import MeasuresView

HIGH, LOW = 366, 190
HIGH_FROM = 940
"""In windows as high as this two rows of cards are shown whole."""


class FactsRow(QScrollArea):
    """Draws the cards of a `MeasuresView` that stay below other tabs; ``open_asked`` carries an element's path."""

    open_asked = Signal(object)
    appeared = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Facts")
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.shown: MeasuresView | None = None
        self.numbers = NumbersRow()
        self.numbers.hide()
        self.grid = CardGrid()
        self.grid.open_asked.connect(self.open_asked)
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(8)
        column.addWidget(self.numbers)
        column.addWidget(self.grid, 1)
        self.setWidget(inside)
        self.make_room(0)

    def make_room(self, window_px: int) -> None:
        """Take as much height as the window has room for."""
        self.setFixedHeight(HIGH if window_px >= HIGH_FROM else LOW)

    def show_measures(self, shown: MeasuresView) -> None:
        """Show other numbers; while the cards are hidden they are kept for later."""
        self.shown = shown
        if self.isVisible():
            self._show()

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802 - Qt's name
        """Show what came while the cards were hidden."""
        super().showEvent(event)
        self._show()
        self.appeared.emit()

    def _show(self) -> None:
        if self.shown is not None:
            self.numbers.show_numbers(self.shown.numbers)
            self.grid.show_cards(self.shown.below)
