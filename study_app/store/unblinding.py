"""Unblinding a study: record the reveal, and write the sealed columns into tables, checksums and description.

Then the rule `catch` excludes sessions with too many incorrect answers to catch trials; before unblinding, that count
would reveal which answers were correct. If the program ends during unblinding, the journals still contain everything,
and unblinding again completes it. In a merged study the key of each site is opened, and recorded in the site's folder.
"""

import contextlib
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Final

from study_app.errors import StoreError, as_argument
from study_app.protocol.blocks import block_titles
from study_app.protocol.quantities import quoted_title
from study_app.store import receipt
from study_app.store.blinded.blinding import (
    Codes,
    Key,
    complete_protocol,
    open_events,
    read_key,
    reveal,
    reveals,
    verified_key,
)
from study_app.store.exclusions import (
    MISSING_RULE,
    Exclusion,
    Reversal,
    dated_reversals,
    exclude,
    exclusions,
    reversals,
)
from study_app.store.files.atomic import (
    is_there,
    read_if_there,
    read_own,
    remove_old_temporary_files,
    remove_temporary_files,
    study_root,
    write_file,
)
from study_app.store.files.folders import ReportProgress, SessionFolder, StudyFolder
from study_app.store.integrity.checksums import replace_checksums
from study_app.store.integrity.folder_lock import is_open, lock_folder
from study_app.store.journals import journal
from study_app.store.journals.journal_events import Event, Recorded, SessionEnded, TrialStarted, start_of
from study_app.store.merged import folders_of
from study_app.store.session_progress.progress import trial_results
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.sessions.recovery import RESTORE, files_beyond_journal
from study_app.store.tables.study_files import has_sealed_columns, refuse_earlier_columns, write_study_files

RULE: Final = "catch"
RULES: Final = {RULE: "errors in catch trials", MISSING_RULE: "trials that could not be delivered"}
"""The automatic rules that exclude sessions, with their reasons; every other exclusion is decided by a person."""


