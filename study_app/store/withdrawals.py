"""Withdrawal: erase all data of a participant from a study's folder and from copies of it.

A tombstone remains, a line of ``withdrawals.jsonl`` without any of the participant's data. It is written first. If the
program ends before everything is erased, `verify` reports the folder, and repeating the command completes the
withdrawal. Erased files are only unlinked: disks and backups may still contain their blocks.
"""

import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any, Final

from study_app.errors import StoreError
from study_app.store.exclusions import exclusion_bytes, exclusions
from study_app.store.files.atomic import (
    append_line,
    cannot_write,
    is_there,
    open_regular,
    parse_json,
    paths_in,
    read_if_there,
    read_regular,
    refuse_special_files,
    sync_folder,
    write_file,
)
from study_app.store.files.folders import ID_PATTERN, SessionFolder, StudyFolder, check_name_and_reason
from study_app.store.files.output_files import Output, erase_outputs
from study_app.store.integrity.checksums import fingerprint, place_of, proof_of, read_checksums, sha256
from study_app.store.integrity.folder_lock import lock_folder, refuse_if_open
from study_app.store.journals import journal
from study_app.store.journals.journal_events import is_valid_value
from study_app.store.merged import MANIFEST, merged_above
from study_app.store.tables.study_files import described_study, write_participants
from study_app.workspace import workspace

_DATASET: Final = "dataset_description.json"
RESULTS: Final = "results"
_ARCHIVES: Final = {".zip", ".7z", ".rar", ".tar", ".gz", ".tgz", ".xz", ".bz2"}


@dataclass(frozen=True, slots=True, kw_only=True)
class ErasedSession:
    """The hashes that identify an erased session."""

    session: int
    begun: str
    checksums: str
    fingerprint: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Tombstone:
    """One withdrawal; a line of ``withdrawals.jsonl``. ``at`` is when the data were erased from that folder."""

    participant: str
    at: str
    by: str
    reason: str
    sessions: tuple[ErasedSession, ...]


@dataclass(frozen=True, slots=True)
class Withdrawn:
    """The result of a withdrawal.

    Attributes
    ----------
    tombstone : Tombstone
        The remaining record of the participant.
    folders : tuple of Path
        The study folders from which the sessions were erased.
    outputs : tuple of Path
        The deleted files that were made from the results.
    elsewhere : tuple of Output
        Outputs outside of the results folder, which were left.
    left : tuple of str
        Paths that still name the participant, or contain sessions other than the erased ones.
    """

    tombstone: Tombstone
    folders: tuple[Path, ...]
    outputs: tuple[Path, ...]
    elsewhere: tuple[Output, ...]
    left: tuple[str, ...]


