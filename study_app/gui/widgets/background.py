"""Jobs outside the GUI thread, so that neither a slow disk nor a long computation freezes a window."""

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
_emitting, _program_ends = threading.Lock(), threading.Event()


@atexit.register
def _abandon_jobs() -> None:
    """Abandon running jobs before Qt is shut down, because a late signal would crash."""
    with _emitting:
        _program_ends.set()


def wait_for_jobs(seconds: float) -> None:
    """Wait at most ``seconds`` for all running jobs: Python aborts if it exits while a thread imports a module."""
    deadline_s = time.perf_counter() + seconds
    for thread in tuple(_threads):
        thread.join(max(deadline_s - time.perf_counter(), 0.0))


class _Outcomes(QObject):
    """Delivers the outcomes of jobs to the GUI thread; a job may outlive its `Background`, but not this object."""

    arrived = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.arrived.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    def _deliver(self, outcome: tuple["Background", Callable[[], Any], bool, Any]) -> None:
        background, *arguments = outcome
        if isValid(background):
            background.deliver_outcome(*arguments)


@cache
def _shared_outcomes() -> _Outcomes:
    return _Outcomes()


def delayed_call(owner: QObject, milliseconds: int, run: Callable[[], Any]) -> QTimer:
    """Return a timer that calls ``run`` once, the given time after the last start of the timer."""
    timer = QTimer(owner)
    timer.setSingleShot(True)
    timer.setInterval(milliseconds)
    timer.timeout.connect(run)
    return timer


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
        self._outcomes = _shared_outcomes()  # must be created in the GUI thread
        self._requested: Callable[[], Any] | None = None
        self._thread: threading.Thread | None = None

    @property
    def busy(self) -> bool:
        return self._requested is not None

    def run(self, job: Callable[[], Any]) -> None:
        """Run ``job`` in a thread; the result of an earlier job is discarded."""
        self._requested = job
        if self._thread is None:
            self._start_job(job)

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until the running job has ended; return whether it has."""
        if self._thread is None:
            return True
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _start_job(self, job: Callable[[], Any]) -> None:
        def run_job() -> None:
            outcome, succeeded = None, False
            try:
                outcome, succeeded = job(), True
            except self._refusals as error:
                outcome = error
            except BaseException as error:
                outcome = error
                raise
            finally:
                with _emitting:
                    if not _program_ends.is_set():
                        self._outcomes.arrived.emit((self, job, succeeded, outcome))

        self._thread = threading.Thread(target=run_job, name="background", daemon=True)
        _threads.add(self._thread)
        self._thread.start()

    def deliver_outcome(self, job: Callable[[], Any], succeeded: bool, outcome: Any) -> None:
        """Emit a job's result, or its exception if it has not ``succeeded``; start the job that replaced it, if any."""
        self._thread = None
        if self._requested is not job and self._requested is not None:
            self._start_job(self._requested)
            return
        self._requested = None
        refused = not succeeded and isinstance(outcome, self._refusals)
        if refused and not self.isSignalConnected(QMetaMethod.fromSignal(self.failed)):
            log.warning("%s", outcome)
        (self.done if succeeded else self.failed).emit(outcome)
