"""A big number on each screen, for a moment: which is which."""

from PySide6.QtCore import QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QGuiApplication, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QScreen
from PySide6.QtWidgets import QWidget

from study_app.gui.theme.theme import PARTICIPANT, font

SHOWN_MS = 4000
SHARE = 0.42  # of the screen's height


class ScreenNumber(QWidget):
    """The number of one screen, all over it; any key or click takes it away."""

    def __init__(self, number: int, screen: QScreen) -> None:
        super().__init__(None, Qt.WindowType.FramelessWindowHint | Qt.WindowType.WindowStaysOnTopHint)
        self.number = number
        self.setWindowTitle(f"Screen {number}")
        self.setScreen(screen)
        self.setGeometry(screen.geometry())
        QTimer.singleShot(SHOWN_MS, self, self.close)

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the number and, below it, the screen's name."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(PARTICIPANT.window))
        painter.setPen(QColor(PARTICIPANT.accent))
        painter.setFont(font("display", scale=self.height() * SHARE / 34))
        painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, str(self.number))
        painter.setPen(QColor(PARTICIPANT.text2))
        painter.setFont(font("title"))
        below = QRectF(0, self.height() * 0.8, self.width(), 48)
        painter.drawText(below, Qt.AlignmentFlag.AlignCenter, self.screen().name())

    def keyPressEvent(self, _event: QKeyEvent) -> None:  # noqa: N802 - Qt's name
        """Go away."""
        self.close()

    def mousePressEvent(self, _event: QMouseEvent) -> None:  # noqa: N802 - Qt's name
        """Go away."""
        self.close()


def identify() -> list[ScreenNumber]:
    """Show its number on every screen."""
    shown = [ScreenNumber(number, screen) for number, screen in enumerate(QGuiApplication.screens(), start=1)]
    for one in shown:
        one.showFullScreen()
    return shown
