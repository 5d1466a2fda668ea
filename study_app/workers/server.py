"""The worker process, which runs requests one after the other until its client ends.

Processes are spawned and ignore Ctrl+C, which the terminal sends to all processes of a program. The replies to a
request are the values of its task, and `Refused` or `Crashed` if it fails.
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
"""Sends a reply that is not the last one."""
Stop: TypeAlias = Callable[[], bool]
"""Returns whether to stop early, since the client asked for it, sent another request, or has ended."""
Task: TypeAlias = Callable[[Any, Send, Stop], object]
"""Runs a request and returns the last reply; a `StudyError` becomes the reply `Refused`."""
_STOP: Final = None
_END: Final = object()


@dataclass(frozen=True, slots=True)
class Refused:
    """A request could not be run, with the reason and without partial effects.

    ``stopped`` means that it was asked to stop; ``lacks_extra`` means that libraries of an extra are not installed.
    """

    sentence: str
    stopped: bool = False
    lacks_extra: bool = False


@dataclass(frozen=True, slots=True)
class Crashed:
    """The process ended before it had finished the request.

    ``exit_code`` is negative if a signal ended it, and 1 after an exception, which the terminal shows.
    """

    exit_code: int | None

    @property
    def sentence(self) -> str:
        """A description for the user."""
        if self.exit_code is not None and self.exit_code < 0:
            return f"the process was ended by signal {-self.exit_code}"
        return f"the process ended with exit code {self.exit_code}; the terminal may show why"


class Stopped(StudyError):
    """A request stopped early, because the client asked for it or sent another request."""


class _WorkerProcess(SpawnProcess):
    """A process that starts with SIGINT blocked, so that Ctrl+C prints no traceback before it is ignored."""

    def start(self) -> None:
        if sys.platform == "win32":
            super().start()
        else:
            previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                super().start()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


class _WorkerContext(SpawnContext):
    """The context that spawns `_WorkerProcess`."""

    Process = _WorkerProcess


CONTEXT: Final = _WorkerContext()


def ignore_interrupts() -> None:
    """Ignore Ctrl+C, since the program that started this process ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def serve_requests(requests: Connection, replies: Connection, task: str, *, background: bool) -> None:
    """Run requests (number, request) until the client ends, and send replies (number, reply, is_last)."""
    ignore_interrupts()
    if background:
        psutil.Process().nice(getattr(psutil, "IDLE_PRIORITY_CLASS", 19))
        compute_in_one_thread()
    waiting: SimpleQueue[Any] = SimpleQueue()
    # Requests are read immediately, since a full pipe would block the client's window.
    threading.Thread(target=_read_requests, args=(requests, waiting), name="requests", daemon=True).start()
    with suppress(ModuleNotFoundError):  # the first request reports the error
        resolve_name(task)
    with suppress(BrokenPipeError, ConnectionResetError):
        while (received := waiting.get()) is not _END:
            if received is _STOP:
                continue  # the request to be stopped has already finished
            number, request = received
            try:
                with naming_the_extra():
                    carry_out: Task = resolve_name(task)
                    last_reply = carry_out(request, partial(_send, replies, number), lambda: not waiting.empty())
            except Exception as exception:
                if not isinstance(error := explain_error(exception), StudyError):
                    raise
                last_reply = Refused(str(error), isinstance(error, Stopped), isinstance(error, MissingExtra))
            replies.send((number, last_reply, True))


def _send(replies: Connection, number: int, reply: object) -> None:
    replies.send((number, reply, False))


def _read_requests(requests: Connection, waiting: SimpleQueue[Any]) -> None:
    try:
        with suppress(EOFError, OSError):
            while True:
                waiting.put(requests.recv())
    finally:
        waiting.put(_END)
