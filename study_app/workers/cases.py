"""Executors of many independent cases: processes of this computer, or a Dask cluster; finished cases are kept on disk.

Processes outlast the loss of one: the cases not finished are computed again. The workers of a cluster must hold the
same program, Python and libraries as this computer. Of a computation that was interrupted the next start computes only
the cases that are not kept. A case is identified by its function and arguments, and belongs to one environment: the
same program, Python and libraries. Every start appends to a separate file, so that two programs need no lock. A
completed computation removes the cases that it used. The files contain pickles, like the compiler's cache: only this
user can access the folder.
"""

import contextlib
import hashlib
import heapq
import io
import logging
import os
import pickle
import platform
import re
import secrets
import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures import wait as wait_for
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, partial
from importlib import metadata
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import Any, BinaryIO, Final, ParamSpec, TypeVar

import study_app
from study_app.errors import WorkerError
from study_app.user_folder import cache_folder
from study_app.workers.server import CONTEXT, compute_in_one_thread, ignore_interrupts

LIBRARIES: Final = ("numpy", "scipy", "numba", "pandas", "ngsolve")
_PACKAGE: Final = Path(study_app.__file__).resolve().parent
_ENDINGS: Final = (".py", ".csv", ".toml")
ATTEMPTS: Final = 3
"""A case that was being computed in this many broken pools is not tried again."""
AHEAD: Final = 2
"""Cases in the pool per process: the one it computes, and the next."""
P = ParamSpec("P")
T = TypeVar("T")
ADDRESS: Final = re.compile(r"(?:tcp|tls)://(?:\[(?P<ipv6>[0-9a-fA-F:]+)\]|(?P<host>[^\s:/\[\]]+)):(?P<port>\d{1,5})")
CONNECT_S: Final = 10.0
CLOSE_S: Final = 2.0
WATCH_S: Final = 0.5
_LOGGERS: Final = ("distributed", "distributed.client", "tornado.application")
"""They print tracebacks when a scheduler is lost, which is raised as one line."""
log = logging.getLogger(__name__)
OLD_S: Final = 30 * 86_400.0
"""Cases not used for this time are removed."""
_ENDING: Final = ".cases"
_KEY: Final = 32
_LENGTH: Final = 8


