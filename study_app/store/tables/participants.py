"""The table of all sessions of a study, made from their journals."""

import contextlib
import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final, TypeAlias

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.atomic import disk_time_ns, is_there, read_own, write_file
from study_app.store.blinded.blinding import Key, reveals
from study_app.store.blinded.sealing import opened, opened_key
from study_app.store.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.sessions.unstarted_sessions import never_begun
from study_app.store.tables import csv_files, session_tables
from study_app.store.tables.column import Column, header
from study_app.store.tables.columns import PARTICIPANTS, PARTICIPANTS_2

COARSE_S = 2.0  # modification times closer than this may be in the wrong order
NONE: Final[Mapping[Path, csv_files.Row]] = MappingProxyType({})

_Stamp: TypeAlias = tuple[int, int] | None  # when a journal was last changed [ns since 1970], and its size; None: gone
_Seen: TypeAlias = dict[Path, tuple[_Stamp, list[csv_files.Row]]]


def participants(folder: StudyFolder) -> list[csv_files.Row]:
    """Return one row per session that has begun its journal, by participant and number; each journal is read."""
    return _rows(folder, {}, NONE)


def participants_at_once(folder: StudyFolder) -> list[csv_files.Row]:
    """Return the result of `participants` without reading each journal, for fast lists.

    A session's row in the table is used if neither its journal nor the study's key was changed since the table was
    made. So it proves nothing: `verify` reads all.
    """
    return _rows(folder, _seen_in_table(folder), NONE)


def _rows(folder: StudyFolder, seen: _Seen, known: Mapping[Path, csv_files.Row]) -> list[csv_files.Row]:
    """Return the rows of all sessions; ``seen``, brought up to date, has those of journals that need not be read."""
    key = opened_or_none(folder)
    rows: list[csv_files.Row] = []
    for session in folder.sessions():
        if session.path in known:
            rows.append(known[session.path])
            continue
        stamp = _stamp(session.journal)
        if stamp is None or seen.get(session.path, (None, []))[0] != stamp:
            seen[session.path] = stamp, row_of(session, key)
        rows += seen[session.path][1]
    return rows


def _seen_in_table(folder: StudyFolder) -> _Seen:
    """Return the rows of the table that no change of a journal or of the key made old; a damaged session has none."""
    for path in folder.data.glob(folder.participants("*").name):
        with contextlib.suppress(OSError, StoreError, ValueError, csv.Error):  # then the journals are read
            made_ns = path.stat().st_mtime_ns - round(COARSE_S * 1e9)
            if is_there(folder.reveals) and folder.reveals.stat().st_mtime_ns >= made_ns:
                return {}
            content = read_own(path, folder.path)
            second = b"group" in content.partition(b"\n")[0].split(b",")
            found = csv_files.read_table(content, PARTICIPANTS_2 if second else PARTICIPANTS)
            sessions = {folder.session(row["participant"], row["session"]): row for row in found}
            return {
                session.path: (stamp, [row])
                for session, row in sessions.items()
                if row["status"] != "damaged" and (stamp := _stamp(session.journal)) is not None and stamp[0] < made_ns
            }
    return {}


def _stamp(path: Path) -> _Stamp:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


def opened_or_none(folder: StudyFolder) -> Key | None:
    """Return the study's key where it was opened and can be read: a lost one hides no session."""
    with contextlib.suppress(StoreError):
        return opened_key(folder)
    return None


def row_of(session: SessionFolder, key: Key | None) -> list[csv_files.Row]:
    """Return the row of one session; none if it has not begun. ``key`` is the study's once it was opened."""
    try:
        contents = journal.scan(session.journal) if is_there(session.journal) else journal.Contents([], 0)
        if not contents.lines and never_begun(session.path):
            return []
    except StoreError:  # one session that cannot be read must not stop the others
        return [_damaged(session, {})]
    return [row_from(session, contents, key) if contents.lines else _damaged(session, {})]


def row_from(session: SessionFolder, contents: journal.Contents, key: Key | None) -> csv_files.Row:
    """Return the row of a session whose journal has these lines."""
    try:
        row = session_tables.participant(opened(contents.lines, key))
    except StoreError:  # one session that cannot be read must not stop the others
        return _damaged(session, contents.lines[0])
    return row if contents.damage is None else row | {"status": "damaged"}


def _damaged(session: SessionFolder, start: journal.Line) -> csv_files.Row:
    """Return the row of a session without one from its journal: from its folder, first line and receipt."""
    if not start:
        with contextlib.suppress(StoreError):
            held = receipt.read(session.receipt)
            device = held.get("device")
            name = device.get("name") if isinstance(device, dict) else None
            start = held | {"at": held.get("started_at"), "device": name}
    known = {name: start.get(name) for name in ("study", "simulated", "pilot", "device", "language")}
    which = {"participant": session.participant, "session": session.number, "session_started_at": start.get("at")}
    return {**dict.fromkeys(header(PARTICIPANTS)), **known, **which, "status": "damaged"}


def write_participants(
    folder: StudyFolder, study: str, known: Mapping[Path, csv_files.Row] = NONE, *, whole: bool = False
) -> None:
    """Bring the table up to date with all journals; those that changed since it was made are read.

    Several programs may do so at once on a shared folder: each looks again after it wrote, so that whoever wrote last
    has seen what the others journalled before they wrote, and the table ends up complete. The table's own time is when
    its making began, so that a program killed meanwhile leaves none that seems newer than a journal it did not read.

    Parameters
    ----------
    folder : StudyFolder
        The study's results.
    study : str
        The study's name.
    known : mapping
        Rows by session folder whose journals need not be read, since this program has just written them.
    whole : bool
        Whether every journal is read, even where the table is up to date.

    Raises
    ------
    StoreError
        The table cannot be written.
    """
    path = folder.participants(study)
    seen = {} if whole else _seen_in_table(folder)
    made_ns, content = _made(folder, seen, known)
    if path.is_file() and path.read_bytes() == content:
        return
    while True:
        write_file(path, content, changed_ns=made_ns)
        made_ns, again = _made(folder, seen, known)
        if again == content:
            return
        content = again


def _made(folder: StudyFolder, seen: _Seen, known: Mapping[Path, csv_files.Row]) -> tuple[int, bytes]:
    """Return when the making of the table began [ns since 1970, by the clock of the folder's disk], and the table."""
    began_ns = disk_time_ns(folder.data)
    return began_ns, table_bytes(folder, _rows(folder, seen, known))


def table_bytes(folder: StudyFolder, rows: Sequence[csv_files.Row]) -> bytes:
    """Return the table with these rows, and the group of each session in a study of format 2 that was unblinded."""
    return csv_files.csv_bytes(columns_of(folder, rows), [{"group": None} | row for row in rows])


def columns_of(folder: StudyFolder, rows: Iterable[csv_files.Row]) -> tuple[Column, ...]:
    """Return the columns of the table with these rows."""
    second = any("group" in row for row in rows)
    return PARTICIPANTS_2 if second and reveals(folder.path) else PARTICIPANTS
