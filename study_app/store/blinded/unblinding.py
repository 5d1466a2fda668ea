"""Opening a study: the reveal is recorded, and what was sealed appears in tables, their checksums and the description.

If the program ends meanwhile, the journals contain everything, and opening the study again completes it.
"""

import contextlib
from dataclasses import dataclass, replace
from pathlib import Path

from study_app.errors import StoreError
from study_app.protocol.model import StudyHead
from study_app.store import receipt
from study_app.store.atomic import is_there, write_file
from study_app.store.blinded.blinding import Codes, Key, read_key, reveal
from study_app.store.blinded.catch_trials import exclude_inattentive
from study_app.store.checksums import replace_checksums
from study_app.store.exclusions import Exclusion
from study_app.store.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal import Line
from study_app.store.sessions.folder_lock import open_alone
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.tables.csv_files import in_columns_of
from study_app.store.tables.participants import write_participants
from study_app.store.tables.session_tables import table_columns
from study_app.store.tables.study_description import described_study, has_intervals, write_description


@dataclass(frozen=True, slots=True)
class Unblinded:
    """What was opened.

    Attributes
    ----------
    codes : mapping
        Block → code → condition id.
    left : tuple of str
        For each table left unchanged the reason and the remedy.
    excluded : tuple of Exclusion
        Sessions that the rule `catch` excluded.
    """

    codes: Codes
    left: tuple[str, ...]
    excluded: tuple[Exclusion, ...] = ()


def unblind(folder: Path, by: str, reason: str) -> Unblinded:
    """Open a study's key, record who did so and why, and write the sealed columns into its tables.

    A table that differs from its journal is not changed, nor is a session that runs or cannot be read.

    Raises
    ------
    StoreError
        As `blinding.reveal`, or another program writes to the folder; then nothing has changed.
    """
    study = StudyFolder(folder)
    with open_alone(folder) if is_there(study.key) else contextlib.nullcontext():
        codes = reveal(folder, by, reason)
        key = read_key(folder)
        left: list[str] = []
        for session in study.sessions():
            try:
                left += _open_tables(study, session, key)
            except StoreError as error:
                left.append(f"{error}; then: liquid-study rebuild {session.path}")
        try:
            _open_study(study)
        except StoreError as error:
            left.append(f"{error}; then unblind again")
    excluded: tuple[Exclusion, ...] = ()
    try:
        excluded = exclude_inattentive(folder)
    except (StoreError, ValueError, KeyError, TypeError) as error:
        left.append(f"the rule catch was not applied: {error}; then unblind again")
    return Unblinded(codes, tuple(left), excluded)


def _open_tables(study: StudyFolder, session: SessionFolder, key: Key) -> list[str]:
    """Write a session's tables with the sealed columns; return the reasons for tables left unchanged."""
    if not is_there(session.journal):
        return []
    lines = journal.read(session.journal)
    if not lines or not lines[0].get("measures_sealed"):
        return []
    with open_alone(session.path):
        return list(_rewrite(Place(study, session, lines[0]["study"]), lines, key))


def _rewrite(place: Place, lines: list[Line], key: Key) -> list[str]:
    """Write the sealed columns; a table of an earlier version stays without columns unknown to it."""
    left: list[str] = []
    ours: dict[str, tuple[bytes, bytes]] = {}
    before, after = (dict(table_files(place, lines, one)) for one in (None, key))
    for path, columns in zip(after, table_columns(lines, opened=True).values(), strict=True):
        held = path.read_bytes() if is_there(path) else b""
        written = [replace(column, later=False) if column.sealed else column for column in columns]
        sealed, content = (in_columns_of(held, whole[path], written)[0] for whole in (before, after))
        if held not in (sealed, content):
            left.append(
                f"{path} differs from the journal, so it was not changed: "
                f"rebuild it with liquid-study rebuild {place.folder.path}"
            )
            continue
        if held != content:
            write_file(path, content)
        ours[path.name] = sealed, content
    if is_there(place.folder.checksums):
        replace_checksums(place.folder, ours)
    return left


def _open_study(study: StudyFolder) -> None:
    """Bring the table of participants and the description up to date."""
    name = described_study(study)
    if name is not None:
        write_participants(study, name, whole=True)
    for session in study.sessions():
        with contextlib.suppress(StoreError, KeyError, TypeError, ValueError):  # another receipt is used instead
            protocol = receipt.read(session.receipt)["protocol"]
            head, number = StudyHead.model_validate(protocol["study"]), protocol.get("format", 1)
            write_description(study, head, number, intervals=has_intervals(protocol))
            return
