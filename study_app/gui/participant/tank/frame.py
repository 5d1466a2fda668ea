"""One frame of the tank as values: what is drawn where, and which places differ from the frame before.

A frame is a table from the name of a thing to (state, place). Two frames with equal states look equal there, so that
only the places of things whose state changed are painted anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF, QRegion

from study_app.gui.participant.tank import sprites
from study_app.gui.theme.theme import TANK

Point: TypeAlias = tuple[float, float, float]
_Pixel: TypeAlias = tuple[float, float]

_PITCH = math.radians(14.4)
_DISTANCE = 3.3  # from the eye to the middle of the glass, in heights of the water beyond half the depth
_LEAST_WIDTH = 2.05  # of the water, in its heights: a tank looks like a tank
_LEAST_DEPTH = 1.2
_GLASS_ABOVE = 0.13  # of the water's height
_MARGIN_M = 0.0025  # between ball and glass


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """The inner dimensions of the tank: half width, floor, water level, glass edge, half depth [m]."""

    x: float
    floor: float
    water: float
    top: float
    z: float

    @classmethod
    def around(cls, workspace_m: Point, ball_m: float) -> Box:
        """Return the tank in which a ball of radius ``ball_m`` can reach the whole workspace (full sizes)."""
        spare = 2 * (ball_m + _MARGIN_M)
        width, height, depth = (size + spare for size in workspace_m)
        return cls(
            x=max(width, _LEAST_WIDTH * height) / 2,
            floor=-height / 2,
            water=height / 2,
            top=height * (0.5 + _GLASS_ABOVE),
            z=max(depth, _LEAST_DEPTH * height) / 2,
        )

    def corners(self) -> tuple[Point, ...]:
        return tuple((x, y, z) for x in (-self.x, self.x) for y in (self.floor, self.top) for z in (-self.z, self.z))


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A pinhole camera at (0, ``eye_y``, ``eye_z``) [m], pitched down by ``pitch`` [rad].

    ``focal`` and ``centre`` are in px.
    """

    eye_y: float
    eye_z: float
    focal: float
    centre_x: float
    centre_y: float
    pitch: float = _PITCH

    @classmethod
    def fitted(cls, box: Box, left: float, top: float, width: float, height: float, *, pitch: float = _PITCH) -> Camera:
        """Return the camera that shows the whole box centred and as large as the rectangle allows [px]."""
        middle = (box.top + box.floor) / 2
        distance = _DISTANCE * (box.water - box.floor) + box.z
        eye_y = middle + math.sin(pitch) * distance
        eye_z = math.cos(pitch) * distance
        bare = cls(eye_y=eye_y, eye_z=eye_z, focal=1.0, centre_x=0.0, centre_y=0.0, pitch=pitch)
        pixels = [bare.point(corner) for corner in box.corners()]
        xs, ys = [x for x, _ in pixels], [y for _, y in pixels]
        focal = min(width / (max(xs) - min(xs)), height / (max(ys) - min(ys)))
        return cls(
            eye_y=eye_y,
            eye_z=eye_z,
            focal=focal,
            centre_x=left + width / 2 - focal * (max(xs) + min(xs)) / 2,
            centre_y=top + height / 2 - focal * (max(ys) + min(ys)) / 2,
            pitch=pitch,
        )

    def distance(self, point: Point) -> float:
        """Return the distance of a point from the eye along the line of sight [m]."""
        _, y, z = point
        return (self.eye_y - y) * math.sin(self.pitch) + (self.eye_z - z) * math.cos(self.pitch)

    def scale(self, point: Point) -> float:
        return self.focal / self.distance(point)

    def point(self, point: Point) -> _Pixel:
        """Return the screen position of a point [px]."""
        x, y, z = point
        up = (y - self.eye_y) * math.cos(self.pitch) - (z - self.eye_z) * math.sin(self.pitch)
        scale = self.scale(point)
        return self.centre_x + scale * x, self.centre_y - scale * up


