"""The wake's tail as the tank draws it: segments on the screen, brighter and thicker the newer, with their breaks.

Everything here is places in px for one camera; ``tank`` paints it.
"""

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from study_app.gui.participant.tank.camera import Box, Camera
from study_app.gui.theme.theme import TANK
from study_app.lab.wake_tail import Tail
from study_app.viewmodels.lab import Floats

SHADES = 14  # steps of age that are distinguished
THICKEST_PX, THINNEST_PX = 5.0, 1.6
RING_PX = 4.6
HEAD_PX = 11.0
STEP_PX = 2.5
LEAST_FOR_HEAD_PX = 46.0  # of a segment's length on the screen


@dataclass(frozen=True, slots=True)
class TailPlaces:
    """Runs of one shade from the oldest to the newest, where segments begin, and an arrow head (place, turn) on each.

    ``floor`` is the tail's shadow.
    """

    runs: tuple[tuple[int, QPolygonF], ...]
    breaks: tuple[QPointF, ...]
    heads: tuple[tuple[QPointF, float, int], ...]
    floor: tuple[QPolygonF, ...]


def tail_places(tail: Tail, camera: Camera, box: Box) -> TailPlaces:
    """Return where a tail goes on the screen of ``camera``."""
    count = len(tail.positions_m)
    x, y, z = (np.clip(tail.positions_m[:, k], *span) for k, span in enumerate(_inside(box)))
    pixels = _pixels(camera, x, y, z)
    floor = _pixels(camera, x, np.full(count, box.floor), z)
    shades = np.minimum((tail.ages * SHADES).astype(int), SHADES - 1)
    bounds = [0, *(int(start) for start in np.flatnonzero(tail.breaks) if start), count]
    runs: list[tuple[int, QPolygonF]] = []
    shadows: list[QPolygonF] = []
    heads: list[tuple[QPointF, float, int]] = []
    for first, behind in itertools.pairwise(bounds if count else ()):
        rows = np.arange(max(0, first - 1), behind)  # a segment begins where the one before ended
        rows = rows[_kept(pixels[rows])]
        runs += _runs(_points(pixels[rows]), shades[rows])
        shadows.append(QPolygonF(_points(floor[rows])))
        head = _head(pixels[rows])
        if head is not None:
            place, turn, row = head
            heads.append((place, turn, int(shades[rows[row]])))
    begins = [0, *(bound - 1 for bound in bounds[1:-1])] if count else []
    return TailPlaces(tuple(runs), tuple(_points(pixels[begins])), tuple(heads), tuple(shadows))


def paint_floor(painter: QPainter, places: TailPlaces) -> None:
    """Paint the tail's shadow on the floor."""
    ink = QColor(TANK.shadow)
    ink.setAlphaF(0.44)
    painter.setPen(QPen(ink, 3.0, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap, Qt.PenJoinStyle.BevelJoin))
    for points in places.floor:
        painter.drawPolyline(points)


def paint_tail(painter: QPainter, places: TailPlaces) -> None:
    """Paint the segments from the oldest to the newest, a head on each that is long enough, then the breaks."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for shade, points in places.runs:
        ink, width = shade_style(shade)
        painter.setPen(QPen(ink, width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin))
        painter.drawPolyline(points)
    for place, turn, shade in places.heads:
        ink, width = shade_style(shade)
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
def shade_style(shade: int) -> tuple[QColor, float]:
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


def _head(pixels: Floats) -> tuple[QPointF, float, int] | None:
    """Return the middle of a segment's length, its direction there, and the row; None where it is too short."""
    steps = np.hypot(*np.diff(pixels, axis=0).T)
    length = float(steps.sum())
    if length < LEAST_FOR_HEAD_PX:
        return None
    row = int(np.searchsorted(np.cumsum(steps), 0.55 * length))
    right, down = pixels[min(len(pixels) - 1, row + 1)] - pixels[max(0, row - 1)]
    return QPointF(*pixels[row].tolist()), math.atan2(down, right), row


def _kept(pixels: Floats) -> NDArray[np.int_]:
    """Return the rows that are drawn: both ends, and one in every few px between."""
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(pixels, axis=0).T))])
    kept = np.flatnonzero(np.diff(np.floor(arc / STEP_PX), prepend=-1.0))
    return np.unique(np.append(kept, len(pixels) - 1))


def _pixels(camera: Camera, x: Floats, y: Floats, z: Floats) -> Floats:
    """Return where points, a column each, fall on the screen: (n, 2) px."""
    place: Any = camera.point((x, y, z))  # type: ignore[arg-type]  # arithmetic alone: whole columns at once
    return np.column_stack(place)


def _points(pixels: Floats) -> list[QPointF]:
    return [QPointF(across, down) for across, down in pixels.tolist()]


def _inside(box: Box) -> tuple[tuple[float, float], ...]:
    return (-box.x, box.x), (box.floor, box.water), (-box.z, box.z)
