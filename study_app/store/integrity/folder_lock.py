"""Folder locks: a marker in a folder while a program writes there, so that no other program does.

Every opening has a marker with a unique name, which contains machine, process and start of the process; so the marker
of a killed program differs from that of a running one, and can be removed without affecting a newer one. A program
writes its marker first and then searches for others: of two simultaneous programs at most one continues.

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
_SAME_S = 0.05  # processes with the same ID that began within this time are the same process
_BEFORE_THE_FIRST_LINE = ("receipt.json", "journal.jsonl")
_NO_PROGRAM_TAKES_S = 3600.0  # time in which a program marks a folder that it created, or removes it


@dataclass(frozen=True, slots=True)
class Opening:
    """A folder locked by this program until ``release`` or the end of a ``with`` block; a fork does not release it."""

    marker: Path
    process: int = field(default_factory=os.getpid)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """Remove the marker; one that cannot be removed is ignored once this program has ended."""
        if self.process != os.getpid():
            return
        with contextlib.suppress(OSError):
            self.marker.unlink(missing_ok=True)


def lock_folder(folder: Path) -> Opening:
    """Mark ``folder`` as open in this program.

    Raises
    ------
    StoreError
        Another program has it open, or the marker cannot be written. Nothing is left behind.
    """
    opening = Opening(folder / f".open-{secrets.token_hex(4)}.json")
    try:
        write_file(opening.marker, json.dumps(_this_program()).encode())
        for marker in markers(folder):
            if marker != opening.marker:
                if _may_be_running(holder := _holder(marker)):
                    raise _open_elsewhere(marker, holder)
                marker.unlink(missing_ok=True)
        sync_folder(folder)
    except OSError as error:
        opening.release()
        raise cannot_write(folder, error) from error
    except StoreError:
        opening.release()
        raise
    return opening


def create_locked_folder(folder: Path) -> Opening | None:
    """Create ``folder``, locked by this program from the start; return None if it exists and is not empty."""
    opening = Opening(folder / f".open-{secrets.token_hex(4)}.json")
    try:
        created = create_folder(folder, {opening.marker.name: json.dumps(_this_program()).encode()})
    except StoreError:
        if is_there(opening.marker):  # created, but not flushed to the disk
            shutil.rmtree(folder, ignore_errors=True)
        elif is_there(folder):
            return None
        raise
    return opening if created else None


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
            raise _open_elsewhere(marker, holder)


def is_never_begun(path: Path) -> bool:
    """Return whether the session folder ``path`` exists without a line in its journal or any file written later.

    A receipt with the session's end or a resumption is a later file.

    Raises
    ------
    StoreError
        The system denies access.
    """
    if not is_there(path):
        return False
    try:
        early = {path / name for name in _BEFORE_THE_FIRST_LINE}
        files = {entry for entry in path.iterdir() if not is_system_file(Path(entry.name))}
        if files - early - {*markers(path), *temporary_files(path)}:
            return False
    except OSError as error:
        raise cannot_read(path, error) from error
    with contextlib.suppress(StoreError):
        held = receipt.read(path / "receipt.json")
        if held.get("status") != receipt.UNFINISHED or held.get("resumed"):
            return False
    first = path / "journal.jsonl"
    if not is_there(first):
        return True
    contents = journal.scan(first)
    return not contents.lines and contents.damage is None


def is_abandoned(path: Path) -> bool:
    """Return whether a program that has ended claimed the session folder ``path`` without beginning the session."""
    return is_never_begun(path) and not is_open(path)


def take_over_folder(path: Path) -> Opening | None:
    """Lock and empty the session folder ``path``; return None if it was begun or another program has it open."""
    if not is_abandoned(path):
        return None
    opening = lock_folder(path)
    try:
        if not is_never_begun(path):
            opening.release()
            return None
        remove_temporary_files(path)
        for name in _BEFORE_THE_FIRST_LINE:
            (path / name).unlink(missing_ok=True)
    except OSError as error:
        opening.release()
        raise cannot_write(path, error) from error
    except StoreError:
        opening.release()
        raise
    return opening


def remove_abandoned_claims(participant: Path) -> None:
    """Remove what ended programs left in a participant's folder while they claimed or released a session.

    Without a marker the owner is unknown; then only folders older than any such operation are removed.
    """
    for half in temporary_files(participant):
        with contextlib.suppress(OSError):  # it was begun or removed in the meantime
            old = time.time() - half.stat().st_mtime > _NO_PROGRAM_TAKES_S
            if half.is_dir() and (old or markers(half)) and not is_open(half):  # in this order: markers come
                shutil.rmtree(half, ignore_errors=True)


def _open_elsewhere(marker: Path, holder: dict[str, Any]) -> StoreError:
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
        return began is not None and abs(began - float(holder["began"])) < _SAME_S
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
