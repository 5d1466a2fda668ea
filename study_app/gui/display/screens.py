"""Screens, graphics card and the clock of frames."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, Final

from PySide6.QtCore import QObject, QPoint, QRect, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication, QOffscreenSurface, QOpenGLContext, QScreen
from PySide6.QtWidgets import QWidget

from study_app.errors import DisplayError

_FRAME_CHECKS_MS = (300, 1000, 3000)  # when the window manager's frame around a new window is measured


@dataclass(frozen=True, slots=True, kw_only=True)
class ScreenShown:
    """A screen as reported by the system: its size in logical pixels and in millimetres (0 if unknown)."""

    number: int
    name: str
    width_px: int
    height_px: int
    refresh_hz: float
    scaling: float
    width_mm: float
    height_mm: float

    @property
    def words(self) -> str:
        size = f"{round(self.width_px * self.scaling)} × {round(self.height_px * self.scaling)}"
        return f"{size}, {self.refresh_hz:.0f} Hz, {self.scaling:.0%}".replace("%", "\u202f%")


def screens_shown() -> tuple[ScreenShown, ...]:
    """Return the descriptions of all screens, in order."""
    return tuple(screen_shown(screen) for screen in QGuiApplication.screens())


def screen_shown(screen: QScreen) -> ScreenShown:
    """Return a screen's description from the system."""
    size, physical = screen.size(), screen.physicalSize()
    return ScreenShown(
        number=QGuiApplication.screens().index(screen) + 1,
        name=screen.name(),
        width_px=size.width(),
        height_px=size.height(),
        refresh_hz=screen.refreshRate(),
        scaling=screen.devicePixelRatio(),
        width_mm=physical.width(),
        height_mm=physical.height(),
    )


def choose_screens(number: int | None) -> tuple[QScreen, QScreen]:
    """Return the participant's and the operator's screens; the same one twice if there is only one.

    ``number`` is the participant's, from 1; None: the last one, which is usually a second monitor. Do not store them: a
    screen can be removed, and PySide releases a screen with the last widget whose ``screen()`` returned it.

    Raises
    ------
    DisplayError
        There is no screen with this number.
    """
    screens = QGuiApplication.screens()
    if number is not None and not 1 <= number <= len(screens):
        known = "there is 1 screen" if len(screens) == 1 else f"there are {len(screens)} screens"
        raise DisplayError(f"screen {number} cannot be used: {known}; choose a number from 1 to {len(screens)}")
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


def place_window(window: QWidget, screen: QScreen, *, corner: bool) -> None:
    """Place ``window`` in the centre or the lower right corner of a screen, no larger than the screen.

    The window manager's frame is known only some time after the window is shown; the window is then moved so that the
    frame fits, too.
    """
    window.setScreen(screen)
    window.setGeometry(_rectangle_inside(window, screen.availableGeometry(), corner=corner))
    for after_ms in _FRAME_CHECKS_MS:
        QTimer.singleShot(after_ms, window, partial(_fit_frame, window, corner=corner))


def _fit_frame(window: QWidget, *, corner: bool = False) -> None:
    """Move ``window`` and its frame completely onto its screen, reducing the minimum size if necessary."""
    area, outer, inner = window.screen().availableGeometry(), window.frameGeometry(), window.geometry()
    if window.isFullScreen() or window.isMaximized() or area.contains(outer):
        return
    top_left, bottom_right = inner.topLeft() - outer.topLeft(), inner.bottomRight() - outer.bottomRight()
    area = QRect(area.topLeft() + top_left, area.bottomRight() + bottom_right)
    smallest = (window.minimumSize() - (outer.size() - inner.size())).expandedTo(
        window.minimumSize().boundedTo(area.size())
    )
    if smallest.boundedTo(area.size()) != smallest:
        return  # the window does not fit the screen even without a frame
    window.setMinimumSize(smallest)
    window.setGeometry(_rectangle_inside(window, area, corner=corner))


