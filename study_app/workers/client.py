"""The client of a worker process, which sends orders and receives answers without ever waiting for the process."""

import threading
from contextlib import suppress
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import Final, Generic, TypeVar

from study_app.workers.server import CONTEXT, Crashed, Refused, serve_orders

PATIENCE_S: Final = 3.0
"""How long a process may take to end before it is killed [s]."""

_Order = TypeVar("_Order")
_Answer = TypeVar("_Answer")


class WorkerClient(Generic[_Order, _Answer]):
    """A worker process that carries out orders, one after the other.

    A new order or `stop` asks the current one to stop early; the task decides whether to do so.

    Parameters
    ----------
    task : str
        The function that carries out an order (see `study_app.workers.server.Task`), as "package.module:function",
        which only the process imports. Orders and answers are pickled.
    background : bool
        Whether the process gets the lowest priority.

    Raises
    ------
    OSError
        The system cannot start a process.
    """

    def __init__(self, task: str, *, name: str, background: bool = False) -> None:
        orders_end, self._orders = CONTEXT.Pipe(duplex=False)
        self._answers, answers_end = CONTEXT.Pipe(duplex=False)
        self.process: BaseProcess = CONTEXT.Process(
            target=serve_orders,
            args=(orders_end, answers_end, task),
            kwargs={"background": background},
            name=name,
            daemon=True,
        )
        with orders_end, answers_end:
            self.process.start()
        self._order_count = 0
        self._open_orders: list[int] = []
        self._closed = False
        self._ending_thread: threading.Thread | None = None

    @property
    def works(self) -> bool:
        """Whether orders can be sent."""
        return not self._closed and self.process.is_alive()

    @property
    def ended(self) -> bool:
        """Whether the process has ended."""
        return not self.process.is_alive()

    def order(self, order: _Order) -> int:
        """Send an order; return the number that its answers have. Answers to earlier orders may still arrive."""
        self._order_count += 1
        self._open_orders.append(self._order_count)
        self._send((self._order_count, order))
        return self._order_count

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
                    self._open_orders.remove(number)
            return answers
        if self.process.is_alive():  # the process has closed its end of the pipe and is about to end
            return answers
        answers += [(number, Crashed(self.process.exitcode)) for number in self._open_orders]
        self._open_orders = []
        return answers

    def close(self) -> None:
        """Ask the process to end, even during an order; a thread kills it after `PATIENCE_S`."""
        if self._closed:
            return
        self._closed = True
        self._orders.close()
        self._answers.close()
        self.process.terminate()
        self._ending_thread = threading.Thread(
            target=self._end_process, name=f"{self.process.name} ending", daemon=True
        )
        self._ending_thread.start()

    def wait_until_ended(self) -> None:
        """Wait until the process has ended after `close`."""
        if self._ending_thread is not None:
            self._ending_thread.join()

    def _end_process(self) -> None:
        self.process.join(PATIENCE_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()

    def _send(self, message: tuple[int, _Order] | None) -> None:
        if not self._closed:
            with suppress(BrokenPipeError, ConnectionResetError):
                self._orders.send(message)
