"""The pointer as a hand: hidden and held in the window while the tank is shown, its motion emitted in metres.

The system's own pointer would be a proxy without delay, so it is never shown together with the ball. It is put back
into the middle of the window whenever it comes near an edge; motion that was under way is neither lost nor counted
twice.
"""

from PySide6.QtCore import QEvent, QObject, QPoint, Qt, Signal
from PySide6.QtGui import QCursor, QGuiApplication, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

SHARE_OF_SCREEN = 0.6  # of the screen's height that moves the hand through the height of the workspace
NOTCHES = 24  # of the wheel through the depth of the workspace
NOTCH = 120  # eighths of a degree
WITHOUT_GRAB = ("offscreen", "minimal")  # there is no other window that could take the pointer
BUTTONS = {Qt.MouseButton.LeftButton: 1 << 0, Qt.MouseButton.RightButton: 1 << 1}


class PointerCapture(QObject):
    """Holds the pointer while a widget is shown.

    ``moved(x, y, z)`` is the hand's place [m, hand frame], which stays from one capture to the next; ``pressed(bits)``
    are the buttons held, bit 0 the left one. Wheel and Shift with motion are depth: forwards is away.
    """

    moved = Signal(float, float, float)
    pressed = Signal(int)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._widget: QWidget | None = None
        self._hand = [0.0, 0.0, 0.0]
        self._half = (0.0, 0.0, 0.0)
        self.gain = 0.0
        self._bits = 0
        self._last = QPoint()
        self._returning = False

    @property
    def held(self) -> bool:
        return self._widget is not None

    def take(self, widget: QWidget, workspace_m: tuple[float, float, float]) -> None:
        """Hide the pointer in ``widget`` and turn its motion into the hand's, within the workspace (full sizes)."""
        self.release()
        self._widget = widget
        width, height, depth = workspace_m
        self._half = (width / 2, height / 2, depth / 2)
        self.gain = height / (SHARE_OF_SCREEN * widget.screen().geometry().height())
        widget.setCursor(Qt.CursorShape.BlankCursor)
        widget.setMouseTracking(True)
        widget.installEventFilter(self)
        if QGuiApplication.platformName() not in WITHOUT_GRAB:
            widget.grabMouse()
        self._last = self._middle()
        self._returning = False
        QCursor.setPos(self._last)
        self._move(0.0, 0.0, 0.0)

    def release(self) -> None:
        """Let the pointer go; buttons count as let go."""
        if self._widget is None:
            return
        widget, self._widget = self._widget, None
        widget.removeEventFilter(self)
        if QWidget.mouseGrabber() is widget:
            widget.releaseMouse()
        widget.unsetCursor()
        if self._bits:
            self._bits = 0
            self.pressed.emit(0)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if watched is not self._widget:
            return False
        if isinstance(event, QWheelEvent):
            self._move(0.0, 0.0, -2 * self._half[2] * event.angleDelta().y() / NOTCH / NOTCHES)
            return True
        if isinstance(event, QMouseEvent):
            if event.type() == QEvent.Type.MouseMove:
                self._follow(event.globalPosition().toPoint(), event.modifiers())
            else:
                self._hold(event)
            return True
        return False

    def _middle(self) -> QPoint:
        assert self._widget is not None  # noqa: S101  # asked only while held
        return self._widget.mapToGlobal(self._widget.rect().center())

    def _follow(self, place: QPoint, modifiers: Qt.KeyboardModifier) -> None:
        """Move the hand by the pointer's step; bring the pointer back when it strays."""
        assert self._widget is not None  # noqa: S101  # events come only while held
        middle = self._middle()
        if self._returning and _apart(place, middle) < _apart(place, self._last):
            self._last, self._returning = middle, False
        step = place - self._last
        self._last = place
        right, down = step.x() * self.gain, step.y() * self.gain
        if modifiers & Qt.KeyboardModifier.ShiftModifier:
            self._move(right, 0.0, down)
        else:
            self._move(right, -down, 0.0)
        if not self._returning and _apart(place, middle) > min(self._widget.width(), self._widget.height()) // 4:
            self._bring_back(middle)

    def _bring_back(self, middle: QPoint) -> None:
        """Put the pointer into the middle, and follow it from there.

        On X11 the answer to the question where it is comes after the jump, and Qt then delivers only the last of all
        motions, so that the next one is counted from the middle. Elsewhere motions from before may still come: until
        one is nearer to the middle than to the last place, they are counted from there.
        """
        QCursor.setPos(middle)
        if QGuiApplication.platformName() == "xcb":
            QCursor.pos()
            self._last = middle
        else:
            self._returning = True

    def _hold(self, event: QMouseEvent) -> None:
        bit = BUTTONS.get(event.button(), 0)
        bits = self._bits & ~bit if event.type() == QEvent.Type.MouseButtonRelease else self._bits | bit
        if bits != self._bits:
            self._bits = bits
            self.pressed.emit(bits)

    def _move(self, right: float, up: float, near: float) -> None:
        for axis, step in enumerate((right, up, near)):
            half = self._half[axis]
            self._hand[axis] = min(max(self._hand[axis] + step, -half), half)
        self.moved.emit(*self._hand)


def _apart(one: QPoint, other: QPoint) -> int:
    return (one - other).manhattanLength()