@cache
def environment() -> Mapping[str, str]:
    """Return the versions by name; that of the program is followed by a digest of its files and shipped protocols."""
    digest = hashlib.sha256()
    for name, path in _files():
        digest.update(name.encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return {
        "liquid-study": f"{study_app.__version__} ({digest.hexdigest()[:16]})",
        "Python": platform.python_version(),
        **{name: _version(name) for name in LIBRARIES},
    }


def environment_digest() -> str:
    """Return a digest of `environment`."""
    return hashlib.sha256(repr(sorted(environment().items())).encode()).hexdigest()[:16]


def difference(other: Mapping[str, str]) -> str:
    """Return a description of how another environment differs from this one; empty if it does not."""
    own = environment()
    return "; ".join(
        f"{name} {own.get(name, 'missing')} instead of {other.get(name, 'missing')}"
        for name in sorted({*own, *other})
        if own.get(name) != other.get(name)
    )


def _files() -> Iterator[tuple[str, Path]]:
    """Yield the files of the package and the shipped protocols with their names in it, in one order.

    The protocols are inside an installed package, and next to that of a checkout.
    """
    shipped = () if (_PACKAGE / "protocols").is_dir() else (_PACKAGE.parent / "protocols").glob("*.toml")
    files = {path.relative_to(_PACKAGE).as_posix(): path for path in _PACKAGE.rglob("*") if path.suffix in _ENDINGS}
    files |= {f"protocols/{path.name}": path for path in shipped}
    yield from sorted(files.items())


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


class CancellingExecutor(Executor):
    """An executor whose ``with`` block, left by an exception, cancels what has not finished."""

    workers: int

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for all cases, or cancel them."""
        self.shutdown(cancel_futures=kind is not None)


@dataclass(order=True)
class _Case:
    number: int
    call: tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]] = field(compare=False)
    future: Future[Any] = field(compare=False)
    attempts: int = field(default=0, compare=False)


@dataclass(frozen=True)
class _Finished:
    case: _Case
    pool: ProcessPoolExecutor
    found: Future[Any]


@dataclass(frozen=True)
class _Shutdown:
    cancel: bool


class ProcessExecutor(CancellingExecutor):
    """Processes that start when there are cases, import their own modules, and ignore Ctrl+C.

    They end with the executor, or with its program. When one ends unexpectedly, its pool is replaced, and the
    unfinished cases are computed again. One thread owns the pool; futures of cancelled cases are never the pool's own.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._watched, self._held = CONTEXT.Pipe(duplex=False)
        self._messages: SimpleQueue[_Case | _Finished | _Shutdown] = SimpleQueue()
        self._submitted = 0
        self._closed = False
        self._dispatcher = threading.Thread(target=self._dispatch, name="cases", daemon=True)
        self._dispatcher.start()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Compute a case.

        Raises
        ------
        RuntimeError
            The executor was shut down.
        """
        if self._closed:
            raise RuntimeError("the executor was shut down")
        future: Future[T] = Future()
        self._submitted += 1
        self._messages.put(_Case(self._submitted, (fn, args, kwargs), future))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Finish all cases, or cancel those that have not finished, and end the processes.

        Parameters
        ----------
        wait : bool
            Whether to return when that is done.
        cancel_futures : bool
            Whether to end the processes at once.
        """
        self._closed = True
        self._messages.put(_Shutdown(cancel_futures))
        if wait:
            self._dispatcher.join()

    def _dispatch(self) -> None:
        waiting: list[_Case] = []
        running: list[_Case] = []
        pool: ProcessPoolExecutor | None = None
        ending: _Shutdown | None = None
        with self._watched, self._held:
            while ending is None or running or waiting:
                message = self._messages.get()
                if isinstance(message, _Case):
                    heapq.heappush(waiting, message)
                elif isinstance(message, _Shutdown):
                    ending = message
                    if ending.cancel:
                        self._held.close()
                else:
                    running.remove(message.case)
                    if message.pool is pool and _lost(message.found):
                        pool.shutdown()
                        pool = None
                    if not _settled(message.case, message.found, cancel=ending is not None and ending.cancel):
                        heapq.heappush(waiting, message.case)
                if ending is not None and ending.cancel:
                    for case in waiting:
                        _drop(case)
                    waiting.clear()
                while waiting and len(running) < AHEAD * self.workers:
                    case = heapq.heappop(waiting)
                    if case.future.cancelled():
                        _drop(case)
                        continue
                    pool = pool or self._new_pool()
                    self._start(case, pool)
                    running.append(case)
            if pool is not None:
                pool.shutdown()

    def _new_pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(
            self.workers, mp_context=CONTEXT, initializer=_start_process, initargs=(self._watched,)
        )

    def _start(self, case: _Case, pool: ProcessPoolExecutor) -> None:
        """Submit a case to the pool; its end is reported to the dispatcher, which alone handles it."""
        function, args, kwargs = case.call
        try:
            found = pool.submit(function, *args, **kwargs)
        except (BrokenExecutor, OSError, RuntimeError) as error:  # the system cannot start a process
            found = Future()
            found.set_exception(BrokenExecutor(str(error)) if isinstance(error, OSError) else error)
        found.add_done_callback(lambda found: self._messages.put(_Finished(case, pool, found)))


def _lost(found: Future[Any]) -> bool:
    """Return whether a process of the pool ended before the outcome was there."""
    return isinstance(found.exception(), BrokenExecutor)


def _settled(case: _Case, found: Future[Any], *, cancel: bool) -> bool:
    """Set the outcome of a case; return False if it must be computed again."""
    error = found.exception()
    if _lost(found):
        case.attempts += 1
        if cancel or case.future.cancelled():
            _drop(case)
            return True
        if case.attempts < ATTEMPTS:
            return False
        cause = error
        error = WorkerError(
            f"a worker process ended unexpectedly {ATTEMPTS} times during the same cases, or could not be started (it "
            "was killed, or the memory was exhausted): try again with fewer --workers"
        )
        error.__cause__ = cause
    if case.future.set_running_or_notify_cancel():
        if error is not None:
            case.future.set_exception(error)
        else:
            case.future.set_result(found.result())
    return True


def _drop(case: _Case) -> None:
    """Cancel a case that has no outcome."""
    case.future.cancel()
    case.future.set_running_or_notify_cancel()


def _start_process(watched: Connection) -> None:
    """Prepare a process of the pool before it imports the computing modules."""
    ignore_interrupts()
    compute_in_one_thread()  # there are as many processes as cores
    threading.Thread(target=_exit_at_end_of, args=(watched,), name="end of program", daemon=True).start()


def _exit_at_end_of(watched: Connection) -> None:
    """End this process when the other end of the pipe is closed: by the executor, or because its program was killed."""
    with suppress(EOFError, OSError):
        watched.recv_bytes()
    os._exit(0)


class ClusterExecutor(CancellingExecutor):
    """The workers of a Dask cluster; a case whose worker is lost is computed again by another one."""

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
    """Compute a case on a worker."""
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
    """Reject an unusable address within seconds; Dask would wait for long or fail at exit."""
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


class KeptCases(CancellingExecutor):
    """An executor that stores each finished case, and reuses cases that an earlier start finished.

    Parameters
    ----------
    executor : CancellingExecutor
        Computes the other cases.
    folder : Path
        By default in the user's cache.

    Attributes
    ----------
    reused : int
        How many cases were taken from the store.
    stored : int
        How many cases of this computation are in the store.
    """

    def __init__(self, executor: CancellingExecutor, folder: Path | None = None) -> None:
        self._executor = executor
        folder = folder or cache_folder() / "cases"
        _remove_old(folder)
        self._folder = folder / environment_digest()
        self._own = self._folder / f"{secrets.token_hex(8)}{_ENDING}"
        self._file: BinaryIO | None = None
        self._found = {path: dict(_records(path)) for path in sorted(self._folder.glob(f"*{_ENDING}"))}
        self._kept = {key: content for records in self._found.values() for key, content in records.items()}
        self._used: set[bytes] = set()
        self.reused = self.stored = 0

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Return the stored outcome of a case, or compute it."""
        key = _key_of((fn, args, kwargs))
        self._used.add(key)
        if key not in self._kept:
            computed = self._executor.submit(fn, *args, **kwargs)
            computed.add_done_callback(partial(self._keep, key))
            return computed
        self.reused += 1
        self.stored += 1
        future: Future[T] = Future()
        future.set_result(pickle.loads(self._kept[key]))  # noqa: S301 - this user's own, and checked
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Shut the executor down; remove what was stored unless cases were cancelled."""
        self._executor.shutdown(wait, cancel_futures=cancel_futures)
        if self._file is not None:
            self._file.close()
        if cancel_futures:
            return
        finished = [path for path, records in self._found.items() if records.keys() <= self._used]
        for path in (self._own, *finished):
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)

    def _keep(self, key: bytes, computed: Future[Any]) -> None:
        """Append the outcome of a case to this start's file; without a folder that can be written, keep nothing."""
        if computed.cancelled() or computed.exception() is not None:
            return
        content = key + pickle.dumps(computed.result(), pickle.HIGHEST_PROTOCOL)
        try:
            if self._file is None:
                self._folder.mkdir(parents=True, exist_ok=True)
                self._file = self._own.open("ab", buffering=0)
            self._file.write(len(content).to_bytes(_LENGTH) + hashlib.sha256(content).digest() + content)
        except (OSError, ValueError) as error:
            log.warning("%s cannot be written (%s): a finished case is not kept", self._own, error)
        else:
            self.stored += 1


