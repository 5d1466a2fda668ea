"""The files of a study's folder that are derived from its sessions: the table of participants and the description.

``dataset_description.json`` is the Psych-DS description, generated from the column dictionary. Psych-DS 1.5 requires
that ``variableMeasured`` lists exactly the headers of all tables, so all tables are written before this file.
"""

import contextlib
import json
import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from study_app.errors import StoreError, as_argument
from study_app.protocol.model import StudyHead
from study_app.protocol.source import text_in
from study_app.store import receipt
from study_app.store.blinded.blinding import Key, open_events, opened_key, reveals
from study_app.store.files import csv_files
from study_app.store.files.atomic import is_there, parse_json, read_own, write_file
from study_app.store.files.columns import GROUP, PARTICIPANTS, SEALED, TRIALS_MISSING, every_column, with_missing_trials
from study_app.store.files.csv_files import Column, Row, header
from study_app.store.files.folders import SessionFolder, StudyFolder, check_study_name
from study_app.store.integrity.folder_lock import is_never_begun
from study_app.store.journals import journal
from study_app.store.merged import MANIFEST, folders_of, refuse_merged
from study_app.store.tables import session_tables

_ROW_CACHE: Final[dict[Path, tuple[object, list[csv_files.Row]]]] = {}
"""Cached rows by session folder, with time and size of the journal, since reading a journal takes 5 ms."""
# Files of a study folder other than tables; patterns as in .gitignore.
_IGNORED = b"""\
.psychds-ignore
.*.tmp
.open-*.json
journal.jsonl
receipt.json
checksums.sha256
recordings/
blinding/
exclusions.csv
exclusions_reversed.jsonl
fingerprints.txt
withdrawals.jsonl
rebuilt.txt
"""


def participant_rows(folder: StudyFolder) -> list[csv_files.Row]:
    """Return one row per session with a journal, by participant and number."""
    key = opened_or_none(folder)
    return [row for session in folder.sessions() for row in _cached_row(session, key)]


def _cached_row(session: SessionFolder, key: Key | None) -> list[csv_files.Row]:
    """Return the row of one session as `row_of`, from the cache if the journal has not changed."""
    try:
        status = session.journal.lstat()
    except OSError:
        return row_of(session, key)
    stamp = status.st_mtime_ns, status.st_size, None if key is None else key.hash
    if (cached := _ROW_CACHE.get(session.path)) is not None and cached[0] == stamp:
        return cached[1]
    rows = row_of(session, key)
    if all(row["status"] != "damaged" for row in rows):
        _ROW_CACHE[session.path] = stamp, rows
    return rows


def opened_or_none(folder: StudyFolder) -> Key | None:
    """Return the study's opened key, or None if it is sealed or unreadable, so that a lost key hides no sessions."""
    with contextlib.suppress(StoreError):
        return opened_key(folder)
    return None


def row_of(session: SessionFolder, key: Key | None) -> list[csv_files.Row]:
    """Return a list with the row of one session, empty if it has not begun. ``key`` is the study's opened key."""
    try:
        contents = journal.scan(session.journal) if is_there(session.journal) else journal.Contents([], 0)
        if not contents.lines and is_never_begun(session.path):
            return []
    except StoreError:  # an unreadable session must not prevent reading the others
        return [_damaged_row(session, {})]
    return [row_from(session, contents, key) if contents.lines else _damaged_row(session, {})]


def row_from(session: SessionFolder, contents: journal.Contents, key: Key | None) -> csv_files.Row:
    """Return the row of a session from its journal's contents, as a list."""
    try:
        row = session_tables.participant_row(open_events(contents.lines, key))
    except StoreError:  # an unreadable session must not prevent reading the others
        return _damaged_row(session, contents.lines[0].line())
    return row if contents.damage is None else row | {"status": "damaged"}


def _damaged_row(session: SessionFolder, start: Mapping[str, Any]) -> csv_files.Row:
    """Return the row of a session with a damaged journal, from its folder, first line and receipt."""
    if not start:
        with contextlib.suppress(StoreError):
            session_receipt = receipt.read(session.receipt)
            device = session_receipt.get("device")
            name = device.get("name") if isinstance(device, dict) else None
            start = session_receipt | {"at": session_receipt.get("started_at"), "device": name}
    details = {name: start.get(name) for name in ("study", "simulated", "pilot", "device", "language")}
    identity = {"participant": session.participant, "session": session.number, "session_started_at": start.get("at")}
    return {**dict.fromkeys(header(PARTICIPANTS)), **details, **identity, "status": "damaged"}


