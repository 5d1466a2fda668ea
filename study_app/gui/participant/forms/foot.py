"""The foot of a page of questions: what is missing, which keys answer, how many are answered, and the button."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from PySide6.QtCore import QRect, QRectF, Qt
from PySide6.QtGui import QAccessible, QColor, QFont, QFontMetrics, QFontMetricsF, QPainter, QPaintEvent
from PySide6.QtWidgets import QStyle, QWidget

from study_app.gui.participant.pages.key_caps import GoButton, draw_key, key_size
from study_app.gui.participant.pages.page_widget import beginning, page_painter
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.accessible import give_role
from study_app.gui.widgets.boxes import STRETCH, hbox

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

MARK = 22.0
MOVE_KEYS = "↑ ↓"
LINE = 1  # over the foot [px]
GAP = 9.0
HIGHEST = 2000  # of wrapped words [px]
WRAPPED = int(Qt.TextFlag.TextWordWrap)


class Foot(QWidget):
    """One line; the keys give way where a message needs the room. All but the button is painted."""

    def __init__(self, words: Words, parent: QWidget) -> None:
        super().__init__(parent)
        self._words = words
        self._scale = 1.0
        self._message, self._count, self._answer_keys = "", "", ""
        self.button = GoButton(words.continue_, words.enter_key, self)
        self._row = hbox((STRETCH, 1), self.button, parent=self)
        give_role(self, QAccessible.Role.StaticText)

    def set_scale(self, scale: float, margin: int, *, tight: bool) -> None:
        """Grow with the page."""
        self._scale = scale
        self._strong = font("statement", scale=scale, weight=600)
        self._small = font("body", scale=scale * 0.94)
        self._tabular = font("cell", scale=scale * 0.95)
        self.button.set_scale(scale * (0.95 if tight else 1.0))
        self._row.setContentsMargins(margin, LINE, margin - 4, 0)
        self.setFixedHeight(LINE + round((72 if tight else 96) * scale))
        self.update()

    def show_state(self, message: str, done: int, of: int, keys: str) -> None:
        self._message, self._answer_keys = message, keys
        self._count = self._words.answered.format(done=done, of=of)
        kept = self._words.answers_kept if message else ""
        hints = ((MOVE_KEYS, self._words.key_move), (keys, self._words.key_answer)) if keys else ()
        self.setAccessibleName(" ".join(filter(None, (message, kept, self._count))))
        self.setAccessibleDescription(", ".join(f"{key} {text}" for key, text in hints))
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw a line, and under it from the end: how many are answered, the keys, and what is missing."""
        painter = page_painter(self)
        painter.setLayoutDirection(Qt.LayoutDirection.LayoutDirectionAuto)  # words are in their own language's
        painter.fillRect(0, 0, self.width(), LINE, QColor(PARTICIPANT.border))
        gap = round(GAP * self._scale)
        line = self._row.contentsRect()
        end = self._paint_count(painter, line.right() + 1 - self.button.width() - gap)
        room = end - 2 * gap - line.left()
        room_after_sign = room - round(MARK * self._scale) - gap
        light = QFontMetricsF(self._small).horizontalAdvance(self._words.answers_kept)
        strong = QFontMetricsF(self._strong).horizontalAdvance(self._message) + 4
        needed = max(strong, light) if self._message else 0.0
        end = self._paint_keys(painter, end - gap, room_after_sign - needed if self._message else room)
        if self._message:
            lines = math.ceil(needed / max(1.0, room_after_sign))
            high = lines * QFontMetricsF(self._strong).height() + QFontMetricsF(self._small).height()
            kept = light <= room_after_sign and high <= self.height() - LINE
            self._paint_message(painter, end - gap, kept=kept)
        painter.end()

    def _paint_count(self, painter: QPainter, end: int) -> int:
        """Draw up to ``end`` how many are answered; return where that begins [px]."""
        before, after = round(14 * self._scale), round(4 * self._scale)
        width = before + self._width(self._tabular, self._count) + after
        place = self._placed(end - width, width).adjusted(before, 0, -after, 0)
        self._write(painter, place, self._count, self._tabular, PARTICIPANT.text2)
        return end - width

    def _paint_keys(self, painter: QPainter, end: int, room: float) -> int:
        """Draw the keys up to ``end`` where there is ``room`` for them; return where they begin [px]."""
        gap, words = round(GAP * self._scale), self._words
        hints = ((MOVE_KEYS, words.key_move), (self._answer_keys, words.key_answer))
        caps = [round(key_size(key, self._scale)[0]) + 2 for key, _ in hints]
        line = self._row.contentsRect()
        high = round(key_size(MOVE_KEYS, self._scale)[1]) + 2
        middle = line.top() + (line.height() - high) // 2 + high / 2
        widths = [self._width(self._small, text) for _, text in hints]
        if not self._answer_keys or sum(caps) + sum(widths) + 6 * gap > room:
            return end + gap
        for (key, text), cap, width in zip(hints, caps, widths, strict=True):
            self._write(painter, self._placed(end - width, width), text, self._small, PARTICIPANT.text2)
            end -= width + gap
            draw_key(painter, self._placed(end - cap, cap).left() + 1, middle, key, self._scale)
            end -= cap + gap
        return end + gap

    def _paint_message(self, painter: QPainter, end: int, *, kept: bool) -> None:
        """Draw what is missing up to ``end``, with a second line that nothing is lost where ``kept``."""
        side = round(MARK * self._scale)
        left = self._row.contentsRect().left() + side + round(GAP * self._scale)
        sign = self._placed(self._row.contentsRect().left(), side)
        top = sign.top() + (sign.height() - side) // 2
        size = MARK * self._scale
        x = sign.right() + 1 - size if self.layoutDirection() == Qt.LayoutDirection.RightToLeft else sign.left()
        draw_icon(painter, "warning", QRectF(x, top, size, size), PARTICIPANT.warn)
        place = self._placed(left, end - left)
        high = self._bounds(self._strong, self._message, end - left).height()
        low = self._bounds(self._small, self._words.answers_kept, end - left).height() if kept else 0
        place.setTop(place.top() + (place.height() - high - low + 1) // 2)
        place.setHeight(high)
        self._write(painter, place, self._message, self._strong, PARTICIPANT.text)
        if kept:
            place.translate(0, high)
            place.setHeight(low)
            self._write(painter, place, self._words.answers_kept, self._small, PARTICIPANT.text2)

    def _write(self, painter: QPainter, place: QRect, words: str, face: QFont, ink: str) -> None:
        painter.setFont(face)
        painter.setPen(QColor(ink))
        flags = int(beginning(self) | Qt.AlignmentFlag.AlignVCenter) | WRAPPED
        painter.drawText(QRectF(place), flags, words)

    def _placed(self, left: int, width: int) -> QRect:
        """Return a place, as high as the foot, so far from where lines begin [px]."""
        line = self._row.contentsRect()
        return QStyle.visualRect(self.layoutDirection(), line, QRect(left, line.top(), width, line.height()))

    def _width(self, face: QFont, words: str) -> int:
        """Return the width of words on one line [px]."""
        return self._bounds(face, words, HIGHEST).width()

    def _bounds(self, face: QFont, words: str, width: int) -> QRect:
        return QFontMetrics(face).boundingRect(0, 0, width, HIGHEST, int(beginning(self)) | WRAPPED, words)
