"""The foot of a page of questions: what is missing, which keys answer, how many are answered, and the button."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QFontMetricsF, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QVBoxLayout, QWidget

from study_app.gui.participant.pages.key_caps import GoButton, KeyCap
from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, font

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

MARK = 22.0
MOVE_KEYS = "↑ ↓"


class Sign(QWidget):
    """The sign of what is missing."""

    _side = MARK

    def set_size(self, side: float, gap: float = 0.0) -> None:
        """Give it its size, and a gap to the words after it [px]."""
        self._side = side
        self.setFixedSize(round(side + gap), round(side))

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802
        """Draw it."""
        painter = page_painter(self)
        flip = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        left = self.width() - self._side if flip else 0.0
        draw_icon(painter, "warning", QRectF(left, 0, self._side, self._side), PARTICIPANT.warn)
        painter.end()


class Foot(QWidget):
    """One line; the keys give way where a message needs the room."""

    def __init__(self, words: Words, parent: QWidget) -> None:
        super().__init__(parent)
        self._words = words
        self._scale = 1.0
        self._answer_keys = ""
        self._sign = Sign(self)
        self._caps = (KeyCap(self), KeyCap(self))
        self._hints = (QLabel(words.key_answer, self), QLabel(words.key_move, self))
        self._message, self._kept, self._count = QLabel(self), QLabel(words.answers_kept, self), QLabel(self)
        self.button = GoButton(words.continue_, words.enter_key, self)
        self._message.setStyleSheet(f"color: {PARTICIPANT.text}; background: transparent;")
        for label in (self._kept, self._count, *self._hints):
            label.setStyleSheet(f"color: {PARTICIPANT.text2}; background: transparent;")
        self._message.setWordWrap(True)
        lines = QVBoxLayout()
        lines.setSpacing(0)
        lines.addStretch(1)
        lines.addWidget(self._message)
        lines.addWidget(self._kept)
        lines.addStretch(1)
        self._row = QHBoxLayout(self)
        self._row.addWidget(self._sign)
        self._row.addLayout(lines, 1)
        for cap, hint in zip(self._caps, self._hints, strict=True):
            self._row.addWidget(cap)
            self._row.addWidget(hint)
        self._row.addWidget(self._count)
        self._row.addWidget(self.button)

    def set_scale(self, scale: float, margin: int, *, tight: bool) -> None:
        """Grow with the page."""
        self._scale = scale
        self._sign.set_size(MARK * scale)
        self._message.setFont(font("statement", scale=scale, weight=600))
        small = font("body", scale=scale * 0.94)
        for label in (self._kept, *self._hints):
            label.setFont(small)
        self._count.setFont(font("cell", scale=scale * 0.95))
        self._count.setContentsMargins(round(14 * scale), 0, round(4 * scale), 0)
        self.button.set_scale(scale * (0.95 if tight else 1.0))
        self._row.setContentsMargins(margin, 0, margin - 4, 0)
        self._row.setSpacing(round(9 * scale))
        self.setFixedHeight(round((72 if tight else 96) * scale))
        self._fit()

    def show_state(self, message: str, done: int, of: int, keys: str) -> None:
        """Say what is missing, how many are answered, and which keys answer."""
        self._message.setText(message)
        self._count.setText(self._words.answered.format(done=done, of=of))
        self._answer_keys = keys
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Show what there is room for."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        """Show the message with its second line where that fits, and the keys in the width that is left."""
        message, gap = self._message.text(), self._row.spacing()
        margins = self._row.contentsMargins()
        room = self.width() - margins.left() - margins.right() - self.button.width() - 3 * gap
        room -= self._count.sizeHint().width()
        strong, light = (QFontMetricsF(label.font()) for label in (self._message, self._kept))
        kept = light.horizontalAdvance(self._words.answers_kept)
        needed = max(strong.horizontalAdvance(message) + 4, kept) if message else 0.0
        room_after_sign = room - self._sign.width() - gap
        lines = math.ceil(needed / max(1.0, room_after_sign))
        height = lines * strong.height() + light.height()
        for part, shown in (
            (self._sign, bool(message)),
            (self._message, bool(message)),
            (self._kept, bool(message) and kept <= room_after_sign and height <= self.height()),
        ):
            part.setVisible(shown)
        hints = (self._answer_keys, MOVE_KEYS)
        for cap, key in zip(self._caps, hints, strict=True):
            cap.show_key(key, self._scale)
        taken = sum(label.sizeHint().width() for label in self._hints) + sum(cap.width() for cap in self._caps)
        fits = bool(self._answer_keys) and taken + 6 * gap <= (room_after_sign - needed if message else room)
        for hint in (*self._caps, *self._hints):
            hint.setVisible(fits)
