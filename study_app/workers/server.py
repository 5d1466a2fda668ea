"""The worker process: it carries out orders in sequence, by one function, until its client has ended."""

import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from pkgutil import resolve_name
from queue import SimpleQueue
from typing import Any, Final, TypeAlias

import psutil

from study_app.errors import StudyError, naming_the_extra
from study_app.workers.messages import Refused, Stopped
from study_app.workers.spawning import compute_in_one_thread, ignore_interrupts

Send: TypeAlias = Callable[[Any], object]
"""Sends an answer before the last one."""

Stop: TypeAlias = Callable[[], bool]
"""Whether to stop early: by request, because another order waits, or because the client has ended."""

Task: TypeAlias = Callable[[Any, Send, Stop], object]
"""Carries out an order; what it returns is its last answer. A `StudyError` is answered by `Refused`."""

_STOP: Final = None
_END: Final = object()


def serve(orders: Connection, answers: Connection, task: str, *, background: bool) -> None:
    """Carry out orders (number, order) until the client has ended; answers are (number, answer, last).

    Parameters
    ----------
    task : str
        The function that carries out an order (see `Task`), as "package.module:function". It is imported here.
    background : bool
        Whether this process gets the lowest priority and computes in one thread, before it imports the task.
    """
    ignore_interrupts()
    if background:
        psutil.Process().nice(getattr(psutil, "IDLE_PRIORITY_CLASS", 19))
        compute_in_one_thread()
    waiting: SimpleQueue[Any] = SimpleQueue()
    # Orders are read at once: a full pipe would make the client's window wait.
    threading.Thread(target=_read, args=(orders, waiting), name="orders", daemon=True).start()
    with suppress(ModuleNotFoundError):  # then the first order reports it
        resolve_name(task)
    with suppress(BrokenPipeError, ConnectionResetError):
        while (received := waiting.get()) is not _END:
            if received is _STOP:
                continue  # its order has ended
            number, order = received
            try:
                with naming_the_extra():
                    carry_out: Task = resolve_name(task)
                    last = carry_out(order, partial(_send, answers, number), lambda: not waiting.empty())
            except StudyError as error:
                last = Refused(str(error), stopped=isinstance(error, Stopped))
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
