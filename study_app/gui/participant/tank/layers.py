"""The static images of the tank, and the layers that are painted over them."""

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from PySide6.QtCore import QPointF, QRect, QRectF, QSizeF, Qt, Signal
from PySide6.QtGui import QColor, QImage, QLinearGradient, QPainter, QPolygonF, QRadialGradient, QRegion, QSurfaceFormat
from PySide6.QtOpenGLWidgets import QOpenGLWidget
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.participant.tank import glass
from study_app.gui.participant.tank.frame import Box, Camera, DrawnPart
from study_app.gui.theme.theme import PARTICIPANT
from study_app.video.frames import VideoFrame

ROOM = ("#0E141A", "#16222C", "#0A1015")
SEED = 11
_PAINTING = threading.Lock()


@dataclass(frozen=True, slots=True)
class Backdrop:
    """The static images and their positions: ``back`` fills the widget, ``front`` is at ``front_at`` [px]."""

    back: QImage
    front: QImage
    front_at: QRectF


def paint_backdrop(size: tuple[int, int], ratio: float, box: Box, camera: Camera) -> Backdrop:
    """Return both images of a tank for a widget of ``size`` [logical px] on a screen with pixel ratio ``ratio``.

    The last two results are cached. Another thread may call this in advance; a second caller waits for that result.
    """
    with _PAINTING:
        return _paint_backdrop(size, ratio, box, camera)


@lru_cache(maxsize=2)
def _paint_backdrop(size: tuple[int, int], ratio: float, box: Box, camera: Camera) -> Backdrop:
    area = QRectF(0, 0, *size)
    back = _blank_image(area.size(), ratio, QImage.Format.Format_RGBX64)
    painter = _image_painter(back)
    _paint_room(painter, area, box, camera)
    glass.paint_walls(painter, box, camera)
    glass.paint_floor(painter, box, camera)
    glass.paint_light(painter, box, camera)
    glass.paint_far_edges(painter, box, camera)
    glass.paint_near_sides(painter, box, camera)
    painter.end()
    front_at = glass.front_area(box, camera).intersected(area)
    front = _blank_image(front_at.size(), ratio, QImage.Format.Format_ARGB32_Premultiplied)
    painter = _image_painter(front)
    painter.translate(-front_at.topLeft())
    glass.paint_surface(painter, box, camera)
    glass.paint_near_lines(painter, box, camera)
    painter.end()
    return Backdrop(_dither_image(back), front, front_at)


def _blank_image(size: QSizeF, ratio: float, kind: QImage.Format) -> QImage:
    image = QImage(max(1, math.ceil(size.width() * ratio)), max(1, math.ceil(size.height() * ratio)), kind)
    image.setDevicePixelRatio(ratio)
    image.fill(Qt.GlobalColor.transparent)
    return image


def _image_painter(image: QImage) -> QPainter:
    painter = QPainter(image)
    painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform)
    return painter


def _paint_room(painter: QPainter, area: QRectF, box: Box, camera: Camera) -> None:
    """Paint the dark room, the faint light around the tank, and the tank's reflection on the table."""
    top, middle, bottom = ROOM
    painter.fillRect(
        area, glass.shade(QLinearGradient(0, 0, 0, area.height()), (0, top, 255), (0.6, middle, 255), (1, bottom, 255))
    )
    centre = glass.point_on_screen(camera, (0, 0, 0))
    reach = area.width() * 0.52
    painter.fillRect(
        area,
        glass.shade(
            QRadialGradient(centre, reach), (0, "#1E3443", 120), (0.6, "#1A2A36", 60), (1, PARTICIPANT.window, 0)
        ),
    )
    near_left, near_right = (
        glass.point_on_screen(camera, (-box.x, box.floor, box.z)),
        glass.point_on_screen(camera, (box.x, box.floor, box.z)),
    )
    deep = (near_right.x() - near_left.x()) * 0.075
    mirror = QPolygonF(
        [near_left, near_right, near_right + QPointF(-deep * 0.25, deep), near_left + QPointF(deep * 0.25, deep)]
    )
    fade = QLinearGradient(0, near_left.y(), 0, near_left.y() + deep)
    glass.fill_shape(painter, mirror, glass.shade(fade, (0, "#2F6079", 86), (0.35, "#254C61", 36), (1, "#1A3445", 0)))


def _dither_image(image: QImage) -> QImage:
    """Return a 16-bit image with 8 bits per channel, dithered by one step, so that gradients stay smooth."""
    width, height, ratio = image.width(), image.height(), image.devicePixelRatio()
    deep = np.frombuffer(image.constBits(), np.uint16).reshape(height, width, 4)
    random = np.random.Generator(np.random.PCG64(SEED))
    noise = random.integers(0, 257, (height, width, 1), np.uint16)
    flat = np.empty((height, width, 4), np.uint8)
    for channel, byte in ((0, 2), (1, 1), (2, 0)):
        flat[..., byte] = (np.minimum(deep[..., channel : channel + 1], 65278) + noise)[..., 0] // 257
    flat[..., 3] = 255
    dithered = QImage(flat.data, width, height, 4 * width, QImage.Format.Format_RGB32).copy()
    dithered.setDevicePixelRatio(ratio)
    return dithered


