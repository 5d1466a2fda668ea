"""Start of worker processes: by spawn, and ignoring Ctrl+C, which the terminal sends to all processes of a program."""

import os
import signal
import sys
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Final


class _WorkerProcess(SpawnProcess):
    """A process that begins with SIGINT blocked, so that it prints no traceback before it can ignore it."""

    def start(self) -> None:
        if sys.platform == "win32":
            super().start()
        else:
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                super().start()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _WorkerContext(SpawnContext):
    """Spawns `_WorkerProcess`."""

    Process = _WorkerProcess


CONTEXT: Final = _WorkerContext()


def ignore_interrupts() -> None:
    """Ignore Ctrl+C: the program that started this process ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def compute_in_one_thread() -> None:
    """Limit the linear algebra of this process to one thread; numpy must not be imported yet."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
