"""Sessions whose program has ended: resume them, or recreate the files derived from their journals.

A journal that has lost lines, because other files of its session contain more, is not used.
"""

import contextlib
import csv
import io
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import study_app
from study_app.errors import StoreError, as_argument
from study_app.protocol.descriptions import CONDITIONS_DIFFER, differences
from study_app.protocol.model import Protocol
from study_app.protocol.randomization import stream
from study_app.protocol.source import StudySource, has_hash
from study_app.protocol.upgrade import needs_upgrade
from study_app.store import receipt
from study_app.store.blinded.blinding import (
    Key,
    complete_protocol,
    has_same_conditions,
    open_or_draw_key,
    opened_key,
    protocol_errors,
    read_key,
)
from study_app.store.files.atomic import is_there, paths_in, read_own, remove_temporary_files, write_file
from study_app.store.files.folders import RECORDING_NAME, SessionFolder, StudyFolder, locate_session
from study_app.store.integrity.checksums import (
    fingerprint,
    note_fingerprint,
    note_rebuilt,
    place_of,
    read_checksums,
    read_list,
    renew_checksums,
)
from study_app.store.integrity.folder_lock import lock_folder, refuse_if_open
from study_app.store.journals import journal
from study_app.store.journals import journal_events as events
from study_app.store.journals.journal import Contents, Journal, SessionClock
from study_app.store.merged import refuse_merged
from study_app.store.recorder import lost_event, recorded_event, recording_files
from study_app.store.session_progress.progress import Progress, progress_of, recordable
from study_app.store.sessions.begin import make_recorder, note_allocation, refuse_never_begun, session_environment
from study_app.store.sessions.open_session import Place, SessionStore, table_files
from study_app.store.tables import session_tables
from study_app.store.tables.study_files import (
    refuse_earlier_columns,
    update_participants,
    write_description,
    write_participants,
    write_study_files,
)

