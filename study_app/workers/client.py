"""The client of a worker process: it sends orders and receives answers, and never blocks on the process."""

import threading
from contextlib import suppress
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import Final, Generic, TypeVar

from study_app.workers.server import CONTEXT, Crashed, Refused, serve_orders

PATIENCE_S: Final = 3.0
"""Time after which a process that was asked to end is killed [s]."""

_Order = TypeVar("_Order")
_Answer = TypeVar("_Answer")


class WorkerClient(Generic[_Order, _Answer]):
    """A worker process that carries out orders, one after the other.

    A new order, like `stop`, asks the last one to stop early; its task decides whether to do so.

    Parameters
    ----------
    task : str
        The function that carries out an order (see `study_app.workers.server.Task`), as "package.module:function".
        Only the process imports it. Orders and answers are pickled.
    background : bool
        Whether the process gets the lowest priority.

    Raises
    ------
    OSError
        The system cannot start a process.
    """

    def __init__(self, task: str, *, name: str, background: bool = False) -> None:
        far_orders, self._orders = CONTEXT.Pipe(duplex=False)
        self._answers, far_answers = CONTEXT.Pipe(duplex=False)
        self.process: BaseProcess = CONTEXT.Process(
            target=serve_orders,
            args=(far_orders, far_answers, task),
            kwargs={"background": background},
            name=name,
            daemon=True,
        )
        with far_orders, far_answers:
            self.process.start()
        self._ordered = 0
        self._open: list[int] = []
        self._closed = False
        self._ending: threading.Thread | None = None

    @property
    def works(self) -> bool:
        """Whether the process accepts orders."""
        return not self._closed and self.process.is_alive()

    @property
    def ended(self) -> bool:
        """Whether the process has ended."""
        return not self.process.is_alive()

    def order(self, order: _Order) -> int:
        """Send an order; return the number of its answers. Answers to earlier orders may still arrive."""
        self._ordered += 1
        self._open.append(self._ordered)
        self._send((self._ordered, order))
        return self._ordered

    def stop(self) -> None:
        """Ask the current order to stop early."""
        self._send(None)

    def answers(self, wait_s: float = 0.0) -> list[tuple[int, _Answer | Refused | Crashed]]:
        """Return the answers since the last call, with the numbers of their orders.

        The last answer to an order is the result of its task, `Refused`, or `Crashed` if the process ended.

        Parameters
        ----------
        wait_s : float
            Maximum time to wait for the first answer [s].
        """
        if self._closed:
            return []
        answers: list[tuple[int, _Answer | Refused | Crashed]] = []
        with suppress(EOFError, OSError):
            wait([self._answers], wait_s)
            while self._answers.poll():
                number, answer, last = self._answers.recv()
                answers.append((number, answer))
                if last:
                    self._open.remove(number)
            return answers
        if self.process.is_alive():  # the process closed its end, and is about to end
            return answers
        answers += [(number, Crashed(self.process.exitcode)) for number in self._open]
        self._open = []
        return answers

    def close(self) -> None:
        """Ask the process to end, even during a request; a thread waits for it, and kills it after ``PATIENCE_S``."""
        if self._closed:
            return
        self._closed = True
        self._orders.close()
        self._answers.close()
        self.process.terminate()
        self._ending = threading.Thread(target=self._end, name=f"{self.process.name} ending", daemon=True)
        self._ending.start()

    def wait_until_ended(self) -> None:
        """Wait until the process has ended after `close`."""
        if self._ending is not None:
            self._ending.join()

    def _end(self) -> None:
        self.process.join(PATIENCE_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()

    def _send(self, message: tuple[int, _Order] | None) -> None:
        if not self._closed:
            with suppress(BrokenPipeError, ConnectionResetError):
                self._orders.send(message)
