"""Paint glass, water, light and floor of the tank; ``paint_backdrop`` does so once for each size."""

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QGradient,
    QImage,
    QLinearGradient,
    QPainter,
    QPen,
    QPolygonF,
    QRadialGradient,
    QTransform,
)

from study_app.gui.participant.tank.frame import Box, Camera, Point
from study_app.gui.theme.theme import TANK

COLUMNS, ROWS = 512, 320
_RAYS = 2  # rays per cell and axis
_BEND = 0.075  # largest shift of a ray, in widths of the floor
_WAVES = 12
SEED = 7


@cache
def brightness() -> NDArray[np.float32]:
    """Return the light on the floor above its mean as a (320, 512) array in 0 … 1, from the back of the tank."""
    random = np.random.Generator(np.random.PCG64(SEED))
    x = _ray_starts(COLUMNS)[None, :]
    z = _ray_starts(ROWS)[:, None]
    shift_x = np.zeros((z.size, x.size), np.float32)
    shift_z = np.zeros_like(shift_x)
    for _ in range(_WAVES):
        number = math.tau * random.uniform(2.0, 8.0)
        angle = random.uniform(0, math.tau)
        along_x, along_z = math.cos(angle), math.sin(angle)
        slope = _BEND / _WAVES * np.cos(number * (along_x * x + along_z * z) + random.uniform(0, math.tau))
        shift_x += along_x * slope
        shift_z += along_z * slope
    landed = _count_rays(x + shift_x, z + shift_z)
    soft = _blur_image(_blur_image(_blur_image(landed)))
    above = np.clip(soft - 0.85, 0, None)
    light: NDArray[np.float32] = np.clip(above / 2.6, 0, 1).astype(np.float32)
    return light


def _ray_starts(cells: int) -> NDArray[np.float32]:
    """Return the start positions of rays along one axis [widths of the floor]; some are beyond the ends."""
    beyond = math.ceil(_BEND * COLUMNS) * _RAYS
    starts: NDArray[np.float32] = np.arange(-beyond, cells * _RAYS + beyond, dtype=np.float32)
    return (starts + np.float32(0.5)) / np.float32(COLUMNS * _RAYS)