def write_participants(folder: StudyFolder, study: str) -> None:
    """Update the table from all journals.

    Several programs may do so at once on a shared folder: each reads the journals again after writing, so that the last
    writer has seen the lines of the others and the table is complete.
    """
    path = folder.participants(study)
    content = table_bytes(folder, participant_rows(folder))
    if path.is_file() and path.read_bytes() == content:
        return
    while True:
        write_file(path, content)
        newer = table_bytes(folder, participant_rows(folder))
        if newer == content:
            return
        content = newer


def update_participants(folder: StudyFolder, study: str) -> None:
    """Update the table as `write_participants`, but only log a warning if another program, such as Excel, has it open.

    The table is derived from the journals alone, so the next session or rebuild can write it.
    """
    try:
        write_participants(folder, study)
    except StoreError as error:
        if not (isinstance(error.__cause__, PermissionError) and folder.participants(study).is_file()):
            raise
        logging.getLogger(__name__).warning("%s; the next session or liquid-study rebuild will write it", error)


def table_bytes(folder: StudyFolder, rows: Sequence[csv_files.Row]) -> bytes:
    """Return the table with these rows and the columns of `columns_of`."""
    return csv_files.csv_bytes(
        columns_of(folder, rows), [{"group": None, TRIALS_MISSING.name: None} | row for row in rows]
    )


def columns_of(folder: StudyFolder, rows: Iterable[csv_files.Row]) -> tuple[Column, ...]:
    """Return the columns of the table with these rows.

    The group of each session is among them if it is pre-existing or was unblinded, the number of missing trials if the
    study has trials of intervals.
    """
    rows = list(rows)
    groups = [row["group"] for row in rows if "group" in row]
    shows_group = any(groups) or bool(groups and reveals(folder.path))
    columns = (*PARTICIPANTS, GROUP) if shows_group else PARTICIPANTS
    return with_missing_trials(columns) if any(TRIALS_MISSING.name in row for row in rows) else columns


def description_bytes(study: StudyHead, *, sealed: bool, intervals: bool = False) -> bytes:
    """Return the description of ``study``, with the same bytes on every machine.

    With ``sealed`` it omits the sealed columns, except a pre-existing group; ``intervals`` tells whether the study has
    blocks with a design.
    """
    title = text_in(study.title, study.languages[0])
    hidden = {column.name for column in every_column(intervals=intervals) if sealed and column.sealed}
    if study.group_assignment == "pre-existing":
        hidden.discard(GROUP.name)
    content = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": study.name,
        "alternateName": title,
        "description": study.description or title,
        "version": study.version,
        "variableMeasured": [
            column.variable for column in every_column(intervals=intervals) if column.name not in hidden
        ],
    }
    return (json.dumps(content, indent=2, ensure_ascii=False) + "\n").encode()


def is_same_description(content: bytes, expected: bytes) -> bool:
    """Return whether two descriptions agree on the study and on names, units and ranges of all columns."""
    try:
        description, expected_description = parse_json(content), parse_json(expected)
        columns, expected_columns = (
            [
                (variable["name"], {key: variable[key] for key in variable.keys() - {"description"}})
                for variable in content.pop("variableMeasured")
            ]
            for content in (description, expected_description)
        )
    except (AttributeError, KeyError, TypeError, ValueError):
        return False
    return bool(description == expected_description and columns == expected_columns)


def write_description(folder: StudyFolder, study: StudyHead, *, intervals: bool = False) -> None:
    """Write the description if it is missing or describes an older version of the study.

    Until the key is opened it omits the sealed columns, unless an earlier version of the program, whose tables have
    them, described them.
    """
    current = read_own(folder.description, folder.path) if is_there(folder.description) else b""
    sealed = not (reveals(folder.path) or has_sealed_columns(current))
    content = description_bytes(study, sealed=sealed, intervals=intervals)
    if current != content:
        write_file(folder.description, content)
    if not is_there(folder.ignore):
        write_file(folder.ignore, _IGNORED)


