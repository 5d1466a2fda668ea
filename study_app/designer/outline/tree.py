"""The tree of the outline: keys that mean steps, and rows that are dragged to another place of their list."""

from PySide6.QtCore import QEvent, QModelIndex, QPoint, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QKeySequence, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QAbstractItemView, QApplication, QFrame, QTreeView

from study_app.designer.outline.outline_rows import ElementPath, OutlineRow
from study_app.designer.outline.rows import ROW_ROLE, RowPainter, sign_right
from study_app.gui.theme.theme import Theme
from study_app.gui.theme.themed import Themed

LINE_PX = 2.0
EDGE_PX = 24


class Tree(Themed, QTreeView):
    """The rows.

    Signals: ``delete_asked``, ``entered_row`` (by Enter), ``copy_asked``, ``paste_asked``, ``dropped``
    (entries of a list, and the index of the one that they come before).
    """

    delete_asked = Signal()
    entered_row = Signal()
    copy_asked = Signal()
    paste_asked = Signal()
    dropped = Signal(object, int)

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
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setMouseTracking(True)
        self.rows = RowPainter(self)
        self.setItemDelegate(self.rows)
        self.setStyleSheet("QTreeView { background: transparent; border: none; outline: none; }")
        self.dragged: tuple[ElementPath, ...] = ()
        self.target: tuple[int, float] | None = None
        self.arrow_pressed = False
        self._pressed: tuple[QPoint, tuple[ElementPath, ...]] | None = None

    def apply_theme(self, theme: Theme) -> None:
        self.theme = self.rows.theme = theme
        self.viewport().update()

    def selected_rows(self) -> list[OutlineRow]:
        """Return the selected elements, in the order of the outline, the current one's list first."""
        found = [index.data(ROW_ROLE) for index in self.selectedIndexes()]
        return [row for row in found if row.path]

    # keys

    def event(self, event: QEvent) -> bool:
        """Keep copying and pasting for the rows."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            keys = (QKeySequence.StandardKey.Copy, QKeySequence.StandardKey.Paste)
            if any(event.matches(key) for key in keys):
                event.accept()
                return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if self.dragged and event.key() == Qt.Key.Key_Escape:
            self._let_go()
        elif event.key() == Qt.Key.Key_Delete and not event.modifiers():
            self.delete_asked.emit()
        elif event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
            self.entered_row.emit()
        elif event.matches(QKeySequence.StandardKey.Copy):
            self.copy_asked.emit()
        elif event.matches(QKeySequence.StandardKey.Paste):
            self.paste_asked.emit()
        else:
            super().keyPressEvent(event)

    # dragging

    def mousePressEvent(self, event: QMouseEvent) -> None:
        index = self.indexAt(event.position().toPoint())
        row = index.data(ROW_ROLE) if index.isValid() else None
        self._pressed = None
        arrow = row is not None and self.model().hasChildren(index) and event.position().x() < sign_right(row)
        self.arrow_pressed = arrow
        plain = event.button() == Qt.MouseButton.LeftButton and not event.modifiers()
        if plain and row is not None and row.step and self.rows.movable:
            selected = [one.step for one in self.selected_rows() if one.step[:-1] == row.step[:-1]]
            together = tuple(dict.fromkeys(selected)) if row.step in selected else (row.step,)
            self._pressed = (event.position().toPoint(), together)
            if len(together) > 1:
                self.setFocus(Qt.FocusReason.MouseFocusReason)
                return
        super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        at = event.position().toPoint()
        if self._pressed is None or not event.buttons() & Qt.MouseButton.LeftButton:
            super().mouseMoveEvent(event)
            return
        start, together = self._pressed
        if not self.dragged and (at - start).manhattanLength() >= QApplication.startDragDistance():
            self.dragged = together
            self.viewport().setCursor(Qt.CursorShape.ClosedHandCursor)
        if self.dragged:
            bar, height = self.verticalScrollBar(), self.viewport().height()
            if at.y() < EDGE_PX or at.y() > height - EDGE_PX:
                bar.setValue(bar.value() + (-12 if at.y() < EDGE_PX else 12))
            self.target = self._target(at)
            self.viewport().update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        dragged, target, pressed = self.dragged, self.target, self._pressed
        self._let_go()
        if dragged:
            if target is not None:
                self.dropped.emit(dragged, target[0])
        elif pressed is not None and len(pressed[1]) > 1:
            self.setCurrentIndex(self.indexAt(event.position().toPoint()))
        else:
            super().mouseReleaseEvent(event)

    def _let_go(self) -> None:
        self.dragged, self.target, self._pressed = (), None, None
        self.viewport().unsetCursor()
        self.viewport().update()

    def _target(self, at: QPoint) -> tuple[int, float]:
        """Return the index of the entry that comes next where the line is, and how far down the line is."""
        best, place = (0, 0.0), self.dragged[0][:-1]
        nearest = float("inf")
        index = self.model().index(0, 0)
        last = -1
        bottom = 0.0
        while index.isValid():
            row = index.data(ROW_ROLE)
            box = QRectF(self.visualRect(index))
            if row.step and row.step[:-1] == place:
                last, bottom = int(row.step[-1]), box.bottom()
                if abs(box.top() - at.y()) < nearest:
                    nearest, best = abs(box.top() - at.y()), (last, box.top())
            elif last >= 0 and row.path and self._below(index, place):
                bottom = box.bottom()
            index = self.indexBelow(index)
        return (last + 1, bottom) if abs(bottom - at.y()) < nearest else best

    def _below(self, index: QModelIndex, place: ElementPath) -> bool:
        """Return whether a row is shown below an entry of a list."""
        above = index.parent()
        while above.isValid():
            row = above.data(ROW_ROLE)
            if row.step and row.step[:-1] == place:
                return True
            above = above.parent()
        return False

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if self.target is not None:
            painter = QPainter(self.viewport())
            y = min(max(self.target[1], 1.0), self.viewport().height() - 1.0)
            place = QRectF(6, y - LINE_PX / 2, self.viewport().width() - 12, LINE_PX)
            painter.fillRect(place, QColor(self.theme.accent))
