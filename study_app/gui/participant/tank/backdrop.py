"""What stands still: room, glass, water, light and floor, painted once for a size and a screen.

Two images: the back, opaque, behind everything that moves; the front, the water's surface and the near glass, before
it. They are painted with 16 bits a channel and dithered, so that the dark gradients show no bands.
"""

import math
import threading
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import QImage, QLinearGradient, QPainter, QPolygonF, QRadialGradient

from study_app.gui.participant.tank import glass
from study_app.gui.participant.tank.frame import Box, Camera
from study_app.gui.theme.theme import PARTICIPANT

ROOM = ("#0E141A", "#16222C", "#0A1015")
SEED = 11
_PAINTING = threading.Lock()


@dataclass(frozen=True, slots=True)
class Backdrop:
    """The still images and where they go: ``back`` fills the widget, ``front`` lies at ``front_at`` [px]."""

    back: QImage
    front: QImage
    front_at: QRectF


def backdrop(size: tuple[int, int], ratio: float, box: Box, camera: Camera) -> Backdrop:
    """Return both images of a tank for a widget of ``size`` [logical px] on a screen of pixel ratio ``ratio``.

    The last two are kept. It may be called in another thread to have them at hand: who asks meanwhile waits for it.
    """
    with _PAINTING:
        return _painted(size, ratio, box, camera)


@lru_cache(maxsize=2)
def _painted(size: tuple[int, int], ratio: float, box: Box, camera: Camera) -> Backdrop:
    area = QRectF(0, 0, *size)
    back = _blank(area.size(), ratio, QImage.Format.Format_RGBX64)
    painter = _painter(back)
    _room(painter, area, box, camera)
    glass.walls(painter, box, camera)
    glass.floor(painter, box, camera)
    glass.light(painter, box, camera)
    glass.far_edges(painter, box, camera)
    glass.near_sides(painter, box, camera)
    painter.end()
    front_at = glass.front_area(box, camera).intersected(area)
    front = _blank(front_at.size(), ratio, QImage.Format.Format_ARGB32_Premultiplied)
    painter = _painter(front)
    painter.translate(-front_at.topLeft())
    glass.surface(painter, box, camera)
    glass.near_lines(painter, box, camera)
    painter.end()
    return Backdrop(_dithered(back), front, front_at)


def _blank(size: QSizeF, ratio: float, kind: QImage.Format) -> QImage:
    image = QImage(max(1, math.ceil(size.width() * ratio)), max(1, math.ceil(size.height() * ratio)), kind)
    image.setDevicePixelRatio(ratio)
    image.fill(Qt.GlobalColor.transparent)
    return image


def _painter(image: QImage) -> QPainter:
    painter = QPainter(image)
    painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform)
    return painter


def _room(painter: QPainter, area: QRectF, box: Box, camera: Camera) -> None:
    """Paint the dark room, a breath of light around the tank and the tank's mirror image on the table."""
    top, middle, bottom = ROOM
    painter.fillRect(
        area, glass.shade(QLinearGradient(0, 0, 0, area.height()), (0, top, 255), (0.6, middle, 255), (1, bottom, 255))
    )
    centre = glass.at(camera, (0, 0, 0))
    reach = area.width() * 0.52
    painter.fillRect(
        area,
        glass.shade(
            QRadialGradient(centre, reach), (0, "#1E3443", 120), (0.6, "#1A2A36", 60), (1, PARTICIPANT.window, 0)
        ),
    )
    near_left, near_right = glass.at(camera, (-box.x, box.floor, box.z)), glass.at(camera, (box.x, box.floor, box.z))
    deep = (near_right.x() - near_left.x()) * 0.075
    mirror = QPolygonF(
        [near_left, near_right, near_right + QPointF(-deep * 0.25, deep), near_left + QPointF(deep * 0.25, deep)]
    )
    fade = QLinearGradient(0, near_left.y(), 0, near_left.y() + deep)
    glass.fill(painter, mirror, glass.shade(fade, (0, "#2F6079", 86), (0.35, "#254C61", 36), (1, "#1A3445", 0)))


def _dithered(image: QImage) -> QImage:
    """Return the 16-bit image with 8 bits a channel, rounded with noise of one step, so that gradients stay smooth."""
    width, height, ratio = image.width(), image.height(), image.devicePixelRatio()
    deep = np.frombuffer(image.constBits(), np.uint16).reshape(height, width, 4)
    random = np.random.Generator(np.random.PCG64(SEED))
    noise = random.integers(0, 257, (height, width, 1), np.uint16)
    flat = np.empty((height, width, 4), np.uint8)
    for channel, place in ((0, 2), (1, 1), (2, 0)):
        flat[..., place] = (np.minimum(deep[..., channel : channel + 1], 65278) + noise)[..., 0] // 257
    flat[..., 3] = 255
    made = QImage(flat.data, width, height, 4 * width, QImage.Format.Format_RGB32).copy()
    made.setDevicePixelRatio(ratio)
    return made
