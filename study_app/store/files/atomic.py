"""Atomic writing, so that neither a reader nor the next start after a power cut finds a partial file.

The functions for reading accept only regular files, if required within the study's folder, and JSON that users may have
changed.
"""

import contextlib
import errno
import json
import os
import re
import secrets
import shutil
import stat
import sys
import time
from collections.abc import Iterator, Mapping
from io import BufferedReader
from pathlib import Path
from typing import Any, BinaryIO

from study_app.errors import StoreError

OLD_S = 3600.0  # longer than any time between the last write of a temporary file and its renaming
_CANNOT_FLUSH = (errno.EINVAL, errno.EBADF, errno.ENOTSUP)  # error numbers of folders that cannot be flushed
_MOVE_RETRY_S = (0.01, 0.05, 0.2)
_MAX_FILE_BYTES = 1 << 30  # of a results folder, whose files have megabytes
_MAX_JSON_DEPTH = 64  # greatest depth of JSON, so that values can be processed recursively
_TEMPORARY = re.compile(r"\.[^.].*\.[0-9a-f]{8}\.tmp")  # not of hidden files: markers are created and removed


def write_file(path: Path, content: bytes | bytearray, *, waits: bool = True) -> None:
    """Write ``content`` to ``path``, replacing an existing file in one step.

    The content is written under a temporary name, flushed to the disk and renamed over the old file; then the folder's
    entry is flushed. If anything fails before the renaming, the old file is untouched and no temporary file is left.
    Without ``waits`` nothing is flushed, so that a power cut may lose the file: use it for files that can be recreated.

    Raises
    ------
    StoreError
        The file cannot be written, for the reason in the message; or, as the message says, it was written, but the
        folder's entry could not be flushed.
    """
    with _temporary_file(path, path) as temporary:
        write_new_file(temporary, content, waits=waits)
        move(temporary, path)
    if waits:
        flush_entry(path)


def move(temporary: Path, path: Path) -> None:
    """Rename a folder, or a file over the old one; retry while a viewer or virus scanner holds it on Windows."""
    rename = temporary.rename if temporary.is_dir() else temporary.replace
    for pause_s in _MOVE_RETRY_S:
        with contextlib.suppress(PermissionError):
            rename(path)
            return
        time.sleep(pause_s)
    rename(path)


@contextlib.contextmanager
def _temporary_file(path: Path, target: Path) -> Iterator[Path]:
    """Yield a temporary path next to ``path`` and remove its file at the end; errors name ``target``."""
    temporary = temporary_path(path)
    try:
        yield temporary
    except OSError as error:
        raise cannot_write(target, error) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def create_folder(path: Path, files: Mapping[str, bytes], *, waits: bool = True, mode: int = 0o666) -> bool:
    """Create folder ``path`` with ``files``, or return False if another program was first.

    The folder is filled under a temporary name and renamed into place, which no system does over a folder that is not
    empty: of two programs exactly one succeeds, and the other finds complete files. Without ``waits`` nothing is
    flushed (see `write_file`). ``mode`` limits the files' permissions.
    """
    temporary = temporary_path(path)
    try:
        temporary.mkdir()
        for name, content in files.items():
            write_new_file(temporary / name, content, waits=waits, mode=mode)
        if waits:
            sync_folder(temporary)
        move(temporary, path)
    except OSError as error:
        if any((path / name).exists() for name in files):
            return False
        raise cannot_write(path, error) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    if waits:
        flush_entry(path)
    return True


def make_folder(path: Path, *, waits: bool = True) -> None:
    """Create a folder and its parents unless they exist; with ``waits`` flush the new ones to the disk.

    Raises
    ------
    StoreError
        The folder cannot be created.
    """
    path = path.absolute()
    missing = [level for level in (path, *path.parents) if waits and not is_there(level)]
    try:
        path.mkdir(parents=True, exist_ok=True)
        for level in missing:
            sync_folder(level.parent)
    except OSError as error:
        raise cannot_write(path, error) from error