RESTORE = "restore the journal from a backup"
_SHOWN_DIFFERENCES = 6
_MAX_GAP_S = 366 * 86400.0
"""Longest plausible gap [s]: beyond it the wall clock was or is wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rebuilt:
    """The result of `rebuild_session`.

    ``rewritten`` files were missing or differed from the journal, ``swept`` were temporary files of a killed program;
    ``torn_bytes`` at the journal's end are an incomplete line, and were not changed. ``lost`` files are missing, and
    the journal does not contain their contents.
    """

    rewritten: tuple[Path, ...]
    swept: tuple[Path, ...]
    torn_bytes: int
    lost: tuple[Path, ...]


def reopen_store(
    session_folder: Path,
    protocol: Protocol,
    source: bytes,
    *,
    operator: str,
    device: Mapping[str, Any],
    screens: Mapping[str, Any],
    motors_masked: Mapping[str, Any] | None = None,
    outlets: Mapping[str, Any] | None = None,
    video: Mapping[str, Any] | None = None,
    now_ns: Callable[[], int] = time.perf_counter_ns,
    now: datetime | None = None,
) -> SessionStore:
    """Open an unfinished session to resume it; ``progress.progress_of(store.lines)`` gives its progress.

    An incomplete line at the journal's end is moved to a separate file, temporary files are removed, and
    ``session_resumed`` is journalled with the gap since the last line (null if the wall clock was set back or is years
    off). The session's clock continues from there, so that its times never decrease.

    Parameters
    ----------
    session_folder : Path
        The session's ``ses-NN`` folder.
    protocol : Protocol
        The protocol to run.
    source : bytes
        The content of the protocol's file, with the hash recorded when the session began.
    operator : str
        The operator who resumes the session.
    device : mapping
        Description for the receipt.
    screens : mapping
        Description for the receipt.
    motors_masked : mapping, optional
        The masking of motor noise, for the receipt; None if it was not asked.
    outlets : mapping, optional
        The outlets to other programs, for the receipt; None without any.
    video : mapping, optional
        Description of camera and footage for the receipt; None in a study without a video.
    now_ns : callable
        The monotonic clock [ns] to continue with: the servo's.
    now : datetime, optional
        Wall time with its zone; by default the system's.

    Raises
    ------
    StoreError
        It is not a session folder, or the session is open in another program, finished, damaged, has a journal with
        less information than the other files, or another protocol (the message names differences that are not
        blinded); the key is invalid; or the folder cannot be written. Nothing has changed then, except that an
        incomplete last line may have been moved.
    """
    study_folder, folder = locate_session(session_folder)
    refuse_never_begun(folder)
    refuse_merged(study_folder.path)
    lock = lock_folder(folder.path)
    try:
        interrupted = _read_interrupted(study_folder, folder, protocol, source)
        contents = interrupted.contents
        gap_s, clock = _continued_clock(contents.lines, now_ns, now)
        recorder = make_recorder(interrupted.place, interrupted.start, clock, interrupted.key)
        reopened = Journal.reopen(folder.journal, contents, clock)
    except BaseException:
        lock.release()
        raise
    store = SessionStore(
        interrupted.place, reopened, interrupted.key, interrupted.receipt, lock, lines=contents.lines, recorder=recorder
    )
    gap: dict[str, Any] = {"gap_s": gap_s, "operator": operator}
    with contextlib.ExitStack() as cleanup:
        cleanup.callback(store.close)
        at_s = round(clock.seconds(), 6)
        version, name = study_app.__version__, device.get("name")
        environment = session_environment(protocol, device, screens, clock, motors_masked, outlets, video)
        entry = {"at": clock.at(at_s), **gap, **environment}
        details: dict[str, Any] = {"torn_bytes": contents.torn_bytes, "device": name, "version": version}
        store.append(events.SessionResumed(**gap, **details, receipt_hash=receipt.digest(entry)), t_s=at_s)
        note_allocation(store)
        remove_temporary_files(folder.path)
        if is_there(folder.recordings):
            remove_temporary_files(folder.recordings)
        for event in (
            _unrecorded_results(folder, contents.lines, interrupted.key) if interrupted.start.recordings else ()
        ):
            store.append(event)
        store.note_resumed(entry)
        store.write_tables()
        write_description(study_folder, protocol.study, intervals=bool(protocol.design_questions))
        update_participants(study_folder, interrupted.place.study)
        cleanup.pop_all()
    return store


def check_resumable(session_folder: Path, protocol: Protocol, source: bytes) -> None:
    """Raise the errors of `reopen_store` before any preparation; nothing is changed.

    Raises
    ------
    StoreError
        As for `reopen_store`.
    """
    study_folder, folder = locate_session(session_folder)
    refuse_never_begun(folder)
    refuse_if_open(folder.path)
    _read_interrupted(study_folder, folder, protocol, source)


def sealed_source(session_folder: Path, source: bytes) -> bytes:
    """Return a protocol's source with the liquid files as they were sealed with the key of a session's study.

    Raises
    ------
    StoreError
        The path is not a session folder.
    """
    study_folder, _ = locate_session(session_folder)
    try:
        files = read_key(study_folder.path).files
    except StoreError:  # `reopen_store` reports the error
        return source
    return StudySource.split(source).with_liquids(files.get).content if files else source


def rebuild_session(session_folder: Path) -> Rebuilt:
    """Recreate the files derived from a session's journal.

    These are its tables, the study's table of participants, the receipt's status and the checksums and fingerprint of a
    finished session; a missing description of the study is recreated from a receipt. Correct files are not changed.
    Recreated checksums or fingerprints are noted permanently in ``rebuilt.txt``: they prove nothing about earlier
    changes.

    Raises
    ------
    StoreError
        It is not a session folder, is open in another program, or its journal is empty, damaged or has less
        information than the session's other files; or a file cannot be written.
    """
    study_folder, folder = locate_session(session_folder)
    with lock_folder(folder.path):
        contents = journal.read_complete(folder.journal)
        place = Place(study_folder, folder, events.start_of(contents.lines).study)
        _refuse_truncated_journal(place, contents.lines)
        swept = remove_temporary_files(folder.path) + (
            remove_temporary_files(folder.recordings) if is_there(folder.recordings) else ()
        )
        table = study_folder.participants(place.study)
        before = _read_if_file(table)
        tables = table_files(place, contents.lines, opened_key(study_folder))
        rewritten = [path for path, content in tables if _read_if_file(path) != content]
        for path, content in tables:
            if path in rewritten:
                write_file(path, content)
        rewritten += _update_receipt(folder, contents.lines)
        write_participants(study_folder, place.study)
        rewritten += [table] if _read_if_file(table) != before else []
        if not is_there(study_folder.description):
            write_study_files(study_folder)
            rewritten += [study_folder.description] if is_there(study_folder.description) else []
        ended = isinstance(contents.lines[-1], events.SessionEnded)
        if ended:
            rewritten += _update_proofs(place, contents.lines, rewritten)
        lost = () if is_there(folder.receipt) else (folder.receipt,)
        return Rebuilt(rewritten=tuple(rewritten), swept=swept, torn_bytes=contents.torn_bytes, lost=lost)


def _refuse_truncated_journal(place: Place, lines: Sequence[events.Event]) -> None:
    """Raise an error if the journal has less information than the session's other files, which would be replaced."""
    for name in events.unknown_events(lines):
        raise StoreError(
            f"{place.folder.journal} contains {name!r} events, which this version does not recognise: use the "
            "version that wrote them"
        )
    for path, problem in (*files_beyond_journal(place, lines), *_ended_or_recorded(place, lines)):
        raise StoreError(f"{path} {problem}: {RESTORE}")


