"""The Esc key, which stops the force when held, and the base class of the main window's pages."""

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication, QKeyEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.key_presses import key_presses
from study_app.gui.theme.themed import Themed

HOLD_MS = 600


class EscapeKey(QObject):
    """An event filter that detects Esc in any part of a window.

    ``held`` is emitted once it has been down for 600 ms, regardless of the page, ``tapped`` if it was released before.
    Leaving the window ends a hold without either.

    Parameters
    ----------
    anywhere
        Whether it follows the focused window, including windows that open later. The focus may move while Esc is down,
        because a question closes or a page takes the focus; only the release then ends the hold, in any window. A hold
        that began in the ignored window (`ignore_window`) does not count, unless the focus has moved to another window
        of the program.
    """

    held = Signal()
    tapped = Signal()

    def __init__(self, parent: QObject, *, anywhere: bool = False) -> None:
        super().__init__(parent)
        self._ignored_window: QWidget | None = None
        self._began_in_ignored = False
        self._pressed_at_ms = 0
        self._timer = QTimer(self, singleShot=True, interval=HOLD_MS, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._emit_held)
        presses = key_presses()  # created even if not ``anywhere``, because it removes key repeats from every window
        if anywhere:
            presses.changed.connect(self._follow_escape)

    def ignore_window(self, window: QWidget) -> None:
        self._ignored_window = window

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.WindowDeactivate:
            self._timer.stop()
        elif isinstance(event, QKeyEvent):
            self._follow_escape(watched, event)
        return False

    def _follow_escape(self, window: QObject | None, event: QKeyEvent) -> None:
        """Track presses and releases of Esc; if the program was busy, their time stamps tell how long it was held."""
        if event.key() != Qt.Key.Key_Escape:
            return
        if event.type() == QEvent.Type.KeyPress and not self._timer.isActive():
            self._began_in_ignored = self._is_ignored(window)
            self._pressed_at_ms = event.timestamp()
            self._timer.start()
        elif event.type() == QEvent.Type.KeyRelease and self._timer.isActive():
            self._timer.stop()
            if event.timestamp() - self._pressed_at_ms >= self._timer.interval():
                self._emit_held()
            else:
                self.tapped.emit()

    def _is_ignored(self, window: QObject | None) -> bool:
        return window is not None and self._ignored_window is not None and window is self._ignored_window.windowHandle()

    def _emit_held(self) -> None:
        focus_window = QGuiApplication.focusWindow()
        if not (self._began_in_ignored and (focus_window is None or self._is_ignored(focus_window))):
            self.held.emit()


class Place(Themed, QWidget):
    """A page of the main window, next to the rail.

    ``message`` carries a title and a sentence that the main window shows until the page is left or emits
    ``message_over``; ``file_message`` also carries a file that can be opened. ``go_asked`` carries the name of another
    page.
    """

    message = Signal(str, str)
    file_message = Signal(str, str, object)
    message_over = Signal()
    go_asked = Signal(str)

    def enter(self) -> None:
        """Prepare for being shown: reload what may have changed."""

    def leave(self) -> None:
        """Prepare for being hidden: release at once every device that can exert force."""


def last_focused(part: QWidget) -> QWidget | None:
    """Return the child widget that last had keyboard focus, if it is visible and enabled."""
    last = part.focusWidget()
    return last if last not in {None, part} and last.isVisible() and last.isEnabled() else None