def copy_folder(folder: Path, to: Path) -> None:
    """Copy a folder with its contents to ``to``, which must not exist, atomically, and flush it to the disk.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    temporary = temporary_path(to)
    try:
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(folder, temporary, copy_function=copy_file)
        sync_folders(temporary)
        move(temporary, to)
    except OSError as error:  # shutil.Error, too
        raise cannot_write(to, error) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    flush_entry(to)


def copy_file(source: str, to: str) -> str:
    """Copy a regular file with its times to ``to``, which must not exist; flush it to the disk and return ``to``."""
    with open_regular(Path(source)) as file, Path(to).open("xb") as copy:
        shutil.copyfileobj(file, copy)
        copy.flush()
        flush_file(copy.fileno())
    shutil.copystat(source, to)
    return to


def append_line(path: Path, line: bytes, *, waits: bool = True) -> None:
    """Add ``line`` (which ends in a newline) to the end of ``path`` and, with ``waits``, flush it to the disk.

    An incomplete line left by a power cut is ended with a newline first, so that it does not merge with this one.

    Raises
    ------
    StoreError
        The file cannot be written; the line is removed again.
    """
    try:
        with path.open("a+b", buffering=0) as file:
            size = file.seek(0, os.SEEK_END)
            try:
                write_all(file, line if _ends_with_newline(file, size) else b"\n" + line)
                if waits:
                    flush_file(file.fileno())
                    sync_folder(path.parent)
            except OSError:
                file.truncate(size)
                raise
    except OSError as error:
        raise cannot_write(path, error) from error


def write_all(file: BinaryIO, content: bytes | bytearray) -> None:
    """Write all of ``content`` to an unbuffered ``file``, in as many writes as the system needs."""
    rest = memoryview(content)
    while rest:
        rest = rest[file.write(rest) :]


def temporary_path(path: Path) -> Path:
    """Return a new temporary name in the folder of ``path``, to be renamed to ``path``."""
    return path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")


def temporary_files(folder: Path, name: str = "") -> tuple[Path, ...]:
    """Return the temporary files directly in ``folder``, ``name`` a given name if set; their programs may still run."""
    paths = (path for path in folder.glob(".*.tmp") if _TEMPORARY.fullmatch(path.name))
    # A temporary name is "." + name + ".01234567.tmp".
    return tuple(sorted(path for path in paths if not name or path.name[1:-13] == name))


def remove_old_temporary_files(folder: Path, name: str = "") -> None:
    """Remove old temporary files, ``name`` a name if set, from a folder into which other programs may be writing.

    Only files too old to be in use are removed. Their age is measured with a new file on the same disk, because the
    clock of another computer that writes there may differ. A file that cannot be removed is left.
    """
    if not (paths := temporary_files(folder, name)):
        return
    with contextlib.suppress(OSError, StoreError), _temporary_file(folder / "time", folder) as probe:
        write_new_file(probe, b"", waits=False)
        now_s = probe.stat().st_mtime
        for path in paths:
            with contextlib.suppress(OSError):
                if not path.is_dir() and now_s - path.stat().st_mtime > OLD_S:
                    path.unlink()


def paths_in(folder: Path) -> list[Path]:
    """Return all files and folders at any depth of ``folder``, sorted; folders may vanish meanwhile."""
    levels = os.walk(folder)
    return sorted(Path(above) / name for above, folders, names in levels for name in (*folders, *names))


def remove_temporary_files(folder: Path) -> tuple[Path, ...]:
    """Remove the temporary files directly in ``folder`` and return them; no other program may be writing there."""
    leftovers = temporary_files(folder)
    for path in leftovers:
        try:
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)
        except OSError as error:
            raise cannot_write(path, error) from error
    return leftovers


def probe_free_bytes(folder: Path) -> int:
    """Check that ``folder``, or its nearest existing parent, is writable, and return its free space in bytes.

    A small file is written, flushed to the disk and removed; nothing else is changed.

    Raises
    ------
    StoreError
        Nothing can be written there.
    """
    existing = next(path for path in (folder, *folder.absolute().parents) if is_there(path))
    with _temporary_file(existing / "probe", folder) as path:
        write_new_file(path, b"probe\n")
        return shutil.disk_usage(existing).free


def flush_file(descriptor: int) -> None:
    """Flush a file to the medium: on macOS, where fsync leaves data in the drive's memory, with F_FULLFSYNC.

    Drives that do not support it, such as network and USB drives, are flushed with fsync.
    """
    if sys.platform == "darwin":  # not covered by tests
        import fcntl  # noqa: PLC0415 - Windows does not have it

        with contextlib.suppress(OSError):
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    os.fsync(descriptor)


def sync_folder(path: Path) -> None:
    """Flush the folder's entries, so that a file created or renamed in it survives a power cut.

    Some network drives cannot flush a folder; then the server orders its entries itself.
    """
    if sys.platform == "win32":  # a folder cannot be opened there; the file system orders its entries itself
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        flush_file(descriptor)
    except OSError as error:
        if error.errno not in _CANNOT_FLUSH:
            raise
    finally:
        os.close(descriptor)


def sync_folders(path: Path) -> None:
    """Flush the entries of a folder and of all folders below it."""
    for folder in (path, *(entry for entry in paths_in(path) if entry.is_dir() and not entry.is_symlink())):
        sync_folder(folder)


def flush_entry(path: Path) -> None:
    """Flush the folder's entry of ``path``, which was renamed into place.

    Raises
    ------
    StoreError
        It cannot be flushed; the message says that ``path`` is written.
    """
    try:
        sync_folder(path.parent)
    except OSError as error:
        raise StoreError(
            f"{path} was written, but the disk did not confirm it ({system_message(error)}): check the disk, because "
            "a power failure could restore the previous version of the file"
        ) from error


def cannot_write(path: Path, error: OSError) -> StoreError:
    """Return a one-line error that names ``path``, the system's reason and the remedies."""
    blocked = isinstance(error, FileExistsError | NotADirectoryError) or (
        isinstance(error, FileNotFoundError) and any(map(os.path.isfile, path.parents))  # on Windows
    )
    if isinstance(error, FileNotFoundError) and not blocked:
        return StoreError(f"{path} cannot be written: the folder does not exist; create it, or choose another folder")
    why = "there is a file where a folder is needed" if blocked else system_message(error)
    return StoreError(
        f"{path} cannot be written ({why}): free disk space, correct its permissions, close the program "
        "that is using it, or choose another folder"
    )


