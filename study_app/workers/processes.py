"""An executor of local processes that outlasts the loss of one: the cases not finished are computed again."""

import heapq
import os
import threading
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from queue import SimpleQueue
from types import TracebackType
from typing import Any, Final, ParamSpec, TypeVar

from study_app.errors import WorkerError
from study_app.workers.spawning import CONTEXT, compute_in_one_thread, ignore_interrupts

ATTEMPTS: Final = 3
"""A case that was being computed in this many broken pools is not tried again."""
AHEAD: Final = 2
"""Cases in the pool per process: the one it computes, and the next."""

P = ParamSpec("P")
T = TypeVar("T")


class CancellingExecutor(Executor):
    """An executor whose ``with`` block, left by an exception, cancels what has not finished.

    Attributes
    ----------
    workers : int
        How many cases it computed at the same time when it was opened.
    """

    workers: int

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for all cases, or cancel them."""
        self.shutdown(cancel_futures=kind is not None)


@dataclass(order=True)
class _Case:
    number: int
    call: tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]] = field(compare=False)
    future: Future[Any] = field(compare=False)
    attempts: int = field(default=0, compare=False)


@dataclass(frozen=True)
class _Finished:
    case: _Case
    pool: ProcessPoolExecutor
    found: Future[Any]


@dataclass(frozen=True)
class _Shutdown:
    cancel: bool


class ProcessExecutor(CancellingExecutor):
    """Processes that start when there are cases, import their own modules, and ignore Ctrl+C.

    They end with the executor, or with its program. When one ends unexpectedly, its pool is replaced, and the
    unfinished cases are computed again. One thread owns the pool; futures of cancelled cases are never the pool's own.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._watched, self._held = CONTEXT.Pipe(duplex=False)
        self._messages: SimpleQueue[_Case | _Finished | _Shutdown] = SimpleQueue()
        self._submitted = 0
        self._closed = False
        self._dispatcher = threading.Thread(target=self._dispatch, name="cases", daemon=True)
        self._dispatcher.start()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Compute a case.

        Raises
        ------
        RuntimeError
            The executor was shut down.
        """
        if self._closed:
            raise RuntimeError("the executor was shut down")
        future: Future[T] = Future()
        self._submitted += 1
        self._messages.put(_Case(self._submitted, (fn, args, kwargs), future))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Finish all cases, or cancel those that have not finished, and end the processes.

        Parameters
        ----------
        wait : bool
            Whether to return when that is done.
        cancel_futures : bool
            Whether to end the processes at once.
        """
        self._closed = True
        self._messages.put(_Shutdown(cancel_futures))
        if wait:
            self._dispatcher.join()

    def _dispatch(self) -> None:
        waiting: list[_Case] = []
        running: list[_Case] = []
        pool: ProcessPoolExecutor | None = None
        ending: _Shutdown | None = None
        with self._watched, self._held:
            while ending is None or running or waiting:
                message = self._messages.get()
                if isinstance(message, _Case):
                    heapq.heappush(waiting, message)
                elif isinstance(message, _Shutdown):
                    ending = message
                    if ending.cancel:
                        self._held.close()
                else:
                    running.remove(message.case)
                    if message.pool is pool and _lost(message.found):
                        pool.shutdown()
                        pool = None
                    if not _settled(message.case, message.found, cancel=ending is not None and ending.cancel):
                        heapq.heappush(waiting, message.case)
                if ending is not None and ending.cancel:
                    for case in waiting:
                        _drop(case)
                    waiting.clear()
                while waiting and len(running) < AHEAD * self.workers:
                    case = heapq.heappop(waiting)
                    if case.future.cancelled():
                        _drop(case)
                        continue
                    pool = pool or self._new_pool()
                    self._start(case, pool)
                    running.append(case)
            if pool is not None:
                pool.shutdown()

    def _new_pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(
            self.workers, mp_context=CONTEXT, initializer=_start_process, initargs=(self._watched,)
        )

    def _start(self, case: _Case, pool: ProcessPoolExecutor) -> None:
        """Submit a case to the pool; its end is reported to the dispatcher, which alone handles it."""
        function, args, kwargs = case.call
        try:
            found = pool.submit(function, *args, **kwargs)
        except (BrokenExecutor, OSError, RuntimeError) as error:  # the system cannot start a process
            found = Future()
            found.set_exception(BrokenExecutor(str(error)) if isinstance(error, OSError) else error)
        found.add_done_callback(lambda found: self._messages.put(_Finished(case, pool, found)))


def _lost(found: Future[Any]) -> bool:
    """Return whether a process of the pool ended before the outcome was there."""
    return isinstance(found.exception(), BrokenExecutor)


def _settled(case: _Case, found: Future[Any], *, cancel: bool) -> bool:
    """Set the outcome of a case; return False if it must be computed again."""
    error = found.exception()
    if _lost(found):
        case.attempts += 1
        if cancel or case.future.cancelled():
            _drop(case)
            return True
        if case.attempts < ATTEMPTS:
            return False
        cause = error
        error = WorkerError(
            f"a worker process ended unexpectedly {ATTEMPTS} times during the same cases, or could not be started (it "
            "was killed, or the memory was exhausted): try again with fewer --workers"
        )
        error.__cause__ = cause
    if case.future.set_running_or_notify_cancel():
        if error is not None:
            case.future.set_exception(error)
        else:
            case.future.set_result(found.result())
    return True


def _drop(case: _Case) -> None:
    """Cancel a case that has no outcome."""
    case.future.cancel()
    case.future.set_running_or_notify_cancel()


def _start_process(watched: Connection) -> None:
    """Prepare a process of the pool before it imports the computing modules."""
    ignore_interrupts()
    compute_in_one_thread()  # there are as many processes as cores
    threading.Thread(target=_exit_at_end_of, args=(watched,), name="end of program", daemon=True).start()


def _exit_at_end_of(watched: Connection) -> None:
    """End this process when the other end of the pipe is closed: by the executor, or because its program was killed."""
    with suppress(EOFError, OSError):
        watched.recv_bytes()
    os._exit(0)
