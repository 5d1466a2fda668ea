"""Named arrows from the ball in a tank: force, wake, velocity. Participants never see them."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPainterPath, QPen, QPolygonF

from study_app.gui.participant.tank.frame import Camera, Point
from study_app.gui.theme.theme import TANK, font

HEIGHTS = 0.55
"""Length of the longest arrow, in heights of the water."""
_LEAST_PX = 9.0
_NAME_PX = 18


class Arrow(NamedTuple):
    """A vector that starts at a point [m, hand], in metres of the tank, with its name and colour."""

    name: str
    start_m: Point
    vector_m: Point
    colour: str

    def ends(self, camera: Camera) -> tuple[QPointF, QPointF]:
        """Return both ends on the screen [px]."""
        x, y, z = (start + step for start, step in zip(self.start_m, self.vector_m, strict=True))
        return QPointF(*camera.point(self.start_m)), QPointF(*camera.point((x, y, z)))


def arrows_area(camera: Camera, arrows: Sequence[Arrow]) -> QRectF:
    """Return a rectangle around the arrows and their names [px]."""
    area = QRectF()
    for start, tip in (arrow.ends(camera) for arrow in arrows):
        area |= QRectF(start, tip).normalized()
    return area.adjusted(-110, -50, 110, 50) if arrows else area


def paint_arrows(painter: QPainter, camera: Camera, arrows: Sequence[Arrow]) -> None:
    """Paint arrows and, on top, their names; arrows too short to show a direction are omitted."""
    last_area, visible = QRectF(), []
    for arrow in arrows:
        start, tip = arrow.ends(camera)
        direction = tip - start
        length, ink = math.hypot(direction.x(), direction.y()), QColor(arrow.colour)
        if length < _LEAST_PX:
            continue
        visible.append((arrow, tip, direction, length))
        for colour, width in ((QColor(TANK.shadow), 6.0), (ink, 3.2)):
            painter.setPen(QPen(colour, width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
            painter.drawLine(start, tip - direction * (5.0 / length))
        draw_head(painter, tip, math.atan2(direction.y(), direction.x()), ink, 13.0)
    for arrow, tip, direction, length in visible:
        ratio = painter.device().devicePixelRatio()
        name_image = _name_image(arrow.name, arrow.colour, ratio)
        wide = name_image.width() / ratio
        middle = tip + direction * ((12.0 + wide / 2) / length)
        area = QRectF(middle.x() - wide / 2, middle.y() - _NAME_PX / 2, wide, _NAME_PX)
        if area.intersects(last_area):
            area.moveTop(
                last_area.bottom() + 2 if middle.y() >= last_area.center().y() else last_area.top() - _NAME_PX - 2
            )
        painter.drawImage(area.topLeft(), name_image)
        last_area = area


def draw_head(painter: QPainter, tip: QPointF, angle: float, ink: QColor, size: float) -> None:
    """Paint an arrow head centred at ``tip``, pointing ``angle`` [rad] clockwise from the right."""
    corners = [(0.55, 0.0), (-0.45, 0.46), (-0.45, -0.46)]
    cos, sin = math.cos(angle), math.sin(angle)
    shape = QPolygonF([tip + QPointF(cos * u - sin * v, sin * u + cos * v) * size for u, v in corners])
    edge = QColor(TANK.shadow)
    edge.setAlphaF(0.55)
    painter.setPen(QPen(edge, 1.2, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin))
    painter.setBrush(ink)
    painter.drawPolygon(shape)


@lru_cache(maxsize=16)
def _name_image(word: str, colour: str, ratio: float) -> QImage:
    """Return an image of a word with a dark outline, for a screen with pixel ratio ``ratio``."""
    name_font = font("label", weight=600)
    width = QFontMetricsF(name_font).horizontalAdvance(word) + 4
    image = QImage(math.ceil(width * ratio), math.ceil(_NAME_PX * ratio), QImage.Format.Format_ARGB32_Premultiplied)
    image.setDevicePixelRatio(ratio)
    image.fill(Qt.GlobalColor.transparent)
    letters = QPainterPath()
    letters.addText(2, _NAME_PX - 4.5, name_font, word)
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.strokePath(letters, QPen(QColor(TANK.shadow), 2.6))
    painter.fillPath(letters, QColor(colour))
    painter.end()
    return image
