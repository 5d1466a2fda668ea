"""One frame of the tank as values: what is drawn where, and which places differ from the frame before.

A frame is a table from the name of a thing to (state, place). Two frames with equal states look equal there, so that
only the places of things whose state changed are painted anew.
"""

import math
from dataclasses import dataclass
from typing import Protocol

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QPolygonF, QRegion

from study_app.gui.participant.tank import sprites
from study_app.gui.participant.tank.camera import Box, Camera, Point

DEPTH_STEPS = 64
MARK = 0.8  # a target's mark on the floor, in radii of the target
PLUMB_HALF_PX = 3.0


class TaskShown(Protocol):
    """What is drawn of a task (see ``session.tasks.TaskView``)."""

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
    """A thing that looks as ``state`` says and lies inside ``place`` [px]."""

    state: object
    place: QRectF


@dataclass(frozen=True, slots=True)
class BallPlace:
    """Where the proxy is drawn: middle, radius by depth step, haze, and the floor below it [px]."""

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
    """Where a target is drawn: middle, radius, its marks on the floor (circle, diamond) and below it [px]."""

    middle: QPointF
    radius: float
    depth_m: float
    circle: QPolygonF
    diamond: QPolygonF
    feet: tuple[QPointF, ...]

    @property
    def place(self) -> QRectF:
        """Return the square that holds ring, ticks and light."""
        reach = self.radius * sprites.GLOW + 4
        return QRectF(self.middle.x() - reach, self.middle.y() - reach, 2 * reach, 2 * reach)

    @property
    def marks(self) -> QRectF:
        """Return the place of the marks on the floor and of the line above them."""
        above = QRectF(self.middle, self.circle.boundingRect().center()).normalized().adjusted(-4, 0, 4, 0)
        return self.circle.boundingRect().united(self.diamond.boundingRect()).united(above).adjusted(-3, -3, 3, 3)


def target_place(camera: Camera, box: Box, centre: Point, radius_m: float) -> TargetPlace:
    """Return where a target of ``radius_m`` around ``centre`` [m, hand] is drawn."""
    x, _, z = centre
    reach = MARK * radius_m
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
        feet=_feet(QPointF(*camera.point((x, box.floor, z))), middle + QPointF(0, radius), 9.0),
    )


class BallPlacer:
    """Finds where the ball is drawn; its sizes come in steps of depth, one sprite each."""

    def __init__(self, camera: Camera, box: Box, radius_m: float) -> None:
        self._camera, self._box, self._radius_m = camera, box, radius_m
        nearest = camera.distance((0, box.water, box.z))
        farthest = camera.distance((0, box.floor, -box.z))
        self._nearest, self._step = nearest, (farthest - nearest) / (DEPTH_STEPS - 1)

    def size(self, step: int) -> tuple[float, float]:
        """Return radius [px] and haze of a step of depth, 0 the nearest."""
        distance = self._nearest + step * self._step
        return self._radius_m * self._camera.focal / distance, step / (DEPTH_STEPS - 1)

    def step(self, point: Point) -> int:
        """Return the step of depth of a point."""
        nearness = (self._camera.distance(point) - self._nearest) / self._step
        return min(max(round(nearness), 0), DEPTH_STEPS - 1)

    def place(self, position_m: Point) -> BallPlace:
        """Return where a ball at ``position_m`` [m, hand] is drawn; beyond the glass it stays at the glass."""
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
            feet=_feet(floor, middle + QPointF(0, radius), 11.0),
        )


def _feet(floor: QPointF, end: QPointF, pitch: float) -> tuple[QPointF, ...]:
    """Return dots from the floor up to ``end``, ``pitch`` px apart: they stand still while the ball rises."""
    along = end - floor
    length = math.hypot(along.x(), along.y())
    return (
        tuple(floor + along * (pitch * step / length) for step in range(int((length - 4) / pitch) + 1))
        if length
        else ()
    )


def ball_things(ball: BallPlace) -> dict[str, Placed]:
    """Return ball, shadow and plumb line as things of a frame."""
    state = (ball.middle.x(), ball.middle.y(), ball.radius, ball.floor.x(), ball.floor.y())
    around = ball.radius + 3
    wide = ball.spread * ball.floor_radius * sprites.SOFT + 3
    high = wide * ball.floor_flat + 3
    line = QRectF(ball.floor, ball.middle).normalized()
    return {
        "ball": Placed(state, QRectF(ball.middle.x() - around, ball.middle.y() - around, 2 * around, 2 * around)),
        "shadow": Placed(state, QRectF(ball.floor.x() - wide, ball.floor.y() - high, 2 * wide, 2 * high)),
        "plumb": Placed(state, line.adjusted(-PLUMB_HALF_PX, 0, PLUMB_HALF_PX, PLUMB_HALF_PX)),
    }


def changes(before: dict[str, Placed], after: dict[str, Placed]) -> QRegion:
    """Return the places [whole logical px] that look different in two frames."""
    region = QRegion()
    for name in before.keys() | after.keys():
        old, new = before.get(name), after.get(name)
        if old is not None and new is not None and old.state == new.state:
            continue
        for thing in (old, new):
            if thing is not None:
                region += thing.place.toAlignedRect()
    return region
