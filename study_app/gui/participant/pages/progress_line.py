"""Where the participant is: part, setting and one short bar a setting, the same on every page."""

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.protocol.wording.languages import Words
from study_app.session.pages import Progress

BEGINNING = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)  # Qt mirrors it with the painter
BAR = (40.0, 6.0, 8.0)  # width, height, gap [logical px at scale 1]


def progress_words(progress: Progress, words: Words) -> tuple[str, str]:
    """Return "Part 2 of 2" and "Delay setting 3 of 7"; what is the only one of its kind is not counted."""
    counted = progress.part is not None and progress.parts > 1
    part = words.part.format(part=progress.part, parts=progress.parts) if counted else ""
    named = progress.label and progress.of > 1
    template = words.setting_at_most if progress.at_most else words.setting
    setting = template.format(label=progress.label, of=progress.of) if named else progress.label
    return part, setting


def draw_progress(
    painter: QPainter, room: QRectF, progress: Progress, words: Words, *, scale: float = 1.0, share: float = 0.5
) -> float:
    """Draw words and bars from the beginning of a line in ``room``; return the width [px].

    ``share`` is how much of the present bar is full: the task is its first half, the questionnaire its second. Bars
    that find no room are left out; the words say the same.
    """
    flip = words.right_to_left
    part, setting = progress_words(progress, words)
    x = 0.0
    painter.save()
    painter.setLayoutDirection(Qt.LayoutDirection.RightToLeft if flip else Qt.LayoutDirection.LeftToRight)
    for text, weight, colour in ((part, 600, PARTICIPANT.text), (setting, 400, PARTICIPANT.text2)):
        if not text:
            continue
        painter.setFont(font("statement", scale=scale, weight=weight))
        painter.setPen(QColor(colour))
        wide = QFontMetricsF(painter.font()).horizontalAdvance(text)
        painter.drawText(_from(room, x, wide + 2, room.height(), flip=flip), BEGINNING, text)
        x += wide + 14 * scale
    x += 10 * scale
    if progress.of > 1 and x + _bars_width(progress.of, scale) <= room.width():
        x = _draw_bars(painter, room, x, progress, scale=scale, share=share, flip=flip)
    painter.restore()
    return x


def _draw_bars(
    painter: QPainter, room: QRectF, x: float, progress: Progress, *, scale: float, share: float, flip: bool
) -> float:
    """Draw one bar a setting from ``x`` on; return where they end [px from the beginning]."""
    width, height, gap = (size * scale for size in BAR)
    painter.setPen(Qt.PenStyle.NoPen)
    for index in range(1, progress.of + 1):
        bar = _from(room, x, width, height, flip=flip)
        painter.setBrush(QColor(PARTICIPANT.text if index < progress.index else PARTICIPANT.sunk))
        painter.drawRoundedRect(bar, height / 2, height / 2)
        if index == progress.index and share > 0:
            painter.setBrush(QColor(PARTICIPANT.accent))
            full = _from(room, x, max(height, width * share), height, flip=flip)
            painter.drawRoundedRect(full, height / 2, height / 2)
        x += width + gap
    return x - gap


def _bars_width(count: int, scale: float) -> float:
    width, _, gap = (size * scale for size in BAR)
    return count * (width + gap) - gap


def _from(room: QRectF, x: float, width: float, height: float, *, flip: bool) -> QRectF:
    """Return a place ``x`` from where the line begins, in the middle of its height."""
    left = room.right() - x - width if flip else room.left() + x
    return QRectF(left, room.center().y() - height / 2, width, height)


class ProgressLine(QWidget):
    """The progress at the head of a page; empty, but as high, where a page has none."""

    def __init__(self, progress: Progress | None, words: Words, share: float, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._progress = progress
        self._words = words
        self._share = share
        self._scale = 1.0
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        if progress is not None:
            self.setAccessibleName(" · ".join(filter(None, progress_words(progress, words))))
        self.set_scale(1.0)

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        self._scale = scale
        self.setFixedHeight(round(QFontMetricsF(font("statement", scale=scale)).height()))
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self._progress is None:
            return
        painter = page_painter(self)
        draw_progress(painter, QRectF(self.rect()), self._progress, self._words, scale=self._scale, share=self._share)
        painter.end()
