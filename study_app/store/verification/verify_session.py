"""Verification of one session: its files against its journal, receipt, checksums and recordings.

If a program has the session open, only its journal is checked, because written lines do not change but the other files
are still updated. If `fingerprints.txt` lists the session as ended, its fingerprint is compared even if a lock says
that it is open.

`verify_study` checks everything, which takes a while. `session_discrepancies` checks a session before an analysis reads
it, and is fast if its files still have their checksums.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any

import study_app
from study_app.errors import PlugInError, StoreError, as_argument
from study_app.number_text import counted
from study_app.protocol.upgrade import needs_upgrade
from study_app.protocol.wording import SHIPPED
from study_app.store import receipt
from study_app.store.blinded.blinding import Key, complete_protocol, open_events, opened_key
from study_app.store.files import csv_files
from study_app.store.files.atomic import is_there, parse_json, read_own, read_regular, study_root, temporary_files
from study_app.store.files.csv_files import Column
from study_app.store.files.folders import FINGERPRINTS, SessionFolder
from study_app.store.integrity.checksums import file_hash, fingerprint, read_checksums, session_files, system_files
from study_app.store.integrity.folder_lock import is_never_begun, is_open
from study_app.store.journals import journal
from study_app.store.journals import journal_events as events
from study_app.store.journals.journal import Contents
from study_app.store.recorder import recording_files
from study_app.store.session_progress.progress import Progress, attempt_name, progress_of, recordable
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.sessions.recovery import RESTORE, files_beyond_journal
from study_app.store.tables.session_tables import table_columns
from study_app.store.tables.study_files import opened_or_none, row_from

_BEGAN = "but the receipt, tables, recordings or checksums show that the session began: restore it from a backup"
_ROUNDED_S = 1.1e-6
_CHANGED = "has changed since the session ended (its checksum differs)"
_REBUILT_AFTER = "states that the checksums or the fingerprint were rewritten after the session ended"
INTERRUPTED = "the unblinding was interrupted: run liquid-study unblind again"
_COMPARE = "compare it with fingerprints stored elsewhere: liquid-study verify --fingerprints FILE"


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem and its path in the study folder; with ``shares`` it matters only for sharing the data."""

    place: str
    message: str
    shares: bool = False

    def __str__(self) -> str:
        return f"{self.place}: {self.message}"


@dataclass(slots=True)
class Findings:
    """The problems in a study's ``folder``, with its number of sessions and the ``plug_ins`` named in receipts.

    ``errors`` are about files that cannot be trusted, ``warnings`` about other facts.
    """

    folder: Path
    errors: tuple[Finding, ...] = ()
    warnings: tuple[Finding, ...] = ()
    sessions: int = 0
    running: int = 0
    plug_ins: dict[str, list[str]] = field(default_factory=dict)

    @property
    def is_sound(self) -> bool:
        """Whether there are no errors."""
        return not self.errors

    def extend(self, others: Findings) -> None:
        """Add the findings of ``others``."""
        self.errors += others.errors
        self.warnings += others.warnings

    def error(self, path: Path, message: str) -> None:
        """Add an error: ``path`` cannot be trusted."""
        self.errors += (Finding(self._name(path), message),)

    def add_failure(self, path: Path, error: StoreError) -> None:
        """Add the error raised while ``path`` was read, without repeating the path in the message."""
        self.error(path, str(error).removeprefix(str(path)).lstrip(" ,:/"))

    def warning(self, path: Path, message: str, *, shares: bool = False) -> None:
        """Add a warning about ``path``."""
        self.warnings += (Finding(self._name(path), message, shares),)

    @contextlib.contextmanager
    def reading(self, path: Path) -> Iterator[None]:
        """Convert an error raised in this ``with`` block into a finding about ``path``; continue after the block."""
        try:
            yield
        except StoreError as error:
            self.add_failure(path, error)

    def _name(self, path: Path) -> str:
        inside = path.is_relative_to(self.folder) and path != self.folder
        return path.relative_to(self.folder).as_posix() if inside else "."


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedSession:
    """The data of one session with which the study's own files are compared.

    ``row`` is the session's row of the participants table: None if it has not begun, or if its journal cannot be read
    (``readable`` is False). ``running`` means that a program has it open, ``chained`` that each line of its journal has
    the hash of the previous ones. ``trials`` are the numbers of its trials. ``fingerprint`` is "" unless the journal
    records the session's end.
    """

    place: Place
    readable: bool = False
    running: bool = False
    chained: bool = False
    row: csv_files.Row | None = None
    trials: frozenset[int] = frozenset()
    fingerprint: str = ""


