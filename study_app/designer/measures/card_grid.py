"""The grid of the cards of measures."""

from collections.abc import Sequence

from PySide6.QtCore import QEvent, Signal
from PySide6.QtGui import QHideEvent
from PySide6.QtWidgets import QHBoxLayout, QWidget

from study_app.designer.measures.parts import Made, part_of
from study_app.gui.theme.themed import Themed, apply_theme_within, remove_widget
from study_app.gui.widgets.boxes import STRETCH, hbox, insert_layout, vbox


class CardGrid(Themed, QWidget):
    """Cards in two columns; only those that changed are made anew. ``open_asked`` carries the path of an element.

    While the pointer is over them, none becomes lower: what is pointed at stays where it is.
    """

    open_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.cards: tuple[object, ...] = ()
        self.parts: list[Made] = []
        self.grid = vbox((STRETCH, 1), spacing=8, margins=0, parent=self)
        self._rows: list[QHBoxLayout] = []

    def show_cards(self, cards: tuple[object, ...]) -> None:
        if cards == self.cards:
            return
        pointed = self.isVisible() and self.underMouse()
        heights = [(part.height(), part.accessibleName()) for part in self.parts] if pointed else []
        kept = {at: part for at, (part, card) in enumerate(zip(self.parts, self.cards, strict=True))
                if at < len(cards) and card == cards[at]}  # fmt: skip
        for at, part in enumerate(self.parts):
            if at not in kept:
                remove_widget(part)
        for row in self._rows:
            for part in kept.values():
                row.removeWidget(part)
            self.grid.removeItem(row)
            row.deleteLater()
        self.parts = []
        for at, card in enumerate(cards):
            self.parts.append(kept[at] if at in kept else self._made(card))
        self._rows = [hbox(*((part, 1) for part in some), spacing=8) for some in _rows(self.parts)]
        for at, row in enumerate(self._rows):
            insert_layout(self.grid, at, row)
        self.cards = cards
        for part, (height, title) in zip(self.parts, heights, strict=False):
            part.setMinimumHeight(height if title == part.accessibleName() else 0)

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self._let_shrink()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._let_shrink()

    def _let_shrink(self) -> None:
        for part in self.parts:
            part.setMinimumHeight(0)

    def _made(self, card: object) -> Made:
        part = part_of(card)
        part.open_asked.connect(self.open_asked)
        apply_theme_within(part, self.theme)
        return part


def _rows(parts: Sequence[Made]) -> list[list[Made]]:
    """Return cards in rows of two, wide ones in a row of their own."""
    rows: list[list[Made]] = []
    waiting: list[Made] = []
    for part in parts:
        if part.wide:
            rows.append([part])
            continue
        waiting.append(part)
        if len(waiting) == 2:
            rows.append(waiting)
            waiting = []
    return [*rows, waiting] if waiting else rows
