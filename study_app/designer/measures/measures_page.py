"""The tab Measures with cards of the selected element and the study's power, and the cards below other tabs."""

import re

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QScrollArea, QWidget

from study_app.designer.measures.cards import CardGrid
from study_app.designer.measures.measures_view import MeasuresView
from study_app.designer.measures.simulation import Simulated
from study_app.designer.parts import small_button
from study_app.gui.widgets import Card, add_parts, label, vbox

_OUTDATED = "These numbers describe the last valid version of the study. Correct the problems to update them."
FACTS_MAX_PX, FACTS_MIN_PX = 366, 190
FACTS_SHARE, HIGH_MIN_PX = 0.3, 940
"""Greatest proportion of the window's height for the cards; window height from which two rows fit completely [px]."""


class _MeasureCards(QScrollArea):
    """Shows the cards of a `MeasuresView`; ``open_asked`` carries an element's path.

    The cards are not updated while hidden; ``appeared`` is emitted when they become visible.
    """

    open_asked = Signal(object)
    appeared = Signal()

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.shown: MeasuresView | None = None
        self.grid = CardGrid(self.open_asked.emit)
        self.earlier = label(_OUTDATED, "small", "warn", wraps=True)
        self.earlier.hide()
        inside = QWidget()
        inside.setObjectName("earlier")
        self.column = vbox(self.earlier, (self.grid, 1), spacing=8, margins=0, parent=inside)
        self.setWidget(inside)

    def show_measures(self, shown: MeasuresView) -> None:
        self.shown = shown
        if self.isVisible():
            self.show_parts(shown)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if self.shown is not None:
            self.show_parts(self.shown)
        self.appeared.emit()

    def show_parts(self, shown: MeasuresView) -> None:
        self.earlier.setVisible(shown.earlier)
        for part in self.widget().findChildren(QWidget, options=Qt.FindChildOption.FindDirectChildrenOnly):
            part.setEnabled(part is self.earlier or not shown.earlier)
        self.grid.show_cards(shown.cards)


class _PowerCard(Card):
    """The output of ``liquid-study power``, the progress of its simulation, and the trials that would be lost."""

    def __init__(self) -> None:
        self.preregister = small_button("file", "Write preregistration")
        self.preregister.setToolTip("Write a text with the saved study's hypotheses, design, sample size and analysis")
        super().__init__("Power", self.preregister, padding=16, gap=8)
        self.setAccessibleName("Power")
        self.changed = label("The study has changed since it was preregistered.", "small", "warn", wraps=True)
        self.changed.hide()
        self.lost = label("", "small", "warn", wraps=True)
        self.progress = label("", "small", "text2", wraps=True)
        self.table = label("", "small", wraps=True)
        self.table.setTextFormat(Qt.TextFormat.MarkdownText)
        self.table.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        add_parts(self.column, self.changed, self.lost, self.progress, self.table)

    def show_power(self, simulated: Simulated) -> None:
        table, progress = simulated.table, simulated.failed or simulated.waiting
        self.lost.setText("\n".join(f"{sentence}." for sentence in simulated.lost))
        self.lost.setVisible(bool(simulated.lost))
        self.progress.setText(progress)
        self.progress.setVisible(bool(progress))
        self.table.setText(re.sub("^#+ (.*)$", r"**\1**", table, flags=re.MULTILINE))
        self.table.setVisible(bool(table))


class MeasuresPage(_MeasureCards):
    """The tab Measures: the cards, and below them the study's power."""

    def __init__(self) -> None:
        super().__init__("Measures")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.power = _PowerCard()
        self.column.addWidget(self.power)
        self.column.addStretch(1)
        self.column.setStretchFactor(self.grid, 0)

    def show_parts(self, shown: MeasuresView) -> None:
        super().show_parts(shown)
        self.power.show_power(shown.simulated)


class FactsRow(_MeasureCards):
    """The cards that stay below other tabs."""

    def __init__(self) -> None:
        super().__init__("Facts")
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._window_px = self._left_px = 0
        self.fit_height(0, 0)

    def fit_height(self, window_px: int, left_px: int) -> None:
        """Set the height that the cards need, at most ``left_px`` if positive, otherwise a proportion of the window."""
        self._window_px, self._left_px = window_px, left_px
        largest = FACTS_MAX_PX if window_px >= HIGH_MIN_PX else max(FACTS_MIN_PX, round(FACTS_SHARE * window_px))
        largest = left_px if left_px > 0 else largest
        column = self.column
        needed = max(column.totalHeightForWidth(self.viewport().width()), column.totalMinimumSize().height())
        self.setFixedHeight(min(largest, needed + 2 * self.frameWidth()) if self.grid.cards else largest)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        handled = super().eventFilter(watched, event)
        if watched is self.widget() and event.type() == QEvent.Type.LayoutRequest:
            self.fit_height(self._window_px, self._left_px)
        return handled

    def show_parts(self, shown: MeasuresView) -> None:
        super().show_parts(shown)
        self.fit_height(self._window_px, self._left_px)
