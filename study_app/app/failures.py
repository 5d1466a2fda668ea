"""The handling of failures: exceptions in slots, painting and threads, signals, crashes."""

import contextlib
import faulthandler
import logging
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from io import FileIO
from pathlib import Path
from types import FunctionType, TracebackType
from typing import Concatenate, Final, ParamSpec, Protocol, TypeVar

from PySide6.QtCore import QObject, Qt, QTimer, Signal, SignalInstance
from PySide6.QtGui import QGuiApplication, QSessionManager
from PySide6.QtWidgets import QGraphicsItem, QStyledItemDelegate, QWidget

from study_app.app.timing import disable_collection
from study_app.ending_signals import ENDING_SIGNALS
from study_app.errors import SessionError
from study_app.haptics.runtime.grants import allow_suspension, refuse_suspension

log = logging.getLogger(__name__)

PAINTING: Final = ("paintEvent", "paint")  # painting methods of widgets, and of items and delegates


class UncaughtExceptions:
    """Replaces ``sys.excepthook`` while installed.

    Parameters
    ----------
    handle : called with each exception; if it returns False, the previous hook is called as well
    """

    def __init__(self, handle: Callable[[BaseException], bool]) -> None:
        self._handle = handle
        self.previous = sys.excepthook

    def install(self) -> None:
        guard_painting()
        self.previous, sys.excepthook = sys.excepthook, self.handle_exception

    def remove(self) -> None:
        sys.excepthook = self.previous

    def __enter__(self) -> None:
        self.install()

    def __exit__(self, *_: object) -> None:
        self.remove()

    def handle_exception(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if not self._handle(error):
            self.previous(kind, error, trace)


def guard_painting() -> None:
    """Wrap the painting methods of all widget and item classes, so that exceptions go to ``sys.excepthook`` at once.

    Otherwise Qt continues to paint other widgets while the exception is pending; PySide6 6.12 then loses references to
    their methods, until the process ends with a segmentation fault.
    """
    kinds: list[type] = [QWidget, QGraphicsItem, QStyledItemDelegate]
    while kinds:
        kind = kinds.pop()
        kinds += kind.__subclasses__()
        for name in PAINTING:
            method = vars(kind).get(name)
            if isinstance(method, FunctionType) and not hasattr(method, "__wrapped__"):
                setattr(kind, name, _report_exceptions(method))


def _report_exceptions(method: Callable[..., None]) -> Callable[..., None]:
    @wraps(method)
    def paint(*arguments: object) -> None:
        try:
            method(*arguments)
        except Exception as error:  # noqa: BLE001 - the hook decides
            # The traceback must not be stored: it would keep this frame alive, and with it a painter that Qt waits for.
            error.__traceback__ = error.__traceback__ and error.__traceback__.tb_next
            sys.excepthook(type(error), error, error.__traceback__)

    return paint


class ThreadExceptions(QObject):
    """Replaces ``threading.excepthook`` while installed; ``ended`` carries a description of the exception.

    The signal is emitted in the thread of this object.
    """

    ended = Signal(str)
    _ended = Signal(str)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._previous = threading.excepthook
        self._ended.connect(self.ended, Qt.ConnectionType.QueuedConnection)

    def install(self) -> None:
        self._previous, threading.excepthook = threading.excepthook, self._handle_exception

    def remove(self) -> None:
        threading.excepthook = self._previous

    def _handle_exception(self, arguments: threading.ExceptHookArgs) -> None:
        """Log the exception; called in the thread that it has ended."""
        name = arguments.thread.name if arguments.thread is not None else "unknown"
        log.error("the thread %r ended: %s", name, arguments.exc_value, exc_info=arguments.exc_value)
        self._ended.emit(f"{name}: {arguments.exc_type.__name__}: {arguments.exc_value}")


class Failing(Protocol):
    """An object that handles a failure and ends with zero force."""

    def fail(self, error: BaseException) -> None: ...


_F = TypeVar("_F", bound=Failing)
_P = ParamSpec("_P")


def guarded(slot: Callable[Concatenate[_F, _P], None]) -> Callable[Concatenate[_F, _P], None]:
    """Decorate a slot so that an exception calls ``fail``, which sends zero force."""

    @wraps(slot)
    def run(self: _F, /, *arguments: _P.args, **named: _P.kwargs) -> None:
        try:
            slot(self, *arguments, **named)
        except Exception as error:  # noqa: BLE001 - any exception requires zero force
            self.fail(error)

    return run


def guarded_session_slot(slot: Callable[Concatenate[_F, _P], None]) -> Callable[Concatenate[_F, _P], None]:
    """Decorate a slot like `guarded`, but log and ignore events that arrive too late (`SessionError`)."""

    @wraps(slot)
    def run(self: _F, /, *arguments: _P.args, **named: _P.kwargs) -> None:
        try:
            slot(self, *arguments, **named)
        except SessionError as error:
            log.info("dropped: %s", error)

    return guarded(run)


class CrashTrace:
    """Makes `faulthandler` write to ``path`` until `close`, which removes an empty file.

    The trace contains source files, functions and line numbers, but no values. If the file cannot be opened, there is
    no trace. A resumed session appends to the file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._enabled_before = faulthandler.is_enabled()
        self._file: FileIO | None = None
        with contextlib.suppress(OSError):
            self._file = path.open("ab", buffering=0)
            faulthandler.enable(self._file)

    def close(self) -> None:
        """Restore the terminal as the target of crash traces; a second call does nothing."""
        file, self._file = self._file, None
        if file is None:
            return
        faulthandler.disable()
        if self._enabled_before and sys.__stderr__ is not None:
            faulthandler.enable(sys.__stderr__)
        file.close()
        with contextlib.suppress(OSError):
            if self._path.stat().st_size == 0:
                self._path.unlink()


CANCELLED = 130  # exit codes
BUG = 1
_HEARTBEAT_MS = 100  # maximum delay before Python handles a signal
BY_SIGNAL_S = 2.0  # maximum wait for threads when a signal ends the program, after zero force
OPENING_PATIENCE_S = 20.0  # maximum wait for a device that is being opened
_HANG_UP = 1  # the number of SIGHUP, which represents a log-off on every system


class Patience:
    """A time limit [s] that several waits share."""

    def __init__(self, seconds: float) -> None:
        self._until_s = time.perf_counter() + seconds

    @property
    def left_s(self) -> float:
        """The remaining time [s]; never negative."""
        return max(self._until_s - time.perf_counter(), 0.0)


def log_off_signal() -> SignalInstance:
    """Return the signal that the system emits before it ends the program, so that work can be saved."""
    application = QGuiApplication.instance()
    assert isinstance(application, QGuiApplication)  # noqa: S101 - the application exists once windows are shown
    return application.commitDataRequest


@contextmanager
def ending_on_signals(end: Callable[[int], None]) -> Iterator[None]:
    """Call ``end`` once, with the signal's number, on Ctrl+C, a request to terminate or a log-off.

    Signals are handled in the event loop. A log-off waits only for ``end``. Ctrl+Z is ignored, since the force would
    continue while the program is suspended.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []

    def handle(number: int, _frame: object) -> None:
        if not received:
            received.append(number)
            disable_collection()
            QTimer.singleShot(0, lambda: end(number))

    def log_off(manager: QSessionManager) -> None:
        manager.setRestartHint(QSessionManager.RestartHint.RestartNever)
        if not received:
            received.append(_HANG_UP)
            disable_collection()
            end(_HANG_UP)

    previous_handlers = {number: signal.signal(number, handle) for number in ENDING_SIGNALS}
    logging_off = log_off_signal()
    refuse_suspension(received)
    logging_off.connect(log_off, Qt.ConnectionType.DirectConnection)
    heartbeat = QTimer()
    heartbeat.timeout.connect(lambda: None)  # runs Python code, which lets Python handle signals
    heartbeat.start(_HEARTBEAT_MS)
    try:
        yield
    finally:
        heartbeat.stop()
        allow_suspension(received)
        logging_off.disconnect(log_off)
        for number, handler in previous_handlers.items():
            signal.signal(number, handler)
