"""A frame of the tank as values, and the region in which it differs from the previous frame.

A frame maps the name of each part to its state and place. A part with the same state looks the same, so that only the
places of parts whose state has changed are repainted.
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
_DISTANCE = 3.3  # from the eye to the front of the tank, in heights of the water
_LEAST_WIDTH = 2.05  # of the water, in heights of the water
_LEAST_DEPTH = 1.2  # likewise
_GLASS_ABOVE = 0.13  # height of the glass above the water, in heights of the water
_MARGIN_M = 0.0025  # least distance between ball and glass


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
        unit_camera = cls(eye_y=eye_y, eye_z=eye_z, focal=1.0, centre_x=0.0, centre_y=0.0, pitch=pitch)
        pixels = [unit_camera.point(corner) for corner in box.corners()]
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
_MARK = 0.8  # size of a target's mark on the floor, in radii of the target
_PLUMB_HALF_PX = 3.0


class TaskShown(Protocol):
    """The properties of a task that are drawn (see ``session.tasks.TaskView``)."""

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
class DrawnPart:
    """A part of a frame, whose appearance depends only on ``state``, and the rectangle ``place`` around it [px]."""

    state: object
    place: QRectF


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnBall:
    """The proxy as drawn: its centre, radius (by depth step) and haze, and the floor below it [px]."""

    middle: QPointF
    radius: float
    haze: float
    depth_m: float
    floor: QPointF
    floor_radius: float  # of the shadow, by depth step
    floor_flat: float
    spread: float  # of the shadow, which is wider and fainter if the ball is higher
    shade: float
    feet: tuple[QPointF, ...]  # dots of the plumb line, from the floor up


@dataclass(frozen=True, slots=True)
class DrawnTarget:
    """A target as drawn: its centre, radius, marks on the floor (circle, diamond) and plumb line [px]."""

    middle: QPointF
    radius: float
    depth_m: float
    circle: QPolygonF
    diamond: QPolygonF
    feet: tuple[QPointF, ...]

    @property
    def place(self) -> QRectF:
        """The square around ring, ticks and light."""
        reach = self.radius * sprites.GLOW + 4
        return QRectF(self.middle.x() - reach, self.middle.y() - reach, 2 * reach, 2 * reach)

    @property
    def marks(self) -> QRectF:
        """The rectangle around the marks on the floor and the line above them."""
        above = QRectF(self.middle, self.circle.boundingRect().center()).normalized().adjusted(-4, 0, 4, 0)
        return self.circle.boundingRect().united(self.diamond.boundingRect()).united(above).adjusted(-3, -3, 3, 3)


def drawn_target(camera: Camera, box: Box, centre: Point, radius_m: float) -> DrawnTarget:
    """Return how a target of ``radius_m`` around ``centre`` [m, hand] is drawn."""
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
    return DrawnTarget(
        middle=middle,
        radius=radius,
        depth_m=camera.distance(centre),
        circle=QPolygonF([QPointF(*camera.point(point)) for point in circle]),
        diamond=QPolygonF([QPointF(*camera.point(point)) for point in corners]),
        feet=_plumb_dots(QPointF(*camera.point((x, box.floor, z))), middle + QPointF(0, radius), 9.0),
    )


class BallPlacer:
    """Computes how the ball is drawn; its size changes in depth steps, each of which has a sprite."""

    def __init__(self, camera: Camera, box: Box, radius_m: float) -> None:
        self._camera, self._box, self._radius_m = camera, box, radius_m
        nearest = camera.distance((0, box.water, box.z))
        farthest = camera.distance((0, box.floor, -box.z))
        self._nearest, self._step = nearest, (farthest - nearest) / (DEPTH_STEPS - 1)

    def size(self, step: int) -> tuple[float, float]:
        """Return the radius [px] and haze of a depth step; step 0 is the nearest."""
        distance = self._nearest + step * self._step
        return self._radius_m * self._camera.focal / distance, step / (DEPTH_STEPS - 1)

    def step(self, point: Point) -> int:
        nearness = (self._camera.distance(point) - self._nearest) / self._step
        return min(max(round(nearness), 0), DEPTH_STEPS - 1)

    def place(self, position_m: Point) -> DrawnBall:
        """Return how a ball at ``position_m`` [m, hand] is drawn; it stays inside the glass."""
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
        return DrawnBall(
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
    """Return dots from the floor up to ``end``, ``pitch`` px apart; they do not move when ``end`` moves up or down."""
    line = end - floor
    length = math.hypot(line.x(), line.y())
    return (
        tuple(floor + line * (pitch * step / length) for step in range(int((length - 4) / pitch) + 1)) if length else ()
    )


def ball_parts(ball: DrawnBall) -> dict[str, DrawnPart]:
    """Return ball, shadow and plumb line as parts of a frame."""
    state = (ball.middle.x(), ball.middle.y(), ball.radius, ball.floor.x(), ball.floor.y())
    radius = ball.radius + 3
    half_width = ball.spread * ball.floor_radius * sprites.SOFT + 3
    half_height = half_width * ball.floor_flat + 3
    line = QRectF(ball.floor, ball.middle).normalized()
    return {
        "ball": DrawnPart(state, QRectF(ball.middle.x() - radius, ball.middle.y() - radius, 2 * radius, 2 * radius)),
        "shadow": DrawnPart(
            state, QRectF(ball.floor.x() - half_width, ball.floor.y() - half_height, 2 * half_width, 2 * half_height)
        ),
        "plumb": DrawnPart(state, line.adjusted(-_PLUMB_HALF_PX, 0, _PLUMB_HALF_PX, _PLUMB_HALF_PX)),
    }


def changed_region(before: dict[str, DrawnPart], after: dict[str, DrawnPart]) -> QRegion:
    """Return the region that differs between two frames [whole logical px]."""
    region = QRegion()
    for name in before.keys() | after.keys():
        old, new = before.get(name), after.get(name)
        if old is not None and new is not None and old.state == new.state:
            continue
        for part in (old, new):
            if part is not None:
                region += part.place.toAlignedRect()
    return region


def paint_marks(painter: QPainter, target: DrawnTarget, stroke: float, *, is_lit: bool) -> None:
    """Paint a target's marks on the floor with line widths relative to ``stroke`` [px]."""
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
