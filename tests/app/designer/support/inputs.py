"""Keys and clicks of a user, which the X server sends to a real window."""

import subprocess
import time
from collections.abc import Callable

from PySide6.QtCore import QPoint
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

ACTIVE_MS, SETTLES_MS = 3000, 40


def happens(found: Callable[[], object], ms: int) -> bool:
    """Handle events until something is so; return whether it is within a time."""
    ends = time.monotonic() + ms / 1000
    while not found():
        if time.monotonic() > ends:
            return False
        QTest.qWait(5)
    return True


class XInput:
    """Keys and clicks of the X server, by xdotool; they go to the window that has its focus or is under its pointer."""

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
        shown = QApplication.activeModalWidget() or QApplication.activeWindow()
        if shown is None:
            shown = next((one for one in reversed(QApplication.topLevelWidgets()) if one.isVisible()), None)
            if shown is not None:
                self.come_forward(shown)

    def come_forward(self, window: QWidget) -> None:
        """Give the keyboard to a window, and put it above the others, as a window manager would."""
        number = str(int(window.winId()))
        subprocess.run(["xdotool", "windowraise", number, "windowfocus", number], check=False)
        QTest.qWaitForWindowActive(window, ACTIVE_MS)

    @staticmethod
    def _send(*arguments: str) -> None:
        """Send events and handle them: they have come when xdotool ends."""
        subprocess.run(["xdotool", *arguments], check=True)
        QTest.qWait(SETTLES_MS)