def files_beyond_journal(place: Place, lines: Sequence[events.Event]) -> Iterator[tuple[Path, str]]:
    """Yield path and description of each file (receipt, checksums, tables) that contains more than the journal.

    A session that has ended has a complete journal. After a power cut the trials table may have one more trial, since
    the line of a trial's start is not flushed at once; answers are.
    """
    folder = place.folder
    ended = isinstance(lines[-1], events.SessionEnded)
    session_receipt = receipt.read(folder.receipt) if is_there(folder.receipt) else {}
    if not ended and (status := session_receipt.get("status", receipt.UNFINISHED)) != receipt.UNFINISHED:
        yield folder.receipt, f"has the status {status!r}, but the journal {receipt.UNFINISHED!r}"
    if len(session_receipt.get("resumed", ())) > sum(isinstance(line, events.SessionResumed) for line in lines):
        yield folder.receipt, "records more resumptions of the session than the journal does"
    if ended:
        return
    if is_there(folder.checksums):
        yield folder.checksums, "was written after the session ended, but the journal does not record the end"
    rows = session_tables.SessionRows(lines)
    for name, tolerance in (("responses", 0), ("trials", 1), ("intervals", 1)):
        path, expected = folder.table(place.study, name), len(rows.table(name))
        if (row_count := _count_rows(path, place.study_folder.path)) > expected + tolerance:
            yield path, f"has {row_count} rows, but the journal contains {expected}"


def _ended_or_recorded(place: Place, lines: Sequence[events.Event]) -> Iterator[tuple[Path, str]]:
    """Yield path and description of fingerprints and recordings that contain more than a journal without an end."""
    folder, study = place.folder, place.study_folder
    if isinstance(lines[-1], events.SessionEnded):
        return
    if place_of(study, folder) in {session for _, session in read_list(study.fingerprints)}:
        yield study.fingerprints, f"lists {place_of(study, folder)} as ended, but its journal does not record the end"
    expected = {path for which in recordable(lines) for path in recording_files(folder.recordings, *which)}
    for path in paths_in(folder.recordings):
        if path not in expected and RECORDING_NAME.fullmatch(path.relative_to(folder.path).as_posix()):
            yield path, "belongs to a trial that never started, according to the journal"


def _count_rows(path: Path, root: Path) -> int:
    """Return the number of rows of a table; 0 if it is not a table, which can be recreated without loss."""
    try:
        text = read_own(path, root).decode("utf-8", "replace")
        names, *rows = list(csv.reader(io.StringIO(text, newline=""))) or [[]]
    except (StoreError, csv.Error):
        return 0
    return sum(len(row) == len(names) > 1 for row in rows)


@dataclass(frozen=True, slots=True)
class _Interrupted:
    """The data of an interrupted session that can be resumed."""

    place: Place
    contents: Contents
    start: events.SessionStarted
    receipt: dict[str, Any]
    key: Key


def _read_interrupted(
    study_folder: StudyFolder, folder: SessionFolder, protocol: Protocol, source: bytes
) -> _Interrupted:
    """Read the data of an interrupted session; raise an error if it cannot be resumed with this protocol."""
    contents = journal.read_complete(folder.journal)
    start = _check_unfinished(folder, contents.lines)
    place = Place(study_folder, folder, start.study)
    first = receipt.read(folder.receipt)
    if receipt.has_other_format(first, start):
        raise StoreError(f"{folder.journal} and its receipt have different formats: restore them from a backup")
    _refuse_truncated_journal(place, contents.lines)
    refuse_earlier_columns(study_folder)
    _check_same_protocol(place, first, start, protocol, source)
    draw = stream(start.seed, "blinding").random if start.simulated else None
    return _Interrupted(place, contents, start, first, open_or_draw_key(study_folder.path, protocol, draw))


def _check_unfinished(folder: SessionFolder, lines: list[events.Event]) -> events.SessionStarted:
    """Return the first line of a session; raise an error if it is empty or finished, and so cannot be resumed."""
    if not lines:
        raise StoreError(
            f"{folder.journal} is empty: the program ended before the session began; use a new session number"
        )
    refuse_finished(folder, progress_of(lines))
    return events.start_of(lines)


def refuse_finished(folder: SessionFolder, done: Progress) -> None:
    """Raise StoreError if a session has ended, so that it is not resumed."""
    if done.ended is not None and not is_there(folder.checksums):
        raise StoreError(
            f"{folder.path} is finished ({done.ended}), but its receipt, tables and checksums could not all be "
            f"written: run liquid-study rebuild {as_argument(folder.path)} to write them"
        )
    if done.ended is not None:
        raise StoreError(
            f"{folder.path} is finished ({done.ended}) and cannot be resumed; use a new session number for another "
            "visit"
        )


