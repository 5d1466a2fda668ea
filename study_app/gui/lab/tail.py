"""The wake's tail as the tank draws it: segments on the screen, brighter and thicker the newer, with their breaks.

Everything here is places in px for one camera; ``tank`` paints it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPen, QPolygonF

from study_app.gui.lab.view import Floats, TailShown
from study_app.gui.tank.camera import Box, Camera
from study_app.gui.theme import TANK

SHADES = 14  # steps of age that are told apart
THICKEST_PX, THINNEST_PX = 5.0, 1.6
RING_PX = 4.6
HEAD_PX = 11.0
LEAST_FOR_HEAD_PX = 46.0  # of a segment's length on the screen


@dataclass(frozen=True, slots=True)
class TailPlaces:
    """Runs of one shade from the oldest to the newest, where segments begin, and an arrow head (place, turn) on each.

    ``floor`` is the tail's shadow, one path.
    """

    runs: tuple[tuple[int, QPolygonF], ...]
    breaks: tuple[QPointF, ...]
    heads: tuple[tuple[QPointF, float, int], ...]
    floor: QPainterPath


def tail_places(tail: TailShown, camera: Camera, box: Box) -> TailPlaces:
    """Return where a tail goes on the screen of ``camera``."""
    x, y, z = (np.clip(tail.positions_m[:, k], *span) for k, span in enumerate(_inside(box)))
    px, py = camera.point((x, y, z))  # type: ignore[arg-type]  # arithmetic alone: whole columns at once
    fx, fy = camera.point((x, np.full_like(x, box.floor), z))  # type: ignore[arg-type]
    shades = np.minimum((tail.ages * SHADES).astype(int), SHADES - 1)
    starts = np.flatnonzero(tail.breaks)
    bounds = [0, *(int(start) for start in starts if start), len(x)]
    floor = QPainterPath()
    runs: list[tuple[int, QPolygonF]] = []
    heads: list[tuple[QPointF, float, int]] = []
    for first, last in itertools.pairwise(bounds):
        span = slice(max(0, first - 1), last)  # a segment begins where the one before ended
        points = _points(np.asarray(px)[span], np.asarray(py)[span])
        runs += _runs(points, shades[span])
        floor.addPolygon(QPolygonF(_points(np.asarray(fx)[span], np.asarray(fy)[span])))
        head = _head(np.asarray(px)[span], np.asarray(py)[span])
        if head is not None:
            heads.append((*head, int(shades[(span.start + last - 1) // 2])))
    rings = tuple(QPointF(float(px[k - 1]), float(py[k - 1])) for k in bounds[1:-1])  # type: ignore[index]
    first_place = (QPointF(float(px[0]), float(py[0])),) if len(x) else ()  # type: ignore[index]
    return TailPlaces(tuple(runs), (*first_place, *rings), tuple(heads), floor)


def paint_floor(painter: QPainter, places: TailPlaces) -> None:
    """Paint the tail's shadow on the floor."""
    ink = QColor(TANK.shadow)
    ink.setAlphaF(0.44)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(_round(ink, 3.0))
    painter.drawPath(places.floor)


def paint_tail(painter: QPainter, places: TailPlaces) -> None:
    """Paint the segments from the oldest to the newest, a head on each that is long enough, then the breaks."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for shade, points in places.runs:
        ink, width = _look(shade)
        painter.setPen(_round(ink, width))
        painter.drawPolyline(points)
    for place, turn, shade in places.heads:
        ink, width = _look(shade)
        draw_head(painter, place, turn, ink.lighter(112), HEAD_PX + width)
    for place in places.breaks:
        draw_ring(painter, place)


def draw_ring(painter: QPainter, place: QPointF) -> None:
    """Paint the mark of a break."""
    painter.setPen(QPen(QColor(TANK.proxy_light), 2.0))
    painter.setBrush(QColor(TANK.shadow))
    painter.drawEllipse(place, RING_PX, RING_PX)


def draw_head(painter: QPainter, tip: QPointF, turn: float, ink: QColor, size: float) -> None:
    """Paint an arrow head whose middle is at ``tip``, pointing ``turn`` [rad] from the right, downwards."""
    corners = [(0.55, 0.0), (-0.45, 0.46), (-0.45, -0.46)]
    cos, sin = math.cos(turn), math.sin(turn)
    shape = QPolygonF([tip + QPointF(cos * u - sin * v, sin * u + cos * v) * size for u, v in corners])
    edge = QColor(TANK.shadow)
    edge.setAlphaF(0.55)
    painter.setPen(QPen(edge, 1.2, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin))
    painter.setBrush(ink)
    painter.drawPolygon(shape)


@lru_cache(maxsize=SHADES)
def _look(shade: int) -> tuple[QColor, float]:
    """Return colour and width of a step of age, 0 the newest."""
    newness = 1.0 - shade / (SHADES - 1)
    old, new, mix = QColor(TANK.tail_old), QColor(TANK.tail), newness**1.6
    red, green, blue = (
        a + (b - a) * mix
        for a, b in ((old.redF(), new.redF()), (old.greenF(), new.greenF()), (old.blueF(), new.blueF()))
    )
    ink = QColor.fromRgbF(red, green, blue, 0.55 + 0.45 * newness)
    return ink, THINNEST_PX + (THICKEST_PX - THINNEST_PX) * newness


def _runs(points: list[QPointF], shades: NDArray[np.int_]) -> list[tuple[int, QPolygonF]]:
    """Return the stretches of one shade, each beginning where the one before ends."""
    cuts = [0, *(int(cut) for cut in np.flatnonzero(np.diff(shades)) + 1), len(points) - 1]
    return [
        (int(shades[start]), QPolygonF(points[start : end + 1]))
        for start, end in itertools.pairwise(cuts)
        if end > start
    ]


def _head(px: Floats, py: Floats) -> tuple[QPointF, float] | None:
    """Return the middle of a segment's length and its direction there; None where it is too short for a head."""
    steps = np.hypot(np.diff(px), np.diff(py))
    length = float(steps.sum())
    if length < LEAST_FOR_HEAD_PX:
        return None
    k = int(np.searchsorted(np.cumsum(steps), 0.55 * length))
    back, ahead = max(0, k - 2), min(len(px) - 1, k + 2)
    turn = math.atan2(float(py[ahead] - py[back]), float(px[ahead] - px[back]))
    return QPointF(float(px[k]), float(py[k])), turn


def _points(px: Floats, py: Floats) -> list[QPointF]:
    return [QPointF(x, y) for x, y in zip(px.tolist(), py.tolist(), strict=True)]


def _round(ink: QColor, width: float) -> QPen:
    return QPen(ink, width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin)


def _inside(box: Box) -> tuple[tuple[float, float], ...]:
    return (-box.x, box.x), (box.floor, box.water), (-box.z, box.z)