def check_session(place: Place, key: Key | None, findings: Findings, *, recordings: bool = True) -> CheckedSession:
    """Check one session; repeat the check if there are errors and a program has opened it in the meantime.

    Without ``recordings`` the recordings are not read, which would take a while.
    """
    errors = Findings(findings.folder)
    checked = CheckedSession(place=place, running=is_open(place.folder.path))
    with errors.reading(place.folder.path):
        checked = _check_files(place, key, errors, running=checked.running, recordings=recordings)
    if errors.errors and not checked.running and is_open(place.folder.path):
        return check_session(place, key, findings, recordings=recordings)
    findings.extend(errors)
    return checked


def _check_files(
    place: Place, key: Key | None, findings: Findings, *, running: bool, recordings: bool
) -> CheckedSession:
    folder = place.folder
    if running:
        findings.warning(folder.path, "is open in another program")
    else:
        for path in (*temporary_files(folder.path), *temporary_files(folder.recordings)):
            message = "is an incomplete file left by a program that was killed; the rebuild command removes it"
            findings.warning(path, message)
        if is_there(folder.crash) and folder.crash.stat().st_size:
            findings.warning(folder.crash, "shows how the program crashed: send it to the developers")
    contents = _check_journal(folder, findings, running=running)
    lines = contents.lines
    if not running:
        _check_receipt(folder, lines, key, findings)
    if not lines:
        return CheckedSession(place=place, readable=running or is_never_begun(folder.path), running=running)
    start = events.start_of(lines)
    expected = {"participant": folder.participant, "session": folder.number, "study": place.study}
    for name, value in expected.items():
        if (recorded := getattr(start, name)) != value:
            findings.error(
                folder.journal, f"belongs to {name} {recorded!r}, but is stored with the files for {value!r}"
            )
    opened = lines
    with findings.reading(folder.journal):
        opened = open_events(lines, key)
    for problem in (*_changed_responses(lines), *_unconfirmed_answers(lines)):
        findings.error(folder.journal, problem)
    ended = isinstance(lines[-1], events.SessionEnded)
    hashes = {}
    if ended or not running:
        names = {*session_files(folder), *(_checksums_or_empty(folder).keys() & set(system_files(folder)))}
        hashes = {
            name: _file_hash_or_empty(folder, name) for name in names if recordings or not name.endswith(".parquet")
        }
    if not running:
        _check_tables(place, lines, findings, ended=ended)
        if ended:
            _check_checksums(place, lines, opened, hashes, findings, recordings=recordings)
        if recordings:
            _check_recordings(folder, opened, key, hashes, findings, ended=ended, damaged=contents.damage is not None)
    for name in system_files(folder):
        if name not in hashes:
            message = "was created by the operating system, or is a copy made by a file-sharing program"
            findings.warning(folder.path / name, message)
    if is_there(folder.rebuilt):
        with findings.reading(folder.rebuilt):
            for line in read_own(folder.rebuilt, study_root(folder.rebuilt)).decode("utf-8", "replace").splitlines():
                proof = f"only a copy of {FINGERPRINTS} can prove that the data are unchanged"
                findings.warning(folder.rebuilt, f"{events.shorten_value(line)}; {proof}")
    return CheckedSession(
        place=place,
        readable=True,
        running=running,
        chained=lines[-1].previous is not None,
        row=row_from(folder, contents, opened_or_none(place.study_folder)),
        trials=frozenset(progress_of(lines).presented),
        fingerprint=fingerprint(_listed_hashes(folder, hashes), lines) if ended and recordings else "",
    )


