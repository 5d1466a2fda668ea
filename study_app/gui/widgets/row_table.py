"""Tables in the style of the program: selectable rows, chips in cells, hairlines between rows.

The model returns each cell's text in the display role, from which screen readers read it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFont, QKeyEvent, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFrame,
    QHeaderView,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
)

from study_app.gui.theme.theme import RADIUS_CONTROL, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.cards import chip_size, fill_rounded, paint_chip

_ROW_HEIGHT = 43
MARGIN = 12
_GAP = 4
Index = QModelIndex | QPersistentModelIndex
CHIP_ROLE = Qt.ItemDataRole.UserRole + 1
"""Tone, icon and word of a chip, in place of the text."""
BELOW_ROLE = Qt.ItemDataRole.UserRole + 2
"""A word in small type below the text or chip."""
CARE_ROLE = Qt.ItemDataRole.UserRole + 3
"""Whether the row is tinted because it needs attention."""


NO_PARENT = QModelIndex()


class Rows(QAbstractTableModel):
    """A table model with one value per row.

    Parameters
    ----------
    headings : name and heading of each column
    cell : returns the values of a cell by their roles, from the row's value and the name of the column
    """

    def __init__(self, headings: Mapping[str, str], cell: Callable[[Any, str], Mapping[int, Any]]) -> None:
        super().__init__()
        self._names, self._headings, self._cell = (*headings,), (*headings.values(),), cell
        self.rows: tuple[Any, ...] = ()
        self._cells: dict[tuple[int, int], Mapping[int, Any]] = {}

    def show(self, rows: Iterable[Any]) -> None:
        """Replace the rows."""
        self.beginResetModel()
        self.rows, self._cells = tuple(rows), {}
        self.endResetModel()

    def rowCount(self, parent: Index = NO_PARENT) -> int:
        return 0 if parent.isValid() else len(self.rows)

    def columnCount(self, parent: Index = NO_PARENT) -> int:
        return 0 if parent.isValid() else len(self._names)

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        is_column = orientation == Qt.Orientation.Horizontal
        return self._headings[section] if is_column and role == Qt.ItemDataRole.DisplayRole else None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        key = index.row(), index.column()
        if key not in self._cells:
            self._cells[key] = self._cell(self.rows[key[0]], self._names[key[1]])
        return self._cells[key].get(role)


class _Cells(QStyledItemDelegate):
    """Draws texts and chips of cells; the table draws what spans a whole row."""

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        table = self.parent()
        assert isinstance(table, Table)  # noqa: S101 - made by it
        theme = table.theme
        cell = QRectF(option.rect).adjusted(MARGIN if index.column() == 0 else _GAP, 0, -_GAP, 0)  # type: ignore[attr-defined]
        chip, below = index.data(CHIP_ROLE), index.data(BELOW_ROLE)
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if chip is not None:
            width = min(chip_size(chip[2], small=True).width(), int(cell.width()))
            height, top = (20, cell.top() + 4) if below else (24, cell.center().y() - 12)
            body = QRectF(cell.left(), top, width, height)
            paint_chip(painter, body, theme, *chip, small=True)
            if below:
                lower = QRectF(
                    cell.left() + _GAP, body.bottom(), cell.width() - _GAP, cell.bottom() - 4 - body.bottom()
                )
                _write_text(painter, lower, font("small"), theme.text2, below)
            painter.restore()
            return
        face = index.data(Qt.ItemDataRole.FontRole) or font("label", weight=400, tabular=True)
        upper = QRectF(cell) if not below else QRectF(cell.left(), cell.top() + 3, cell.width(), cell.height() / 2)
        _write_text(painter, upper, face, theme.text if index.column() == 0 else theme.text2, str(index.data() or ""))
        if below:
            lower = QRectF(upper).translated(0, upper.height() - 4)
            _write_text(painter, lower, font("small"), theme.text2, below)
        painter.restore()


def _write_text(painter: QPainter, cell: QRectF, face: QFont, ink: str, text: str) -> None:
    painter.setFont(face)
    painter.setPen(QColor(ink))
    shown = painter.fontMetrics().elidedText(text, Qt.TextElideMode.ElideRight, int(cell.width()))
    painter.drawText(cell, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, shown)


class Table(Themed, QTableView):
    """A table of whole rows; ``opened`` carries the index of a row that was double-clicked or confirmed by Enter.

    Parameters
    ----------
    widths : fraction of the width and minimum width [px] of each column
    """

    opened = Signal(QModelIndex)

    def __init__(self, model: Rows, widths: Sequence[tuple[int, int]], name: str) -> None:
        super().__init__()
        self._widths = tuple(widths)
        self.setAccessibleName(name)
        self.setModel(model)
        self.setItemDelegate(_Cells(self))
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setShowGrid(False)
        self.setWordWrap(False)
        self.setTabKeyNavigation(False)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.verticalHeader().hide()
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.verticalHeader().setDefaultSectionSize(_ROW_HEIGHT)
        header = self.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        header.setMinimumSectionSize(10)
        header.setFont(font("small"))
        header.setFixedHeight(26)
        header.setHighlightSections(False)
        header.setSectionsClickable(False)
        self.doubleClicked.connect(self.opened)

    @property
    def chosen_row(self) -> int | None:
        chosen = self.selectionModel().selectedRows()
        return chosen[0].row() if chosen else None

    def minimumSizeHint(self) -> QSize:
        return QSize(sum(minimum for _, minimum in self._widths), 26 + _ROW_HEIGHT)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self.currentIndex().isValid():
            self.opened.emit(self.currentIndex())
        else:
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        minimum = sum(minimum for _, minimum in self._widths)
        shares = sum(share for share, _ in self._widths)
        spare = max(0, self.viewport().width() - minimum)
        for column, (share, needs) in enumerate(self._widths):
            self.setColumnWidth(column, needs + spare * share // shares)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self.viewport())
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        first, last = self.rowAt(0), self.rowAt(self.viewport().height() - 1)
        rows = self.model().rowCount()
        for row in range(max(0, first), (last if last >= 0 else rows - 1) + 1):
            body = self._row_rectangle(row)
            chosen = self.selectionModel().isRowSelected(row, QModelIndex())
            if chosen or self.model().index(row, 0).data(CARE_ROLE):
                fill_rounded(painter, body, RADIUS_CONTROL, self.theme.selected if chosen else self.theme.window)
            painter.setPen(QPen(QColor(self.theme.grid), 1))
            under = body.bottom() + 1
            painter.drawLine(MARGIN, int(under), self.viewport().width() - MARGIN, int(under))
        painter.end()
        super().paintEvent(event)
        if self.hasFocus() and self.currentIndex().isValid():
            painter = QPainter(self.viewport())
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(QPen(QColor(self.theme.accent), 2))
            ring = self._row_rectangle(self.currentIndex().row()).adjusted(1, 1, -1, -1)
            painter.drawRoundedRect(ring, RADIUS_CONTROL, RADIUS_CONTROL)
            painter.end()

    def _row_rectangle(self, row: int) -> QRectF:
        top = self.rowViewportPosition(row)
        return QRectF(0, top + 1, self.viewport().width(), _ROW_HEIGHT - 3)