@dataclass(frozen=True, slots=True)
class Unblinded:
    """The result of unblinding a study.

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


def unblind(folder: Path, by: str, reason: str, progress: ReportProgress | None = None) -> Unblinded:
    """Open a study's key, record who opened it and why, and write the sealed columns into its tables.

    A table that differs from its journal is not changed, nor is a running or unreadable session. Repeating it completes
    an interrupted unblinding. ``progress`` is called with the current step and the fraction done.

    Raises
    ------
    StoreError
        As for `blinding.reveal`, or another program writes to the folder; nothing has changed.
    """
    study = StudyFolder(folder)
    refuse_earlier_columns(study)
    with lock_folder(folder) if is_there(study.key) else contextlib.nullcontext():
        codes = reveal(folder, by, reason)
        key = read_key(folder)
        remove_old_temporary_files(study.path)
        remove_old_temporary_files(study.data)
        left: list[str] = []
        sessions = study.sessions()
        for number, session in enumerate(sessions):
            if progress is not None:
                progress(f"opening session {number + 1} of {len(sessions)}", number / (len(sessions) + 1))
            try:
                left += _open_tables(study, session, key)
            except StoreError as error:
                left.append(f"{error}; then unblind again")
        if progress is not None:
            progress("writing the tables of the study", len(sessions) / (len(sessions) + 1))
        try:
            write_study_files(study)
        except StoreError as error:
            left.append(f"{error}; then unblind again")
    excluded: tuple[Exclusion, ...] = ()
    try:
        excluded = exclude_inattentive(folder)
    except (StoreError, ValueError, KeyError, TypeError) as error:
        left.append(f"the rule “catch” was not applied ({error}): correct this, then unblind again")
    return Unblinded(codes, tuple(left), excluded)


def is_unblinded(folder: Path) -> bool:
    """Return whether `unblind` was completed: its last step describes the sealed columns.

    Raises
    ------
    StoreError
        The list of reveals, or the description, cannot be read.
    """
    return has_opened_keys(folder) and has_sealed_columns(read_if_there(StudyFolder(folder).description) or b"")


def unblind_folder(folder: Path, by: str, reason: str, progress: ReportProgress | None = None) -> dict[str, Unblinded]:
    """Open the key of a study, or of each site of a merged study; return results by the prefix of IDs ("A-" or "").

    Raises
    ------
    StoreError
        ``by`` or ``reason`` is empty, or a key is missing, unreadable or not the one the sessions ran under; none was
        opened then.
    """
    folders = folders_of(folder)
    if "" not in folders:
        for site_folder in folders.values():
            verified_key(StudyFolder(site_folder))
    by_site: dict[str, Unblinded] = {}
    for prefix, site_folder in folders.items():
        result = unblind(site_folder, by, reason, progress)
        excluded = tuple(replace(row, participant=f"{prefix}{row.participant}") for row in result.excluded)
        by_site[prefix] = replace(result, excluded=excluded)
    return by_site


def late_exclusions(folder: Path, rows: Sequence[Exclusion]) -> tuple[Exclusion, ...]:
    """Return the exclusions decided or reversed by a person after the key was opened; none for a merged study.

    Each records whether the key was open; only those of earlier versions are compared by time.
    """
    opened_at = min(filter(None, (_parse_time(reveal["at"]) for reveal in reveals(folder))), default=None)

    def is_after_opening(text: str) -> bool:
        at = _parse_time(text)  # reveals are recorded in whole seconds
        return bool(opened_at and at and at.replace(microsecond=0) > opened_at)

    by_person = (
        Reversal(exclusion=row, at=row.excluded_at, key_open=row.key_open)
        for row in rows
        if row.rule_or_person not in RULES
    )
    return tuple(
        decision.exclusion
        for decision in (*by_person, *dated_reversals(folder))
        if (is_after_opening(decision.at) if decision.key_open is None else decision.key_open)
    )


def _parse_time(text: str) -> datetime | None:
    with contextlib.suppress(ValueError):  # `verify` reports it
        return datetime.fromisoformat(text).astimezone()
    return None


def reveals_of(folder: Path) -> tuple[dict[str, str], ...]:
    """Return the recorded reveals of a study; in a merged study each has its ``site``.

    Raises
    ------
    StoreError
        They cannot be read.
    """
    site_reveals: list[dict[str, str]] = []
    for prefix, site_folder in folders_of(folder).items():
        site: Mapping[str, str] = {"site": prefix[:-1]} if prefix else {}
        site_reveals += [{**site, **reveal} for reveal in reveals(site_folder)]
    return tuple(site_reveals)


def has_opened_keys(folder: Path) -> bool:
    """Return whether the key of a study, or the keys of all sites of a merged study, were opened.

    Raises
    ------
    StoreError
        A list of reveals cannot be read.
    """
    return all(reveals(place) for place in folders_of(folder).values())


def exclude_inattentive(folder: Path) -> tuple[Exclusion, ...]:
    """Exclude the sessions with too many incorrect answers to catch trials; return the added exclusions.

    A session that is already excluded, or was included again by a person, keeps this decision; running sessions are
    not judged. The study's key must be open.
    """
    study, key = StudyFolder(folder), read_key(folder)
    decided = {row.what[:2] for row in exclusions(folder) if row.trial is None}
    decided |= {row.what[:2] for row in reversals(folder) if row.rule_or_person == RULE}
    added: list[Exclusion] = []
    for session in study.sessions():
        if (session.participant, session.number) in decided or is_open(session.path):
            continue
        reason = ""
        with contextlib.suppress(StoreError, KeyError, TypeError, ValueError, AttributeError):  # `verify` names it
            reason = "; ".join(_missed_catch_trials(session, key))
        if reason:
            added.append(exclude(folder, session.participant, session.number, by=RULE, reason=reason))
    return tuple(added)


def _missed_catch_trials(session: SessionFolder, key: Key) -> Iterator[str]:
    """Yield a phrase with the number of incorrect answers to catch trials for each block with too many."""
    published = receipt.read(session.receipt)["protocol"]
    if not any("catch" in block for block in published["blocks"].values()):
        return
    protocol, titles = complete_protocol(published, key), block_titles(published)
    lines = open_events(journal.read(session.journal), key)
    blocks = {line.trial: line.block for line in lines if isinstance(line, TrialStarted)}
    catch_results = [result for result in trial_results(protocol, lines) if result.catch]
    for block in protocol.blocks.values():
        answered = [result for result in catch_results if blocks[result.trial] == block.id]
        incorrect = sum(not result.correct for result in answered)
        if block.catch is not None and answered and incorrect / len(answered) > block.catch.wrong_most:
            yield (
                f"{incorrect} of {len(answered)} catch trials in {quoted_title(titles[block.id])} were answered "
                f"incorrectly (at most {100 * block.catch.wrong_most:g} % are permitted)"
            )


def _open_tables(study: StudyFolder, session: SessionFolder, key: Key) -> list[str]:
    """Write a session's tables with the sealed columns; return the reasons for tables left unchanged."""
    if not is_there(session.journal):
        return []
    lines = journal.read(session.journal)
    if not lines or not start_of(lines).measures_sealed:
        return []
    with lock_folder(session.path):
        remove_temporary_files(session.path)
        remove_temporary_files(session.recordings)
        return list(_open_files(Place(study, session, start_of(lines).study), lines, key))


