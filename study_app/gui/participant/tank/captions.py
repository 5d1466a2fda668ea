"""The texts around the tank: progress, count of targets, instruction, hint, and how to pause."""

from __future__ import annotations

import math

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QRegion

from study_app.gui.participant.intervals.answer_page import draw_interval, interval_width
from study_app.gui.participant.pages.page_widget import (
    BEGINNING,
    draw_key,
    draw_progress,
    font_scale,
    key_size,
    mirror_rectangle,
)
from study_app.gui.participant.tank.frame import DrawnPart, TaskShown
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.protocol.wording import Words
from study_app.session.pages import TaskPage

_DESIGNED_FOR = (1920, 1080)
_LEAST_SCALE = 0.72
_INSTRUCTION = 0.72  # width of the instruction, relative to the window
_FINE = 0.9  # least scale of small text
_COUNTED_DOWN_S = 10  # the last seconds of a task, which are counted down
_CONTROLS_PX = (470, 64)  # size of an adjustment's buttons, with the space above and below
_PATCH_ROOM = 88  # size of the photodiode's patch in the lower right corner [px]
_CENTRED = int(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)
LEFT_TO_RIGHT, ISOLATE, END = "\u2066", "\u2068", "\u2069"  # Unicode controls of isolated runs of text
RIGHT = int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)


def _caption_scale(width: float, height: float) -> float:
    """Return the scale of text relative to 1920 × 1080 in a window of ``width`` × ``height`` [px]."""
    return min(max(min(width / _DESIGNED_FOR[0], height / _DESIGNED_FOR[1]), _LEAST_SCALE), 2.0)


