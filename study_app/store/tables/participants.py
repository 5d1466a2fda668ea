"""The table of all sessions of a study, made from their journals."""

from __future__ import annotations

import contextlib
import csv
import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.atomic import is_there, read_own, write_file
from study_app.store.blinded.blinding import Key
from study_app.store.blinded.sealing import opened, opened_key
from study_app.store.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.sessions.unstarted_sessions import never_begun
from study_app.store.tables import csv_files, session_tables
from study_app.store.tables.columns import PARTICIPANTS, header

COARSE_S = 2.0  # moments of files closer to each other than this may be told in the wrong order
NONE: Final[Mapping[Path, csv_files.Row]] = MappingProxyType({})


def participants(folder: StudyFolder, known: Mapping[Path, csv_files.Row] = NONE) -> list[csv_files.Row]:
    """Return one row per session that has begun its journal, by participant and number.

    ``known`` are rows by session folder whose journals need not be read, since this program has just written them.
    """
    key = opened_or_none(folder)
    return [
        row
        for session in folder.sessions()
        for row in ([known[session.path]] if session.path in known else row_of(session, key))
    ]


def participants_at_once(folder: StudyFolder) -> list[csv_files.Row]:
    """Return what `participants` does, without reading each journal, for lists that people wait for.

    A session's row in the table counts where the journal was last changed clearly before the table was; its journal is
    read where it was not. So it proves nothing: `verify` reads all.
    """
    key = opened_or_none(folder)
    written_s, known = _table(folder)
    return [
        row
        for session in folder.sessions()
        for row in (
            [known[session.participant, session.number]]
            if (session.participant, session.number) in known and _changed_s(session.journal) < written_s - COARSE_S
            else row_of(session, key)
        )
    ]


def _table(folder: StudyFolder) -> tuple[float, dict[tuple[str, int], csv_files.Row]]:
    """Return when the table was written [s since 1970], and its rows by participant and session."""
    written_s, rows = 0.0, {}
    for path in folder.data.glob(folder.participants("*").name):
        with contextlib.suppress(OSError, ValueError, csv.Error):  # then the journals are read
            written_s = _changed_s(path)
            found = csv_files.read_table(read_own(path, folder.path), PARTICIPANTS)
            rows = {(row["participant"], row["session"]): row for row in found}
    return written_s, rows


def _changed_s(path: Path) -> float:
    """Return when a file was last changed [s since 1970]; infinite where it is not there."""
    try:
        return path.stat().st_mtime
    except OSError:
        return math.inf


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
    """Return the row of a session whose journal gives none: what its folder, its first line and its receipt tell."""
    if not start:
        with contextlib.suppress(StoreError):
            held = receipt.read(session.receipt)
            device = held.get("device")
            name = device.get("name") if isinstance(device, dict) else None
            start = held | {"at": held.get("started_at"), "device": name}
    known = {name: start.get(name) for name in ("study", "simulated", "pilot", "device", "language")}
    which = {"participant": session.participant, "session": session.number, "session_started_at": start.get("at")}
    return {**dict.fromkeys(header(PARTICIPANTS)), **known, **which, "status": "damaged"}


def write_participants(folder: StudyFolder, study: str, known: Mapping[Path, csv_files.Row] = NONE) -> None:
    """Bring the table up to date with all journals; ``known`` as in :func:`participants`.

    Several programs may do so at once on a shared folder: each looks again after it wrote, so that whoever wrote last
    has seen what the others journalled before they wrote, and the table ends up complete.

    Raises
    ------
    StoreError
        The table cannot be written.
    """
    path = folder.participants(study)
    content = csv_files.csv_bytes(PARTICIPANTS, participants(folder, known))
    if path.is_file() and path.read_bytes() == content:
        return
    while True:
        write_file(path, content)
        again = csv_files.csv_bytes(PARTICIPANTS, participants(folder, known))
        if again == content:
            return
        content = again
