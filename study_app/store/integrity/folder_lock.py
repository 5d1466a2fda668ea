"""Folder locks: a marker in a folder while a program writes there, so that no other program does.

Every lock has a marker with a unique name, which contains the machine, the process and its start time. The marker of a
killed program therefore differs from that of a running one, and can be removed without affecting a newer one. A program
writes its marker first and then searches for others, so that of two simultaneous programs at most one continues.

A session that was claimed and never begun, because its program ended before the journal's first line, contains no data:
its number is free again. A program that takes it over locks it first. A program that ends while it claims or releases
a session leaves a hidden folder next to it.
"""

import contextlib
import json
import os
import platform
import re
import secrets
import shutil
import time
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, Self

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.files.atomic import (
    cannot_read,
    cannot_write,
    create_folder,
    is_there,
    parse_json,
    remove_temporary_files,
    sync_folder,
    temporary_files,
    write_file,
)
from study_app.store.integrity.checksums import is_system_file
from study_app.store.journals import journal

_MARKER = re.compile(r"\.open-[0-9a-f]{8}\.json")
_START_TOLERANCE_S = 0.05  # processes with the same ID that began within this time are the same process
_INITIAL_FILES = ("receipt.json", "journal.jsonl")
_MAX_CLAIM_S = 3600.0  # time in which a program marks a folder that it created, or removes it


@dataclass(frozen=True, slots=True)
class FolderLock:
    """A lock on a folder until ``release`` or the end of a ``with`` block; a forked process does not release it."""

    marker: Path
    process: int = field(default_factory=os.getpid)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """Remove the marker; if that fails, other programs ignore it once this program has ended."""
        if self.process != os.getpid():
            return
        with contextlib.suppress(OSError):
            self.marker.unlink(missing_ok=True)


def lock_folder(folder: Path) -> FolderLock:
    """Mark ``folder`` as open in this program.

    Raises
    ------
    StoreError
        Another program has it open, or the marker cannot be written. Nothing is left behind.
    """
    lock = FolderLock(folder / f".open-{secrets.token_hex(4)}.json")
    try:
        write_file(lock.marker, json.dumps(_this_program()).encode())
        for marker in markers(folder):
            if marker != lock.marker:
                if _may_be_running(holder := _holder(marker)):
                    raise _locked_error(marker, holder)
                marker.unlink(missing_ok=True)
        sync_folder(folder)
    except OSError as error:
        lock.release()
        raise cannot_write(folder, error) from error
    except StoreError:
        lock.release()
        raise
    return lock


def create_locked_folder(folder: Path) -> FolderLock | None:
    """Create ``folder``, locked by this program from the start; return None if it exists and is not empty."""
    lock = FolderLock(folder / f".open-{secrets.token_hex(4)}.json")
    try:
        created = create_folder(folder, {lock.marker.name: json.dumps(_this_program()).encode()})
    except StoreError:
        if is_there(lock.marker):  # created, but not flushed to the disk
            shutil.rmtree(folder, ignore_errors=True)
        elif is_there(folder):
            return None
        raise
    return lock if created else None


def markers(folder: Path) -> tuple[Path, ...]:
    """Return the markers in ``folder``, of running and ended programs."""
    return tuple(sorted(path for path in folder.glob(".open-*.json") if _MARKER.fullmatch(path.name)))


def is_open(folder: Path) -> bool:
    """Return whether a program, perhaps this one, has ``folder`` open."""
    return any(_may_be_running(_holder(marker)) for marker in markers(folder))


def refuse_if_open(folder: Path) -> None:
    """Reject a folder that a program, perhaps this one, has open; nothing is changed."""
    for marker in markers(folder):
        holder = _holder(marker)
        if _may_be_running(holder):
            raise _locked_error(marker, holder)


