"""The outline: what the study is made of, as a tree to choose from, with a field to find."""

from __future__ import annotations

from PySide6.QtCore import QItemSelectionModel, QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPen, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeView,
)

from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import RADIUS_CONTROL, Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import ActionButton
from study_app.viewmodels.designer.outline_rows import OutlineRow

ROW_PX, HEADING_PX = 32, 38
INDENT = 20
ROW_ROLE = Qt.ItemDataRole.UserRole + 1
Index = QModelIndex | QPersistentModelIndex


class _Rows(QStyledItemDelegate):
    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:  # noqa: N802 - Qt's name
        return QSize(100, HEADING_PX if not index.data(ROW_ROLE).path else ROW_PX)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        tree = self.parent()
        assert isinstance(tree, Tree)  # noqa: S101 - made by it
        t, row = tree.theme, index.data(ROW_ROLE)
        place = QRectF(option.rect)  # type: ignore[attr-defined]  # missing in the stubs
        place.setLeft(0)
        place.setRight(tree.viewport().width())
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        right = place.right() - 10
        middle = Qt.AlignmentFlag.AlignVCenter
        if not row.path:
            painter.setPen(QColor(t.text2))
            painter.setFont(font("label", weight=600, tabular=True))
            painter.drawText(place.adjusted(8, 6, -10, 0), middle, row.title)
            painter.drawText(place.adjusted(8, 6, -10, 0), middle | Qt.AlignmentFlag.AlignRight, row.note)
            painter.restore()
            return
        state = option.state  # type: ignore[attr-defined]
        chosen = bool(state & QStyle.StateFlag.State_Selected)
        if chosen or state & QStyle.StateFlag.State_MouseOver:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.selected if chosen else t.hover))
            painter.drawRoundedRect(place.adjusted(0, 1, 0, -1), RADIUS_CONTROL - 2, RADIUS_CONTROL - 2)
        if chosen:
            painter.setBrush(QColor(t.accent))
            painter.drawRoundedRect(QRectF(0, place.top() + 5, 3, place.height() - 10), 1.5, 1.5)
            if tree.hasFocus():
                painter.setPen(QPen(QColor(t.accent), 2))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawRoundedRect(place.adjusted(1, 2, -1, -2), RADIUS_CONTROL - 2, RADIUS_CONTROL - 2)
        x = 8.0 + INDENT * (row.depth - 1)
        if tree.model().hasChildren(index):
            chevron = "chevron_down" if tree.isExpanded(index) else "chevron"
            draw_icon(painter, chevron, QRectF(x, place.center().y() - 7, 14, 14), t.text2, 2.0)
        ink = t.accent if chosen else t.text if row.depth == 1 else t.text2
        draw_icon(painter, row.icon, QRectF(x + 20, place.center().y() - 9, 18, 18), ink, 1.9)
        painter.setFont(font("label", weight=600, tabular=True))
        if row.faults:
            badge = QRectF(right - 22, place.center().y() - 10, 22, 20)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.bad_bg))
            painter.drawRoundedRect(badge, 10, 10)
            painter.setPen(QColor(t.bad))
            painter.drawText(badge, Qt.AlignmentFlag.AlignCenter, str(row.faults))
            right = badge.left() - 6
        if row.note:
            painter.setFont(font("label", weight=400, tabular=True))
            painter.setPen(QColor(t.text2))
            width = painter.fontMetrics().horizontalAdvance(row.note) + 2
            painter.drawText(QRectF(right - width, place.top(), width, place.height()), middle, row.note)
            right -= width + 8
        painter.setFont(font("label", weight=600 if chosen else 500))
        painter.setPen(QColor(ink))
        room = QRectF(x + 48, place.top(), right - x - 48, place.height())
        painter.drawText(
            room, middle, painter.fontMetrics().elidedText(row.title, Qt.TextElideMode.ElideRight, int(room.width()))
        )
        painter.restore()


class Tree(Themed, QTreeView):
    """The rows; keys that mean steps are the outline's."""

    key_pressed = Signal(int)

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Outline of the study")
        self.setHeaderHidden(True)
        self.setIndentation(0)
        self.setRootIsDecorated(False)
        self.setExpandsOnDoubleClick(False)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setMouseTracking(True)
        self.setItemDelegate(_Rows(self))
        self.setStyleSheet("QTreeView { background: transparent; border: none; outline: none; }")

    def wear(self, theme: Theme) -> None:
        """Take the colours of ``theme``."""
        self.theme = theme
        self.viewport().update()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802 - Qt's name
        """Hand on Insert and Delete."""
        if event.key() in {Qt.Key.Key_Insert, Qt.Key.Key_Delete}:
            self.key_pressed.emit(event.key())
        else:
            super().keyPressEvent(event)


