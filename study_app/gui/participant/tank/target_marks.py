"""The marks of a target on the tank's floor, and the line of dots below it."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPainter, QPen

from study_app.gui.participant.tank import sprites
from study_app.gui.participant.tank.frame import TargetPlace
from study_app.gui.theme.theme import TANK


def paint_marks(painter: QPainter, target: TargetPlace, stroke: float, *, is_lit: bool) -> None:
    """Paint them with lines that follow the width of a ``stroke`` [px]."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    ink = QColor(TANK.lit if is_lit else TANK.dim)
    ink.setAlphaF(0.62 if is_lit else 0.55)
    if is_lit:
        painter.setPen(QPen(ink, stroke * 0.36))
        painter.drawPolygon(target.circle)
        return
    thin = stroke * 0.3
    points = target.diamond.toList()
    for start, end in zip(points, points[1:] + points[:1], strict=True):
        along = end - start
        painter.setPen(sprites.dashes(ink, thin, (along.x() ** 2 + along.y() ** 2) ** 0.5, 4))
        painter.drawLine(start, end)
    ink.setAlphaF(0.45)
    painter.setPen(QPen(ink, thin, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
    painter.drawPoints(target.feet)