DEPTH_STEPS = 64
_MARK = 0.8  # a target's mark on the floor, in radii of the target
_PLUMB_HALF_PX = 3.0


class TaskShown(Protocol):
    """The drawn properties of a task (see ``session.tasks.TaskView``)."""

    @property
    def lit(self) -> int | None: ...
    @property
    def reached(self) -> int: ...
    @property
    def of(self) -> int | None: ...
    @property
    def dwell(self) -> float: ...
    @property
    def elapsed_s(self) -> float: ...
    @property
    def target_m(self) -> Point | None: ...


@dataclass(frozen=True, slots=True)
class Placed:
    """A drawn part whose appearance follows from ``state``, within ``place`` [px]."""

    state: object
    place: QRectF


@dataclass(frozen=True, slots=True, kw_only=True)
class BallPlace:
    """The drawn place of the proxy: centre, radius by depth step, haze, and the floor below it [px]."""

    middle: QPointF
    radius: float
    haze: float
    depth_m: float
    floor: QPointF
    floor_radius: float  # by depth step
    floor_flat: float
    spread: float  # of the shadow: wider and fainter the higher the ball
    shade: float
    feet: tuple[QPointF, ...]  # dots of the plumb line, from the floor up


@dataclass(frozen=True, slots=True)
class TargetPlace:
    """The drawn place of a target: centre, radius, its marks on the floor (circle, diamond) and below it [px]."""

    middle: QPointF
    radius: float
    depth_m: float
    circle: QPolygonF
    diamond: QPolygonF
    feet: tuple[QPointF, ...]

    @property
    def place(self) -> QRectF:
        """Return the square around ring, ticks and light."""
        reach = self.radius * sprites.GLOW + 4
        return QRectF(self.middle.x() - reach, self.middle.y() - reach, 2 * reach, 2 * reach)

    @property
    def marks(self) -> QRectF:
        """Return the rectangle around the marks on the floor and the line above them."""
        above = QRectF(self.middle, self.circle.boundingRect().center()).normalized().adjusted(-4, 0, 4, 0)
        return self.circle.boundingRect().united(self.diamond.boundingRect()).united(above).adjusted(-3, -3, 3, 3)


def target_place(camera: Camera, box: Box, centre: Point, radius_m: float) -> TargetPlace:
    """Return the drawn place of a target of ``radius_m`` around ``centre`` [m, hand]."""
    x, _, z = centre
    reach = _MARK * radius_m
    circle = [
        (x + reach * math.cos(turn), box.floor, z + reach * math.sin(turn))
        for turn in (math.tau * step / 48 for step in range(48))
    ]
    corners = [
        (x - reach, box.floor, z),
        (x, box.floor, z - reach),
        (x + reach, box.floor, z),
        (x, box.floor, z + reach),
    ]
    middle = QPointF(*camera.point(centre))
    radius = radius_m * camera.scale(centre)
    return TargetPlace(
        middle=middle,
        radius=radius,
        depth_m=camera.distance(centre),
        circle=QPolygonF([QPointF(*camera.point(point)) for point in circle]),
        diamond=QPolygonF([QPointF(*camera.point(point)) for point in corners]),
        feet=_plumb_dots(QPointF(*camera.point((x, box.floor, z))), middle + QPointF(0, radius), 9.0),
    )


