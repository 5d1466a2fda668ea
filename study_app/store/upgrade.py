"""Upgrade of study files and results of earlier versions in place, since readers support only the current format.

Journals and receipts are evidence and are not changed. Tables are derived from the journal: the columns that they have
are compared with it, and then they are rewritten with the current columns.
"""

import contextlib
import hashlib
from collections.abc import Iterator
from pathlib import Path

from study_app.errors import StoreError, as_argument
from study_app.protocol.load import read_document
from study_app.protocol.source import source_bytes
from study_app.protocol.upgrade import needs_upgrade, upgraded_file
from study_app.store.blinded.blinding import opened_key
from study_app.store.files.atomic import is_there, read_if_there, read_regular, write_file
from study_app.store.files.csv_files import has_same_cells
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.integrity.checksums import replace_checksums
from study_app.store.integrity.folder_lock import is_never_begun, lock_folder
from study_app.store.journals import journal
from study_app.store.journals.journal_events import SessionEnded, start_of
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.sessions.recovery import RESTORE, files_beyond_journal
from study_app.store.tables.study_files import has_earlier_columns, write_study_files

_SECTIONS = frozenset({"study", "scene", "liquids"})


def upgrade(path: Path) -> list[Path]:
    """Rewrite a study or scene file of format 1, or all such files and the results in a folder, in the current format.

    The original of a study file is copied next to it, as ``NAME.toml.format-1``, and the copy is compared with it. All
    files are read and checked before the first is written.

    Parameters
    ----------
    path : Path
        A TOML file, or a folder, which is searched at any depth.

    Returns
    -------
    sequence of paths
        The rewritten files, sorted; empty if all have the current format.

    Raises
    ------
    ProtocolError
        A file is not TOML, or cannot be upgraded (`protocol.upgrade.upgraded_file`).
    StoreError
        A copy of another original exists, a table differs from its journal, a session is open in another program, its
        journal is damaged, or a file cannot be written.
    """
    files = [path] if path.is_file() else sorted(path.rglob("*.toml"))
    upgraded: dict[Path, bytes] = {}
    for file in files:
        source = source_bytes(file)
        document, _ = read_document(source, str(file))
        if needs_upgrade(document) and _SECTIONS & document.keys():
            upgraded[file] = upgraded_file(source, str(file))
    with contextlib.ExitStack() as locks:
        tables = {study: list(_outdated_tables(study, locks)) for study in _outdated_studies(path)}
        for file, content in upgraded.items():
            original, copy = file.read_bytes(), file.with_name(f"{file.name}.format-1")
            if not copy.exists():
                write_file(copy, original)
            if read_regular(copy) != original:
                raise StoreError(
                    f"{copy} is not a copy of {file.name}, so {file.name} was not changed: rename {copy.name} and try "
                    "again"
                )
            write_file(file, content)
        for study, session_tables in tables.items():
            for session, table, held, content in session_tables:
                if is_there(session.checksums):  # before the table, so that an interrupted upgrade can be repeated
                    hashes = hashlib.sha256(held).hexdigest(), hashlib.sha256(content).hexdigest()
                    replace_checksums(session, {table.name: hashes})
                write_file(table, content)
            write_study_files(study)
    rewritten = [table for session_tables in tables.values() for _, table, _, _ in session_tables]
    return sorted([*upgraded, *rewritten, *(study.description for study in tables)])


def _outdated_studies(path: Path) -> Iterator[StudyFolder]:
    """Yield the studies in a folder whose tables were written by an earlier version."""
    studies = (StudyFolder(key.parent.parent) for key in sorted(path.rglob("blinding/key.sealed")))
    yield from filter(has_earlier_columns, studies)


def _outdated_tables(
    study: StudyFolder, locks: contextlib.ExitStack
) -> Iterator[tuple[SessionFolder, Path, bytes, bytes]]:
    """Lock each session and yield it with path, content and new content of each table that lacks columns."""
    key = opened_key(study)
    for session in study.sessions():
        if is_never_begun(session.path):
            continue
        locks.callback(lock_folder(session.path).release)
        lines = journal.read(session.journal)
        place = Place(study, session, start_of(lines).study)
        for file, problem in files_beyond_journal(place, lines):
            raise StoreError(f"{file} {problem}: {RESTORE}")
        for table, new_content in table_files(place, lines, key):
            old_content = read_if_there(table)
            if old_content is None or old_content == new_content:
                continue
            if isinstance(lines[-1], SessionEnded) and not has_same_cells(old_content, new_content):
                raise StoreError(
                    f"{table} differs from its journal, so nothing was upgraded: run liquid-study rebuild "
                    f"{as_argument(session.path)} to recreate it"
                )
            yield session, table, old_content, new_content