def withdraw(
    folder: Path, participant: str, *, by: str, reason: str, also: Iterable[Path] = (), now: datetime | None = None
) -> Withdrawn:
    """Erase the sessions of a participant from the study in ``folder``, and from copies of it.

    This erases the participant's folder, the rows in tables and lists, and outputs in the workspace. A tombstone
    remains, and the participant's ID cannot be used again. Withdrawing again completes an interrupted withdrawal, and
    can include further copies. Copies in the results folder of the workspace are found without ``also``. If a folder is
    the copy of a site in a merged study, outputs of the merged study are erased, too.

    Parameters
    ----------
    folder : Path
        The study folder.
    participant : str
        The participant's ID.
    by : str
        The operator's initials.
    reason : str
        The reason; it is kept, so it must not identify the person.
    also : iterable of Path
        Folders with copies of the study, searched at any depth.
    now : datetime, optional
        Wall time with its zone; by default the system's.

    Raises
    ------
    StoreError
        There is no such participant, one of their sessions is running, ``by`` or ``reason`` is empty, or a file cannot
        be written or deleted; data erased before the error stay erased.
    """
    by, reason = check_name_and_reason(by, reason, "a withdrawal requires initials and a reason")
    study = StudyFolder(folder)
    if not folder.is_dir():
        raise StoreError(f"{folder} is not a folder: specify a study folder, such as results/rek2024")
    at = (now if now is not None else datetime.now().astimezone()).isoformat(timespec="seconds")
    copies, shared = _find_copies(study, also)
    nearby, exports = _find_copies(study, filter(Path.is_dir, [workspace().results]))
    person_sessions = _find_or_make_tombstone(study, participant, at, by, reason).sessions
    copies += [
        copy for copy in nearby if copy not in copies and _has_session_copies(copy, participant, person_sessions)
    ]
    shared += [export for export in exports if export not in shared]
    for dataset in (study, *copies):
        refuse_special_files(dataset.data / f"sub-{participant}")
    with lock_folder(folder):
        tombstone = _find_or_make_tombstone(study, participant, at, by, reason)
        erased = [study.path] if _erase_participant(study, tombstone) else []
        outputs, elsewhere = _erase_outputs(study.path)
    left = [*_remaining_mentions(study, participant)]
    reached_folders = [study.path]
    for copy in copies:
        with lock_folder(copy.path):
            if others := _other_sessions(copy, tombstone):
                left += [
                    f"{copy.path} was not changed, because its session {other} is not a copy of an erased session; if "
                    "the session belongs to the same participant, withdraw the participant from this folder, too"
                    for other in others
                ]
            elif _erase_participant(copy, replace(tombstone, at=at)):
                erased.append(copy.path)
                left += _remaining_mentions(copy, participant)
            known_tombstone, begun = (
                tombstones(copy).get(participant),
                {session.begun for session in tombstone.sessions if session.begun},
            )
            if known_tombstone is not None and any(session.begun in begun for session in known_tombstone.sessions):
                reached_folders.append(copy.path)
    for results_folder in dict.fromkeys((*reached_folders[1:], *filter(None, map(merged_above, reached_folders)))):
        more_outputs, more_elsewhere = _erase_outputs(results_folder)
        outputs, elsewhere = (*outputs, *more_outputs), (*elsewhere, *more_elsewhere)
    left += [
        f"{export.path} is an export that contains data from {participant}: delete it and create it again"
        for export in shared
        if any(_remaining_mentions(export, participant, export.data, export.path / RESULTS))
    ]
    left += _mentions_beside_studies(study, participant)
    return Withdrawn(tombstone, tuple(erased), outputs, elsewhere, tuple(left))


def tombstones(study: StudyFolder) -> dict[str, Tombstone]:
    """Return the tombstones of a study by participant, in order of withdrawal.

    Raises
    ------
    StoreError
        The list cannot be read, or a line of it is not a withdrawal.
    """
    content = read_if_there(study.withdrawals) or b""
    by_participant: dict[str, Tombstone] = {}
    for number, line in enumerate(content.splitlines(), start=1):
        if line.strip():
            tombstone = _parse_tombstone(study.withdrawals, number, line)
            by_participant[tombstone.participant] = tombstone
    return by_participant


def unerased_files(study: StudyFolder, participant: str) -> Iterator[Path]:
    """Yield the remains of an interrupted withdrawal: the participant's folder, and lists with their rows."""
    if is_there(participant_folder := study.data / f"sub-{participant}"):
        yield participant_folder
    if any(row.participant == participant for row in exclusions(study.path)):
        yield study.exclusions
    for path, has_participant in _lists_with_lines(study, participant):
        if any(map(has_participant, (read_if_there(path) or b"").splitlines())):
            yield path
    if (name := described_study(study)) is not None:
        rows = (read_if_there(study.participants(name)) or b"").splitlines()
        if any(participant.encode() in row.split(b",") for row in rows):
            yield study.participants(name)


def _lists_with_lines(study: StudyFolder, participant: str) -> tuple[tuple[Path, Callable[[bytes], bool]], ...]:
    """Return the lists from which lines are erased, each with a predicate for lines of the participant."""
    return (
        (study.fingerprints, lambda line: _names_session_of(line, study, participant)),
        (study.reversed_exclusions, lambda line: _reverses_exclusion_of(line, participant)),
    )


def describe_session(session: SessionFolder) -> ErasedSession:
    """Return the hashes that identify a session, as far as its files can be read."""
    try:
        with open_regular(session.journal) as file:
            first = file.readline()
        begun = hashlib.sha256(first).hexdigest() if first.endswith(b"\n") else ""
    except OSError:
        begun = ""
    try:
        lines = journal.scan(session.journal).lines
        proof, checksums = fingerprint(read_checksums(session), lines), sha256(session.checksums)
    except StoreError:
        proof = checksums = ""
    return ErasedSession(session=session.number, begun=begun, checksums=checksums, fingerprint=proof)