def _check_same_protocol(
    place: Place, first: Mapping[str, Any], start: events.SessionStarted, protocol: Protocol, source: bytes
) -> None:
    """Raise an error that lists the differences if the protocol differs from that of the session's start."""
    if has_hash(source, start.protocol_hash):
        return
    recorded, is_upgraded = first["protocol"], needs_upgrade(first["protocol"])
    if is_upgraded:
        with protocol_errors(place.folder.receipt):
            key = read_key(place.study_folder.path)
            recorded = receipt.without_conditions(complete_protocol(recorded, key))
    protocols = (
        json.loads(json.dumps(protocol_fields)) for protocol_fields in (recorded, receipt.without_conditions(protocol))
    )
    changes = list(differences(*protocols))
    if not has_same_conditions(place.study_folder.path, protocol):
        changes.append(CONDITIONS_DIFFER)
    if is_upgraded and not changes:
        return
    if not changes:
        changes.append("only in comments, order or notation")
    shown = "; ".join(changes[:_SHOWN_DIFFERENCES])
    more = f"; and {len(changes) - _SHOWN_DIFFERENCES} more" if len(changes) > _SHOWN_DIFFERENCES else ""
    raise StoreError(
        f"{place.folder.path} began with a different protocol file and can be resumed only with that file: restore it, "
        f"or use a new session number. Differences: {shown}{more}"
    )


def _continued_clock(
    lines: list[events.Event], now_ns: Callable[[], int], now: datetime | None
) -> tuple[float | None, SessionClock]:
    """Return the gap since the last line [s], None if unknown, and the clock that continues after it."""
    now = now if now is not None else datetime.now().astimezone()
    gap_s = (now - datetime.fromisoformat(lines[-1].at)).total_seconds()
    known = 0 <= gap_s <= _MAX_GAP_S
    shown_s = progress_of(lines).t_s + (gap_s if known else 0.0)
    clock = SessionClock(now_ns, now - timedelta(seconds=shown_s), shown_s=shown_s)
    return (round(gap_s, 3) if known else None), clock


def _unrecorded_results(folder: SessionFolder, lines: list[events.Event], key: Key) -> Iterator[events.Event]:
    """Yield events for recordings, complete or lost, that the ended program did not write to the journal."""
    from study_app.store import recordings  # noqa: PLC0415 - loads the Parquet library, where there are recordings

    known = {line.which for line in lines if isinstance(line, events.Recorded | events.RecordingLost)}
    for which in recordable(lines):
        if which in known:
            continue
        samples, frames = recording_files(folder.recordings, *which)
        try:
            dropped = recordings.read_facts(samples, key.nonce)["dropped"]
            samples_file, frames_file = (recordings.describe_recording(path, key.nonce) for path in (samples, frames))
            yield recorded_event(which, samples_file, frames_file, dropped)
        except StoreError:
            if not is_there(samples):  # frames are written first and are not a recording by themselves
                with contextlib.suppress(OSError):
                    frames.unlink(missing_ok=True)
            yield lost_event(which, "the program ended before the recording was complete")


def _update_receipt(folder: SessionFolder, lines: list[events.Event]) -> list[Path]:
    """Copy the session's end from the journal to the receipt; a missing receipt cannot be recreated."""
    last = lines[-1]
    if not isinstance(last, events.SessionEnded) or not is_there(folder.receipt):
        return []
    session_receipt = receipt.read(folder.receipt)
    ended = {"status": last.status, "reason": last.reason, "ended_at": last.at}
    if all(session_receipt.get(name) == value for name, value in ended.items()):
        return []
    receipt.write(folder.receipt, session_receipt | ended)
    return [folder.receipt]


def _update_proofs(place: Place, lines: list[events.Event], rewritten: list[Path]) -> list[Path]:
    """Renew the checksums and list a missing fingerprint; return the written paths. Format 1 has neither."""
    study, folder = place.study_folder, place.folder
    listed_places = {session for _, session in read_list(study.fingerprints)}
    is_missing = lines[-1].previous is not None and place_of(study, folder) not in listed_places
    noted = [folder.rebuilt] if is_missing else []
    if is_missing:
        note_rebuilt(folder, f"{study.fingerprints.name} did not contain the session's fingerprint")
    if not renew_checksums(folder, [*rewritten, *noted]):
        return []
    if is_missing:
        note_fingerprint(study, folder, fingerprint(read_checksums(folder), lines))
        return [folder.checksums, folder.rebuilt, study.fingerprints]
    return [folder.checksums, folder.rebuilt]


def _read_if_file(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None
