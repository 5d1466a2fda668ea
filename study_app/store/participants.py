"""The table of all sessions of a study, made from their journals."""

from __future__ import annotations

from study_app.store import journal, tables
from study_app.store.atomic import is_there, write_file
from study_app.store.columns import PARTICIPANTS
from study_app.store.layout import StudyFolder


def participants(folder: StudyFolder) -> list[tables.Row]:
    """Return one row per session that has begun its journal, by participant and number."""
    rows: list[tables.Row] = []
    for session in folder.sessions():
        if not is_there(session.journal):
            continue  # claimed, and not begun
        contents = journal.scan(session.journal)
        if contents.lines:
            damaged = {} if contents.damage is None else {"status": "damaged"}
            rows.append(tables.participant(contents.lines) | damaged)
    return rows


def write_participants(folder: StudyFolder, study: str) -> None:
    """Bring the table up to date with all journals.

    Several programs may do so at once on a shared folder: each looks again after it wrote, so that whoever wrote last
    has seen what the others journalled before they wrote, and the table ends up complete.

    Raises
    ------
    StoreError
        The table cannot be written, or a journal cannot be read.
    """
    content = tables.csv_bytes(PARTICIPANTS, participants(folder))
    while True:
        write_file(folder.participants(study), content)
        again = tables.csv_bytes(PARTICIPANTS, participants(folder))
        if again == content:
            return
        content = again