def add_tombstone(study: StudyFolder, tombstone: Tombstone) -> None:
    """Add a tombstone to the study's list."""
    append_line(study.withdrawals, json.dumps(asdict(tombstone), ensure_ascii=False).encode() + b"\n")


def proof_of_withdrawal(tombstone: Tombstone) -> tuple[str, str]:
    """Return the fingerprint of a withdrawal and its name in lists of fingerprints."""
    return proof_of(json.dumps(asdict(tombstone)).encode()), f"withdrawals.jsonl/sub-{tombstone.participant}"


def _parse_tombstone(path: Path, number: int, line: bytes) -> Tombstone:
    try:
        record: dict[str, Any] = parse_json(line)
        sessions = tuple(ErasedSession(**fields) for fields in record.pop("sessions"))
        tombstone = Tombstone(**record, sessions=sessions)
        proofs = (text for session in sessions for text in (session.begun, session.checksums, session.fingerprint))
        texts = (tombstone.participant, tombstone.by, tombstone.reason, *proofs)
        has_types = all(isinstance(text, str) for text in texts) and all(
            isinstance(session.session, int) for session in sessions
        )
        if has_types and is_valid_value("at", tombstone.at) and ID_PATTERN.fullmatch(tombstone.participant):
            return tombstone
    except (ValueError, KeyError, TypeError, AttributeError):
        pass
    raise StoreError(
        f"{path}, line {number} is not a withdrawal: restore it from a backup; if it is an incomplete last line, "
        "remove it and withdraw again"
    )


def _find_copies(study: StudyFolder, also: Iterable[Path]) -> tuple[list[StudyFolder], list[StudyFolder]]:
    """Return copies of the study below ``also`` that contain sessions, and Psych-DS exports of the study."""
    by_path: dict[Path, StudyFolder] = {}
    for folder in also:
        if not folder.is_dir():
            raise StoreError(f"{folder} is not a folder: --also requires a folder with copies of the study")
        for description in sorted(folder.rglob(_DATASET)):
            dataset = description.parent.resolve()
            if dataset != study.path.resolve() and StudyFolder(dataset).data.is_dir():
                by_path[dataset] = StudyFolder(description.parent)
    copies = [study for study in by_path.values() if is_there(study.key) or study.sessions()]
    name = _study_name(study)
    return copies, [study for study in by_path.values() if study not in copies and _study_name(study) == name]


def _has_session_copies(copy: StudyFolder, participant: str, sessions: Iterable[ErasedSession]) -> bool:
    """Return whether a study folder has, or had, a copy of one of a participant's sessions."""
    begun = {session.begun for session in sessions if session.begun}
    erased = tombstones(copy).get(participant)
    sessions_held = (
        *map(describe_session, _sessions_of(copy, participant)),
        *(() if erased is None else erased.sessions),
    )
    return any(session.begun in begun for session in sessions_held)


def _study_name(study: StudyFolder) -> str | None:
    """Return the name of a dataset's study, or None if this program did not write its description."""
    with suppress(StoreError):
        return described_study(study)
    return None


def _find_or_make_tombstone(study: StudyFolder, participant: str, at: str, by: str, reason: str) -> Tombstone:
    """Return the participant's tombstone: the existing one, or a new one that is not yet written."""
    if (known := tombstones(study).get(participant)) is not None:
        return known
    sessions = _sessions_of(study, participant)
    if not sessions:
        known_ids = ", ".join(study.ids()) or "none"
        raise StoreError(f"{study.path} does not contain participant {participant!r}; participants: {known_ids}")
    return Tombstone(
        participant=participant, at=at, by=by, reason=reason, sessions=tuple(map(describe_session, sessions))
    )


def _sessions_of(study: StudyFolder, participant: str) -> list[SessionFolder]:
    return [session for session in study.sessions() if session.participant == participant]


def _other_sessions(copy: StudyFolder, tombstone: Tombstone) -> list[Path]:
    """Return the folders of the participant's sessions in a copy that are not among the erased sessions."""
    begun = {session.begun for session in tombstone.sessions if session.begun}
    return [
        session.path
        for session in _sessions_of(copy, tombstone.participant)
        if describe_session(session).begun not in begun
    ]


