"""Executors of many independent cases: processes of this computer, or the workers of a Dask cluster.

The workers of a cluster must have the same versions of program, Python and libraries as this computer, since results
could differ otherwise.
"""

import hashlib
import logging
import os
import platform
import re
import socket
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures import wait as wait_for
from contextlib import suppress
from functools import cache
from importlib import metadata
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, Final, ParamSpec, TypeVar

import study_app
from study_app.discovery import explain_error
from study_app.errors import WorkerError
from study_app.workers.one_thread import compute_in_one_thread
from study_app.workers.server import CONTEXT, ignore_interrupts

LIBRARIES: Final = ("numpy", "scipy", "numba", "pandas", "ngsolve")
_ADDRESS: Final = re.compile(r"(?:tcp|tls)://(?:\[(?P<ipv6>[0-9a-fA-F:]+)\]|(?P<host>[^\s:/\[\]]+)):(?P<port>\d{1,5})")
CONNECT_S: Final = 10.0
_LONGEST_GREETING: Final = 1 << 16
_CLOSE_S: Final = 2.0
_WATCH_S: Final = 0.5
_P = ParamSpec("_P")
_T = TypeVar("_T")
_PACKAGE: Final = Path(study_app.__file__).resolve().parent
_SUFFIXES: Final = (".py", ".csv", ".toml")
_LOGGERS: Final = ("distributed", "distributed.client", "tornado.application")
"""Loggers that would print tracebacks when a scheduler is lost, which is raised as an error."""


class ProcessExecutor(ProcessPoolExecutor):
    """Processes, started by the first cases, that import the modules themselves and ignore Ctrl+C.

    They end with the executor (immediately if cases are cancelled) or with the program.
    """

    def __init__(self, workers: int) -> None:
        self._watched, self._closing_end = CONTEXT.Pipe(duplex=False)
        super().__init__(workers, mp_context=CONTEXT, initializer=_start_process, initargs=(self._watched,))

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Compute a case; raise `WorkerError` if a process cannot be started."""
        try:
            return super().submit(_run_case, fn, args, kwargs)
        except OSError as error:
            raise _lost_process_error() from error

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Finish all cases, or cancel them and end the processes without waiting."""
        super().shutdown(wait and not cancel_futures, cancel_futures=cancel_futures)
        if cancel_futures:
            self._closing_end.close()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for all cases, or cancel them after an exception."""
        self.shutdown(cancel_futures=kind is not None)
        if isinstance(error, BrokenExecutor):
            raise _lost_process_error() from error


def _lost_process_error() -> WorkerError:
    return WorkerError(
        "a worker process ended unexpectedly or could not be started (it was killed, or memory ran out): "
        "try again with fewer --workers"
    )


def _start_process(watched: Connection) -> None:
    """Prepare a process of the pool before it imports the computing modules."""
    ignore_interrupts()
    compute_in_one_thread()  # each core has its own process
    threading.Thread(target=_exit_when_closed, args=(watched,), name="end of program", daemon=True).start()


def _exit_when_closed(watched: Connection) -> None:
    """End this process when the other end of the pipe is closed, by the executor or the end of its program."""
    with suppress(EOFError, OSError):
        watched.recv_bytes()
    os._exit(0)


class ClusterExecutor(Executor):
    """The workers of a Dask cluster; a case whose worker is lost is recomputed by another one."""

    def __init__(self, address: str) -> None:
        self.address = address
        _check_responds(address)
        try:
            from distributed import Client  # noqa: PLC0415 - an extra
        except ImportError as error:
            raise WorkerError(
                "a cluster requires the Python package distributed, which is not installed: run pip install "
                "'liquid-study[cluster]', or compute on this computer with --workers"
            ) from error
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        try:
            self._client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except OSError as error:
            raise _no_scheduler_error(address, str(error)) from error
        except Exception as error:  # Dask may raise anything if the server is not a Dask scheduler
            raise _no_scheduler_error(address, "another program is listening there") from error
        self._executor = self._client.get_executor(pure=False)
        self.has_workers = bool(self._client.nthreads())
        self._pending: set[Future[Any]] = set()
        self._ended = threading.Event()
        threading.Thread(target=self._watch_scheduler, name="cluster", daemon=True).start()

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Compute a case on a worker."""
        future: Future[_T] = self._executor.submit(_compute, dict(environment()), fn, args, kwargs)
        self._pending.add(future)
        future.add_done_callback(self._pending.discard)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Cancel the unfinished cases or wait for them, then disconnect from the cluster."""
        if cancel_futures:
            self._cancel_pending()
        elif wait:
            wait_for(self._pending.copy())
        self._ended.set()
        self._client.close(timeout=_CLOSE_S)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for all cases, or cancel them after an exception; raise `WorkerError` if the cluster failed."""
        self.shutdown(cancel_futures=kind is not None)
        if isinstance(error, CancelledError):
            why = f"the cluster at {self.address} is no longer available: restart it, then repeat the command"
        elif type(error).__name__ == "KilledWorker":
            why = f"several workers at {self.address} failed on the same case: allocate more memory to each worker"
        elif isinstance(error, ModuleNotFoundError) and (error.name or "").startswith("study_app"):
            why = f"liquid-study is not installed on the worker at {self.address}: install this version there"
        else:
            return
        raise WorkerError(why) from error

    def _cancel_pending(self) -> None:
        for future in self._pending.copy():
            future.cancel()

    def _watch_scheduler(self) -> None:
        """Cancel all cases when the scheduler is lost, since the client would leave some of them pending."""
        while not self._ended.wait(_WATCH_S):
            if self._client.status != "running":
                self._cancel_pending()