def _check_journal(folder: SessionFolder, findings: Findings, *, running: bool) -> Contents:
    """Check the journal and return its contents, which are empty if it is missing or unreadable."""
    nothing = Contents([], 0)
    if not is_there(folder.journal):
        if is_never_begun(folder.path):
            if not running:
                findings.warning(
                    folder.path,
                    "was created, but the program ended before it wrote a journal: start the session again, or "
                    "delete the folder",
                )
        else:
            findings.error(folder.journal, f"is missing, {_BEGAN}")
        return nothing
    try:
        contents = journal.scan(folder.journal)
    except StoreError as error:
        findings.add_failure(folder.journal, error)
        return nothing
    if contents.damage is not None:
        findings.error(folder.journal, contents.damage.removeprefix(f"{folder.journal}, "))
    if contents.torn_bytes and not running:
        findings.warning(folder.journal, f"it ends with an incomplete line of {counted(contents.torn_bytes, 'byte')}")
    if not contents.lines:
        if running or is_never_begun(folder.path):
            if not running:
                findings.warning(folder.journal, "does not contain a complete line: there are no recorded data")
        elif contents.damage is None:
            findings.error(folder.journal, f"does not contain a complete line, {_BEGAN}")
        return nothing
    for name in events.unknown_events(contents.lines):
        findings.warning(folder.journal, f"contains {name!r} events, which this version does not recognise")
    try:
        done = progress_of(contents.lines)
    except StoreError as error:
        findings.error(folder.journal, str(error))
        return nothing
    missing = done.missing_trials
    if missing.count:
        findings.warning(folder.path, str(missing))
    if done.reached_end and missing.exceed != (done.ended == events.INCOMPLETE):
        findings.error(folder.journal, f"its status is {done.ended!r}, although {missing or 'no trial is missing'}")
    if done.ended is None:
        if not running and contents.damage is None:
            findings.warning(folder.path, "is unfinished but can be resumed")
    elif not isinstance(contents.lines[-1], events.SessionEnded):
        findings.error(folder.journal, "contains lines after the session's end")
    return contents


def _check_receipt(folder: SessionFolder, lines: list[events.Event], key: Key | None, findings: Findings) -> None:
    path = folder.receipt
    if not lines and not is_there(path):
        return  # claimed but never begun
    try:
        held = receipt.read(path)
    except StoreError as error:
        findings.add_failure(path, error)
        return
    if missing := [name for name in receipt.FIELDS if name not in held]:
        findings.error(path, f"does not contain {', '.join(missing)}")
    if key is not None and held["key_hash"] != key.hash:
        findings.error(path, "contains the hash of a different key")
    if not lines:
        return
    start = events.start_of(lines)
    optional = ("row_of", "group")
    compared = [name for name in (*receipt.COPIED_FIELDS, *optional) if name in held or name in optional]
    differing = [name for name in compared if held.get(name) != getattr(start, name)]
    differing += _differing_fields(held, lines)
    if not differing and start.receipt_hash not in (None, receipt.digest(held)):
        differing = ["the settings used when the session began"]
    if differing:
        findings.error(path, f"differs from the journal in {', '.join(differing)}")
    recorded_times = {str(entry.get("at")) for entry in held.get("resumed", ()) if isinstance(entry, dict)}
    resumed_times = [
        line.at for line in lines if isinstance(line, events.SessionResumed) and line.receipt_hash is not None
    ]
    if unrecorded := [at for at in resumed_times if at not in recorded_times]:
        findings.warning(
            path,
            (
                f"does not contain the settings used when the session was resumed at {', '.join(unrecorded)}: the "
                "program was killed at that time, or the entry was removed"
            ),
        )
    if key is not None and not _is_valid_protocol(held, start, key):
        findings.error(path, "its protocol has been changed: restore it from a backup")
    if receipt.has_other_format(held, start):
        findings.error(
            folder.journal,
            f"has a different format from {path.name}: it has been changed; restore the journal from a backup",
        )
    last = lines[-1]
    if isinstance(last, events.SessionEnded) and held.get("status") != last.status:
        findings.error(
            path,
            f"its status is {held.get('status')!r}, but the journal's is {last.status!r}; the rebuild command "
            "corrects it",
        )
    sequence = protocol.get("sequence") if isinstance(protocol := held.get("protocol"), dict) else None
    steps = sequence if isinstance(sequence, list) else []
    left = sum(isinstance(line, events.PageLeft) and line.page in steps[-1:] for line in lines)
    blocks = protocol.get("blocks") if isinstance(protocol, dict) else None
    tables = blocks.values() if isinstance(blocks, dict) else ()
    breaks = [block.get("break_page") for block in tables if isinstance(block, dict)]
    was_last = bool(steps) and steps[-1] not in breaks and left >= steps.count(steps[-1])
    if isinstance(last, events.SessionEnded) and last.status not in events.REACHED_END and was_last:
        findings.error(
            folder.journal,
            (f"its status is {last.status!r}, although the last page was completed: it has been changed"),
        )