class BallPlacer:
    """Computes the ball's drawn place; its size changes in depth steps, one sprite each."""

    def __init__(self, camera: Camera, box: Box, radius_m: float) -> None:
        self._camera, self._box, self._radius_m = camera, box, radius_m
        nearest = camera.distance((0, box.water, box.z))
        farthest = camera.distance((0, box.floor, -box.z))
        self._nearest, self._step = nearest, (farthest - nearest) / (DEPTH_STEPS - 1)

    def size(self, step: int) -> tuple[float, float]:
        """Return radius [px] and haze of a depth step, 0 the nearest."""
        distance = self._nearest + step * self._step
        return self._radius_m * self._camera.focal / distance, step / (DEPTH_STEPS - 1)

    def step(self, point: Point) -> int:
        nearness = (self._camera.distance(point) - self._nearest) / self._step
        return min(max(round(nearness), 0), DEPTH_STEPS - 1)

    def place(self, position_m: Point) -> BallPlace:
        """Return the drawn place of a ball at ``position_m`` [m, hand]; it stays inside the glass."""
        box, spare = self._box, self._radius_m
        x, y, z = position_m
        x = min(max(x, -box.x + spare), box.x - spare)
        y = min(max(y, box.floor + spare), box.water)
        z = min(max(z, -box.z + spare), box.z - spare)
        radius, haze = self.size(self.step((x, y, z)))
        middle = QPointF(*self._camera.point((x, y, z)))
        floor = QPointF(*self._camera.point((x, box.floor, z)))
        near = self._camera.point((x, box.floor, z + spare))[1]
        far = self._camera.point((x, box.floor, z - spare))[1]
        step = self.step((x, box.floor, z))
        floor_radius, _ = self.size(step)
        height = (y - box.floor) / (box.water - box.floor)
        return BallPlace(
            middle=middle,
            radius=radius,
            haze=haze,
            depth_m=self._camera.distance((x, y, z)),
            floor=floor,
            floor_radius=floor_radius,
            floor_flat=round((near - far) / (2 * floor_radius), 2),
            spread=1.15 + 0.35 * height,
            shade=0.98 - 0.42 * height,
            feet=_plumb_dots(floor, middle + QPointF(0, radius), 11.0),
        )


def _plumb_dots(floor: QPointF, end: QPointF, pitch: float) -> tuple[QPointF, ...]:
    """Return dots from the floor up to ``end``, ``pitch`` px apart, whose positions do not depend on the ball."""
    along = end - floor
    length = math.hypot(along.x(), along.y())
    return (
        tuple(floor + along * (pitch * step / length) for step in range(int((length - 4) / pitch) + 1))
        if length
        else ()
    )


def ball_parts(ball: BallPlace) -> dict[str, Placed]:
    """Return ball, shadow and plumb line as parts of a frame."""
    state = (ball.middle.x(), ball.middle.y(), ball.radius, ball.floor.x(), ball.floor.y())
    around = ball.radius + 3
    wide = ball.spread * ball.floor_radius * sprites.SOFT + 3
    high = wide * ball.floor_flat + 3
    line = QRectF(ball.floor, ball.middle).normalized()
    return {
        "ball": Placed(state, QRectF(ball.middle.x() - around, ball.middle.y() - around, 2 * around, 2 * around)),
        "shadow": Placed(state, QRectF(ball.floor.x() - wide, ball.floor.y() - high, 2 * wide, 2 * high)),
        "plumb": Placed(state, line.adjusted(-_PLUMB_HALF_PX, 0, _PLUMB_HALF_PX, _PLUMB_HALF_PX)),
    }


def changed_region(before: dict[str, Placed], after: dict[str, Placed]) -> QRegion:
    """Return the region that differs between two frames [whole logical px]."""
    region = QRegion()
    for name in before.keys() | after.keys():
        old, new = before.get(name), after.get(name)
        if old is not None and new is not None and old.state == new.state:
            continue
        for thing in (old, new):
            if thing is not None:
                region += thing.place.toAlignedRect()
    return region


def paint_marks(painter: QPainter, target: TargetPlace, stroke: float, *, is_lit: bool) -> None:
    """Paint the marks with line widths relative to ``stroke`` [px]."""
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
        painter.setPen(sprites.dashed_pen(ink, thin, (along.x() ** 2 + along.y() ** 2) ** 0.5, 4))
        painter.drawLine(start, end)
    ink.setAlphaF(0.45)
    painter.setPen(QPen(ink, thin, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
    painter.drawPoints(target.feet)
