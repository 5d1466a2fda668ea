"""The worker process: it carries out orders in sequence, by one function, until its client has ended.

Processes are started by spawn and ignore Ctrl+C, which the terminal sends to all processes of a program. `Refused`,
`Crashed` and `Stopped` answer any order, besides the values of its task.
"""

import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from pkgutil import resolve_name
from queue import SimpleQueue
from typing import Any, Final, TypeAlias

import psutil

from study_app.discovery import explain_error
from study_app.errors import MissingExtra, StudyError, naming_the_extra
from study_app.workers.one_thread import compute_in_one_thread

Send: TypeAlias = Callable[[Any], object]
"""Sends an answer before the last one."""
Stop: TypeAlias = Callable[[], bool]
"""Returns whether to stop early: by request, because another order waits, or because the client has ended."""
Task: TypeAlias = Callable[[Any, Send, Stop], object]
"""Executes an order and returns its last answer. A `StudyError` is answered by `Refused`."""
_STOP: Final = None
_END: Final = object()


@dataclass(frozen=True, slots=True)
class Refused:
    """An order could not be carried out, with the reason and without partial effects.

    ``stopped``: by request; ``lacks_extra``: libraries are not installed.
    """

    sentence: str
    stopped: bool = False
    lacks_extra: bool = False


@dataclass(frozen=True, slots=True)
class Crashed:
    """The process ended before it had carried out the order.

    ``exit_code`` is negative if a signal ended it, 1 if the terminal shows an exception.
    """

    exit_code: int | None

    @property
    def sentence(self) -> str:
        """The description of the event for the user."""
        if self.exit_code is not None and self.exit_code < 0:
            return f"the process was ended by signal {-self.exit_code}"
        return f"the process ended with exit code {self.exit_code}; the terminal may show why"


class Stopped(StudyError):
    """An order stopped early, by request or because of another order."""


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


def serve_orders(orders: Connection, answers: Connection, task: str, *, background: bool) -> None:
    """Carry out orders (number, order) until the client has ended; answers are (number, answer, last)."""
    ignore_interrupts()
    if background:
        psutil.Process().nice(getattr(psutil, "IDLE_PRIORITY_CLASS", 19))
        compute_in_one_thread()
    waiting: SimpleQueue[Any] = SimpleQueue()
    # Orders are read at once: a full pipe would make the client's window wait.
    threading.Thread(target=_read, args=(orders, waiting), name="orders", daemon=True).start()
    with suppress(ModuleNotFoundError):  # the first order reports the error
        resolve_name(task)
    with suppress(BrokenPipeError, ConnectionResetError):
        while (received := waiting.get()) is not _END:
            if received is _STOP:
                continue  # the order has already ended
            number, order = received
            try:
                with naming_the_extra():
                    carry_out: Task = resolve_name(task)
                    last = carry_out(order, partial(_send, answers, number), lambda: not waiting.empty())
            except Exception as raised:
                if not isinstance(error := explain_error(raised), StudyError):
                    raise
                last = Refused(str(error), isinstance(error, Stopped), isinstance(error, MissingExtra))
            answers.send((number, last, True))


def _send(answers: Connection, number: int, answer: object) -> None:
    answers.send((number, answer, False))


def _read(orders: Connection, waiting: SimpleQueue[Any]) -> None:
    try:
        with suppress(EOFError, OSError):
            while True:
                waiting.put(orders.recv())
    finally:
        waiting.put(_END)
