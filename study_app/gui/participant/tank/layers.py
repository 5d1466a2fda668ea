"""What lies over or under the tank: the photodiode's patch, the video, the pane of OpenGL."""

import math
from collections.abc import Callable

from PySide6.QtCore import QPointF, QRect, QRectF, QSizeF, Qt, Signal
from PySide6.QtGui import QColor, QImage, QPainter, QRegion, QSurfaceFormat
from PySide6.QtOpenGLWidgets import QOpenGLWidget
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.participant.tank.frame import Box, Camera, Placed
from study_app.gui.theme.theme import PARTICIPANT
from study_app.video.frames import VideoFrame

MOVING_MPS = 0.020
RESTING_MPS = 0.008
REST_NS = 100_000_000
BASE_NS = 8_000_000


class OnsetPatch:
    """Toggles at each onset of a movement of the shown proxy.

    A movement begins when the shown proxy, having been slower than 8 mm/s (hand) for 100 ms, becomes faster than
    20 mm/s. Speeds are taken over at least 8 ms, whatever the refresh rate.
    """

    def __init__(self) -> None:
        self.lit = False
        self._position: tuple[float, float, float] | None = None
        self._time_ns = 0
        self._slow_since_ns: int | None = None
        self._rested = True

    def follow(self, position_m: tuple[float, float, float], time_ns: int) -> bool:
        """Take the shown proxy (3,) [m] and the time of its sample [ns]; return whether the patch is lit."""
        if self._position is None:
            self._position, self._time_ns = position_m, time_ns
        step_ns = time_ns - self._time_ns
        if step_ns < BASE_NS:
            return self.lit
        speed = math.dist(position_m, self._position) * 1e9 / step_ns
        if speed > MOVING_MPS:
            self.lit ^= self._rested
            self._rested = False
        if speed >= RESTING_MPS:
            self._slow_since_ns = None
        elif self._slow_since_ns is None:
            self._slow_since_ns = self._time_ns
        if self._slow_since_ns is not None and time_ns - self._slow_since_ns >= REST_NS:
            self._rested = True
        self._position, self._time_ns = position_m, time_ns
        return self.lit


PATCH = (88.0, 72.0)  # black square, white square in its corner [logical px]


def patch_place(width: float, height: float) -> QRectF:
    """Return where the patch is in a window of this size [logical px]."""
    black, _ = PATCH
    return QRectF(width - black, height - black, black, black)


def paint_patch(painter: QPainter, place: QRectF, *, lit: bool) -> None:
    """Paint the patch into its place."""
    black, white = PATCH
    painter.fillRect(place, QColor(Qt.GlobalColor.black))
    if lit:
        painter.fillRect(place.adjusted(black - white, black - white, 0, 0), QColor(Qt.GlobalColor.white))


class Pane(QOpenGLWidget):
    """Fills its parent and has everything painted by ``paint`` whenever it is updated.

    ``swapped`` comes after each swap, once it is on its way to the screen; swaps wait for the screen's refresh.
    """

    swapped = Signal()

    def __init__(self, parent: QWidget, paint: Callable[[QPainter, QRegion], None]) -> None:
        super().__init__(parent)
        wanted = QSurfaceFormat()
        wanted.setSwapInterval(1)
        wanted.setSamples(4)  # thin strokes are smoothed by the card
        self.setFormat(wanted)
        self._paint = paint
        self.frameSwapped.connect(self.swapped)

    def paintGL(self) -> None:
        """Paint the whole surface: what was on it before is not kept."""
        painter = page_painter(self)
        self._paint(painter, QRegion(QRect(0, 0, self.width(), self.height())))
        painter.end()


def video_place(camera: Camera, box: Box) -> QRectF:
    """Return the place of a video: where the tank would be [px]."""
    xs, ys = zip(*map(camera.point, box.corners()), strict=True)
    return QRectF(QPointF(min(xs), min(ys)), QPointF(max(xs), max(ys))).toAlignedRect().toRectF()


class VideoLayer:
    """Paints the frames of a video; ``place`` is where the tank would be [px]."""

    def __init__(self) -> None:
        self.place = QRectF()
        self._frame: VideoFrame | None = None
        self._image = QImage()

    def show(self, frame: VideoFrame | None) -> None:
        """Take the frame of a view; None where there is none yet."""
        if frame is not None and (self._frame is None or frame.pixels is not self._frame.pixels):
            size = frame.width, frame.height
            self._image = QImage(frame.pixels, *size, frame.stride, QImage.Format.Format_RGB32)
        self._frame = frame

    @property
    def thing(self) -> Placed:
        return Placed(None if self._frame is None else self._frame.number, self.place)

    def size(self, ratio: float) -> tuple[int, int]:
        return max(2, int(self.place.width() * ratio)), max(2, int(self.place.height() * ratio))

    def paint(self, painter: QPainter, region: QRegion) -> None:
        around = region.boundingRect()
        painter.fillRect(around, QColor(PARTICIPANT.window))
        if self._frame is not None and region.intersects(self.place.toAlignedRect()):
            painter.drawImage(self.middle(self._frame), self._image)

    def middle(self, frame: VideoFrame) -> QRectF:
        """Return where a frame is drawn: as large as the place allows, with its own ratio."""
        share = min(self.place.width() / frame.width, self.place.height() / frame.height)
        drawn = QRectF(self.place.topLeft(), QSizeF(share * frame.width, share * frame.height))
        drawn.moveCenter(self.place.center())
        return drawn