class _KeyPickler(pickle.Pickler):
    """Pickles sets in the same order in every start; their hashes differ."""

    def persistent_id(self, value: object) -> object:
        """Return the pickled form of a set."""
        return sorted(map(_key_of, value)) if isinstance(value, set | frozenset) else None


def _key_of(call: object) -> bytes:
    """Return a digest of a call, which does not depend on the identity of its values."""
    content = io.BytesIO()
    pickler = _KeyPickler(content, pickle.HIGHEST_PROTOCOL)
    pickler.fast = True
    pickler.dump(call)
    return hashlib.sha256(content.getbuffer()).digest()


def _records(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """Yield the cases (key, pickled outcome) of a file, up to an incomplete one, at which the program was killed."""
    try:
        whole = path.read_bytes()
    except OSError:
        return
    at = 0
    while at < len(whole):
        begin = at + _LENGTH + _KEY
        end = begin + int.from_bytes(whole[at : at + _LENGTH])
        content = whole[begin:end]
        if end > len(whole) or hashlib.sha256(content).digest() != whole[at + _LENGTH : begin]:
            return
        yield content[:_KEY], content[_KEY:]
        at = end


def _remove_old(folder: Path) -> None:
    with contextlib.suppress(OSError):
        for of_environment in folder.iterdir():
            files = list(of_environment.iterdir())
            newest = max(path.stat().st_mtime for path in (of_environment, *files))
            if time.time() - newest > OLD_S:
                shutil.rmtree(of_environment, ignore_errors=True)