def _rectangle_inside(window: QWidget, area: QRect, *, corner: bool) -> QRect:
    """Return the rectangle of ``window`` in ``area``, from the area's upper left corner if the window is larger."""
    size = window.size().boundedTo(area.size()).expandedTo(window.minimumSize())
    share = 1.0 if corner else 0.5
    right, down = max(0, area.width() - size.width()), max(0, area.height() - size.height())
    return QRect(area.topLeft() + QPoint(round(share * right), round(share * down)), size)


_GL_RENDERER: Final = 0x1F01
SOFTWARE_RENDERERS: Final = ("llvmpipe", "softpipe", "swrast", "swiftshader", "gdi generic", "software", "basic render")
WITHOUT_OPENGL: Final = {"offscreen", "minimal", "vnc", "linuxfb"}


@cache
def opengl_renderer() -> str | None:
    """Return OpenGL's name for its renderer; None without OpenGL."""
    if QGuiApplication.platformName() in WITHOUT_OPENGL:
        return None
    context = QOpenGLContext()
    if not context.create():
        return None
    surface = QOffscreenSurface()
    surface.create()
    if not context.makeCurrent(surface):
        return None
    try:
        return str(context.functions().glGetString(_GL_RENDERER))
    finally:
        context.doneCurrent()


def has_graphics_card() -> bool:
    """Return whether OpenGL uses a graphics card rather than software."""
    name = opengl_renderer()
    return name is not None and not any(word in name.lower() for word in SOFTWARE_RENDERERS)


LEAD_NS: Final = 5_000_000  # how long before a swap a frame is drawn: twice the tank's drawing time at 1080p
STALE_REFRESHES: Final = 8  # refreshes without a swap after which frames are timed by the clock
_NS_PER_S: Final = 1_000_000_000
LOCKED, BY_CLOCK = "synchronized with the screen's refresh", "timed by the computer's clock"


class Frames(QObject):
    """Requests a frame once per refresh of the screen: ``due`` is emitted when one should be drawn."""

    due = Signal()

    def __init__(
        self, refresh_hz: float, *, now_ns: Callable[[], int] = time.perf_counter_ns, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self.period_ns = round(_NS_PER_S / max(refresh_hz, 1.0))
        self._now_ns = now_ns
        self._next_ns = 0
        self._drawn_ns = -_NS_PER_S
        self._swapped_ns: int | None = None
        self._timer = QTimer(self, timerType=Qt.TimerType.PreciseTimer, singleShot=True)
        self._timer.timeout.connect(self._request_frame)

    @property
    def is_locked(self) -> bool:
        swapped_ns = self._swapped_ns
        return swapped_ns is not None and self._now_ns() - swapped_ns < STALE_REFRESHES * self.period_ns

    @property
    def pacing(self) -> str:
        return LOCKED if self.is_locked else BY_CLOCK

    @property
    def next_ns(self) -> int:
        return self._next_ns

    def start(self) -> None:
        self._next_ns = self._now_ns() + self.period_ns
        self._start_timer()

    def stop(self) -> None:
        self._timer.stop()

    def note_swap(self) -> None:
        """Record a buffer swap, and time the next frames so that each is drawn shortly before a swap."""
        self._swapped_ns = self._now_ns()
        aim_ns = self._swapped_ns - min(LEAD_NS, self.period_ns // 2)
        half_ns = self.period_ns // 2
        self._next_ns += (aim_ns - self._next_ns + half_ns) % self.period_ns - half_ns
        while self._next_ns < self._drawn_ns + half_ns:  # the refresh that was just drawn must not be drawn twice
            self._next_ns += self.period_ns
        if self._timer.isActive():
            self._start_timer()

    def _request_frame(self) -> None:
        """Request a frame; the timer of the next one is already running, so that a slow frame does not delay it."""
        now_ns = self._drawn_ns = self._now_ns()
        missed = max(0, (now_ns - self._next_ns) // self.period_ns)
        self._next_ns += (missed + 1) * self.period_ns
        self._start_timer()
        self.due.emit()

    def _start_timer(self) -> None:
        self._timer.start(max(0, round((self._next_ns - self._now_ns()) / 1e6)))