def _differing_fields(session_receipt: Mapping[str, Any], lines: Sequence[events.Event]) -> list[str]:
    """Return the fields of a receipt that the journal contradicts, apart from those copied from its first line."""
    start = events.start_of(lines)
    resumed = {line.at: line.receipt_hash for line in lines if isinstance(line, events.SessionResumed)}
    expected: dict[str, Any] = {"started_at": start.at}
    if not isinstance(lines[-1], events.SessionEnded):
        expected |= {"status": receipt.UNFINISHED, "reason": "", "ended_at": None}
    names = [name for name, value in expected.items() if session_receipt.get(name) != value]
    if start.version == study_app.__version__ and session_receipt.get("generator") != receipt.GENERATOR:
        names.append("generator")
    expected_parts = {
        "device": ("name", start.device),
        "clock": ("origin_at", start.at),
        "versions": ("liquid-study", start.version),
    }
    names += [
        name for name, (part, value) in expected_parts.items() if session_receipt.get(name, {}).get(part) != value
    ]
    for entry in session_receipt.get("resumed", ()):
        at = str(entry.get("at")) if isinstance(entry, dict) else ""
        if at not in resumed or resumed[at] not in (None, receipt.digest(entry)):
            names.append("resumed")
    return names


def _is_valid_protocol(session_receipt: Mapping[str, Any], start: events.SessionStarted, key: Key) -> bool:
    """Return whether a receipt's protocol, completed from the key, is valid and as this version writes it."""
    try:
        protocol = receipt.without_conditions(complete_protocol(session_receipt["protocol"], key))
        is_earlier = start.version != study_app.__version__ or needs_upgrade(session_receipt["protocol"])
    except PlugInError:  # the plug-in is missing; `verify` reports it
        return True
    except (StoreError, KeyError, TypeError, AttributeError, ValueError):  # StoreError: the key lacks a code
        return False
    return is_earlier or _without_own_texts(parse_json(json.dumps(protocol))) == _without_own_texts(
        session_receipt["protocol"]
    )


