"""The process that reads and evaluates studies for a window, from both its ends.

It is asked by orders and tells what it finds piece by piece; the libraries and tables of an evaluation stay in it.
"""

from __future__ import annotations

import multiprocessing
import signal
import threading
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Final

from study_app.analysis.worker_messages import Answer, Order, Refused, Stopped
from study_app.errors import StudyError

PATIENCE_S: Final = 2.0


class AnalysisClient:
    """Gives orders to a process of its own; never waits for it.

    A new order stops the one before at its next step, unless that one writes.
    """

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, far = context.Pipe()
        self._process = context.Process(target=serve, args=(far,), name="analyst", daemon=True)
        self._process.start()
        far.close()
        self._ordered = 0

    @property
    def works(self) -> bool:
        """Whether there still is somebody to give orders to."""
        return self._process.is_alive()

    @property
    def process_id(self) -> int | None:
        """The process's id."""
        return self._process.pid

    def order(self, order: Order) -> int:
        """Give an order; return the number that its answers have. Answers to earlier orders may still come."""
        self._ordered += 1
        self._send((self._ordered, order))
        return self._ordered

    def stop(self) -> None:
        """Ask that the order that is carried out be given up."""
        self._send((self._ordered, None))

    def answers(self) -> list[tuple[int, Answer]]:
        """Return what was told since; the last of an order is `Done` or `Refused`."""
        found: list[tuple[int, Answer]] = []
        with suppress(EOFError, ConnectionResetError):
            while self._connection.poll():
                found.append(self._connection.recv())
        return found

    def close(self) -> None:
        """End the process, whatever it is doing; a thread waits until it is gone."""
        self._connection.close()
        self._process.terminate()
        threading.Thread(target=_see_off, args=(self._process,), name="analyst ending", daemon=True).start()

    def _send(self, message: tuple[int, Order | None]) -> None:
        with suppress(BrokenPipeError, ConnectionResetError):
            self._connection.send(message)


def _see_off(process: BaseProcess) -> None:
    """Wait until a process that was ended is gone."""
    process.join(PATIENCE_S)
    if process.is_alive():
        process.kill()
        process.join(PATIENCE_S)


def serve(connection: Connection) -> None:
    """Carry out (number, order) one after the other until nobody is there any more; answers are (number, answer)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program; this ends with its connection
    from study_app.analysis.worker import carry_out  # noqa: PLC0415 - the libraries: only in this process

    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            number, order = connection.recv()
            if order is None:
                continue  # asked to stop what had just come to its end
            try:
                last: Answer = carry_out(order, partial(_tell, connection, number), connection.poll)
            except StudyError as error:
                last = Refused(str(error), stopped=isinstance(error, Stopped))
            connection.send((number, last))


def _tell(connection: Connection, number: int, told: Answer) -> None:
    connection.send((number, told))