def _compute(expected: Mapping[str, str], fn: Callable[..., _T], args: tuple[Any, ...], kwargs: dict[str, Any]) -> _T:
    """Compute a case on a worker, which must have the expected `environment`."""
    found = environment()
    differing = "; ".join(
        f"{name} {found.get(name, 'missing')} instead of {expected.get(name, 'missing')}"
        for name in sorted({*found, *expected})
        if found.get(name) != expected.get(name)
    )
    if differing:
        raise WorkerError(
            f"the worker on {socket.gethostname()} has {differing}: install the same versions on every worker, because "
            "results could otherwise differ"
        )
    return _run_case(fn, args, kwargs)


def _run_case(fn: Callable[..., _T], args: tuple[Any, ...], kwargs: dict[str, Any]) -> _T:
    """Compute a case; name the plug-in in its errors here, since only this process knows the plug-in's modules."""
    try:
        return fn(*args, **kwargs)
    except Exception as error:
        if (explained := explain_error(error)) is error:
            raise
        raise explained from error


@cache
def environment() -> Mapping[str, str]:
    """Return the versions by name; the program's includes a digest of its files and shipped protocols."""
    shipped = () if (_PACKAGE / "protocols").is_dir() else (_PACKAGE.parent / "protocols").glob("*.toml")
    files = {path.relative_to(_PACKAGE).as_posix(): path for path in _PACKAGE.rglob("*") if path.suffix in _SUFFIXES}
    files |= {f"protocols/{path.name}": path for path in shipped}
    digest = hashlib.sha256()
    for name, path in sorted(files.items()):
        digest.update(name.encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return {
        "liquid-study": f"{study_app.__version__} ({digest.hexdigest()[:16]})",
        "Python": platform.python_version(),
        **{name: _version(name) for name in LIBRARIES},
    }


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


def _check_responds(address: str) -> None:
    """Raise `WorkerError` within seconds if no scheduler responds; Dask would wait long, or fail at exit."""
    parts = _ADDRESS.fullmatch(address)
    if parts is None:
        raise WorkerError(
            f"{address!r} is not the address of a Dask scheduler: specify tcp://HOST:PORT, such as tcp://lab1:8786"
        )
    try:
        target = (parts["ipv6"] or parts["host"], int(parts["port"]))
        with socket.create_connection(target, timeout=CONNECT_S) as connection:
            if address.startswith("tcp:"):
                _receive_greeting(connection)
    except (OSError, OverflowError) as error:
        raise _no_scheduler_error(address, getattr(error, "strerror", None) or str(error)) from error


def _receive_greeting(connection: socket.socket) -> None:
    """Receive a scheduler's greeting: its length as eight bytes, then the greeting itself."""
    deadline_s = time.perf_counter() + CONNECT_S
    received, expected = b"", 8
    while len(received) < expected:
        if (remaining_s := deadline_s - time.perf_counter()) <= 0.0:
            raise TimeoutError("timed out")
        connection.settimeout(remaining_s)
        chunk = connection.recv(expected - len(received))
        received += chunk
        expected += int.from_bytes(received, "little") if len(received) == expected == 8 else 0
        if not chunk or expected > _LONGEST_GREETING:
            raise ConnectionError("another program is listening there")


def _no_scheduler_error(address: str, why: str) -> WorkerError:
    return WorkerError(
        f"no Dask scheduler responds at {address} ({why}): start one there with dask scheduler, correct the address, "
        "or compute on this computer with --workers"
    )
