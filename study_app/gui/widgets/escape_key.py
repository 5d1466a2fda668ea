"""Esc as every window hears it: held it stops the force, tapped it is whatever the window makes of it."""

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication, QKeyEvent, QWindow
from PySide6.QtWidgets import QWidget

HOLD_MS = 600


class EscapeHold(QObject):
    """An event filter that sees Esc go down and up in a window and its parts, whichever has the focus.

    ``held`` comes once it has been down for 600 ms, whatever the window shows meanwhile; ``tapped`` where it came up
    before. A window that is left ends it without either.
    """

    held = Signal()
    tapped = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._timer = _timer(self)
        self._timer.timeout.connect(self.held)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Start at the first press, stop at the release; the keyboard's own repetition counts for neither."""
        if isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Escape and not event.isAutoRepeat():
            if event.type() == QEvent.Type.KeyPress:
                self._timer.start()
            elif event.type() == QEvent.Type.KeyRelease and self._timer.isActive():
                self._timer.stop()
                self.tapped.emit()
        elif event.type() == QEvent.Type.WindowDeactivate:
            self._timer.stop()
        return super().eventFilter(watched, event)


class EscapeAnywhere(QObject):
    """Hears Esc held in whichever window of the program has the keyboard, those that open later too.

    A question closes when Esc goes down, and a page may take the keyboard while it is down: only its release ends a
    hold, in whatever window that is. A hold that began in the window it was left to (``leave_to``) is that window's,
    as long as no other one of the program has got the keyboard since.
    """

    held = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._aside: QWidget | None = None
        self._began_aside = False
        self._watched: QWindow | None = None
        self._timer = _timer(self)
        self._timer.timeout.connect(self._fire)
        application = QGuiApplication.instance()
        if isinstance(application, QGuiApplication):
            application.focusWindowChanged.connect(self._watch)
        self._watch(QGuiApplication.focusWindow())

    def leave_to(self, window: QWidget) -> None:
        """Let ``window`` hear its own."""
        self._aside = window

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        kind = event.type()
        if kind not in {QEvent.Type.KeyPress, QEvent.Type.KeyRelease} or not isinstance(event, QKeyEvent):
            return False
        if event.key() == Qt.Key.Key_Escape and not event.isAutoRepeat():
            if kind == QEvent.Type.KeyRelease:
                self._timer.stop()
            elif not self._timer.isActive():
                self._began_aside = self._is_aside(watched)
                self._timer.start()
        return False

    def _watch(self, window: QWindow | None) -> None:
        """Listen to the window that has the keyboard now: no other one receives keys."""
        if window is not None and window is not self._watched:
            window.removeEventFilter(self)  # one that comes back is listened to once
            window.installEventFilter(self)
        self._watched = window

    def _is_aside(self, window: QObject | None) -> bool:
        return window is not None and self._aside is not None and window is self._aside.windowHandle()

    def _fire(self) -> None:
        now = QGuiApplication.focusWindow()
        if not (self._began_aside and (now is None or self._is_aside(now))):
            self.held.emit()


def _timer(parent: QObject) -> QTimer:
    timer = QTimer(parent)
    timer.setSingleShot(True)
    timer.setInterval(HOLD_MS)
    return timer
