"""Where the participant is: part, setting and one short bar a setting, the same on every page."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.theme import PARTICIPANT, font
from study_app.protocol.words import Words
from study_app.session.pages import Progress

BAR = (40.0, 6.0, 8.0)  # width, height, gap [logical px at scale 1]


def progress_words(progress: Progress, words: Words) -> tuple[str, str]:
    """Return "Part 2 of 2" and "Delay setting 3 of 7"; what is the only one of its kind is not counted."""
    part = words.part.format(part=progress.part, parts=progress.parts) if progress.parts > 1 else ""
    setting = words.setting.format(label=progress.label, of=progress.of) if progress.of > 1 else progress.label
    return part, setting


def draw_progress(
    painter: QPainter, place: QPointF, progress: Progress, words: Words, *, scale: float = 1.0, share: float = 0.5
) -> float:
    """Draw words and bars from ``place`` (left end of the base line); return the width [px].

    ``share`` is how much of the present bar is full: the task is its first half, the questionnaire its second.
    """
    x = place.x()
    part, setting = progress_words(progress, words)
    for text, weight, colour in ((part, 600, PARTICIPANT.text), (setting, 400, PARTICIPANT.text2)):
        if not text:
            continue
        painter.setFont(font("statement", scale=scale, weight=weight))
        painter.setPen(QColor(colour))
        painter.drawText(QPointF(x, place.y()), text)
        x += QFontMetricsF(painter.font()).horizontalAdvance(text) + 14 * scale
    width, height, gap = (size * scale for size in BAR)
    x += 10 * scale
    top = place.y() - 5.5 * scale - height / 2
    painter.setPen(Qt.PenStyle.NoPen)
    if progress.of == 1:
        return x - place.x()
    for index in range(1, progress.of + 1):
        bar = QRectF(x, top, width, height)
        painter.setBrush(QColor(PARTICIPANT.text if index < progress.index else PARTICIPANT.sunk))
        painter.drawRoundedRect(bar, height / 2, height / 2)
        if index == progress.index and share > 0:
            painter.setBrush(QColor(PARTICIPANT.accent))
            bar.setWidth(max(height, width * share))
            painter.drawRoundedRect(bar, height / 2, height / 2)
        x += width + gap
    return x - gap - place.x()


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

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802
        """Draw words and bars."""
        if self._progress is None:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        base = QFontMetricsF(font("statement", scale=self._scale)).ascent()
        draw_progress(painter, QPointF(0, base), self._progress, self._words, scale=self._scale, share=self._share)
        painter.end()
