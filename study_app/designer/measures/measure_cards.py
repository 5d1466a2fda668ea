"""The cards below a tab: the most wanted measures of what is selected."""

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QScrollArea, QWidget

from study_app.designer.measures.card_grid import CardGrid
from study_app.designer.measures.measures_page import NumbersRow
from study_app.designer.measures.number_cards import EARLIER, MeasuresView
from study_app.gui.widgets.boxes import vbox
from study_app.gui.widgets.labels import label

MOST, LEAST = 366, 190
SHARE, HIGH_FROM = 0.3, 940
"""The share of a window's height that the cards take at most; in windows as high as this two rows are shown whole."""


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
        self.earlier = label(EARLIER, "small", "warn", wraps=True)
        self.earlier.hide()
        inside = QWidget()
        inside.setObjectName("earlier")
        self._inside = vbox(self.earlier, self.numbers, (self.grid, 1), spacing=8, margins=0, parent=inside)
        self.setWidget(inside)
        self._window_px = self._left_px = 0
        self.make_room(0, 0)

    def make_room(self, window_px: int, left_px: int) -> None:
        """Take the height of the cards, as far as the window has room for them, or the page above leaves it."""
        self._window_px, self._left_px = window_px, left_px
        most = MOST if window_px >= HIGH_FROM else max(LEAST, round(SHARE * window_px))
        most = left_px if left_px > 0 else most
        needed = max(
            self._inside.totalHeightForWidth(self.viewport().width()), self._inside.totalMinimumSize().height()
        )
        self.setFixedHeight(min(most, needed + 2 * self.frameWidth()) if self.grid.cards else most)

    def show_measures(self, shown: MeasuresView) -> None:
        """Show other numbers; while the cards are hidden they are kept for later."""
        self.shown = shown
        if self.isVisible():
            self._show()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._show()
        self.appeared.emit()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        handled = super().eventFilter(watched, event)
        if watched is self.widget() and event.type() == QEvent.Type.LayoutRequest:
            self.make_room(self._window_px, self._left_px)
        return handled

    def _show(self) -> None:
        if self.shown is not None:
            self.earlier.setVisible(self.shown.earlier)
            for part in (self.numbers, self.grid):
                part.setEnabled(not self.shown.earlier)
            self.numbers.show_numbers(self.shown.numbers, self.shown.waiting)
            self.grid.show_cards(self.shown.below)
            self.make_room(self._window_px, self._left_px)