def _open_files(place: Place, lines: list[Event], key: Key) -> list[str]:
    """Write the sealed columns and open the recordings.

    A table of a session without an end may be behind its journal; then the whole table is rewritten.
    """
    left: list[str] = []
    changes: dict[str, tuple[str, str]] = {}
    before, after = (dict(table_files(place, lines, reader)) for reader in (None, key))
    for path, content in after.items():
        current, sealed = read_if_there(path) or b"", before[path]
        if current not in (sealed, content) and not _is_table_behind(current, path, place, lines, key):
            rebuild = f"run liquid-study rebuild {as_argument(place.folder.path)}"
            remedy = RESTORE if any(files_beyond_journal(place, lines)) else rebuild
            left.append(f"{path} differs from the journal, so it was not changed: {remedy}")
            continue
        if current != content:
            write_file(path, content)
        changes[path.name] = hashlib.sha256(sealed).hexdigest(), hashlib.sha256(content).hexdigest()
    for path, hashes in _recordings(place, lines, key):
        try:
            _open_recording(path, hashes, key)
            changes[path.relative_to(place.folder.path).as_posix()] = hashes
        except StoreError as error:
            left.append(f"{error}; then unblind again")
    if is_there(place.folder.checksums):
        replace_checksums(place.folder, changes)
    return left


def _is_table_behind(current: bytes, path: Path, place: Place, lines: list[Event], key: Key) -> bool:
    """Return whether a table of a session without an end is an earlier state of that table, or its beginning."""
    if isinstance(lines[-1], SessionEnded):
        return False
    whole_lines = current[: current.rfind(b"\n") + 1]
    return any(
        dict(table_files(place, lines[:count], reader))[path].startswith(whole_lines)
        for count in range(len(lines), 0, -1)
        for reader in (None, key)
    )


def _recordings(place: Place, lines: list[Event], key: Key) -> Iterator[tuple[Path, tuple[str, str]]]:
    """Yield each file that was recorded sealed, with its SHA-256 before and after opening."""
    for line in open_events(lines, key):
        if isinstance(line, Recorded) and line.opened_sha256 and line.opened_frames_sha256:
            yield place.folder.path / line.recording, (line.sha256, line.opened_sha256)
            yield place.folder.path / line.recording_frames, (line.frames_sha256, line.opened_frames_sha256)


def _open_recording(path: Path, hashes: tuple[str, str], key: Key) -> None:
    """Replace a sealed recording by the opened one; an opened recording is left unchanged."""
    from study_app.store.recordings import opened_content  # noqa: PLC0415 - loads the Parquet library

    content = read_own(path, study_root(path.parent))
    content_hash = hashlib.sha256(content).hexdigest()
    if content_hash not in hashes:
        raise StoreError(f"{path} has changed since it was recorded, so it was not opened: restore it from a backup")
    if content_hash == hashes[0]:
        write_file(path, opened_content(path, content, key.nonce))