def write_study_files(folder: StudyFolder) -> None:
    """Update the table of participants and the description."""
    if (name := described_study(folder)) is not None:
        write_participants(folder, name)
    for session in folder.sessions():
        try:
            protocol = receipt.read(session.receipt)["protocol"]
            head, intervals = StudyHead.model_validate(protocol["study"]), has_intervals(protocol)
        except (StoreError, KeyError, TypeError, ValueError):  # another receipt is used instead
            continue
        write_description(folder, head, intervals=intervals)
        return


def has_intervals(protocol: Mapping[str, Any]) -> bool:
    """Return whether the protocol in a receipt has blocks with a design."""
    return any("slots" in block for block in protocol["blocks"].values())


def has_sealed_columns(content: bytes) -> bool:
    """Return whether a description names a sealed column; a pre-existing group is not sealed."""
    with contextlib.suppress(AttributeError, KeyError, TypeError, ValueError):
        names = {variable["name"] for variable in parse_json(content)["variableMeasured"]}
        return not names.isdisjoint(SEALED - {GROUP.name})
    return False


def described_study(folder: StudyFolder) -> str | None:
    """Return the name of the study in this folder, or None if it has no study yet."""
    if not is_there(folder.description):
        return None
    try:
        return check_study_name(parse_json(read_own(folder.description, folder.path))["name"])
    except (ValueError, KeyError, TypeError) as error:
        raise StoreError(
            f"{folder.description} does not describe a study: is {folder.path} a results folder?"
        ) from error


def has_earlier_columns(folder: StudyFolder) -> bool:
    """Return whether a study's description lacks columns, as those written by earlier versions do."""
    content = read_own(folder.description, folder.path) if is_there(folder.description) else b""
    with contextlib.suppress(AttributeError, KeyError, TypeError, ValueError):
        names = {variable["name"] for variable in parse_json(content)["variableMeasured"]}
        columns = every_column(intervals="interval" in names)
        return not names.issuperset(column.name for column in columns if not column.sealed)
    return False


def refuse_earlier_columns(folder: StudyFolder) -> None:
    """Raise StoreError for a study whose tables an earlier version wrote; the message says how to upgrade it."""
    if has_earlier_columns(folder):
        raise StoreError(
            f"{folder.path} has tables from an earlier version of the program: run liquid-study upgrade "
            f"{as_argument(folder.path)}"
        )


def check_study(folder: StudyFolder, study: str) -> None:
    """Raise an error for a folder of another study or version, of merged sites or of several studies, or inside these.

    Raises
    ------
    StoreError
        The folder is unsuitable; the message names its kind and the one to use instead.
    """
    refuse_merged(folder.path)
    described = described_study(folder)
    if described is not None:
        if described != study:
            raise StoreError(
                f"{folder.path} contains the study {described!r}, not {study!r}: use another results folder"
            )
        refuse_earlier_columns(folder)
        return
    for parent in folder.path.absolute().parents:
        if is_there(StudyFolder(parent).key):
            raise StoreError(f"{folder.path} lies within {parent}, which is a study's folder: use a folder outside it")
    if studies := sorted(path.name for path in folder.path.glob("*") if is_there(StudyFolder(path).key)):
        raise StoreError(
            f"{folder.path} contains study folders ({', '.join(studies[:3])}{' ...' if studies[3:] else ''}): use "
            f"one of these or a new one next to them, such as {folder.path / study}"
        )


def participants_of(folder: Path) -> list[Row]:
    """Return one row per session of a study, for merged studies by site with the site in the participants' IDs.

    Raises
    ------
    StoreError
        The list of sites cannot be read.
    """
    return [
        {**row, "participant": f"{prefix}{row['participant']}"}
        for prefix, place in folders_of(folder).items()
        for row in participant_rows(StudyFolder(place))
    ]


def study_folders(results: Path) -> Iterator[Path]:
    """Yield the folders of studies and of merged studies under ``results``, sorted.

    Raises
    ------
    OSError
        The folder does not exist or cannot be read.
    """
    for folder in sorted(results.iterdir()):
        if (folder / "data").is_dir() or (not folder.name.startswith(".") and (folder / MANIFEST).is_file()):
            yield folder
