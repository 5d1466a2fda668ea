"""Esc as every window hears it: held it stops the force, tapped it is whatever the window makes of it."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent

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
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(HOLD_MS)
        self._timer.timeout.connect(self.held)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802 - Qt's name
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
