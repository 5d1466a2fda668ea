"""A part of a computation in a copy of this process, beside the rest of it."""

import multiprocessing
import sys
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Generic, TypeVar

Result = TypeVar("Result")


class Forked(Generic[Result]):
    """Computes ``compute()`` in a forked process, which inherits all values; only the result is pickled.

    `result` computes it here if the system cannot fork (Windows, macOS), if this process has other threads, whose locks
    a fork would copy, or if the forked process ends without a result.
    """

    def __init__(self, compute: Callable[[], Result]) -> None:
        """Start the process, if it is safe."""
        self._compute = compute
        self._results: Connection | None = None
        if sys.platform == "linux" and threading.active_count() == 1:
            context = multiprocessing.get_context("fork")
            self._results, sender = context.Pipe(duplex=False)
            self._process = context.Process(target=_send, args=(compute, sender), daemon=True)
            self._process.start()
            sender.close()

    def result(self) -> Result:
        """Wait for the result and return it."""
        if self._results is not None:
            try:
                result: Result = self._results.recv()
            except (EOFError, OSError):
                pass
            else:
                return result
            finally:
                self._results.close()
                self._process.join()
        return self._compute()


def _send(compute: Callable[[], Result], sender: Connection) -> None:
    sender.send(compute())
