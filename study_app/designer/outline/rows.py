"""The rows of the outline, as they are painted."""

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPen
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem, QTreeView

from study_app.designer.outline.outline_rows import OutlineRow
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import RADIUS_CONTROL, Theme, font

ROW_PX, HEADING_PX = 32, 38
INDENT = 20
"""So wide is the grip at the left of a row that can be dragged."""
ROW_ROLE = Qt.ItemDataRole.UserRole + 1
Index = QModelIndex | QPersistentModelIndex


class RowPainter(QStyledItemDelegate):
    """Paints rows; the tree says the theme and whether rows may be moved."""

    def __init__(self, tree: QTreeView) -> None:
        super().__init__(tree)
        self.tree = tree
        self.theme: Theme | None = None
        self.movable = True

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        return QSize(100, HEADING_PX if not index.data(ROW_ROLE).path else ROW_PX)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Paint the heading of a section, or an element with icon, title, time and faults."""
        row = index.data(ROW_ROLE)
        place = QRectF(option.rect)  # type: ignore[attr-defined]  # missing in the stubs
        place.setLeft(0)
        place.setRight(self.tree.viewport().width())
        if self.theme is None:
            return
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if row.path:
            self._element(painter, place, row, option.state, index)  # type: ignore[attr-defined]
        else:
            middle = Qt.AlignmentFlag.AlignVCenter
            painter.setPen(QColor(self.theme.text2))
            painter.setFont(font("label", weight=600, tabular=True))
            painter.drawText(place.adjusted(8, 6, -10, 0), middle, row.title)
            painter.drawText(place.adjusted(8, 6, -10, 0), middle | Qt.AlignmentFlag.AlignRight, row.note)
        painter.restore()

    def _element(
        self, painter: QPainter, place: QRectF, row: OutlineRow, state: QStyle.StateFlag, index: Index
    ) -> None:
        t = self.theme
        assert t is not None  # noqa: S101 - `paint` saw it
        middle, right = Qt.AlignmentFlag.AlignVCenter, place.right() - 10
        chosen = bool(state & QStyle.StateFlag.State_Selected)
        current = index == self.tree.currentIndex()
        pointed = bool(state & QStyle.StateFlag.State_MouseOver)
        if chosen or pointed:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.selected if chosen else t.hover))
            painter.drawRoundedRect(place.adjusted(0, 1, 0, -1), RADIUS_CONTROL - 2, RADIUS_CONTROL - 2)
        if current and chosen:
            painter.setBrush(QColor(t.accent))
            painter.drawRoundedRect(QRectF(0, place.top() + 5, 3, place.height() - 10), 1.5, 1.5)
            if self.tree.hasFocus():
                painter.setPen(QPen(QColor(t.accent), 2))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawRoundedRect(place.adjusted(1, 2, -1, -2), RADIUS_CONTROL - 2, RADIUS_CONTROL - 2)
        x = sign_right(row) - INDENT
        if row.step and self.movable and (chosen or pointed):
            paint_grip(painter, QRectF(x - 8, place.top(), 8, place.height()), t.text2)
        if self.tree.model().hasChildren(index):
            chevron = "chevron_down" if self.tree.isExpanded(index) else "chevron"
            draw_icon(painter, chevron, QRectF(x + 2, place.center().y() - 7, 14, 14), t.text2, 2.0)
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
        room = QRectF(x + 46, place.top(), right - x - 46, place.height())
        words = painter.fontMetrics().elidedText(row.title, Qt.TextElideMode.ElideRight, int(room.width()))
        painter.drawText(room, middle, words)


def sign_right(row: OutlineRow) -> float:
    """Return where the sign ends that shows whether what is below a row is shown [px]."""
    return 12.0 + INDENT * row.depth


def paint_grip(painter: QPainter, place: QRectF, ink: str) -> None:
    """Paint the six dots that something is dragged by."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(ink))
    middle = place.center()
    for across in (-2.2, 2.2):
        for down in (-4.6, 0.0, 4.6):
            painter.drawEllipse(QRectF(middle.x() + across - 1.1, middle.y() + down - 1.1, 2.2, 2.2))
