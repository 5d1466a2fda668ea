"""Tasks that this process shares with a forked copy of itself."""

import multiprocessing
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, MutableSequence, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Generic, TypeVar

Result = TypeVar("Result")


class SharedTasks(Generic[Result]):
    """Computes tasks in this process and in a forked one, which inherits all values; only results are pickled.

    The forked process begins immediately, with the last task; this process begins in `results`, with the first one. It
    computes all tasks if the system cannot fork (Windows, macOS) or if this process has other threads, whose locks a
    fork would copy; and the remaining ones if the forked process dies.
    """

    def __init__(self, tasks: Sequence[Callable[[], Result]]) -> None:
        """Fork the process, if that is safe."""
        self._tasks = tasks
        self._begun: MutableSequence[int] = bytearray(len(tasks))
        self._results_of_fork: Connection | None = None
        if sys.platform == "linux" and threading.active_count() == 1 and len(tasks) > 1:
            context = multiprocessing.get_context("fork")
            # No lock is needed: if both processes begin a task at the same moment, both compute the same result.
            self._begun = context.RawArray("b", len(tasks))
            self._results_of_fork, sender = context.Pipe(duplex=False)
            self._process = context.Process(
                target=self._send_results, args=(self._results_of_fork, sender), daemon=True
            )
            self._process.start()
            sender.close()

    def results(self, report: Callable[[Result], object] | None = None) -> list[Result]:
        """Compute the remaining tasks; return all results in the order of the tasks.

        ``report`` is called with each result that is computed in this process.
        """
        computed: dict[int, Result] = {}

        def compute(indices: Iterable[int]) -> None:
            for index in indices:
                computed[index] = self._tasks[index]()
                if report is not None:
                    report(computed[index])

        try:
            compute(self._claim_tasks(range(len(self._tasks))))
            if self._results_of_fork is not None:
                with suppress(EOFError, OSError):
                    computed |= self._results_of_fork.recv()
            compute(index for index in range(len(self._tasks)) if index not in computed)
        finally:
            if self._results_of_fork is not None:
                self._results_of_fork.close()
                self._process.terminate()
                self._process.join()
        return [computed[index] for index in range(len(self._tasks))]

    def _send_results(self, receiver: Connection, sender: Connection) -> None:
        receiver.close()  # so that sending fails once the other process has ended
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C ends the other process, which ends this one
        computed = {index: self._tasks[index]() for index in self._claim_tasks(reversed(range(len(self._tasks))))}
        with suppress(BrokenPipeError):
            sender.send(computed)

    def _claim_tasks(self, indices: Iterable[int]) -> Iterator[int]:
        """Yield the tasks that neither process has begun, and mark them as begun."""
        for index in indices:
            if not self._begun[index]:
                self._begun[index] = 1
                yield index
