"""What places and windows have in common: Esc that stops the force, the interface of a place."""

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
        Whether it listens by itself to the window of the program that has the keyboard, later ones too. A question
        closes when Esc goes down, and a page may take the keyboard while it is down: then only the release ends a hold,
        in whatever window that is. A hold that began in an ignored window (`ignore_window`) is that window's, as
        long as no other one of the program has got the keyboard since.
    """

    held = Signal()
    tapped = Signal()

    def __init__(self, parent: QObject, *, anywhere: bool = False) -> None:
        super().__init__(parent)
        self._aside: QWidget | None = None
        self._began_aside = False
        self._pressed_at_ms = 0
        self._timer = QTimer(self, singleShot=True, interval=HOLD_MS, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._emit_held)
        presses = key_presses()  # also of a window's own filter: they decide what is a press
        if anywhere:
            presses.changed.connect(self._follow_escape)

    def ignore_window(self, window: QWidget) -> None:
        self._aside = window

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.WindowDeactivate:
            self._timer.stop()
        elif isinstance(event, QKeyEvent):
            self._follow_escape(watched, event)
        return False

    def _follow_escape(self, window: QObject | None, event: QKeyEvent) -> None:
        """Track presses and releases of Esc, and their time stamps if the program was busy."""
        if event.key() != Qt.Key.Key_Escape:
            return
        if event.type() == QEvent.Type.KeyPress and not self._timer.isActive():
            self._began_aside = self._is_ignored(window)
            self._pressed_at_ms = event.timestamp()
            self._timer.start()
        elif event.type() == QEvent.Type.KeyRelease and self._timer.isActive():
            self._timer.stop()
            if event.timestamp() - self._pressed_at_ms >= self._timer.interval():
                self._emit_held()
            else:
                self.tapped.emit()

    def _is_ignored(self, window: QObject | None) -> bool:
        return window is not None and self._aside is not None and window is self._aside.windowHandle()

    def _emit_held(self) -> None:
        now = QGuiApplication.focusWindow()
        if not (self._began_aside and (now is None or self._is_ignored(now))):
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
        """Prepare for being hidden: release at once every device that acts on the hand."""


def last_focused(part: QWidget) -> QWidget | None:
    """Return the part that last had keyboard focus, if it is visible and enabled."""
    last = part.focusWidget()
    return last if last not in {None, part} and last.isVisible() and last.isEnabled() else None