def is_there(path: Path) -> bool:
    """Return whether ``path`` exists.

    Raises
    ------
    StoreError
        The system denies access.
    """
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as error:
        raise cannot_read(path, error) from error
    return True


def refuse_special_files(path: Path) -> None:
    """Raise an error if a folder is or contains a link, a pipe or a device: it must not be copied or deleted.

    Raises
    ------
    StoreError
        The folder contains such a file; the message names its path and type.
    """
    for entry in (path, *paths_in(path)):
        if entry.is_symlink():
            raise StoreError(f"{entry} is a link to {entry.readlink()}: replace the link with its target")
        if is_there(entry) and not entry.is_file() and not entry.is_dir():
            raise StoreError(f"{entry} is neither a file nor a folder: remove it")


def cannot_read(path: Path, error: OSError) -> StoreError:
    """Return a one-line error that names ``path``, the system's reason and the remedies."""
    remedy = "" if isinstance(error, FileNotFoundError) else "correct its permissions, or "
    return StoreError(f"{path} cannot be read ({system_message(error)}): {remedy}restore it from a backup")


def open_regular(path: Path, *, largest_bytes: float = _MAX_FILE_BYTES) -> BufferedReader:
    """Open a regular file for reading; raise OSError for a folder, device, pipe or larger file."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "it is not a file")
    if status.st_size > largest_bytes:
        raise OSError(errno.EFBIG, os.strerror(errno.EFBIG), str(path))
    return path.open("rb")


def read_regular(path: Path) -> bytes:
    """Return the content of a regular file; raise OSError as `open_regular`."""
    with open_regular(path) as file:
        return file.read()


def read_if_there(path: Path) -> bytes | None:
    """Return the content of a file, or None if it does not exist. Raise StoreError if it cannot be read."""
    try:
        return read_regular(path)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise cannot_read(path, error) from error


def read_own(path: Path, root: Path) -> bytes:
    """Return the content of a file, which must lie under ``root`` after links are resolved."""
    try:
        real = Path(os.path.realpath(path, strict=True))  # OSError for a loop of links
        if not real.is_relative_to(root.resolve()):
            raise StoreError(
                f"{path} contains a link to {real}, which is outside {root}: replace the link with the file itself"
            )
        return read_regular(real)
    except OSError as error:
        raise cannot_read(path, error) from error


def read_own_if_there(path: Path, root: Path) -> bytes | None:
    """Return the content of a file that must lie under ``root``; None if it does not exist."""
    return read_own(path, root) if os.path.lexists(path) else None


def parse_json(content: bytes | str) -> Any:
    """Return the value of a JSON text.

    Raises
    ------
    ValueError
        The text is not JSON, which excludes NaN and Infinity, or is nested too deeply.
    """
    try:
        value = json.loads(content, parse_constant=_refuse_constant)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    level = [value]
    for _ in range(_MAX_JSON_DEPTH):
        containers = (value for value in level if isinstance(value, dict | list))
        level = [
            inner
            for container in containers
            for inner in (container.values() if isinstance(container, dict) else container)
        ]
        if not level:
            return value
    raise ValueError("it is nested too deeply")


def _refuse_constant(constant: str) -> None:
    raise ValueError(f"{constant} is not JSON")


def study_root(path: Path) -> Path:
    """Return the study folder that contains a session's file ``path``; for other files, their own folder."""
    parents = path.absolute().parents
    return parents[3] if len(parents) > 3 and parents[2].name == "data" else parents[0]


def system_message(error: OSError) -> str:
    """Return the system's message for ``error``, without the path, which the caller's message names."""
    return error.strerror or type(error).__name__


def _ends_with_newline(file: BinaryIO, size: int) -> bool:
    if size == 0:
        return True
    file.seek(size - 1)
    return file.read(1) == b"\n"


def write_new_file(path: Path, content: bytes | bytearray, *, waits: bool = True, mode: int = 0o666) -> None:
    """Write a new file ``path`` and, with ``waits``, flush it to the disk."""
    with open(path, "xb", buffering=0, opener=lambda name, flags: os.open(name, flags, mode)) as file:
        write_all(file, content)
        if waits:
            flush_file(file.fileno())
