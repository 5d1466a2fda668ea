"""The corner that a photodiode looks at: a black square, and in its outer corner a white one, lit or not."""

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter

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