def _count_rays(x: NDArray[np.float32], z: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the number of rays per cell of the floor, relative to a surface without ripples."""
    column = np.floor(x * COLUMNS).astype(np.int32).ravel()
    row = np.floor(z * COLUMNS).astype(np.int32).ravel()
    inside = (column >= 0) & (column < COLUMNS) & (row >= 0) & (row < ROWS)
    counts = np.bincount(row[inside] * COLUMNS + column[inside], minlength=ROWS * COLUMNS)
    return counts.reshape(ROWS, COLUMNS) / _RAYS**2


def _blur_image(image: NDArray[np.float64], radius: int = 1) -> NDArray[np.float64]:
    """Return the image after a box filter of 2 radius + 1 cells in both directions, edges repeated."""
    width = 2 * radius + 1
    for axis in (0, 1):
        padded = np.pad(image, [(radius + 1, radius) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        summed = np.cumsum(padded, axis=axis)
        image = (
            np.take(summed, range(width, summed.shape[axis]), axis)
            - np.take(summed, range(summed.shape[axis] - width), axis)
        ) / width
    return image


_FLOOR_LINES = 10


def point_on_screen(camera: Camera, point: Point) -> QPointF:
    """Return the screen position of a point."""
    return QPointF(*camera.point(point))


def _polygon(camera: Camera, points: list[Point]) -> QPolygonF:
    """Return the screen polygon of points in the tank."""
    return QPolygonF([point_on_screen(camera, point) for point in points])


def ink(colour: str, alpha: int = 255) -> QColor:
    """Return a colour with an opacity from 0 to 255."""
    tinted = QColor(colour)
    tinted.setAlpha(alpha)
    return tinted


def _pen(colour: str, alpha: int, width: float) -> QPen:
    """Return a solid pen with round ends."""
    return QPen(ink(colour, alpha), width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin)


def shade(gradient: QGradient, *stops: tuple[float, str, int]) -> QBrush:
    """Return a gradient brush with stops of position, colour and opacity."""
    for position, colour, alpha in stops:
        gradient.setColorAt(position, ink(colour, alpha))
    return QBrush(gradient)


def fill_shape(painter: QPainter, shape: QPolygonF, brush: QBrush) -> None:
    """Fill a shape, without an edge."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(brush)
    painter.drawPolygon(shape)


def paint_walls(painter: QPainter, box: Box, camera: Camera) -> None:
    """Paint the back wall, lit from behind, and the two side walls."""
    x, z = box.x, box.z
    back = _polygon(camera, [(-x, box.top, -z), (x, box.top, -z), (x, box.floor, -z), (-x, box.floor, -z)])
    frame = back.boundingRect()
    base = QLinearGradient(frame.topLeft(), frame.bottomLeft())
    fill_shape(painter, back, shade(base, (0, "#284A5E", 255), (0.45, "#25475B", 255), (1, "#1A3548", 255)))
    glow = QRadialGradient(QPointF(frame.center().x(), frame.top() + 0.18 * frame.height()), frame.width() * 0.52)
    fill_shape(
        painter, back, shade(glow, (0, "#6B95AA", 150), (0.35, "#4A7489", 96), (0.75, "#2F5A70", 24), (1, "#244A60", 0))
    )
    for side in (-1, 1):
        far_edge, near_edge = side * x, side * x
        wall = _polygon(
            camera,
            [(far_edge, box.top, -z), (near_edge, box.top, z), (near_edge, box.floor, z), (far_edge, box.floor, -z)],
        )
        near, far = point_on_screen(camera, (near_edge, 0, z)), point_on_screen(camera, (far_edge, 0, -z))
        along = QLinearGradient(QPointF(near.x(), 0), QPointF(far.x(), 0))
        fill_shape(painter, wall, shade(along, (0, "#25435A", 255), (0.7, "#1D3B4F", 255), (1, "#1A364A", 255)))
        down = QLinearGradient(wall.boundingRect().topLeft(), wall.boundingRect().bottomLeft())
        fill_shape(painter, wall, shade(down, (0, "#0F2B40", 190), (0.28, "#16364B", 60), (1, "#2A4A5C", 60)))


def paint_floor(painter: QPainter, box: Box, camera: Camera) -> None:
    """Paint the floor: glass with caustics and a grid that conveys the scale."""
    x, y, z = box.x, box.floor, box.z
    quad = _polygon(camera, [(-x, y, -z), (x, y, -z), (x, y, z), (-x, y, z)])
    far, near = quad.at(0).y(), quad.at(2).y()
    fill_shape(painter, quad, shade(QLinearGradient(0, far, 0, near), (0, "#24485D", 255), (1, "#3A6B85", 255)))
    middle = QRadialGradient(point_on_screen(camera, (0, y, 0)), (quad.at(2).x() - quad.at(3).x()) * 0.5)
    fill_shape(painter, quad, shade(middle, (0, "#5B8CA4", 60), (1, "#2F6079", 0)))
    for side in (-1, 1):
        edge = QLinearGradient(
            point_on_screen(camera, (side * x, y, 0)), point_on_screen(camera, (side * x * 0.72, y, 0))
        )
        fill_shape(painter, quad, shade(edge, (0, "#122B3C", 110), (1, "#122B3C", 0)))
    _paint_caustics(painter, quad)
    for index in range(1, _FLOOR_LINES):
        share = 2 * index / _FLOOR_LINES - 1
        _paint_grid_line(
            painter, point_on_screen(camera, (share * x, y, -z)), point_on_screen(camera, (share * x, y, z))
        )
        _paint_grid_line(
            painter, point_on_screen(camera, (-x, y, share * z)), point_on_screen(camera, (x, y, share * z))
        )


def _paint_grid_line(painter: QPainter, start: QPointF, end: QPointF) -> None:
    painter.setPen(_pen("#BFE0F0", 34, 1.0))
    painter.drawLine(start, end)


def _paint_caustics(painter: QPainter, quad: QPolygonF) -> None:
    light = brightness()
    alpha = np.rint(255 * light).astype(np.uint32)
    pixels = np.ascontiguousarray(alpha * 0x01010101)
    rows, columns = light.shape
    image = QImage(pixels.data, columns, rows, QImage.Format.Format_ARGB32_Premultiplied)
    square = QPolygonF([QPointF(0, 0), QPointF(columns, 0), QPointF(columns, rows), QPointF(0, rows)])
    warp = QTransform()
    if not QTransform.quadToQuad(square, quad, warp):
        raise ValueError("the floor of the tank is not visible on the screen")
    painter.save()
    painter.setTransform(warp, combine=True)
    painter.setOpacity(0.16)
    painter.drawImage(0, 0, image)
    painter.restore()


def paint_light(painter: QPainter, box: Box, camera: Camera) -> None:
    """Paint three shafts of light that fall from the surface at the back of the tank."""
    painter.save()
    painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_Screen)
    for position, width, strength in ((-0.54, 0.10, 74), (0.0, 0.16, 96), (0.46, 0.12, 66)):
        top = point_on_screen(camera, (position * box.x, box.water, -0.75 * box.z))
        foot = point_on_screen(camera, (position * box.x * 1.04, box.floor, -0.6 * box.z))
        half = (point_on_screen(camera, (width * box.x, box.water, 0)) - point_on_screen(camera, (0, box.water, 0))).x()
        painter.save()
        painter.translate(top)
        painter.shear((foot.x() - top.x()) / (foot.y() - top.y()), 0)
        painter.scale(half, (foot.y() - top.y()) * 0.92)
        _paint_shaft(painter, strength)
        painter.restore()
    painter.restore()


