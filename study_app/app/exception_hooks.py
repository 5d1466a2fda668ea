"""Hooks for exceptions that no slot catches: those in Qt's own calls, such as painting, and those that end a thread."""

import logging
import sys
import threading
from collections.abc import Callable
from types import TracebackType

from PySide6.QtCore import QObject, Qt, Signal

log = logging.getLogger(__name__)


class UncaughtExceptions:
    """Replaces ``sys.excepthook`` while installed.

    Parameters
    ----------
    handle : is called with each exception; if it returns False, the ``previous`` hook is called too
    """

    def __init__(self, handle: Callable[[BaseException], bool]) -> None:
        self._handle = handle
        self.previous = sys.excepthook

    def install(self) -> None:
        """Replace the hook."""
        self.previous, sys.excepthook = sys.excepthook, self.hook

    def remove(self) -> None:
        """Restore the previous hook."""
        sys.excepthook = self.previous

    def __enter__(self) -> None:
        """Install."""
        self.install()

    def __exit__(self, *_: object) -> None:
        """Remove."""
        self.remove()

    def hook(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        """Handle an exception; its signature is that of ``sys.excepthook``."""
        if not self._handle(error):
            self.previous(kind, error, trace)


class ThreadExceptions(QObject):
    """Replaces ``threading.excepthook`` while installed; ``ended`` says in this object's thread what ended a thread."""

    ended = Signal(str)
    _ended = Signal(str)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._previous = threading.excepthook
        self._ended.connect(self.ended, Qt.ConnectionType.QueuedConnection)

    def install(self) -> None:
        """Replace the hook."""
        self._previous, threading.excepthook = threading.excepthook, self._hook

    def remove(self) -> None:
        """Restore the previous hook."""
        threading.excepthook = self._previous

    def _hook(self, what: threading.ExceptHookArgs) -> None:
        """Log the exception, in the thread that it ended."""
        name = what.thread.name if what.thread is not None else "unknown"
        log.error("the thread %r ended: %s", name, what.exc_value, exc_info=what.exc_value)
        self._ended.emit(f"{name}: {what.exc_type.__name__}: {what.exc_value}")