def _erase_participant(study: StudyFolder, tombstone: Tombstone) -> bool:
    """Write the tombstone, then erase the participant's folder and rows; return whether there was anything to erase."""
    participant = tombstone.participant
    sessions = _sessions_of(study, participant)
    participant_folder = study.data / f"sub-{participant}"
    for session in sessions:
        refuse_if_open(session.path)
    rows, ignores = exclusions(study.path), read_if_there(study.ignore)  # before anything is written
    if sessions and participant not in tombstones(study):
        add_tombstone(study, replace(tombstone, sessions=tuple(map(describe_session, sessions))))
    ignored = study.withdrawals.name.encode()  # earlier versions wrote the list without it
    if ignores is not None and ignored not in ignores.splitlines():
        append_line(study.ignore, ignored + b"\n")
    try:
        if is_there(participant_folder):
            shutil.rmtree(participant_folder)
            sync_folder(study.data)
    except OSError as error:
        raise cannot_write(participant_folder, error) from error
    kept = tuple(row for row in rows if row.participant != participant)
    if kept != rows:
        write_file(study.exclusions, exclusion_bytes(kept))
    changed = [kept != rows, *(_erase_lines(path, erased) for path, erased in _lists_with_lines(study, participant))]
    name = described_study(study)
    if name is not None:
        write_participants(study, name)
    return bool(sessions) or any(changed)


def _erase_lines(path: Path, erased: Callable[[bytes], bool]) -> bool:
    """Remove the lines for which ``erased`` is true from a list; return whether there were any."""
    lines = (read_if_there(path) or b"").splitlines(keepends=True)
    kept = [line for line in lines if not erased(line)]
    if kept != lines:
        write_file(path, b"".join(kept))
    return kept != lines


def _names_session_of(line: bytes, study: StudyFolder, participant: str) -> bool:
    place = place_of(study, study.session(participant, 1)).rpartition("/")[0]
    return line.decode("utf-8", "replace").partition("  ")[2].strip().lower().startswith(f"{place}/".lower())


def _reverses_exclusion_of(line: bytes, participant: str) -> bool:
    try:
        return bool(parse_json(line)["exclusion"]["participant"] == participant)
    except (ValueError, KeyError, TypeError):
        return False


def _erase_outputs(study: Path) -> tuple[tuple[Path, ...], tuple[Output, ...]]:
    study_path, workspace_path = study.resolve(), workspace().folder.resolve()
    return erase_outputs(study, workspace_path if study_path.is_relative_to(workspace_path) else study_path)


def _mentions_beside_studies(study: StudyFolder, participant: str) -> Iterator[str]:
    """Yield archives in the results folder, and files outside of studies that name the study and the participant."""
    results, name = workspace().results, (_study_name(study) or "").encode()
    dataset_folders = (path.parent for file in (_DATASET, MANIFEST) for path in results.rglob(file))
    studies = {study.path, *dataset_folders}
    for path in paths_in(results):
        if path.is_dir() or not studies.isdisjoint(path.parents):
            continue
        if path.suffix.lower() in _ARCHIVES:
            yield f"{path} is an archive, which is not searched: delete it if it contains data from {participant}"
            continue
        try:
            if name in os.fsencode(path.name) or name in read_regular(path):
                yield from _naming_problem(path, participant)
        except (OSError, StoreError) as error:
            yield f"{path} cannot be searched ({error})"


def _remaining_mentions(study: StudyFolder, participant: str, *folders: Path) -> Iterator[str]:
    """Yield the paths that still name the participant, except tombstone, allocation entry and recordings.

    If ``folders`` are given, only these are searched, since an ID may occur by chance in the footage of an export.
    """
    for path in (path for folder in folders or (study.path,) for path in paths_in(folder)):
        if path != study.withdrawals and not path.is_relative_to(study.allocated):
            yield from _naming_problem(path, participant)


def _naming_problem(path: Path, participant: str) -> Iterator[str]:
    """Yield a sentence if a file names the participant, unless it is a recording."""
    if path.parent.name == "recordings" or not path.is_file():
        return
    word = re.compile(rb"(?<![A-Za-z0-9])" + re.escape(participant.encode()) + rb"(?![A-Za-z0-9])")
    if word.search(os.fsencode(path.name)) or word.search(read_regular(path)):
        yield f"{path} still names {participant}"