def _paint_shaft(painter: QPainter, strength: int) -> None:
    """Paint one shaft of light into [-1, 1] × [0, 1]: soft at both sides, fading downwards."""
    steps = 48
    for step in range(steps):
        down = (step + 0.5) / steps
        fade = math.exp(-2.6 * down) * min(1.0, down * 9)
        across = QLinearGradient(-1 - 0.5 * down, 0, 1 + 0.5 * down, 0)
        alpha = round(strength * fade)
        if alpha == 0:
            continue
        brush = shade(
            across,
            (0, "#8FC4DC", 0),
            (0.25, "#8FC4DC", round(alpha * 0.25)),
            (0.5, "#8FC4DC", alpha),
            (0.75, "#8FC4DC", round(alpha * 0.25)),
            (1, "#8FC4DC", 0),
        )
        painter.fillRect(QRectF(-1.5, step / steps, 3, 1 / steps), brush)


def paint_far_edges(painter: QPainter, box: Box, camera: Camera) -> None:
    """Paint the far edges of the glass."""
    x, z = box.x, box.z
    far = [(-x, box.top, -z), (x, box.top, -z), (x, box.floor, -z), (-x, box.floor, -z)]
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(_pen(TANK.glass, 92, 1.0))
    painter.drawPolygon(_polygon(camera, far))
    for side in (-1, 1):
        painter.setPen(_pen(TANK.glass, 92, 1.0))
        painter.drawLine(
            point_on_screen(camera, (side * x, box.floor, -z)), point_on_screen(camera, (side * x, box.floor, z))
        )
        painter.setPen(_pen(TANK.glass, 128, 1.0))
        painter.drawLine(
            point_on_screen(camera, (side * x, box.top, -z)), point_on_screen(camera, (side * x, box.top, z))
        )


