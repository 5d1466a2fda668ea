"""The client of a worker process, which sends requests and receives replies without ever waiting for the process."""

import threading
from contextlib import suppress
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import Final, Generic, TypeVar

from study_app.workers.server import CONTEXT, Crashed, Refused, serve_requests

PATIENCE_S: Final = 3.0
"""How long a process may take to end before it is killed [s]."""

_Request = TypeVar("_Request")
_Reply = TypeVar("_Reply")


class WorkerClient(Generic[_Request, _Reply]):
    """A worker process that runs requests, one after the other.

    A new request or `stop` asks the current one to stop early; the task decides whether to do so.

    Parameters
    ----------
    task : str
        The function that runs a request (see `study_app.workers.server.Task`), as "package.module:function",
        which only the process imports. Requests and replies are pickled.
    background : bool
        Whether the process gets the lowest priority.

    Raises
    ------
    OSError
        The system cannot start a process.
    """

    def __init__(self, task: str, *, name: str, background: bool = False) -> None:
        requests_end, self._requests = CONTEXT.Pipe(duplex=False)
        self._replies, replies_end = CONTEXT.Pipe(duplex=False)
        self.process: BaseProcess = CONTEXT.Process(
            target=serve_requests,
            args=(requests_end, replies_end, task),
            kwargs={"background": background},
            name=name,
            daemon=True,
        )
        with requests_end, replies_end:
            self.process.start()
        self._request_count = 0
        self._open_requests: list[int] = []
        self._closed = False
        self._ending_thread: threading.Thread | None = None

    @property
    def works(self) -> bool:
        """Whether requests can be sent."""
        return not self._closed and self.process.is_alive()

    @property
    def ended(self) -> bool:
        """Whether the process has ended."""
        return not self.process.is_alive()

    def order(self, request: _Request) -> int:
        """Send a request; return the number that its replies have. Replies to earlier requests may still arrive."""
        self._request_count += 1
        self._open_requests.append(self._request_count)
        self._send((self._request_count, request))
        return self._request_count

    def stop(self) -> None:
        """Ask the current request to stop early."""
        self._send(None)

    def answers(self, wait_s: float = 0.0) -> list[tuple[int, _Reply | Refused | Crashed]]:
        """Return the replies since the last call, with the numbers of their requests.

        The last reply to a request is the result of its task, `Refused`, or `Crashed` if the process ended.

        Parameters
        ----------
        wait_s : float
            Maximum time to wait for the first reply [s].
        """
        if self._closed:
            return []
        replies: list[tuple[int, _Reply | Refused | Crashed]] = []
        with suppress(EOFError, OSError):
            wait([self._replies], wait_s)
            while self._replies.poll():
                number, reply, last = self._replies.recv()
                replies.append((number, reply))
                if last:
                    self._open_requests.remove(number)
            return replies
        if self.process.is_alive():  # the process has closed its end of the pipe and is about to end
            return replies
        replies += [(number, Crashed(self.process.exitcode)) for number in self._open_requests]
        self._open_requests = []
        return replies

    def close(self) -> None:
        """Ask the process to end, even during a request; a thread kills it after `PATIENCE_S`."""
        if self._closed:
            return
        self._closed = True
        self._requests.close()
        self._replies.close()
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

    def _send(self, message: tuple[int, _Request] | None) -> None:
        if not self._closed:
            with suppress(BrokenPipeError, ConnectionResetError):
                self._requests.send(message)
