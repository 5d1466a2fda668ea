"""Jobs outside the window's thread: neither a slow disk nor a long computation freezes a window."""

import queue
import threading
import time
import weakref
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, QTimer, Signal

LOOK_MS = 10
_threads: weakref.WeakSet[threading.Thread] = weakref.WeakSet()


def wait_for_jobs(seconds: float) -> None:
    """Wait a limited time for the jobs of every `Background`: Python aborts if it ends while one loads a module."""
    until_s = time.monotonic() + seconds
    for thread in tuple(_threads):
        thread.join(max(until_s - time.monotonic(), 0.0))


class Background(QObject):
    """Runs one job at a time in a thread; ``done`` carries what the last job that was asked for returned.

    A job that was asked for while another runs begins after it, unless a newer one takes its place. The job returns
    refusals (`StudyError`) as values; what else it raises goes to ``threading.excepthook`` and comes by ``failed``.
    """

    done = Signal(object)
    failed = Signal(object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._made: queue.SimpleQueue[tuple[Callable[[], Any], bool, Any]] = queue.SimpleQueue()
        self._wanted: Callable[[], Any] | None = None
        self._thread: threading.Thread | None = None
        self._look = QTimer(self)
        self._look.setInterval(LOOK_MS)
        self._look.timeout.connect(self._take)

    @property
    def busy(self) -> bool:
        """Whether something was asked for and has not come."""
        return self._wanted is not None

    def run(self, job: Callable[[], Any]) -> None:
        """Run ``job`` in a thread; what was asked for before it does not come any more."""
        self._wanted = job
        if self._thread is None:
            self._begin(job)

    def wait(self) -> None:
        """Wait until the job that runs has ended."""
        if self._thread is not None:
            self._thread.join()

    def _begin(self, job: Callable[[], Any]) -> None:
        made = self._made

        def work() -> None:
            found, whole = None, False
            try:
                found, whole = job(), True
            except BaseException as error:
                found = error
                raise
            finally:
                made.put((job, whole, found))

        self._thread = threading.Thread(target=work, name="background", daemon=True)
        _threads.add(self._thread)
        self._thread.start()
        self._look.start()

    def _take(self) -> None:
        try:
            job, whole, found = self._made.get_nowait()
        except queue.Empty:
            return
        self._look.stop()
        self._thread = None
        if self._wanted is not job and self._wanted is not None:
            self._begin(self._wanted)
            return
        self._wanted = None
        if whole:
            self.done.emit(found)
        else:
            self.failed.emit(found)
