"""The list of the studies that can be opened: each with its title and file, the open one with a mark."""

from __future__ import annotations

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetrics, QKeyEvent, QPainter
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem

from study_app.designer.place.designer_view import BEFORE_ORIGIN, StudyChoice
from study_app.gui.theme.icons import draw_icon
from study_app.gui.widgets.controls import Choice

MARK_PX = 28
TITLE_ROLE = Qt.ItemDataRole.UserRole + 1
"""How many letters of a line are the title."""
OPENS = {
    Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown, Qt.Key.Key_Home, Qt.Key.Key_End,
    Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space, Qt.Key.Key_F4,
}  # fmt: skip
Index = QModelIndex | QPersistentModelIndex


def cut_title(words: str, length: int, metrics: QFontMetrics, room_px: int) -> str:
    """Return the first letters of words, the title, as many as leave room for the rest."""
    rest_px = metrics.horizontalAdvance(words[length:])
    return metrics.elidedText(words[:length], Qt.TextElideMode.ElideRight, max(0, room_px - rest_px))


class StudyLine(QStyledItemDelegate):
    """A study in the list of all: its file is less prominent than its title, and the open one has a check mark."""

    def __init__(self, studies: StudyList) -> None:
        super().__init__(studies)
        self._studies = studies

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        wanted = super().sizeHint(option, index) + QSize(MARK_PX, 0)
        return QSize(min(wanted.width(), self._studies.window().width() * 2 // 3), wanted.height())

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Paint the title, cut where it is too long, what follows it in another ink, and the mark at the right."""
        shown = QStyleOptionViewItem(option)
        self.initStyleOption(shown, index)
        style, words, title = self._studies.style(), index.data(), index.data(TITLE_ROLE)
        room = style.subElementRect(QStyle.SubElement.SE_ItemViewItemText, shown, self._studies.view())
        room.setLeft(room.left() + style.pixelMetric(QStyle.PixelMetric.PM_FocusFrameHMargin) + 1)  # as Qt does
        shown.text = "" if title else words  # type: ignore[attr-defined]  # missing in the stubs
        style.drawControl(QStyle.ControlElement.CE_ItemViewItem, shown, painter, self._studies.view())
        if title:
            painter.setFont(shown.font)  # type: ignore[attr-defined]
            called = cut_title(words, title, painter.fontMetrics(), room.width() - MARK_PX)
            for part, ink in ((called, "text"), (words[title:], "text2")):
                painter.setPen(QColor(getattr(self._studies.theme, ink)))
                painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, part)
                room.setLeft(room.left() + painter.fontMetrics().horizontalAdvance(part))
        if index.row() == self._studies.currentIndex():
            place = QRectF(option.rect)  # type: ignore[attr-defined]  # missing in the stubs
            mark = QRectF(place.right() - MARK_PX, place.center().y() - 8, 16, 16)
            draw_icon(painter, "check", mark, self._studies.theme.accent, 2.2)


class StudyList(Choice):
    """The studies that can be opened; keys open the list, none of them opens another study."""

    def __init__(self) -> None:
        super().__init__()
        self.setItemDelegate(StudyLine(self))

    def add_study(self, study: StudyChoice, *, opened: bool) -> None:
        self.addItem(study.words, study.source)
        self.setItemData(self.count() - 1, len(study.title), TITLE_ROLE)
        if opened:
            self.setItemData(self.count() - 1, f"{study.words}, open", Qt.ItemDataRole.AccessibleTextRole)

    def fitted(self, words: str, room_px: int) -> str:
        """Return title and file; where there is no room for both, the title alone unless another study has it, too."""
        shown = super().fitted(words, room_px)
        if shown == words:
            return shown
        length = self.currentData(TITLE_ROLE) or len(words)
        titles = [self.itemText(at)[: self.itemData(at, TITLE_ROLE)] for at in range(self.count())]
        if titles.count(title := words[:length]) < 2:
            return super().fitted(title, room_px)
        file = words[length:].partition(BEFORE_ORIGIN)[0]
        return super().fitted(cut_title(title + file, length, self.fontMetrics(), room_px) + file, room_px)

    def showPopup(self) -> None:
        super().showPopup()
        if self.currentIndex() < 0:
            self.view().setCurrentIndex(self.model().index(0, self.modelColumn()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        shift_or_pad = Qt.KeyboardModifier.KeypadModifier | Qt.KeyboardModifier.ShiftModifier
        letter = event.text().strip() if event.text().isprintable() else ""
        if (event.key() in OPENS or letter) and not event.modifiers() & ~shift_or_pad:
            self.showPopup()
            if letter:
                self.view().keyboardSearch(letter)
        else:
            event.ignore()
