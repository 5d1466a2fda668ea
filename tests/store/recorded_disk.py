"""A disk below a folder that records each call in order, and fails at one of them."""

import builtins
import errno
import io
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, Literal, NamedTuple
from unittest import mock

Fault = Literal["none", "input/output error", "full", "killed"]
STORE = f"{os.sep}study_app{os.sep}store{os.sep}"
TAKES_ROOM = ("create", "write", "mkdir")


class Call(NamedTuple):
    """A call with the path that it changes or flushes; for a renaming, the new path, and ``old`` the old one."""

    name: str
    path: Path
    old: Path | None = None


class KilledError(SystemExit):
    """The program ends here, as after SIGKILL: nothing that follows changes the disk. A thread ends silently."""


class Disk:
    """The calls on files below ``root`` in order, and ``writers``, the functions of the store that made them.

    The call with number ``at`` (from 0) has a fault: one error, a disk that stays full, or the program is killed.
    """

    def __init__(self, root: Path, fault: Fault = "none", at: int = -1) -> None:
        self.root, self.fault, self.at = root, fault, at
        self.calls: list[Call] = []
        self.writers: set[str] = set()
        self.happened = False

    def call(self, name: str, path: Path, old: Path | None = None) -> None:
        """Record a call; raise if it fails."""
        if not path.is_relative_to(self.root):
            return
        if self.happened and self.fault == "killed":
            raise KilledError
        self.calls.append(Call(name, path, old))
        self.writers |= set(_store_functions(sys._getframe(1)))
        now = len(self.calls) - 1 == self.at
        self.happened |= now
        if now and self.fault == "killed":
            raise KilledError
        if now and self.fault == "input/output error":
            raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))
        if self.happened and self.fault == "full" and name in TAKES_ROOM:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    @contextmanager
    def used(self) -> Iterator[None]:
        """Let the program use this disk."""
        with ExitStack() as patched:
            opener = _opener(self, open)
            for module, name, replacement in (
                (builtins, "open", opener),
                (io, "open", opener),
                (os, "fsync", lambda descriptor: self.call("fsync", _path_of(descriptor))),  # without waiting for it
                *((os, name, self._renaming(getattr(os, name))) for name in ("rename", "replace")),
                *((os, name, self._changing(name, getattr(os, name))) for name in ("unlink", "rmdir", "mkdir")),
            ):
                patched.enter_context(mock.patch.object(module, name, replacement))
            yield

    def _renaming(self, whole: Callable[..., None]) -> Callable[..., None]:
        def rename(old: Any, new: Any, **given: Any) -> None:
            self.call("rename", Path(new).absolute(), Path(old).absolute())
            whole(old, new, **given)

        return rename

    def _changing(self, name: str, whole: Callable[..., None]) -> Callable[..., None]:
        def change(path: Any, *words: Any, dir_fd: int | None = None, **given: Any) -> None:
            folder = Path.cwd() if dir_fd is None else _path_of(dir_fd)
            if os.path.lexists(folder / path) != (name == "mkdir"):  # else it changes nothing
                self.call(name, folder / path)
            whole(path, *words, dir_fd=dir_fd, **given)

        return change


class _File(io.FileIO):
    """A file that records its writes; on a full disk, only half of a write succeeds."""

    disk: Disk

    def write(self, content: Any) -> int:
        path = Path(str(self.name)).absolute()
        try:
            self.disk.call("write", path)
        except OSError as error:
            if error.errno == errno.ENOSPC:
                super().write(bytes(content)[: len(content) // 2])
            raise
        return super().write(content) or 0

    def truncate(self, size: int | None = None) -> int:
        self.disk.call("truncate", Path(str(self.name)).absolute())
        return super().truncate(size)


def _opener(disk: Disk, whole: Callable[..., Any]) -> Callable[..., Any]:
    def opened(file: Any, mode: str = "r", buffering: int = -1, *words: Any, **given: Any) -> Any:
        path = file if isinstance(file, int) else Path(file).absolute()
        if isinstance(path, int) or not set(mode) & set("wxa+") or not path.is_relative_to(disk.root):
            return whole(file, mode, buffering, *words, **given)
        if not path.exists():
            disk.call("create", path)
        raw = _File(path, mode.replace("b", "").replace("t", ""), opener=given.pop("opener", None))
        raw.disk = disk
        if "b" in mode and buffering == 0:
            return raw
        buffered = io.BufferedRandom(raw) if "+" in mode else io.BufferedWriter(raw)
        return buffered if "b" in mode else io.TextIOWrapper(buffered, *words, **given)

    return opened


def _path_of(descriptor: int) -> Path:
    return Path(f"/proc/self/fd/{descriptor}").readlink()


def _store_functions(frame: FrameType | None) -> Iterator[str]:
    """Yield the functions of the store in a stack, as "store/files/atomic.py:write_file"."""
    while frame is not None:
        _, store, module = frame.f_code.co_filename.rpartition(STORE)
        if store:
            yield f"{module}:{frame.f_code.co_qualname.partition('.<locals>')[0]}"
        frame = frame.f_back