def paint_near_sides(painter: QPainter, box: Box, camera: Camera) -> None:
    """Paint the near edges at the sides and below, which no moving part can hide."""
    x, z = box.x, box.z
    painter.setPen(_pen(TANK.glass, 150, 1.25))
    corners = [(-x, box.top, z), (-x, box.floor, z), (x, box.floor, z), (x, box.top, z)]
    painter.drawPolyline(_polygon(camera, corners))


def paint_near_lines(painter: QPainter, box: Box, camera: Camera) -> None:
    """Paint the near edge of the glass above the water, and the water line, in front of moving parts."""
    for height, colour, alpha, width in ((box.top, TANK.glass, 150, 1.25), (box.water, "#E9F6FD", 215, 1.5)):
        painter.setPen(_pen(colour, alpha, width))
        painter.drawLine(
            point_on_screen(camera, (-box.x, height, box.z)), point_on_screen(camera, (box.x, height, box.z))
        )


def front_area(box: Box, camera: Camera) -> QRectF:
    """Return the area of water surface and near lines, in whole pixels."""
    level = [(side * box.x, box.water, end * box.z) for side in (-1, 1) for end in (-1, 1)]
    glass = [(side * box.x, box.top, box.z) for side in (-1, 1)]
    return QRectF(_polygon(camera, level + glass).boundingRect().adjusted(-2, -2, 2, 2).toAlignedRect())


def paint_surface(painter: QPainter, box: Box, camera: Camera) -> None:
    """Paint the water surface from above: a pale layer with a few static ripples."""
    x, y, z = box.x, box.water, box.z
    skin = _polygon(camera, [(-x, y, -z), (x, y, -z), (x, y, z), (-x, y, z)])
    far, near = skin.at(0).y(), skin.at(2).y()
    down = QLinearGradient(0, far, 0, near)
    fill_shape(
        painter, skin, shade(down, (0, "#D5E8F1", 118), (0.16, "#A9C8D8", 72), (0.5, "#7FA6BA", 26), (1, "#A4C3D3", 64))
    )
    sheen = QRadialGradient(point_on_screen(camera, (0, y, -0.55 * z)), (skin.at(1).x() - skin.at(0).x()) * 0.42)
    fill_shape(painter, skin, shade(sheen, (0, "#E4F4FC", 26), (1, "#E4F4FC", 0)))
    painter.setClipRegion(skin.toPolygon())
    for depth, high, waves, phase, alpha in (
        (-0.88, 0.003, 4.6, 0.4, 96),
        (-0.68, 0.005, 3.4, 2.1, 80),
        (-0.34, 0.007, 2.6, 4.4, 62),
        (0.14, 0.009, 2.0, 1.2, 50),
    ):
        _paint_ripple(painter, box, camera, depth * z, high, waves, phase, alpha)
    painter.setClipping(False)
    painter.setPen(_pen("#DDEFF8", 120, 1.0))
    painter.drawLine(skin.at(0), skin.at(1))
    painter.drawLine(skin.at(0), skin.at(3))
    painter.drawLine(skin.at(1), skin.at(2))


def _paint_ripple(
    painter: QPainter, box: Box, camera: Camera, depth: float, high: float, waves: float, phase: float, alpha: int
) -> None:
    height = high * (box.water - box.floor)
    points = []
    for step in range(97):
        share = step / 48 - 1
        swell = math.sin(math.pi * waves * share + phase) + 0.4 * math.sin(math.pi * waves * 1.7 * share + 2 * phase)
        points.append(point_on_screen(camera, (share * box.x, box.water + height * swell, depth)))
    fade = QLinearGradient(points[0], points[-1])
    painter.setPen(
        QPen(shade(fade, (0, "#E9F6FD", 0), (0.2, "#E9F6FD", alpha), (0.8, "#E9F6FD", alpha), (1, "#E9F6FD", 0)), 1.0)
    )
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawPolyline(QPolygonF(points))