def _without_own_texts(protocol: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a receipt's protocol, without design questions if the lab added one of its languages.

    The file of such a language may have been changed since the session, or be missing on this computer.
    """
    if SHIPPED.keys() >= {*protocol["study"]["languages"]}:
        return protocol
    questionnaires = {
        name: form for name, form in protocol["questionnaires"].items() if not name.endswith(receipt.ANSWER)
    }
    return {**protocol, "questionnaires": questionnaires}


def _unconfirmed_answers(lines: Sequence[events.Event]) -> Iterator[str]:
    """Yield a sentence on each trial or form whose answers were never confirmed although the session continued."""
    chosen: dict[int, int] = {}
    form: events.FormShown | None = None
    for line in lines:
        if isinstance(line, events.Choice) and line.trial is not None:
            chosen[line.trial] = line.n
        elif isinstance(line, events.Responses | events.TrialStarted | events.PassedOver) and line.trial is not None:
            chosen.pop(line.trial, None)
        elif isinstance(line, events.FormAnswered | events.PassedOver | events.SessionResumed):
            form = None
        completed = isinstance(line, events.SessionEnded) and line.status in events.REACHED_END
        for trial, number in list(chosen.items()):
            if completed or (isinstance(line, events.TrialStarted) and line.trial > trial):
                del chosen[trial]
                yield f"line {number} contains an answer in trial {trial} that was never confirmed: a line was removed"
        if completed or isinstance(line, events.PageShown | events.FormShown | events.TrialStarted):
            shown = line if isinstance(line, events.FormShown) else None
            if form is not None and (shown is None or (form.form, form.after) != (shown.form, shown.after)):
                yield f"line {form.n} shows form {form.form}, which was never confirmed: a line was removed"
            form = shown


def _changed_responses(lines: Sequence[events.Event]) -> Iterator[str]:
    """Yield a sentence on each answer in ``responses`` that differs from the choices before it."""
    progress = Progress()
    for line in lines:
        if isinstance(line, events.Responses | events.FormAnswered):
            chosen = dict(progress.answers)
            where = f"form {line.form}" if isinstance(line, events.FormAnswered) else f"trial {line.trial}"
            line_name = f"line {line.n} ({line.event})"
            # format 2: a question may have been hidden again
            may_hide = any(row.kind is not None for row in line.items)
            for row in line.items:
                if not _same_answer(row, chosen.pop(row.item, events.Answer())):
                    problem = "that differs from the one chosen earlier: it has been changed"
                    yield f"{line_name} has an answer for {row.item!r} in {where} {problem}"
            for item, answer in chosen.items():
                if answer.given or not may_hide:
                    yield f"{line_name} does not contain the answer to {item!r} in {where}: it has been changed"
        progress.process_line(line)


def _same_answer(listed_answer: events.Answer, chosen: events.Answer) -> bool:
    """Return whether a confirmed answer equals the chosen one; times in lines are rounded to 1 µs."""
    moments = ((getattr(listed_answer, name), getattr(chosen, name)) for name in ("onset_s", "first_s", "last_s"))
    return (listed_answer.value, listed_answer.changes) == (chosen.value, chosen.changes) and all(
        confirmed == expected or (None not in (confirmed, expected) and abs(confirmed - expected) <= _ROUNDED_S)
        for confirmed, expected in moments
    )


def _check_tables(place: Place, lines: list[events.Event], findings: Findings, *, ended: bool) -> None:
    """Compare the tables with those made from the journal; report tables that contain more than the journal."""
    reported: set[Path] = set()
    with contextlib.suppress(StoreError):  # already reported for receipt or journal
        for path, problem in files_beyond_journal(place, lines):
            findings.error(path, f"{problem}: {RESTORE}")
            reported.add(path)
    try:
        key = opened_key(place.study_folder)
        expected = table_files(place, lines, key)
    except StoreError as error:
        findings.error(place.folder.journal, f"cannot be converted into tables: {error}")
        return
    columns = table_columns(lines, opened=key is not None)
    for (path, content), name in zip(expected, columns, strict=True):
        current = path.read_bytes() if path.is_file() else content
        if current != content and current == _sealed_tables(place, lines).get(path):
            findings.error(path, f"does not contain the sealed columns: {INTERRUPTED}")
        elif path not in reported:
            check_table(path, content, columns[name], findings, may_differ=lambda _: not ended)


def _sealed_tables(place: Place, lines: Sequence[events.Event]) -> dict[Path, bytes]:
    """Return a session's tables as they were before `unblind`; empty while the key is sealed."""
    if opened_or_none(place.study_folder) is None or not events.start_of(lines).measures_sealed:
        return {}
    return dict(table_files(place, lines, None))


def check_table(
    path: Path, expected: bytes, columns: tuple[Column, ...], findings: Findings, *, may_differ: Callable[[int], bool]
) -> None:
    """Compare a table with the one made from the journals, and its cells with the column dictionary.

    ``may_differ`` tells whether the line with a number belongs to a session that has not ended. Its tables are updated
    with the next page or by a rebuild, so a difference there is only a warning.
    """
    try:
        content = read_regular(path)
    except OSError:
        findings.error(path, "is missing or cannot be read; the rebuild command recreates it")
        return
    normalized = journal.normalized_text(content)
    if content != normalized == expected:
        findings.error(path, journal.notation_problem(content))
        return
    pairs = zip_longest(content.split(b"\n"), expected.split(b"\n"))
    differing = [number for number, (line, expected_line) in enumerate(pairs, start=1) if line != expected_line]
    may_all_differ = all(map(may_differ, differing))
    if differing:
        report = findings.warning if may_all_differ else findings.error
        report(path, f"differs from the journal, starting at line {differing[0]}; the rebuild command recreates it")
    if not (differing and may_all_differ):  # a row may be partly written: earlier versions wrote in place
        for problem in csv_files.table_problems(content, columns):
            findings.error(path, problem)


def _file_hash_or_empty(folder: SessionFolder, name: str) -> str:
    """Return the current SHA-256 of a session's file, or "" if it cannot be read."""
    try:
        return file_hash(folder, name)
    except StoreError:
        return ""


def _checksums_or_empty(folder: SessionFolder) -> dict[str, str]:
    """Return the session's list of checksums, empty if it cannot be read."""
    try:
        return read_checksums(folder)
    except StoreError:
        return {}


def _listed_hashes(folder: SessionFolder, hashes: Mapping[str, str]) -> Mapping[str, str]:
    """Return the current hashes of the files in the session's list; of all files if there is no list."""
    names = _checksums_or_empty(folder)
    return {name: hashes[name] for name in hashes if name in names} if names else hashes


def _check_checksums(
    place: Place,
    lines: Sequence[events.Event],
    opened: Sequence[events.Event],
    hashes: Mapping[str, str],
    findings: Findings,
    *,
    recordings: bool,
) -> None:
    folder = place.folder
    recorded = [line for line in opened if isinstance(line, events.Recorded)]
    opened_hashes = {line.sha256: line.opened_sha256 for line in recorded}
    opened_hashes |= {line.frames_sha256: line.opened_frames_sha256 for line in recorded}
    if not is_there(folder.checksums):
        findings.error(
            folder.checksums,
            "is missing: the program may have been killed at the end of the session; the rebuild command creates it",
        )
        return
    with findings.reading(folder.checksums):
        listed = read_checksums(folder)
        for name in sorted(listed.keys() | hashes.keys()):
            if name.endswith(".parquet") and not recordings:
                continue
            path = folder.path / name
            if name not in hashes:
                findings.error(path, "is missing")
            elif name not in listed:
                findings.error(path, "was added after the session ended")
            elif not hashes[name]:
                findings.error(path, "cannot be read")
            elif hashes[name] == listed[name]:
                continue
            elif hashes[name] == opened_hashes.get(listed[name]) or _is_opened_table(place, lines, path, listed[name]):
                findings.warning(path, f"is unsealed, but its checksum was not updated: {INTERRUPTED}")
            else:
                content = read_regular(path)
                same_text = hashlib.sha256(journal.normalized_text(content)).hexdigest() == listed[name]
                findings.error(path, journal.notation_problem(content) if same_text else _CHANGED)


def _is_opened_table(place: Place, lines: Sequence[events.Event], path: Path, listed: str) -> bool:
    """Return whether a table is unsealed, while ``listed`` is still the SHA-256 of the sealed table."""
    sealed = _sealed_tables(place, lines).get(path)
    if sealed is None or hashlib.sha256(sealed).hexdigest() != listed:
        return False
    return read_regular(path) == dict(table_files(place, lines, opened_or_none(place.study_folder)))[path]


def _check_recordings(
    folder: SessionFolder,
    lines: list[events.Event],
    key: Key | None,
    hashes: Mapping[str, str],
    findings: Findings,
    *,
    ended: bool,
    damaged: bool,
) -> None:
    """Check that exactly the recordings named in the journal exist, each complete and of the right trial."""
    listed: set[str] = set()
    known = {line.which for line in lines if isinstance(line, events.Recorded | events.RecordingLost)}
    for line in lines:
        if isinstance(line, events.RecordingLost):
            findings.warning(folder.recordings, f"{attempt_name(*line.which)} does not have a recording: {line.reason}")
        if not isinstance(line, events.Recorded):
            continue
        attempt = attempt_name(*line.which)
        if line.samples_unrecorded:
            findings.warning(folder.path / line.recording, f"is missing {line.samples_unrecorded} samples")
        for kind, name, rows, digests in (
            ("samples", line.recording, line.samples_recorded, (line.sha256, line.opened_sha256)),
            ("frames", line.recording_frames, line.frames_recorded, (line.frames_sha256, line.opened_frames_sha256)),
        ):
            listed.add(name)
            if name not in hashes:
                findings.error(folder.path / name, f"is missing, but the journal mentions it ({attempt})")
                continue
            if hashes[name] not in digests:
                findings.error(folder.path / name, f"has changed since it was recorded ({attempt})")
            if rows is not None:  # without a key sealed files cannot be read, as already reported
                _check_facts(folder, line, kind, name, rows, key, findings)
    if events.start_of(lines).recordings:
        for planned in recordable(lines)[: None if ended else -1]:
            if planned not in known:
                findings.warning(
                    folder.recordings, f"{attempt_name(*planned)} was not recorded, and the journal does not state why"
                )
    expected = {
        path.relative_to(folder.path).as_posix()
        for recorded in recordable(lines)
        for path in recording_files(folder.recordings, *recorded)
    }
    for name in sorted(name for name in hashes.keys() - listed if name.endswith(".parquet")):
        if name not in expected:
            findings.error(folder.path / name, "belongs to a trial that never started, according to the journal")
        else:
            remedy = "" if ended or damaged else "; resuming the session adds it"
            findings.warning(folder.path / name, f"does not appear in the journal{remedy}")


def _check_facts(
    folder: SessionFolder, line: events.Recorded, kind: str, name: str, rows: int, key: Key | None, findings: Findings
) -> None:
    from study_app.store import recordings  # noqa: PLC0415 - loads the Parquet library, where there are recordings

    path = folder.path / name
    expected = {"participant": folder.participant, "session": folder.number, "kind": kind, "rows": rows}
    expected |= {"trial": line.trial, "attempt": line.attempt, "interval": line.interval}
    with findings.reading(path):
        facts: dict[str, Any] = recordings.read_facts(path, key.nonce if key else None)
        for fact, value in expected.items():
            if facts.get(fact) != value:
                findings.error(path, f"contains {fact} {facts.get(fact)!r}, but the journal says {value!r}")


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """A file that differs from what was recorded, with the remedy; ``used`` shows whether it is still analysed."""

    path: Path
    what: str
    remedy: str
    used: bool = True

    def __str__(self) -> str:
        return f"{self.path} {self.what}: {self.remedy}"


def session_discrepancies(place: Place) -> tuple[Discrepancy, ...]:
    """Return the discrepancies of a session's journal, receipt, tables and checksums.

    After the session's end its files are compared with their checksums, which were computed when the tables agreed with
    the journal. If any differs, `check_session` checks the session, and the first error of each file is returned, or
    only that of the journal. A session that is open in a program is not checked, since its tables are still updated.
    """
    folder = place.folder
    if is_open(folder.path):
        return ()
    discrepancies = (Discrepancy(folder.rebuilt, _REBUILT_AFTER, _COMPARE),) if is_there(folder.rebuilt) else ()
    if _has_unchanged_files(place):
        return discrepancies
    findings = Findings(folder.path)
    check_session(place, None, findings, recordings=False)
    first_findings: dict[str, Finding] = {}
    for finding in (*findings.errors, *(warning for warning in findings.warnings if warning.place.endswith(".csv"))):
        first_findings.setdefault(finding.place, finding)
    if (journal_finding := first_findings.get(folder.journal.name)) is not None:
        first_findings = {journal_finding.place: journal_finding}
    remedy = f"run liquid-study verify {as_argument(place.study_folder.path)} to check everything"
    return (
        *discrepancies,
        *(Discrepancy(folder.path / error.place, error.message, remedy) for error in first_findings.values()),
    )


def _has_unchanged_files(place: Place) -> bool:
    """Return whether journal, receipt and tables match the checksums of the session's end."""
    folder = place.folder
    tables = [folder.table(place.study, name) for name in ("responses", "trials", "intervals")]
    tables = [path for path in tables if path != tables[-1] or is_there(path)]  # few studies have intervals
    try:
        listed = read_checksums(folder)
        files = (folder.journal, folder.receipt, *tables)
        return all(listed.get(path.name) == file_hash(folder, path.name) for path in files)
    except StoreError:
        return False
