"""Jobs outside the window's thread: neither a slow disk nor a long computation freezes a window."""

import atexit
import logging
import threading
import time
import weakref
from collections.abc import Callable
from functools import cache
from typing import Any

from PySide6.QtCore import QMetaMethod, QObject, Qt, QTimer, Signal
from shiboken6 import isValid

from study_app.errors import StudyError

log = logging.getLogger(__name__)

_threads: weakref.WeakSet[threading.Thread] = weakref.WeakSet()
_telling, _program_ends = threading.Lock(), threading.Event()


@atexit.register
def _abandon_jobs() -> None:
    """Abandon running jobs before Qt is shut down, because a late signal would crash."""
    with _telling:
        _program_ends.set()


def wait_for_jobs(seconds: float) -> None:
    """Wait a limited time for the jobs of every `Background`; Python aborts if it exits during an import."""
    until_s = time.perf_counter() + seconds
    for thread in tuple(_threads):
        thread.join(max(until_s - time.perf_counter(), 0.0))


class _Ends(QObject):
    """Delivers the ends of jobs to the GUI thread; a job may outlive its `Background`, but not this object."""

    came = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.came.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    def _deliver(self, end: tuple["Background", Callable[[], Any], bool, Any]) -> None:
        background, *rest = end
        if isValid(background):
            background.take_outcome(*rest)


@cache
def _shared_ends() -> _Ends:
    return _Ends()


def delayed_call(owner: QObject, milliseconds: int, run: Callable[[], Any]) -> QTimer:
    """Return a timer that calls a function once, this time after it was last started."""
    made = QTimer(owner)
    made.setSingleShot(True)
    made.setInterval(milliseconds)
    made.timeout.connect(run)
    return made


class Background(QObject):
    """Runs one job at a time in a thread; ``done`` carries the result of the last requested job.

    A job that is requested while another runs starts after it, unless a newer one replaces it. Exceptions are emitted
    by ``failed``; those that are not ``refusals`` also go to ``threading.excepthook``. A refusal is logged if nothing
    is connected to ``failed``.
    """

    done = Signal(object)
    failed = Signal(object)

    def __init__(self, parent: QObject, refusals: type[Exception] = StudyError) -> None:
        super().__init__(parent)
        self._refusals = refusals
        self._ends = _shared_ends()  # made in the windows' thread
        self._wanted: Callable[[], Any] | None = None
        self._thread: threading.Thread | None = None

    @property
    def busy(self) -> bool:
        return self._wanted is not None

    def run(self, job: Callable[[], Any]) -> None:
        """Run ``job`` in a thread; the result of an earlier job is discarded."""
        self._wanted = job
        if self._thread is None:
            self._start_job(job)

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until the running job has ended; return whether it has."""
        if self._thread is None:
            return True
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _start_job(self, job: Callable[[], Any]) -> None:
        def work() -> None:
            outcome, whole = None, False
            try:
                outcome, whole = job(), True
            except self._refusals as error:
                outcome = error
            except BaseException as error:
                outcome = error
                raise
            finally:
                with _telling:
                    if not _program_ends.is_set():
                        self._ends.came.emit((self, job, whole, outcome))

        self._thread = threading.Thread(target=work, name="background", daemon=True)
        _threads.add(self._thread)
        self._thread.start()

    def take_outcome(self, job: Callable[[], Any], whole: bool, outcome: Any) -> None:
        """Emit a job's result, or its exception if it is not ``whole``; begin the job that replaced it."""
        self._thread = None
        if self._wanted is not job and self._wanted is not None:
            self._start_job(self._wanted)
            return
        self._wanted = None
        refused = not whole and isinstance(outcome, self._refusals)
        if refused and not self.isSignalConnected(QMetaMethod.fromSignal(self.failed)):
            log.warning("%s", outcome)
        (self.done if whole else self.failed).emit(outcome)
