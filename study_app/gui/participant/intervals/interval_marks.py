"""Which interval of a trial is presented: "1 of 2" and an outlined square for each, the current one filled."""

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPen

from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.protocol.wording.languages import Words
from study_app.session.pages import Interval

SQUARE = 16.0
GAP = 10.0


def interval_width(interval: Interval, words: Words, scale: float) -> float:
    """Return the width that words and squares take [px]."""
    return _words_width(interval, words, scale) + GAP * scale + interval.of * (SQUARE + GAP) * scale


def _words_width(interval: Interval, words: Words, scale: float) -> float:
    text = words.reached.format(reached=interval.number, of=interval.of)
    return QFontMetricsF(font("statement", scale=scale, weight=600)).horizontalAdvance(text) + 4


def draw_interval(
    painter: QPainter, width: float, middle: float, interval: Interval, words: Words, scale: float
) -> None:
    """Draw words and squares, centred in a page of ``width`` around the height ``middle`` [px].

    In a rest no square is filled; in a language that is read from right to left the first is on the right.
    """
    text = words.reached.format(reached=interval.number, of=interval.of)
    side, gap = SQUARE * scale, GAP * scale
    painter.save()
    painter.setFont(font("statement", scale=scale, weight=600))
    wide = _words_width(interval, words, scale)
    x = (width - interval_width(interval, words, scale)) / 2
    painter.setPen(QColor(PARTICIPANT.text))
    words_at = QRectF(x, middle - 20 * scale, wide, 40 * scale)
    if words.right_to_left:
        words_at.moveRight(width - x)
    painter.drawText(words_at, int(Qt.AlignmentFlag.AlignCenter), text)
    painter.setPen(QPen(QColor(PARTICIPANT.text), 2 * scale))
    for number in range(1, interval.of + 1):
        place = QRectF(x + wide + gap + (number - 1) * (side + gap), middle - side / 2, side, side)
        if words.right_to_left:
            place.moveRight(width - place.left())
        filled = number == interval.number and not interval.resting
        painter.setBrush(QColor(PARTICIPANT.text) if filled else Qt.BrushStyle.NoBrush)
        painter.drawRect(place)
    painter.restore()
