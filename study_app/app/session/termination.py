"""The ways a program is ended from outside: signals, Ctrl+C, and the system's session that is logged off."""

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from PySide6.QtCore import Qt, QTimer, SignalInstance
from PySide6.QtGui import QGuiApplication, QSessionManager

from study_app.haptics.runtime.suspension import allow_suspension, refuse_suspension

HEARTBEAT_MS = 100  # how long a signal may wait to be heard
BY_SIGNAL_S = 2.0  # how long a program that is ended from outside waits for threads; the force is zero before
HANG_UP = 1  # the number of SIGHUP, which a log-off counts as everywhere


class Patience:
    """How long several waits may take together [s]."""

    def __init__(self, seconds: float) -> None:
        self._until_s = time.monotonic() + seconds

    @property
    def left_s(self) -> float:
        """What is left of it [s]; never negative."""
        return max(self._until_s - time.monotonic(), 0.0)


def log_off_signal() -> SignalInstance:
    """Return the signal by which the system asks to keep what is to be kept, before it ends the program."""
    application = QGuiApplication.instance()
    assert isinstance(application, QGuiApplication)  # noqa: S101 - whoever shows windows has made it
    return application.commitDataRequest


@contextmanager
def ended_from_outside(end: Callable[[int], None]) -> Iterator[None]:
    """Let Ctrl+C, requests to terminate and a log-off call ``end`` with a signal's number, once.

    Signals are heard from the event loop. A log-off waits for ``end``, and for nothing else. Ctrl-Z does nothing: what
    pushes would push on.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []

    def hear(number: int, _frame: object) -> None:
        if not heard:
            heard.append(number)
            QTimer.singleShot(0, lambda: end(number))

    def log_off(manager: QSessionManager) -> None:
        manager.setRestartHint(QSessionManager.RestartHint.RestartNever)
        if not heard:
            heard.append(HANG_UP)
            end(HANG_UP)

    names = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    before = {number: signal.signal(number, hear) for number in numbers}
    logging_off = log_off_signal()
    refuse_suspension(heard)
    logging_off.connect(log_off, Qt.ConnectionType.DirectConnection)
    heart = QTimer()
    heart.timeout.connect(lambda: None)  # Python hears signals only while it runs; Qt waits outside it
    heart.start(HEARTBEAT_MS)
    try:
        yield
    finally:
        heart.stop()
        allow_suspension(heard)
        logging_off.disconnect(log_off)
        for number, handler in before.items():
            signal.signal(number, handler)
