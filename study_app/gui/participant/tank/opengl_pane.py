"""The tank on the graphics card: the same painter on a surface that tells when it swapped."""

from collections.abc import Callable

from PySide6.QtCore import QRect, Signal
from PySide6.QtGui import QPainter, QRegion, QSurfaceFormat
from PySide6.QtOpenGLWidgets import QOpenGLWidget
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.pages.page_widget import page_painter


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
