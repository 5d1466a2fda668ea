"""What shows whether a screen shows pixels as they are: a ramp of greys, and lines of one and two device pixels."""

from itertools import pairwise

from PySide6.QtCore import QRect, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.theme.theme import PARTICIPANT, font

GREYS = 17
LABEL = 20
FIELD = 120


class GreyRamp(QWidget):
    """Seventeen greys from black to white, each distinguishable from the next."""

    def __init__(self) -> None:
        super().__init__()
        self.setMinimumSize(17 * 24, 80)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("Seventeen greys from black to white")

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the steps, and the number of each below it."""
        painter = QPainter(self)
        painter.setFont(font("key", tabular=True))
        for step, (left, right) in enumerate(steps(self.width())):
            value = round(255 * step / (GREYS - 1))
            painter.fillRect(QRect(left, 0, right - left, self.height() - LABEL), QColor(value, value, value))
            painter.setPen(QColor(PARTICIPANT.text2))
            below = QRectF(left, self.height() - LABEL, right - left, LABEL)
            painter.drawText(below, Qt.AlignmentFlag.AlignCenter, str(value))


class LineField(QWidget):
    """Black and white lines, ``thick`` device pixels each, standing or lying: grey or shimmering where scaled."""

    def __init__(self, thick: int, *, standing: bool) -> None:
        super().__init__()
        self.thick, self.standing = thick, standing
        self.setMinimumSize(FIELD, FIELD - 40)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        way = "standing" if standing else "lying"
        self.setAccessibleName(f"Lines of {thick} pixels, {way}")

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the lines, pixel for pixel of the screen."""
        ratio = self.devicePixelRatioF()
        painter = QPainter(self)
        painter.drawImage(0, 0, lines(round(self.width() * ratio), round(self.height() * ratio), ratio, self))


def lines(width: int, height: int, ratio: float, field: LineField) -> QImage:
    """Return the picture of lines, ``width`` by ``height`` device pixels."""
    image = QImage(width, height, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.black)
    painter = QPainter(image)
    for start in range(0, width if field.standing else height, 2 * field.thick):
        size = (field.thick, height) if field.standing else (width, field.thick)
        painter.fillRect(QRect(*((start, 0) if field.standing else (0, start)), *size), QColor(Qt.GlobalColor.white))
    painter.end()
    image.setDevicePixelRatio(ratio)
    return image


def steps(width: int) -> list[tuple[int, int]]:
    """Return from where to where each grey goes, without a gap between two."""
    edges = [round(width * step / GREYS) for step in range(GREYS + 1)]
    return list(pairwise(edges))
