"""Which window stands on which screen, and what a receipt should record of it."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QSize
from PySide6.QtGui import QGuiApplication, QScreen
from PySide6.QtWidgets import QWidget

from study_app.errors import DisplayError


def choose_screens(number: int | None) -> tuple[QScreen, QScreen]:
    """Return the participant's and the operator's screen; the same one where there is only one.

    ``number`` is the participant's, from 1; None: the last one, where a second monitor usually is.

    Raises
    ------
    DisplayError
        There is no screen of that number.
    """
    screens = QGuiApplication.screens()
    if number is not None and not 1 <= number <= len(screens):
        there = "there is 1 screen" if len(screens) == 1 else f"there are {len(screens)} screens"
        raise DisplayError(f"screen {number} cannot be used: {there}; choose a number from 1 to {len(screens)}")
    participant = screens[(number or len(screens)) - 1]
    others = [screen for screen in screens if screen is not participant]
    return participant, others[0] if others else participant


def describe_screen(screen: QScreen) -> dict[str, Any]:
    """Return name, size, rate and scaling of a screen, for the receipt."""
    return {
        "name": screen.name(),
        "number": QGuiApplication.screens().index(screen) + 1,
        "size_px": [screen.size().width(), screen.size().height()],
        "refresh_hz": round(screen.refreshRate(), 3),
        "scaling": screen.devicePixelRatio(),
        "dots_per_inch": round(screen.physicalDotsPerInch(), 1),
    }


def place(window: QWidget, screen: QScreen, *, corner: bool) -> None:
    """Give ``window`` its size, or as much of it as ``screen`` has, in the middle or in the lower right corner."""
    room = screen.availableGeometry()
    size = window.size().boundedTo(room.size()).expandedTo(window.minimumSize())
    spare = QSize(max(0, room.width() - size.width()), max(0, room.height() - size.height()))
    share = 1.0 if corner else 0.5
    window.setScreen(screen)
    window.resize(size)
    window.move(room.left() + round(share * spare.width()), room.top() + round(share * spare.height()))