class OutlineCard(Card):
    """Draws outline rows.

    Signals: ``chosen`` (path), ``find_changed`` (words), ``add_asked``, ``duplicate_asked``, ``delete_asked``.
    """

    chosen = Signal(object)
    find_changed = Signal(str)
    add_asked = Signal()
    duplicate_asked = Signal()
    delete_asked = Signal()

    def __init__(self) -> None:
        super().__init__(padding=12, gap=8)
        self.setAccessibleName("Outline")
        self.rows: tuple[OutlineRow, ...] = ()
        self._opened: set[object] = set()
        self._filling = False
        self.words = QLineEdit()
        self.words.setAccessibleName("Find in the study")
        self.words.setPlaceholderText("Find in the study (Ctrl+F)")
        self.words.setFont(font("label", weight=400))
        self.words.setProperty("dense", "true")
        self.words.setFixedHeight(36)
        self.words.setClearButtonEnabled(True)
        self.tree = Tree()
        self.items = QStandardItemModel(self.tree)
        self.tree.setModel(self.items)
        self.add = ActionButton("plus", "Add", height=40)
        self.add.setAccessibleName("Add an element (Insert)")
        self.duplicate = ActionButton("copy", "Duplicate", height=40)
        self.duplicate.setAccessibleName("Duplicate the selected element (Ctrl+D)")
        self.column.addWidget(self.words)
        self.column.addWidget(self.tree, 1)
        buttons = QHBoxLayout()
        buttons.setSpacing(8)
        buttons.addWidget(self.add, 1)
        buttons.addWidget(self.duplicate, 1)
        self.column.addLayout(buttons)
        self.words.textChanged.connect(self.find_changed)
        self.tree.selectionModel().currentChanged.connect(self._choose)
        self.tree.clicked.connect(self._click)
        self.tree.expanded.connect(lambda index: self._opened.add(self._key(index)))
        self.tree.collapsed.connect(lambda index: self._opened.discard(self._key(index)))
        self.tree.key_pressed.connect(self._key_pressed)
        self.add.clicked.connect(self.add_asked)
        self.duplicate.clicked.connect(self.duplicate_asked)

    def show_outline(self, rows: tuple[OutlineRow, ...], selected: object) -> None:
        """Show rows; what was open stays open."""
        if rows != self.rows:
            self.rows = rows
            self._filling = True
            scrolled = self.tree.verticalScrollBar().value()
            self.items.clear()
            above: list[QStandardItem] = [self.items.invisibleRootItem()]
            for row in rows:
                item = QStandardItem(row.title)
                item.setData(row, ROW_ROLE)
                item.setData(row.name, Qt.ItemDataRole.AccessibleTextRole)
                if not row.path:
                    item.setFlags(Qt.ItemFlag.ItemIsEnabled)
                depth = max(row.depth - 1, 0)
                del above[depth + 1 :]
                above[-1].appendRow(item)
                above.append(item)
            for index in self._indexes():
                if self._key(index) in self._opened or self.words.text().strip():
                    self.tree.expand(index)
            self.tree.verticalScrollBar().setValue(scrolled)
            self._filling = False
        self.mark(selected)

    def mark(self, path: object) -> None:
        """Mark the row of an element, the nearest to the one that is marked."""
        current = self.tree.currentIndex()
        if current.isValid() and current.data(ROW_ROLE).path == path:
            return
        found = next((index for index in self._indexes() if index.data(ROW_ROLE).path == path), None)
        self._filling = True
        if found is None:
            self.tree.clearSelection()
            self.tree.setCurrentIndex(QModelIndex())
        else:
            if found.parent().isValid():
                self.tree.expand(found.parent())
            if "blocks" in path[:1]:  # type: ignore[index]  # a path
                self.tree.expand(found)
            flags = QItemSelectionModel.SelectionFlag
            self.tree.selectionModel().setCurrentIndex(found, flags.ClearAndSelect)
            self.tree.scrollTo(found)
        self._filling = False

    def _indexes(self) -> list[QModelIndex]:
        found: list[QModelIndex] = []
        waiting = [self.items.index(row, 0) for row in range(self.items.rowCount())]
        while waiting:
            index = waiting.pop(0)
            found.append(index)
            waiting[:0] = [self.items.index(row, 0, index) for row in range(self.items.rowCount(index))]
        return found

    def _key(self, index: Index) -> object:
        row, parent = index.data(ROW_ROLE), index.parent()
        return row.path, row.depth, parent.data(ROW_ROLE).path if parent.isValid() else None

    def _choose(self, index: QModelIndex) -> None:
        if not self._filling and index.isValid() and index.data(ROW_ROLE).path:
            self.chosen.emit(index.data(ROW_ROLE).path)

    def _click(self, index: QModelIndex) -> None:
        if self.items.hasChildren(index):
            self.tree.setExpanded(index, not self.tree.isExpanded(index))

    def _key_pressed(self, key: int) -> None:
        (self.add_asked if key == Qt.Key.Key_Insert else self.delete_asked).emit()
