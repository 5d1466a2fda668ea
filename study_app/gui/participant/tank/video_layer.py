"""The video behind ball and targets: the newest frame of the view, in the middle of the tank's place."""

from PySide6.QtCore import QPointF, QRectF, QSizeF
from PySide6.QtGui import QColor, QImage, QPainter, QRegion

from study_app.gui.participant.tank.camera import Box, Camera
from study_app.gui.participant.tank.frame import Placed
from study_app.gui.theme.theme import PARTICIPANT
from study_app.video.frames import VideoFrame


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
        """The video as a thing of a frame."""
        return Placed(None if self._frame is None else self._frame.number, self.place)

    def size(self, ratio: float) -> tuple[int, int]:
        """Return how many pixels a screen of this pixel ratio has for it."""
        return max(2, int(self.place.width() * ratio)), max(2, int(self.place.height() * ratio))

    def paint(self, painter: QPainter, region: QRegion) -> None:
        """Paint what lies in the region asked for."""
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
