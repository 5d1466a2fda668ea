"""Sessions that were claimed and never begun: their program ended before the journal's first line.

They contain no data, so their number is free again. A program that takes one over locks it first, like every other
folder. A program that ends while it claims or releases a session leaves a hidden folder next to it.
"""

import contextlib
import shutil
import time
from pathlib import Path

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.atomic import cannot_read, cannot_write, is_there, sweep, temporaries
from study_app.store.journals import journal
from study_app.store.sessions.folder_lock import Opening, is_open, markers, open_alone

_BEFORE_THE_FIRST_LINE = ("receipt.json", "journal.jsonl")
_NO_PROGRAM_TAKES_S = 3600.0  # to put its marker into a folder that it has created, or to take that folder away


def never_begun(path: Path) -> bool:
    """Return whether the session's folder ``path`` is there without a line of a journal, or anything later than that.

    A receipt that tells of the session's end, or that it was resumed, is later than that.

    Raises
    ------
    StoreError
        The system does not let us look.
    """
    if not is_there(path):
        return False
    try:
        early = {path / name for name in _BEFORE_THE_FIRST_LINE}
        if set(path.iterdir()) - early - {*markers(path), *temporaries(path)}:
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


def abandoned(path: Path) -> bool:
    """Return whether the session's folder ``path`` was claimed and never begun, by a program that is gone.

    Raises
    ------
    StoreError
        The system does not let us look.
    """
    return never_begun(path) and not is_open(path)


def take_over(path: Path) -> Opening | None:
    """Have the session's folder ``path`` for this program alone and empty it; None where it was begun, or is open.

    Raises
    ------
    StoreError
        Another program takes it at this moment, or it cannot be written.
    """
    if not abandoned(path):
        return None
    opening = open_alone(path)
    try:
        if not never_begun(path):
            opening.release()
            return None
        sweep(path)
        for name in _BEFORE_THE_FIRST_LINE:
            (path / name).unlink(missing_ok=True)
    except OSError as error:
        opening.release()
        raise cannot_write(path, error) from error
    except StoreError:
        opening.release()
        raise
    return opening


def sweep_claims(participant: Path) -> None:
    """Take away what programs that are gone left in a participant's folder as they claimed a session or let go of it.

    Without a program's marker its owner is unknown; then only what is older than any such moment.
    """
    for half in temporaries(participant):
        with contextlib.suppress(OSError):  # it has just become a session, or is gone
            old = time.time() - half.stat().st_mtime > _NO_PROGRAM_TAKES_S
            if half.is_dir() and (old or markers(half)) and not is_open(half):  # in this order: markers come
                shutil.rmtree(half, ignore_errors=True)
