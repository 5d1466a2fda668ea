"""Finished cases of a computation that was interrupted, on disk: the next start computes only the others.

A case is identified by its function and arguments, and belongs to one environment: the same program, Python and
libraries. Every start appends to a separate file, so that two programs need no lock. A completed computation removes
the cases that it used. The files contain pickles, like the compiler's cache: only this user can access the folder.
"""

import contextlib
import hashlib
import io
import logging
import pickle
import secrets
import shutil
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, Final, ParamSpec, TypeVar

from study_app.user_folder import cache_folder
from study_app.workers.environment import environment_digest
from study_app.workers.processes import CancellingExecutor

log = logging.getLogger(__name__)

OLD_S: Final = 30 * 86_400.0
"""Cases not used for this time are removed."""
_ENDING: Final = ".cases"
_KEY: Final = 32
_LENGTH: Final = 8

P = ParamSpec("P")
T = TypeVar("T")


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
