"""Folder locks: a marker in a folder while a program writes there, so that no other program does.

Every opening has a marker with a unique name, which contains machine, process and start of the process; so the marker
of a killed program differs from that of a running one, and can be removed without affecting a newer one. A program
writes its marker first and then searches for others: of two simultaneous programs at most one continues.
"""

import contextlib
import json
import os
import platform
import re
import secrets
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Self

from study_app.errors import StoreError
from study_app.store.atomic import cannot_write, create_folder, is_there, sync_folder, write_file
from study_app.store.journals.parsing import parse_json

_MARKER = re.compile(r"\.open-[0-9a-f]{8}\.json")
SAME_S = 0.05  # processes of one number that began within this time are the same one


@dataclass(frozen=True, slots=True)
class Opening:
    """A folder that this program has open until ``release``, or the end of a ``with`` block."""

    marker: Path

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """Remove the marker; one that cannot be removed is ignored once this program has ended."""
        with contextlib.suppress(OSError):
            self.marker.unlink(missing_ok=True)


def open_alone(folder: Path) -> Opening:
    """Mark ``folder`` as open in this program.

    Raises
    ------
    StoreError
        Another program has it open, or the marker cannot be written. Nothing is left behind.
    """
    opening = Opening(folder / f".open-{secrets.token_hex(4)}.json")
    write_file(opening.marker, json.dumps(_this_program()).encode())
    try:
        for marker in markers(folder):
            if marker != opening.marker:
                _pass(marker)
        sync_folder(folder)
    except OSError as error:
        opening.release()
        raise cannot_write(folder, error) from error
    except StoreError:
        opening.release()
        raise
    return opening


def create_opened(folder: Path) -> Opening | None:
    """Create ``folder``, locked for this program from the start; None if it exists and is not empty.

    Raises
    ------
    StoreError
        It is not there and cannot be created.
    """
    opening = Opening(folder / f".open-{secrets.token_hex(4)}.json")
    try:
        created = create_folder(folder, {opening.marker.name: json.dumps(_this_program()).encode()})
    except StoreError:
        if is_there(folder):
            return None
        raise
    return opening if created else None


def markers(folder: Path) -> tuple[Path, ...]:
    """Return the markers in ``folder``, of running and ended programs."""
    return tuple(sorted(path for path in folder.glob(".open-*.json") if _MARKER.fullmatch(path.name)))


def is_open(folder: Path) -> bool:
    """Return whether a program, perhaps this one, has ``folder`` open."""
    return any(_lives(_holder(marker)) for marker in markers(folder))


def refuse_if_open(folder: Path) -> None:
    """Reject a folder that a program, perhaps this one, has open; nothing is changed.

    Raises
    ------
    StoreError
        Says which program, and since when.
    """
    for marker in markers(folder):
        holder = _holder(marker)
        if _lives(holder):
            raise _is_open(marker, holder)


def _pass(marker: Path) -> None:
    """Remove the marker of a program that has ended; refuse if it still runs."""
    holder = _holder(marker)
    if _lives(holder):
        raise _is_open(marker, holder)
    marker.unlink(missing_ok=True)


def _is_open(marker: Path, holder: dict[str, Any]) -> StoreError:
    return StoreError(
        f"{marker.parent} is open in another program (process {holder.get('pid')} on {holder.get('host')}, since "
        f"{holder.get('at')}): wait for it, or end it there; if that program is gone, delete {marker}"
    )


def _holder(marker: Path) -> dict[str, Any]:
    """Return the content of the marker; nothing if it was removed meanwhile."""
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
        "began": process_began(os.getpid()),
        "at": datetime.now().astimezone().isoformat(timespec="seconds"),
    }


def _lives(holder: dict[str, Any]) -> bool:
    """Return whether the program that wrote a marker may still run; always true for another machine."""
    if holder.get("gone"):
        return False
    if holder.get("host") != platform.node() or not isinstance(holder.get("pid"), int):
        return True
    try:
        began = process_began(holder["pid"])
        return began is not None and abs(began - float(holder["began"])) < SAME_S
    except (PermissionError, KeyError, TypeError, ValueError):  # it runs, but may be another process
        return True


def process_began(process: int) -> float | None:
    """Return when the running process of that number began; None if none runs.

    Parameters
    ----------
    process : int
        Its number.

    Returns
    -------
    float or None
        [s], since the computer was started on Linux, where setting the clock moves the wall time of every process;
        elsewhere since the epoch.

    Raises
    ------
    PermissionError
        It runs, and belongs to another account, which hides it.
    """
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