def is_never_begun(path: Path) -> bool:
    """Return whether the session folder ``path`` exists, but contains no journal line and no file written after it.

    A receipt that records the session's end or a resumption counts as written later.

    Raises
    ------
    StoreError
        The system denies access.
    """
    if not is_there(path):
        return False
    try:
        initial_files = {path / name for name in _INITIAL_FILES}
        files = {entry for entry in path.iterdir() if not is_system_file(Path(entry.name))}
        if files - initial_files - {*markers(path), *temporary_files(path)}:
            return False
    except OSError as error:
        raise cannot_read(path, error) from error
    with contextlib.suppress(StoreError):
        session_receipt = receipt.read(path / "receipt.json")
        if session_receipt.get("status") != receipt.UNFINISHED or session_receipt.get("resumed"):
            return False
    journal_path = path / "journal.jsonl"
    if not is_there(journal_path):
        return True
    contents = journal.scan(journal_path)
    return not contents.lines and contents.damage is None


def is_abandoned(path: Path) -> bool:
    """Return whether a program that has ended claimed the session folder ``path`` without beginning the session."""
    return is_never_begun(path) and not is_open(path)


def take_over_folder(path: Path) -> FolderLock | None:
    """Lock and empty the session folder ``path``; return None if it was begun or another program has it open."""
    if not is_abandoned(path):
        return None
    lock = lock_folder(path)
    try:
        if not is_never_begun(path):
            lock.release()
            return None
        remove_temporary_files(path)
        for name in _INITIAL_FILES:
            (path / name).unlink(missing_ok=True)
    except OSError as error:
        lock.release()
        raise cannot_write(path, error) from error
    except StoreError:
        lock.release()
        raise
    return lock


def remove_abandoned_claims(participant: Path) -> None:
    """Remove the temporary folders of programs that ended while they claimed or released a participant's session.

    Without a marker the owner is unknown; then only folders older than any such operation are removed. A folder that
    cannot be removed is left.
    """
    for folder in temporary_files(participant):
        with contextlib.suppress(OSError):  # for example, it was begun or removed in the meantime
            is_old = time.time() - folder.stat().st_mtime > _MAX_CLAIM_S
            # is_open comes last, because a marker may appear between the checks.
            if folder.is_dir() and (is_old or markers(folder)) and not is_open(folder):
                shutil.rmtree(folder)


def _locked_error(marker: Path, holder: dict[str, Any]) -> StoreError:
    return StoreError(
        f"{marker.parent} is open in another program (process {holder.get('pid')} on {holder.get('host')}, since "
        f"{holder.get('at')}): wait for it, or close it there; if that program is no longer running, delete {marker}"
    )


def _holder(marker: Path) -> dict[str, Any]:
    """Return the content of a marker, empty if it was removed in the meantime."""
    try:
        holder = parse_json(marker.read_bytes())
    except FileNotFoundError:
        return {"gone": True}
    except (OSError, ValueError):
        return {}
    return holder if isinstance(holder, dict) else {}


def _this_program() -> dict[str, Any]:
    return {
        "host": platform.node(),
        "pid": os.getpid(),
        "began": process_start_s(os.getpid()),
        "at": datetime.now().astimezone().isoformat(timespec="seconds"),
    }


def _may_be_running(holder: dict[str, Any]) -> bool:
    """Return whether the program that wrote a marker may still run; always True for another machine."""
    if holder.get("gone"):
        return False
    if holder.get("host") != platform.node() or not isinstance(holder.get("pid"), int):
        return True
    try:
        began = process_start_s(holder["pid"])
        return began is not None and abs(began - float(holder["began"])) < _START_TOLERANCE_S
    except (PermissionError, KeyError, TypeError, ValueError):  # a process with this ID runs, but may be another one
        return True


def process_start_s(process: int) -> float | None:
    """Return the start time of the process with this ID [s since the epoch], or None if it does not run."""
    import psutil  # noqa: PLC0415 - slow to load: only where a folder is locked

    try:
        running = psutil.Process(process)
        if running.status() in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD):
            return None
        return running.create_time() - (psutil.boot_time() if psutil.LINUX else 0.0)
    except psutil.NoSuchProcess:
        return None
    except psutil.AccessDenied as error:
        raise PermissionError(process) from error
