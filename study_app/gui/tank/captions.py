"""The words around the tank: where we are, what to do, how far it is, and the way to pause."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QRegion

from study_app.gui.keys import draw_key
from study_app.gui.progress import draw_progress
from study_app.gui.tank.frame import Placed, TaskShown
from study_app.gui.theme import PARTICIPANT, font
from study_app.protocol.model import Explore, Reach
from study_app.session.pages import TaskPage

if TYPE_CHECKING:
    from study_app.protocol.words import Words

DESIGNED_FOR = (1920, 1080)
CENTRED = int(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)
RIGHT = int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)


def caption_scale(width: float, height: float) -> float:
    """Return how much larger than at 1920 × 1080 words are written in a window of ``width`` × ``height`` [px]."""
    return min(max(min(width / DESIGNED_FOR[0], height / DESIGNED_FOR[1]), 0.72), 2.0)


def below_tank(scale: float) -> float:
    """Return the height [px] that two lines of instruction and the foot need under the tank."""
    return 168 * scale


class Captions:
    """Lays the words out for a size and draws those that a region touches."""

    def __init__(self, page: TaskPage, words: Words) -> None:
        self._page = page
        self._words = words
        self.lay_out(*DESIGNED_FOR, 0.84 * DESIGNED_FOR[1])

    def lay_out(self, width: int, height: int, below: float) -> None:
        """Find the places in a window of ``width`` × ``height``; the tank ends at ``below`` [px]."""
        self._scale = scale = caption_scale(width, height)
        self._fine = fine = max(scale, 0.9)  # small words shrink less than the tank
        margin = 64 * scale
        head = 58 * scale
        self._instruction_font = font("instruction", scale=scale)
        self._count_font = font("number", scale=scale)
        self._small = font("statement", scale=fine)
        line = QFontMetricsF(self._instruction_font).height()
        foot = height - 58 * scale
        self._head = QPointF(margin, head + 6 * scale)
        self._foot = QPointF(margin, foot)
        room = foot - 22 * scale - below
        lines = (
            1 if QFontMetricsF(self._instruction_font).horizontalAdvance(self._page.instruction) < 0.72 * width else 2
        )
        top = below + max(4 * scale, (room - lines * line) * 0.55)
        self._instruction = QRectF(0.14 * width, top, 0.72 * width, max(foot - 20 * scale - top, lines * line))
        self._count = QRectF(width - margin - 300 * scale, head - 26 * scale, 300 * scale, 70 * scale)
        self._hint = QRectF(0.25 * width, foot - 20 * scale, 0.5 * width, 40 * scale)

    def things(self, task: TaskShown | None) -> dict[str, Placed]:
        """Return what can change among the words."""
        return {
            "count": Placed((task.reached, task.of) if task else None, self._count),
            "hint": Placed(self._hint_words(task), self._hint),
        }

    def draw(self, painter: QPainter, region: QRegion, task: TaskShown | None) -> None:
        """Draw the words in ``region``."""
        page, words, scale, fine = self._page, self._words, self._scale, self._fine
        head = QRectF(0, 0, self._count.left(), self._count.bottom())
        if page.progress is not None and region.intersects(head.toAlignedRect()):
            draw_progress(painter, self._head, page.progress, words, scale=1.25 * scale, share=0.5)
        if isinstance(page.task, Reach) and region.intersects(self._count.toAlignedRect()):
            self._draw_count(painter, task)
        if region.intersects(self._instruction.toAlignedRect()):
            _text(painter, self._instruction, CENTRED, page.instruction, self._instruction_font, PARTICIPANT.text)
        if region.intersects(QRectF(0, self._hint.top(), self._hint.left(), 60 * scale).toAlignedRect()):
            left, middle = self._foot.x(), self._foot.y()
            left += draw_key(painter, left, middle, words.escape_key, 1.1 * fine) + 12 * fine
            place = QRectF(left, middle - 20 * scale, self._hint.left() * 2, 40 * scale)
            middle_left = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
            _text(painter, place, middle_left, words.pause_hint, self._small, PARTICIPANT.text2)
        hint = self._hint_words(task)
        if hint and region.intersects(self._hint.toAlignedRect()):
            colour = PARTICIPANT.text if hint == words.continue_now else PARTICIPANT.text3
            _text(painter, self._hint, int(Qt.AlignmentFlag.AlignCenter), hint, self._small, colour)

    def _hint_words(self, task: TaskShown | None) -> str:
        """Return how long it takes until the participant may or must go on."""
        if task is None:
            return ""
        todo, words = self._page.task, self._words
        if isinstance(todo, Explore):
            wait = math.ceil(todo.min_s - task.elapsed_s)
            return words.continue_in.format(seconds=wait) if wait > 0 else words.continue_now
        if todo.duration_s is None:
            return ""
        return words.seconds_left.format(seconds=max(0, math.ceil(todo.duration_s - task.elapsed_s)))

    def _draw_count(self, painter: QPainter, task: TaskShown | None) -> None:
        reached = task.reached if task else 0
        of = task.of if task else None
        count = str(reached) if of is None else self._words.reached.format(reached=reached, of=of)
        upper = QRectF(self._count.topLeft(), self._count.size() * 0.5)
        upper.setWidth(self._count.width())
        _text(painter, upper, RIGHT, count, self._count_font, PARTICIPANT.text)
        _text(
            painter,
            upper.translated(0, upper.height()),
            RIGHT,
            self._words.targets_reached,
            self._small,
            PARTICIPANT.text2,
        )


def _text(painter: QPainter, place: QRectF, flags: int, text: str, face: QFont, colour: str) -> None:
    painter.setFont(face)
    painter.setPen(QColor(colour))
    painter.drawText(place, flags, text)
