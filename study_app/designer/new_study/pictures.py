"""Pictures of the templates: what a participant feels or answers, drawn in the tank's colours."""

import math
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QLinearGradient, QPainter, QPainterPath, QPen, QRadialGradient

from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CARD, TANK, font

DEEP: Final = "#142E40"
LINE: Final = "#62B5EA"


def paint_picture(painter: QPainter, name: str, body: QRectF) -> None:
    """Paint the picture of a template into the upper part of its card."""
    ground = QPainterPath()
    ground.addRoundedRect(body.adjusted(0, 0, 0, RADIUS_CARD), RADIUS_CARD, RADIUS_CARD)
    painter.save()
    painter.setClipRect(body)
    painter.setPen(Qt.PenStyle.NoPen)
    if name == "questionnaire-only":
        painter.fillPath(ground, QColor(PARTICIPANT.window))
    else:
        water = QLinearGradient(body.topLeft(), body.bottomLeft())
        water.setColorAt(0, QColor(TANK.water_light))
        water.setColorAt(1, QColor(DEEP))
        painter.fillPath(ground, water)
        for high, depth in ((0.12, 2.2), (0.17, 1.6)):
            _stroke(painter, _wave(body, high, depth), QColor(TANK.glass), 1.0, 70)
    scale = min(body.width() / 340, body.height() / 180)
    painter.translate(body.center().x() - 170 * scale, body.center().y() - 95 * scale)
    painter.scale(scale, scale)
    PICTURES.get(name, _liquids)(painter)
    painter.restore()


def _wave(body: QRectF, high: float, depth: float) -> QPainterPath:
    path, y = QPainterPath(), body.top() + high * body.height()
    path.moveTo(body.left(), y)
    for step in range(1, 61):
        x = step / 60
        path.lineTo(body.left() + x * body.width(), y + depth * math.sin(2 * math.pi * 3 * x))
    return path


def _stroke(painter: QPainter, path: QPainterPath, colour: QColor, width: float, alpha: int = 255) -> None:
    colour.setAlpha(alpha)
    pen = QPen(colour, width)
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(pen)
    painter.drawPath(path)


def _ball(painter: QPainter, x: float, y: float, radius: float = 11) -> None:
    light = QRadialGradient(QPointF(x - radius / 3, y - radius / 3), radius * 1.4)
    light.setColorAt(0, QColor(TANK.proxy_light))
    light.setColorAt(1, QColor(TANK.proxy))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(light)
    painter.drawEllipse(QPointF(x, y), radius, radius)


def _words(painter: QPainter, x: float, y: float, words: str) -> None:
    painter.setPen(QColor(TANK.lit))
    painter.setFont(font("small", weight=500))
    painter.drawText(QRectF(x - 60, y - 9, 120, 18), Qt.AlignmentFlag.AlignCenter, words)


def _path(x: float, y: float, length: float, swings: float, high: float) -> QPainterPath:
    """Return the way of a ball that ends at a place, with swings that become smaller toward it."""
    path = QPainterPath()
    for step in range(41):
        share = step / 40
        up = high * (1 - 0.6 * share) * math.sin(math.pi * swings * (1 - share))
        point = QPointF(x - length * (1 - share), y - up)
        path.moveTo(point) if step == 0 else path.lineTo(point)
    return path


def _liquids(painter: QPainter) -> None:
    for number, (swings, high) in enumerate(((3.0, 26.0), (1.6, 14.0), (0.8, 8.0))):
        x = 78 + 113 * number
        _stroke(painter, _path(x, 104, 62, swings, high), QColor(TANK.tail), 2.4 + number, 200)
        _ball(painter, x, 104)
        _words(painter, x - 40, 158, f"L{number + 1}")
    painter.setPen(QPen(QColor(255, 255, 255, 50), 1))
    for between in (113.0, 226.0):
        painter.drawLine(QPointF(between, 70), QPointF(between, 165))


def _function(painter: QPainter) -> None:
    curve = QPainterPath()
    for step in range(61):
        x = step / 60
        point = QPointF(30 + 280 * x, 150 - 72 * (1 - math.exp(-3.2 * x**1.3)))
        curve.moveTo(point) if step == 0 else curve.lineTo(point)
    _stroke(painter, curve, QColor(LINE), 3)
    painter.setPen(QPen(QColor(255, 255, 255, 90), 1))
    painter.drawLine(QPointF(30, 152), QPointF(310, 152))
    painter.setPen(QPen(QColor(TANK.lit), 1.2, Qt.PenStyle.DashLine))
    painter.drawLine(QPointF(30, 113), QPointF(112, 113))
    painter.drawLine(QPointF(112, 113), QPointF(112, 152))
    for x, y in ((48, 146), (72, 128), (96, 122), (126, 96), (164, 92), (214, 78), (270, 79)):
        _ball(painter, x, y, 5)
    painter.setPen(QPen(QColor(TANK.lit), 2.5))
    painter.setBrush(QColor(DEEP))
    painter.drawEllipse(QPointF(112, 113), 6, 6)


def _delay(painter: QPainter) -> None:
    _stroke(painter, _path(150, 98, 120, 0.7, -26), QColor(TANK.tail), 3.4, 200)
    _ball(painter, 150, 98, 13)
    painter.setPen(QPen(QColor(TANK.proxy_light), 1.8, Qt.PenStyle.DashLine))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawEllipse(QPointF(246, 116), 13, 13)
    painter.setPen(QPen(QColor(TANK.lit), 1.6))
    painter.drawLine(QPointF(150, 148), QPointF(246, 148))
    painter.setPen(QPen(QColor(255, 255, 255, 110), 1))
    painter.drawLine(QPointF(150, 114), QPointF(150, 148))
    painter.drawLine(QPointF(246, 132), QPointF(246, 148))
    _words(painter, 150, 162, "seen")
    _words(painter, 246, 162, "felt")


def _slider(painter: QPainter) -> None:
    _stroke(painter, _path(176, 92, 116, 1.4, 18), QColor(TANK.tail), 3.2, 200)
    _ball(painter, 176, 92, 12)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(PARTICIPANT.sunk))
    painter.drawRoundedRect(QRectF(36, 134, 268, 6), 3, 3)
    painter.setBrush(QColor(LINE))
    painter.drawRoundedRect(QRectF(36, 134, 196, 6), 3, 3)
    painter.setPen(QPen(QColor(DEEP), 2))
    painter.drawEllipse(QPointF(232, 137), 10, 10)
    _words(painter, 58, 160, "not at all")
    _words(painter, 272, 160, "like the real one")


def _cells(painter: QPainter) -> None:
    for row, chosen in enumerate((5, 2, 6)):
        y = 40 + 46 * row
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(PARTICIPANT.sunk))
        painter.drawRoundedRect(QRectF(22, y, (94, 112, 80)[row], 8), 4, 4)
        for cell in range(7):
            place = QRectF(150 + 25 * cell, y - 8, 20, 24)
            painter.setPen(QPen(QColor(LINE if cell == chosen else PARTICIPANT.ctl), 1.2))
            painter.setBrush(QColor(LINE) if cell == chosen else QColor(PARTICIPANT.surface))
            rounding = 10 if cell == chosen else 4
            painter.drawRoundedRect(place, rounding, rounding)


PICTURES: Final[dict[str, Callable[[QPainter], None]]] = {
    "compare-liquids": _liquids,
    "viscosity-jnd": _function,
    "delay-detection": _delay,
    "rate-realism": _slider,
    "questionnaire-only": _cells,
}
"""The picture of each template; one without a picture of its own has that of liquids."""
