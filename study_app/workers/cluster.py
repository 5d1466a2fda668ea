"""An executor on a Dask cluster, whose workers must hold the same program, Python and libraries as this computer."""

import logging
import re
import socket
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError, Future
from concurrent.futures import wait as wait_for
from functools import partial
from typing import Any, Final, ParamSpec, TypeVar

from study_app.errors import WorkerError
from study_app.workers.environment import difference, environment
from study_app.workers.processes import CancellingExecutor

ADDRESS: Final = re.compile(r"(?:tcp|tls)://(?:\[(?P<ipv6>[0-9a-fA-F:]+)\]|(?P<host>[^\s:/\[\]]+)):(?P<port>\d{1,5})")
CONNECT_S: Final = 10.0
CLOSE_S: Final = 2.0
WATCH_S: Final = 0.5
_LOGGERS: Final = ("distributed", "distributed.client", "tornado.application")
"""They print tracebacks when a scheduler is lost, which is raised as one line."""

P = ParamSpec("P")
T = TypeVar("T")


class ClusterExecutor(CancellingExecutor):
    """The workers of a Dask cluster; a case whose worker is lost is computed again by another one.

    Parameters
    ----------
    address : str
        Of the scheduler, such as tcp://HOST:8786.

    Raises
    ------
    WorkerError
        The address cannot be used, no scheduler answers there, or the package ``distributed`` is missing.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        _check_that_something_answers(address)
        try:
            from distributed import Client  # noqa: PLC0415 - an extra
        except ImportError as error:
            raise WorkerError(
                "a cluster needs the package distributed, which is not installed: pip install 'liquid-study[cluster]', "
                "or compute here with --workers"
            ) from error
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            self._client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, MemoryError) as error:
            raise _no_scheduler(address, str(error)) from error
        self._executor = self._client.get_executor(pure=False)
        self.workers = sum(self._client.nthreads().values())
        self._pending: set[Future[Any]] = set()
        self._pending_lock = threading.Lock()
        self._ended = threading.Event()
        threading.Thread(target=self._watch, name="cluster", daemon=True).start()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Compute a case on a worker."""
        future: Future[T] = Future()
        with self._pending_lock:
            self._pending.add(future)
        computed = self._executor.submit(_compute, dict(environment()), fn, args, kwargs)
        computed.add_done_callback(partial(self._settle, future))
        future.add_done_callback(lambda future: computed.cancel() if future.cancelled() else None)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Disconnect from the cluster, after unfinished cases are cancelled or complete."""
        with self._pending_lock:
            pending = tuple(self._pending)
        if cancel_futures:
            for future in pending:
                future.cancel()
        elif wait:
            wait_for(pending)
        self._ended.set()
        self._client.close(timeout=CLOSE_S)

    def _settle(self, future: Future[T], computed: Future[T]) -> None:
        """Give a case the outcome that the cluster reports."""
        if not self._begin_settling(future):
            return
        error = CancelledError() if computed.cancelled() else computed.exception()
        if error is None:
            future.set_result(computed.result())
        else:
            future.set_exception(_in_words(self.address, error))

    def _begin_settling(self, future: Future[Any]) -> bool:
        """Return whether the caller sets the outcome of the case: it is the first, and the case not cancelled."""
        with self._pending_lock:
            if future not in self._pending:
                return False
            self._pending.remove(future)
        return future.set_running_or_notify_cancel()

    def _watch(self) -> None:
        """Fail all cases when the scheduler is lost: the client then leaves some without an outcome."""
        while not self._ended.wait(WATCH_S):
            if self._client.status == "running":
                continue
            with self._pending_lock:
                pending = tuple(self._pending)
            for future in pending:
                if self._begin_settling(future):
                    future.set_exception(_in_words(self.address, CancelledError()))


def _compute(expected: Mapping[str, str], fn: Callable[..., T], args: tuple[Any, ...], kwargs: dict[str, Any]) -> T:
    """Compute a case on a worker.

    Raises
    ------
    WorkerError
        Its result might differ: the worker has another program, Python or library.
    """
    if differs := difference(expected):
        raise WorkerError(
            f"the worker on {socket.gethostname()} has {differs}: install the same versions on every worker, since "
            "results could differ"
        )
    return fn(*args, **kwargs)


def _in_words(address: str, error: BaseException) -> BaseException:
    """Return the message for a failure of the cluster, as opposed to a case."""
    if isinstance(error, CancelledError):
        why = f"the cluster at {address} was lost: start it again, then the same command"
    elif type(error).__name__ == "KilledWorker":
        why = f"the cluster at {address} lost several workers during the same case: give its workers more memory"
    elif isinstance(error, ModuleNotFoundError) and (error.name or "").startswith("study_app"):
        why = f"a worker of {address} does not have this program: install liquid-study there as here"
    else:
        return error
    found = WorkerError(why)
    found.__cause__ = error
    return found


def _check_that_something_answers(address: str) -> None:
    """Reject an unusable address within seconds; Dask would wait for long or fail at exit.

    Raises
    ------
    WorkerError
        The address is not valid, or no scheduler can be at it.
    """
    parts = ADDRESS.fullmatch(address)
    if parts is None:
        raise WorkerError(
            f"{address!r} is not the address of a Dask scheduler: give tcp://HOST:PORT, such as tcp://lab1:8786"
        )
    try:
        place = (parts["ipv6"] or parts["host"], int(parts["port"]))
        with socket.create_connection(place, timeout=CONNECT_S) as connection:
            if address.startswith("tcp:") and not connection.recv(1):  # a scheduler speaks first
                raise ConnectionError("another program answers there")
    except (OSError, OverflowError) as error:
        raise _no_scheduler(address, getattr(error, "strerror", None) or str(error)) from error


def _no_scheduler(address: str, why: str) -> WorkerError:
    return WorkerError(
        f"no Dask scheduler answers at {address} ({why}): start one there with dask scheduler, correct the address, or "
        "compute here with --workers"
    )