_MOVING_MPS = 0.020
_RESTING_MPS = 0.008
_REST_NS = 100_000_000
_BASE_NS = 8_000_000


class OnsetPatch:
    """A patch that toggles at each movement onset of the displayed proxy.

    A movement begins when the displayed proxy, after being slower than 8 mm/s (hand) for 100 ms, becomes faster than 20
    mm/s. Speeds are taken over at least 8 ms, regardless of the refresh rate.
    """

    def __init__(self) -> None:
        self.lit = False
        self._position: tuple[float, float, float] | None = None
        self._time_ns = 0
        self._slow_since_ns: int | None = None
        self._rested = True

    def follow_motion(self, position_m: tuple[float, float, float], time_ns: int) -> bool:
        """Process the displayed proxy (3,) [m] and its sample's time [ns]; return whether the patch is lit."""
        if self._position is None:
            self._position, self._time_ns = position_m, time_ns
        step_ns = time_ns - self._time_ns
        if step_ns < _BASE_NS:
            return self.lit
        speed = math.dist(position_m, self._position) * 1e9 / step_ns
        if speed > _MOVING_MPS:
            self.lit ^= self._rested
            self._rested = False
        if speed >= _RESTING_MPS:
            self._slow_since_ns = None
        elif self._slow_since_ns is None:
            self._slow_since_ns = self._time_ns
        if self._slow_since_ns is not None and time_ns - self._slow_since_ns >= _REST_NS:
            self._rested = True
        self._position, self._time_ns = position_m, time_ns
        return self.lit


_PATCH = (88.0, 72.0)  # sides of the black square and of the white square in its corner [logical px]


def patch_rectangle(width: float, height: float) -> QRectF:
    """Return the rectangle of the patch in a window of this size [logical px]."""
    black, _ = _PATCH
    return QRectF(width - black, height - black, black, black)


def paint_patch(painter: QPainter, place: QRectF, *, lit: bool) -> None:
    """Paint the patch into ``place``; if ``lit``, with the white square."""
    black, white = _PATCH
    painter.fillRect(place, QColor(Qt.GlobalColor.black))
    if lit:
        painter.fillRect(place.adjusted(black - white, black - white, 0, 0), QColor(Qt.GlobalColor.white))


class Pane(QOpenGLWidget):
    """A surface of the graphics card that is painted by ``paint`` whenever it is updated.

    ``swapped`` is emitted after each buffer swap, which sends the frame to the screen; swaps are synchronised to the
    refresh.
    """

    swapped = Signal()

    def __init__(self, parent: QWidget, paint: Callable[[QPainter, QRegion], None]) -> None:
        super().__init__(parent)
        surface_format = QSurfaceFormat()
        surface_format.setSwapInterval(1)
        surface_format.setSamples(4)  # thin strokes are smoothed by the card
        self.setFormat(surface_format)
        self._paint = paint
        self.frameSwapped.connect(self.swapped)

    def paintGL(self) -> None:
        """Paint the whole surface, since its previous content is lost."""
        painter = page_painter(self)
        self._paint(painter, QRegion(QRect(0, 0, self.width(), self.height())))
        painter.end()


def video_area(camera: Camera, box: Box) -> QRectF:
    """Return the rectangle of a video, which is that of the tank [px]."""
    xs, ys = zip(*map(camera.point, box.corners()), strict=True)
    return QRectF(QPointF(min(xs), min(ys)), QPointF(max(xs), max(ys))).toAlignedRect().toRectF()


class VideoLayer:
    """Paints the frames of a video at the tank's ``place`` [px]."""

    def __init__(self) -> None:
        self.place = QRectF()
        self._frame: VideoFrame | None = None
        self._image = QImage()

    def show_frame(self, frame: VideoFrame | None) -> None:
        if frame is not None and (self._frame is None or frame.pixels is not self._frame.pixels):
            size = frame.width, frame.height
            self._image = QImage(frame.pixels, *size, frame.stride, QImage.Format.Format_RGB32)
        self._frame = frame

    @property
    def placed_frame(self) -> DrawnPart:
        return DrawnPart(None if self._frame is None else self._frame.number, self.place)

    def size(self, ratio: float) -> tuple[int, int]:
        return max(2, int(self.place.width() * ratio)), max(2, int(self.place.height() * ratio))

    def paint(self, painter: QPainter, region: QRegion) -> None:
        area = region.boundingRect()
        painter.fillRect(area, QColor(PARTICIPANT.window))
        if self._frame is not None and region.intersects(self.place.toAlignedRect()):
            painter.drawImage(self.frame_place(self._frame), self._image)

    def frame_place(self, frame: VideoFrame) -> QRectF:
        """Return the rectangle of a frame: as large as the place permits, with its aspect ratio."""
        share = min(self.place.width() / frame.width, self.place.height() / frame.height)
        drawn = QRectF(self.place.topLeft(), QSizeF(share * frame.width, share * frame.height))
        drawn.moveCenter(self.place.center())
        return drawn
