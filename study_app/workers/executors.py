"""Executors for many independent cases, each of which draws from its own seed.

Code that has many cases takes a `concurrent.futures.Executor` and uses only its ``submit`` and ``map``, so another one,
such as a cluster's, can take the place of those made here.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Final, Literal, TypeAlias, get_args

from study_app.errors import WorkerError

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing.connection import Connection

# multiprocessing is loaded where processes are needed: every command imports this module.

Engine: TypeAlias = Literal["processes", "threads"]
ENGINES: Final[tuple[Engine, ...]] = get_args(Engine)

POLL_S: Final = 0.01
_ONE_THREAD: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""A process of the pool computes linear algebra in one thread: there are as many processes as cores."""


@contextmanager
def open_executor(engine: Engine = "processes", workers: int = -1) -> Iterator[Executor]:
    """Open an executor on this computer; leaving the block by an exception cancels what has not begun.

    Parameters
    ----------
    engine : {"processes", "threads"}
        Processes import anew what they need; they ignore Ctrl+C, and end when the block or this program ends.
    workers : int
        How many cases are computed at the same time; -1: one per core.

    Yields
    ------
    concurrent.futures.Executor

    Raises
    ------
    WorkerError
        A process of the executor ended unexpectedly.
    """
    count = workers if workers > 0 else os.cpu_count() or 1
    if engine == "threads":
        with ThreadPoolExecutor(count) as threads:
            try:
                yield threads
            except BaseException:
                threads.shutdown(wait=False, cancel_futures=True)
                raise
        return
    from concurrent.futures import ProcessPoolExecutor  # noqa: PLC0415

    from study_app.workers.spawning import CONTEXT  # noqa: PLC0415

    watched, held = CONTEXT.Pipe(duplex=False)
    with watched, held:
        pool = ProcessPoolExecutor(count, mp_context=CONTEXT, initializer=_start_process, initargs=(watched,))
        try:
            yield pool
        except BaseException as error:
            _cancel(pool, held)
            if isinstance(error, BrokenExecutor):
                raise WorkerError(
                    "a worker process ended unexpectedly (it was killed, or the memory was exhausted): try again with "
                    "fewer workers"
                ) from error
            raise
        pool.shutdown()


def _cancel(pool: ProcessPoolExecutor, held: Connection) -> None:
    """Cancel what has not begun, then end the processes, whatever they compute, and wait for them.

    Python 3.11 prints a traceback where a pool breaks that still holds cancelled futures. So the processes are ended
    once the last future is cancelled, or runs: then those before it were taken out of the queue.
    """
    ending = threading.Thread(target=pool.shutdown, kwargs={"cancel_futures": True}, name="end of executor")
    try:
        last = pool.submit(int)
    except BrokenExecutor:
        ending.start()
    else:
        ending.start()
        while not (last.running() or last.done()):
            time.sleep(POLL_S)
    held.close()
    ending.join()


def _start_process(watched: Connection) -> None:
    """Prepare a process of the pool before it imports what computes."""
    from study_app.workers.spawning import ignore_interrupts  # noqa: PLC0415

    ignore_interrupts()
    for name in _ONE_THREAD:
        os.environ.setdefault(name, "1")
    threading.Thread(target=_exit_at_end_of, args=(watched,), name="end of program", daemon=True).start()


def _exit_at_end_of(watched: Connection) -> None:
    """End this process when the other end of the pipe is closed: by the executor, or because its program was killed."""
    with suppress(EOFError, OSError):
        watched.recv_bytes()
    os._exit(0)