class Captions:
    """Lays out the texts for a window size and draws those that intersect a region.

    Texts are enlarged by at least ``text_scale``. In a right-to-left language everything is mirrored except the tank
    and the photodiode's patch.
    """

    def __init__(self, page: TaskPage, wording: Words, text_scale: float = 1.0) -> None:
        self._page = page
        self._words = wording
        self._text_scale = text_scale
        self._small: QFont
        self._line: float
        self._direction = Qt.LayoutDirection.RightToLeft if wording.right_to_left else Qt.LayoutDirection.LeftToRight
        self.lay_out(*_DESIGNED_FOR, 0.84 * _DESIGNED_FOR[1])

    def show_interval(self, page: TaskPage) -> None:
        self._page = page

    def height_below(self, width: float, height: float) -> float:
        """Return the height of instruction and foot below the tank [px]; it is the same for most instructions."""
        self._choose_fonts(width, height)
        lines = max(2, self._instruction_lines())
        stacked = self._is_stacked()
        foot = height - self._top_of_foot(stacked=True) if stacked or self._text_scale > 1 else 0.0
        return max(168 * self._scale, foot + (lines + 0.3) * self._line) + self._controls_above

    def height_above(self, width: float, height: float) -> float:
        """Return the height of progress and count above the tank [px]."""
        self._choose_fonts(width, height)
        return 102 * self._scale if self._text_scale > 1 else 0.0

    def lay_out(self, width: float, height: float, below: float) -> None:
        """Lay out the texts in a window of ``width`` × ``height``; the tank ends at ``below`` [px]."""
        self._choose_fonts(width, height)
        scale, margin = self._scale, 64 * _caption_scale(width, height)
        head, small = 58 * scale, QFontMetricsF(self._small).height()
        count = 300 * scale
        across = width - 2 * margin - (count if self._page.task.targets_m else 0)
        if self._page.interval is not None:
            marks = interval_width(self._page.interval, self._words, self._head_scale)
            across = min(across, (width - marks) / 2 - margin - 24 * scale)
        self._head = self._mirror_if_rtl(QRectF(margin, head - 20 * scale, across, 40 * scale))
        self._count = self._mirror_if_rtl(QRectF(width - margin - count, head - 26 * scale, count, 70 * scale))
        start, room = self._foot_extent()
        if self._foot_width() > room:
            self._pause_font = font("statement", scale=self._fine * room / self._foot_width())
        self._foot = QRectF(start, self._foot_middle() - small, min(self._foot_width(), room), 2 * small)
        longest, stacked = self._longest_hint(), self._is_stacked()
        middle = self._foot_middle() - (1.25 * small if stacked else 0)
        self._hint = QRectF((width - longest) / 2, middle - 0.62 * small, longest, 1.24 * small)
        if stacked:
            self._foot.setTop(self._foot_middle() - 0.62 * small)
        tall = self._instruction_lines() * self._line
        room = self._top_of_foot(stacked=stacked) - below - self._controls_above
        top = below + max(4 * scale, (room - tall) * 0.55)
        self._instruction = QRectF((1 - _INSTRUCTION) / 2 * width, top, _INSTRUCTION * width, max(room, tall))

    def _choose_fonts(self, width: float, height: float) -> None:
        self._width, self._height = width, height
        base = _caption_scale(width, height)
        min_scale = font_scale(width, height, self._text_scale) if self._text_scale > 1 else 1.0
        self._scale = max(base, _LEAST_SCALE * min_scale)
        self._fine = max(self._scale, min_scale if self._text_scale > 1 else _FINE)  # shrinks less than the tank
        self._instruction_font = font("instruction", scale=self._scale)
        self._count_font = font("number", scale=self._scale)
        self._small = self._pause_font = font("statement", scale=self._fine)
        self._line = QFontMetricsF(self._instruction_font).height()

    def _instruction_lines(self) -> int:
        metrics = QFontMetricsF(self._instruction_font)
        room = QRectF(0, 0, _INSTRUCTION * self._width, 1e4)
        texts = (self._page.instruction, self._page.question)
        return max(1, *(round(metrics.boundingRect(room, _CENTRED, text).height() / self._line) for text in texts))

    def _foot_extent(self) -> tuple[float, float]:
        """Return start and width of the space for the foot, in reading direction [px]."""
        margin = 64 * _caption_scale(self._width, self._height)
        start = max(margin, _PATCH_ROOM + 12) if self._words.right_to_left else margin
        return start, self._width - start - (margin if self._words.right_to_left else _PATCH_ROOM + 12)

    def _longest_hint(self) -> float:
        return max(QFontMetricsF(self._small).horizontalAdvance(text) for text in self._longest_hints()) + 8

    def _is_stacked(self) -> bool:
        """Return whether the hint is above the foot because there is no room next to it."""
        start, room = self._foot_extent()
        return start + min(self._foot_width(), room) + 24 > (self._width - self._longest_hint()) / 2

    def _foot_middle(self) -> float:
        small = QFontMetricsF(self._small).height()
        base = _caption_scale(self._width, self._height)
        return self._height - max(58 * base, 0.5 * small + 24 * base)

    def _top_of_foot(self, *, stacked: bool) -> float:
        return self._foot_middle() - QFontMetricsF(self._small).height() * (1.9 if stacked else 0.65)

    def _foot_width(self) -> float:
        key, _ = key_size(self._words.escape_key, 1.1 * self._fine)
        return key + 12 * self._fine + QFontMetricsF(self._pause_font).horizontalAdvance(self._words.pause_hint) + 4

    def parts(self, task: TaskShown | None, hint: str = "") -> dict[str, DrawnPart]:
        return {
            "count": DrawnPart(self._count_and_total(task), self._count),
            "hint": DrawnPart(self._complete_hint(task, hint), self._hint),
        }

    def draw(self, painter: QPainter, region: QRegion, task: TaskShown | None, hint: str = "") -> None:
        """Draw the texts in ``region``; ``hint`` tells how to move the ball to its target, or is ""."""
        page, wording = self._page, self._words
        painter.setLayoutDirection(self._direction)
        if page.progress is not None and region.intersects(self._head.toAlignedRect()):
            draw_progress(painter, self._head, page.progress, wording, scale=self._head_scale, share=0.5)
        if page.interval is not None:
            draw_interval(painter, self._width, self._head.center().y(), page.interval, wording, self._head_scale)
        if page.task.targets_m and region.intersects(self._count.toAlignedRect()):
            self._draw_count(painter, task)
        if region.intersects(self._instruction.toAlignedRect()):
            rest = page.interval if page.interval is not None and page.interval.resting else None
            text = page.said if rest is None else rest.announced
            _draw_text(painter, self._instruction, _CENTRED, text, self._instruction_font, PARTICIPANT.text)
        if region.intersects(self._mirror_if_rtl(self._foot).toAlignedRect()):
            self._draw_foot(painter)
        hints = self._complete_hint(task, hint)
        if hints and region.intersects(self._hint.toAlignedRect()):
            strong = bool(hint) or hints.startswith(wording.continue_now) or hints == wording.time_is_up
            colour = PARTICIPANT.text if strong else PARTICIPANT.text3
            _draw_text(painter, self._hint, int(Qt.AlignmentFlag.AlignCenter), hints, self._small, colour)

    @property
    def _head_scale(self) -> float:
        return max(1.25 * self._scale, self._fine)

    def _mirror_if_rtl(self, place: QRectF) -> QRectF:
        """Return ``place``, mirrored if the language is read from right to left."""
        return mirror_rectangle(place, self._width) if self._words.right_to_left else place

    @property
    def controls_middle(self) -> float:
        """The vertical centre of the adjustment controls [px], level with the foot or above it."""
        above = self._controls_above
        return self._foot.top() - above / 2 if above else self._foot_middle()

    @property
    def _controls_above(self) -> float:
        """The height of the controls above the foot [px]; 0 if they fit beside it or there are none."""
        wide, high = (side * self._fine for side in _CONTROLS_PX)
        start = 64 * _caption_scale(self._width, self._height)
        beside = start + self._foot_width() + 24 <= (self._width - wide) / 2
        return high if self._page.question and not beside else 0.0

    @property
    def small_scale(self) -> float:
        return self._fine

    @property
    def setting_keys(self) -> str:
        """The keys of an adjustment, from left to right in every language."""
        wording = self._words
        finish = wording.key_does.format(key=wording.enter_key, action=wording.done)
        if not wording.right_to_left:
            return f"← {wording.less} · {wording.more} → · {finish}"
        less, more, finish = (f"{ISOLATE}{text}{END}" for text in (wording.less, wording.more, finish))
        return f"{LEFT_TO_RIGHT}← {less} · {more} → · {finish}{END}"

    def _longest_hints(self) -> tuple[str, ...]:
        wording = self._words
        counted = wording.seconds_left.format(seconds=999)
        both = wording.seconds_left.format(seconds=_COUNTED_DOWN_S)
        if self._page.task.targets_m:
            return tuple(f"{away} · {both}" for away in (wording.further_away, wording.nearer, wording.time_is_up))
        if self._page.task.paced:
            return wording.back_to_target, wording.further_away, wording.nearer
        return f"{wording.continue_now} · {both}", wording.continue_in.format(seconds=999), counted, wording.time_is_up

    def _draw_foot(self, painter: QPainter) -> None:
        fine, wording = self._fine, self._words
        key, _ = key_size(wording.escape_key, 1.1 * fine)
        cap = self._mirror_if_rtl(QRectF(self._foot.left(), self._foot.top(), key, self._foot.height()))
        draw_key(painter, cap.left(), cap.center().y(), wording.escape_key, 1.1 * fine)
        text_area = self._foot.adjusted(key + 12 * fine, 0, 0, 0)
        _draw_text(
            painter, self._mirror_if_rtl(text_area), BEGINNING, wording.pause_hint, self._pause_font, PARTICIPANT.text2
        )

    def _complete_hint(self, task: TaskShown | None, hint: str) -> str:
        """Return ``hint`` together with the time until the participant may or must continue."""
        definition, wording = self._page.task, self._words
        if self._page.adjusts:
            return hint
        if definition.paced or (self._page.interval is not None and self._page.interval.resting):
            return hint  # a countdown would distract from the paced task, whose end is predictable
        elapsed_s = task.elapsed_s if task else 0.0  # before the first view, no time has elapsed
        left_s = math.ceil(definition.limit_s - elapsed_s)
        if left_s <= 0:
            return wording.time_is_up
        counted = wording.seconds_left.format(seconds=left_s)
        if definition.least_s is not None:
            wait_s = math.ceil(definition.least_s - elapsed_s)
            if wait_s > 0:
                return wording.continue_in.format(seconds=wait_s)
            return wording.continue_now if left_s > _COUNTED_DOWN_S else f"{wording.continue_now} · {counted}"
        shows_time = definition.wanted is None or left_s <= _COUNTED_DOWN_S
        return " · ".join(filter(None, (hint, counted if shows_time else "")))

    def _count_and_total(self, task: TaskShown | None) -> tuple[int, int | None]:
        if task is not None:
            return task.reached, task.of
        return 0, self._page.task.wanted

    def _draw_count(self, painter: QPainter, task: TaskShown | None) -> None:
        reached, of = self._count_and_total(task)
        count = str(reached) if of is None else self._words.reached.format(reached=reached, of=of)
        upper = QRectF(self._count.topLeft(), self._count.size() * 0.5)
        upper.setWidth(self._count.width())
        _draw_text(painter, upper, RIGHT, count, self._count_font, PARTICIPANT.text)
        _draw_text(
            painter,
            upper.translated(0, upper.height()),
            RIGHT,
            self._words.targets_reached,
            self._small,
            PARTICIPANT.text2,
        )


def _draw_text(painter: QPainter, place: QRectF, flags: int, text: str, face: QFont, colour: str) -> None:
    painter.setFont(face)
    painter.setPen(QColor(colour))
    painter.drawText(place, flags, text)
