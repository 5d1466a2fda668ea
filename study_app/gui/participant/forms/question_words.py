"""The words of a question: its number, its text and the small line under it, painted as one."""

from PySide6.QtCore import QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QFontMetrics, QFontMetricsF, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QStyle, QWidget

from study_app.gui.participant.pages.page_widget import beginning, page_painter
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT

HIGHEST = 2000  # of wrapped words [px]


class QuestionWords(QWidget):
    """One widget instead of four with a layout of their own: a page has nine and more of them.

    The number stands in a column of its own, so that the texts of all questions begin at one line. What is missing has
    a sign before the note.
    """

    def __init__(self, number: int, text: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.text, self.note, self.missing = text, "", False
        self._number = str(number)
        self._number_width = 0
        self._faces = (QFont(), QFont(), QFont())
        self._sign, self._sign_gap = 0.0, 0.0
        self._known: dict[int, tuple[int, int]] = {}  # heights by width
        policy = QSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)

    def fill_row(self) -> None:
        """Take the room that a row of a given height leaves, and ask for none."""
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Ignored)

    def show_note(self, note: str, *, missing: bool) -> None:
        """Show the small line, or none; with the sign and the colour of what is missing."""
        if (note, missing) != (self.note, self.missing):
            self.note, self.missing = note, missing
            self._changed()

    def set_fonts(self, text: QFont, note: QFont, number: QFont, sign_gap: float) -> None:
        """Write in these fonts, with a gap [px] after the sign."""
        if (text, note, number) == self._faces:
            return
        self._faces, self._sign_gap = (text, note, number), sign_gap
        self._sign = QFontMetricsF(note).height() - 1
        self._changed()

    def set_number_width(self, width: int) -> None:
        """Give the number its column [px]."""
        if width != self._number_width:
            self._number_width = width
            self._changed()

    def sizeHint(self) -> QSize:
        """Return the least size: the width is a share of the row, the height follows from it."""
        return self.minimumSizeHint()

    def minimumSizeHint(self) -> QSize:
        if not self.sizePolicy().hasHeightForWidth():
            return QSize(0, 0)
        text, note, _ = self._faces
        longest = self._note_left + self._bounds(note, self.note, 0).width()
        return QSize(self._number_width + max(longest, self._bounds(text, self.text, 0).width()), 0)

    def heightForWidth(self, width: int) -> int:
        return sum(self._heights(width))

    def paintEvent(self, _event: QPaintEvent) -> None:
        width, left = self.width(), self._number_width
        high, note_high = self._heights(width)
        top = (self.height() - high - note_high + 1) // 2
        painter = page_painter(self)
        painter.setLayoutDirection(Qt.LayoutDirection.LayoutDirectionAuto)  # words are in their own language's
        ink = PARTICIPANT.warn if self.missing else PARTICIPANT.text3
        note_top, note_left = top + high, left + self._note_left
        text_face, note_face, number_face = self._faces
        for face, colour, place, words in (
            (number_face, ink, QRect(0, top, left, high), self._number),
            (text_face, PARTICIPANT.text, QRect(left, top, width - left, high), self.text),
            (note_face, ink, QRect(note_left, note_top, width - note_left, note_high), self.note),
        ):
            painter.setFont(face)
            painter.setPen(QColor(colour))
            painter.drawText(self._placed(place), self._flags, words)
        if self.missing:
            room = self._placed(
                QRect(left, note_top + (note_high - round(self._sign)) // 2, self._note_left, note_high)
            )
            mirrored = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
            x = room.right() - self._sign if mirrored else room.left()
            draw_icon(painter, "warning", QRectF(x, room.top(), self._sign, self._sign), PARTICIPANT.warn)
        painter.end()

    @property
    def _flags(self) -> int:
        return int(beginning(self) | Qt.AlignmentFlag.AlignTop) | int(Qt.TextFlag.TextWordWrap)

    @property
    def _note_left(self) -> int:
        """Where the note begins after the number's column [px]."""
        return round(self._sign + self._sign_gap) if self.missing else 0

    def _placed(self, place: QRect) -> QRectF:
        return QRectF(QStyle.visualRect(self.layoutDirection(), self.rect(), place))

    def _bounds(self, face: QFont, words: str, width: int) -> QRect:
        return QFontMetrics(face).boundingRect(0, 0, width, HIGHEST, self._flags, words)

    def _heights(self, width: int) -> tuple[int, int]:
        """Return the heights [px] of number and text, and of the note."""
        if width not in self._known:
            self._known[width] = self._measured(width)
        return self._known[width]

    def _measured(self, width: int) -> tuple[int, int]:
        text, note, number = self._faces
        room = width - self._number_width
        high = max(self._bounds(text, self.text, room).height(), QFontMetrics(number).height())
        if not self.note:
            return high, 0
        note_high = self._bounds(note, self.note, room - self._note_left).height()
        return high, max(note_high, round(self._sign)) if self.missing else note_high

    def _changed(self) -> None:
        self._known.clear()
        self.updateGeometry()
        self.update()
