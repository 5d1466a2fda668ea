"""Keys and clicks of a user: sent to a real window by the X server, or to a window without a screen by Qt."""

import subprocess
import time
from collections.abc import Callable
from typing import Protocol

from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

ACTIVE_MS, SETTLES_MS = 3000, 40
PATIENCE_MS = 30_000
HELD = {
    "ctrl": Qt.KeyboardModifier.ControlModifier,
    "alt": Qt.KeyboardModifier.AltModifier,
    "shift": Qt.KeyboardModifier.ShiftModifier,
}


def happens(condition: Callable[[], object], ms: int) -> bool:
    """Handle events until a condition holds; return whether it does within a time."""
    ends = time.perf_counter() + ms / 1000
    while not condition():
        if time.perf_counter() > ends:
            return False
        QTest.qWait(5)
    return True


def wait_until(condition: Callable[[], object], what: str, ms: int = PATIENCE_MS) -> None:
    """Handle events until a condition holds; fail after a time."""
    assert happens(condition, ms), f"waited {ms / 1000:g} s in vain for {what}"


def name_of(part: QWidget) -> str:
    """Return the accessible name of a widget."""
    return part.accessibleName() or (part.text() if isinstance(part, QAbstractButton) else "")


def window_in_front() -> QWidget | None:
    """Return the window that takes keys: an open list, a dialog, or the active window."""
    return QApplication.activePopupWidget() or QApplication.activeModalWidget() or QApplication.activeWindow()


class Hand(Protocol):
    """The source of input: keys and texts for the focused widget, clicks and wheel notches at a position.

    ``aims_ms`` is how long a part must stay where it is before it is clicked.
    """

    aims_ms: int

    def key(self, keys: str) -> None: ...

    def write(self, text: str) -> None: ...

    def click(self, at: QPoint, times: int = 1) -> None: ...

    def turn_wheel(self, at: QPoint, down: bool) -> None: ...

    def bring_forward(self, window: QWidget) -> None: ...


class QtInput:
    """Keys and clicks of Qt's test module, for windows without a screen."""

    aims_ms = 0

    def key(self, keys: str) -> None:
        """Press keys, as "ctrl+s" or "shift+Tab"."""
        *modifier_names, name = keys.split("+")
        modifiers = Qt.KeyboardModifier.NoModifier
        for modifier in modifier_names:
            modifiers |= HELD[modifier]
        QTest.keyClick(self._takes_keys(), Qt.Key[f"Key_{name[:1].upper()}{name[1:]}"], modifiers)

    def write(self, text: str) -> None:
        """Type a text."""
        QTest.keyClicks(self._takes_keys(), text)

    def click(self, at: QPoint, times: int = 1) -> None:
        """Click at a place of the screen."""
        window = self._in_front()
        handle, place = window.windowHandle(), window.mapFromGlobal(at)
        if times > 1:
            QTest.mouseDClick(handle, Qt.MouseButton.LeftButton, pos=place)
        if times != 2:
            QTest.mouseClick(handle, Qt.MouseButton.LeftButton, pos=place)

    def turn_wheel(self, at: QPoint, down: bool) -> None:
        """Turn the wheel by a notch."""
        window = self._in_front()
        place = QPointF(window.mapFromGlobal(at))
        QTest.wheelEvent(window.windowHandle(), place, QPoint(0, -120 if down else 120))

    def bring_forward(self, window: QWidget) -> None:
        """Give the keyboard to a window."""
        window.activateWindow()

    def _takes_keys(self) -> QWidget:
        return QApplication.focusWidget() or self._in_front()

    @staticmethod
    def _in_front() -> QWidget:
        window = window_in_front()
        assert window is not None, "no window takes keys"
        return window


class XInput:
    """Keys and clicks of the X server, by xdotool; they go to the window that has its focus or is under its pointer."""

    aims_ms = 200

    def key(self, keys: str) -> None:
        """Press keys, as "ctrl+s"."""
        self._focus()
        self._send("key", "--clearmodifiers", keys)

    def write(self, text: str) -> None:
        """Type a text."""
        self._focus()
        self._send("type", "--delay", "2", text)

    def click(self, at: QPoint, times: int = 1) -> None:
        """Click at a place of the screen."""
        self._send("mousemove", str(at.x()), str(at.y()))
        self._send("click", "--repeat", str(times), "--delay", "20", "1")

    def turn_wheel(self, at: QPoint, down: bool) -> None:
        """Turn the wheel by a notch."""
        self._send("mousemove", str(at.x()), str(at.y()))
        self._send("click", "5" if down else "4")

    def _focus(self) -> None:
        """Give the keyboard to the window in front, as a window manager would."""
        front = QApplication.activeModalWidget() or QApplication.activeWindow()
        if front is None:
            front = next((widget for widget in reversed(QApplication.topLevelWidgets()) if widget.isVisible()), None)
            if front is not None:
                self.bring_forward(front)

    def bring_forward(self, window: QWidget) -> None:
        """Give the keyboard to a window, and put it above the others, as a window manager would."""
        number = str(int(window.winId()))
        subprocess.run(["xdotool", "windowraise", number, "windowfocus", number], check=False)
        QTest.qWaitForWindowActive(window, ACTIVE_MS)

    @staticmethod
    def _send(*arguments: str) -> None:
        """Send events and handle them: they have come when xdotool ends."""
        subprocess.run(["xdotool", *arguments], check=True)
        QTest.qWait(SETTLES_MS)
