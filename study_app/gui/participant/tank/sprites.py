"""Sprites of the tank, drawn at sub-pixel positions so that slow motion is smooth."""

import math
from dataclasses import dataclass
from functools import lru_cache

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QLinearGradient, QPainter, QPainterPath, QPen, QRadialGradient

from study_app.gui.theme.theme import TANK

GLOW = 1.55  # reach of the lit ring's light, in radii
_TICK = (1.18, 1.32)  # inner and outer end of a ring's tick, in radii
SOFT = 1.5  # reach of a shadow, in radii of the ball


@dataclass(frozen=True, slots=True)
class Sprite:
    """An image and the half extents of its rectangle around a centre [logical px]."""

    image: QImage
    half_width: float
    half_height: float

    def place(self, middle: QPointF, scale: float = 1.0) -> QRectF:
        """Return the sprite's rectangle around ``middle``."""
        width, height = scale * self.half_width, scale * self.half_height
        return QRectF(middle.x() - width, middle.y() - height, 2 * width, 2 * height)


def _empty_sprite(half_width: float, half_height: float, ratio: float) -> tuple[Sprite, QPainter]:
    """Return an empty sprite with a margin for its edge, and a painter with the origin at its centre."""
    half_columns, half_rows = math.ceil(half_width * ratio) + 1, math.ceil(half_height * ratio) + 1
    image = QImage(2 * half_columns, 2 * half_rows, QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.translate(half_columns, half_rows)
    painter.scale(ratio, ratio)
    return Sprite(image, half_columns / ratio, half_rows / ratio), painter


def _colour_with_alpha(colour: str, alpha: float = 1.0) -> QColor:
    ink = QColor(colour)
    ink.setAlphaF(alpha)
    return ink


@lru_cache(maxsize=256)
def ball_sprite(radius: float, ratio: float, haze: float) -> Sprite:
    """Return the proxy of ``radius`` [logical px]; ``haze`` in 0 … 1 grows with the water in front of it."""
    sprite, painter = _empty_sprite(radius, radius, ratio)
    painter.scale(radius, radius)
    disc = QRectF(-1, -1, 2, 2)
    body = QRadialGradient(QPointF(0, 0), 1.25, QPointF(-0.34, -0.42))
    for place, colour in (
        (0, "#FFD58C"),
        (0.28, TANK.proxy_light),
        (0.56, TANK.proxy),
        (0.86, "#A85C14"),
        (1, "#6E3A0A"),
    ):
        body.setColorAt(place, QColor(colour))
    painter.setBrush(body)
    painter.drawEllipse(disc)
    bounce = QRadialGradient(QPointF(0.02, 0.78), 0.62)
    bounce.setColorAt(0, _colour_with_alpha("#BFD3D8", 0.34))
    bounce.setColorAt(1, _colour_with_alpha("#BFD3D8", 0))
    painter.setBrush(bounce)
    painter.drawEllipse(disc)
    _paint_rim(painter)
    painter.save()
    painter.translate(-0.33, -0.42)
    painter.rotate(-36)
    painter.scale(0.34, 0.22)
    shine = QRadialGradient(QPointF(0, 0), 1)
    for place, alpha in ((0, 0.95), (0.3, 0.72), (0.65, 0.22), (1, 0)):
        shine.setColorAt(place, _colour_with_alpha("#FFFFFF", alpha))
    painter.setBrush(shine)
    painter.drawEllipse(QRectF(-1, -1, 2, 2))
    painter.restore()
    painter.setBrush(_colour_with_alpha(TANK.water_light, 0.20 * haze))
    painter.drawEllipse(disc)
    painter.end()
    return sprite


def _paint_rim(painter: QPainter) -> None:
    """Paint the reflection of the floor on the ball's lower edge."""
    along = QLinearGradient(-0.85, 0, 0.75, 0)
    for place, alpha in ((0, 0), (0.3, 0.62), (0.6, 0.5), (1, 0)):
        along.setColorAt(place, _colour_with_alpha("#FFD9A6", alpha))
    painter.setPen(QPen(along, 0.035, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawArc(QRectF(-0.965, -0.965, 1.93, 1.93), 200 * 16, 115 * 16)
    painter.setPen(Qt.PenStyle.NoPen)


@lru_cache(maxsize=256)
def shadow_sprite(radius: float, ratio: float, flat: float) -> Sprite:
    """Return the shadow of a ball of ``radius`` [logical px]; ``flat`` is its ratio of height to width."""
    reach = SOFT * radius
    sprite, painter = _empty_sprite(reach, reach * flat, ratio)
    painter.scale(reach, reach * flat)
    dark = QRadialGradient(QPointF(0, 0), 1)
    for place, alpha in ((0, 0.78), (0.38, 0.62), (0.68, 0.24), (1, 0)):
        dark.setColorAt(place, _colour_with_alpha(TANK.shadow, alpha))
    painter.setBrush(dark)
    painter.drawEllipse(QRectF(-1, -1, 2, 2))
    painter.end()
    return sprite


@lru_cache(maxsize=16)
def ring_sprite(radius: float, ratio: float, stroke: float) -> Sprite:
    """Return the lit target without its dwell arc: light, track and four ticks."""
    reach = GLOW * radius
    sprite, painter = _empty_sprite(reach, reach, ratio)
    glow = QRadialGradient(QPointF(0, 0), reach)
    for place, alpha in ((0, 0.07), (0.5, 0.13), (0.655, 0.42), (0.72, 0.30), (0.86, 0.10), (1, 0)):
        glow.setColorAt(place, _colour_with_alpha("#CFE9F7", alpha))
    painter.setBrush(glow)
    painter.drawEllipse(QPointF(0, 0), reach, reach)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QPen(_colour_with_alpha(TANK.lit, 0.22), stroke * 1.5))
    painter.drawEllipse(QPointF(0, 0), radius, radius)
    painter.setPen(QPen(_colour_with_alpha("#A9D3E8", 0.78), stroke * 0.8))
    painter.drawEllipse(QPointF(0, 0), radius, radius)
    painter.setPen(QPen(_colour_with_alpha(TANK.lit, 0.92), stroke * 0.42))
    for quarter in range(4):
        angle = math.pi / 4 + quarter * math.pi / 2
        inner, outer = (QPointF(radius * r * math.cos(angle), radius * r * math.sin(angle)) for r in _TICK)
        painter.drawLine(inner, outer)
    painter.end()
    return sprite


@lru_cache(maxsize=32)
def diamond_sprite(radius: float, ratio: float, stroke: float) -> Sprite:
    """Return a target that is not lit: a dashed diamond with half diagonal ``radius`` [logical px]."""
    reach = radius + 2 * stroke
    sprite, painter = _empty_sprite(reach, reach, ratio)
    corners = [QPointF(0, -radius), QPointF(radius, 0), QPointF(0, radius), QPointF(-radius, 0)]
    path = QPainterPath(corners[0])
    for corner in (*corners[1:], corners[0]):
        path.lineTo(corner)
    painter.setPen(dashed_pen(_colour_with_alpha(TANK.dim, 0.86), stroke, math.hypot(radius, radius), 6))
    painter.drawPath(path)
    painter.end()
    return sprite


def dashed_pen(ink: QColor, stroke: float, side: float, count: int) -> QPen:
    """Return a pen with ``count`` dashes per side [px], with half a dash at both ends."""
    pen = QPen(ink, stroke, Qt.PenStyle.CustomDashLine, Qt.PenCapStyle.FlatCap, Qt.PenJoinStyle.MiterJoin)
    period = side / (count * stroke)
    pen.setDashPattern([period * 0.64, period * 0.36])
    pen.setDashOffset(period * 0.32)
    return pen


def draw_sprite(
    painter: QPainter, sprite: Sprite, middle: QPointF, *, opacity: float = 1.0, scale: float = 1.0
) -> None:
    """Draw a sprite around ``middle``, which may be between pixels, at ``scale`` times its size."""
    painter.setOpacity(opacity)
    painter.drawImage(sprite.place(middle, scale), sprite.image)
    painter.setOpacity(1.0)
