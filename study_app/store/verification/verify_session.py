"""One session against its journal, its receipt, its checksums and its recordings.

Of a session that runs in a program only what that program does not change again is judged: tables, receipt, checksums
and fingerprint follow its journal. A session that a program wrote while it was checked is checked again.
"""

import contextlib
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.atomic import is_there, paths_in, read_own, study_root, temporaries
from study_app.store.blinded.blinding import Key
from study_app.store.blinded.sealing import opened
from study_app.store.checksums import files, read_checksums, sha256
from study_app.store.folders import FINGERPRINTS, SessionFolder
from study_app.store.journals import journal
from study_app.store.journals.cut_journal import RESTORE, beyond
from study_app.store.journals.journal import Contents, Line
from study_app.store.journals.journal_events import shortened, unknown_events
from study_app.store.progress import named, progress_of, recordable
from study_app.store.recorder import recording_files
from study_app.store.sessions.folder_lock import is_open
from study_app.store.sessions.open_session import Place
from study_app.store.sessions.unstarted_sessions import never_begun
from study_app.store.tables import csv_files
from study_app.store.tables.participants import opened_or_none, row_from
from study_app.store.verification.fingerprints import fingerprint
from study_app.store.verification.response_checks import wrong_responses
from study_app.store.verification.table_comparison import check_tables
from study_app.store.verification.violations import Gathered

LOOKS = 20
"""So often is looked again at what was found in files that another program wrote meanwhile."""
BETWEEN_S = 0.05

_BEGUN = "but receipt, tables, recordings or checksums show that the session began: restore it from a copy"
NOTHING = Contents([], 0)
READERS = 4  # files whose checksums are computed at the same time


@dataclass(frozen=True, slots=True)
class Checked:
    """What the study's own files are compared with, of one session.

    ``row`` is its row of the participants table: None where it has not begun, or its journal cannot be read
    (``readable`` is False). ``running`` says that a program has it open, ``chained`` that its journal's lines tell what
    was before them. ``trials`` are their numbers. ``fingerprint`` is that of a session that has ended.
    """

    place: Place
    readable: bool
    running: bool
    chained: bool = False
    row: csv_files.Row | None = None
    trials: frozenset[int] = frozenset()
    fingerprint: str = ""


def check_session(place: Place, key: Key | None, found: Gathered) -> Checked:
    """Check one session; again, where there is an error and a program wrote it meanwhile."""
    folder = place.folder
    for _ in range(LOOKS):
        before, seen = _state(folder), found.alike()
        checked = Checked(place, readable=False, running=False)
        with seen.reading(folder.path):
            checked = _look(place, key, seen)
        if not seen.errors or _state(folder) == before:
            break
        time.sleep(BETWEEN_S)
    found.take(seen)
    return checked


def _state(folder: SessionFolder) -> dict[str, tuple[int, int, int]]:
    """Return what tells that a file of the session came, went or changed."""
    found = {}
    for path in paths_in(folder.path):
        with contextlib.suppress(OSError):  # it has just gone
            facts = path.stat()
            found[str(path)] = (facts.st_ino, facts.st_size, facts.st_mtime_ns)
    return found


def _look(place: Place, key: Key | None, found: Gathered) -> Checked:
    folder = place.folder
    running = is_open(folder.path)
    half = () if running else (*temporaries(folder.path), *temporaries(folder.recordings))
    for path in half:
        found.warning(path, "is an incomplete file of a program that was ended; rebuild removes it")
    if running:
        found.warning(folder.path, "is open in another program")
    elif is_there(folder.crash) and folder.crash.stat().st_size:
        found.warning(folder.crash, "shows where the program crashed: send it to the developers")
    contents = _journal(folder, found, running=running)
    lines = contents.lines
    _receipt(folder, lines, key.hash if key else None, found, running=running)
    if not lines:
        return Checked(place, readable=running or never_begun(folder.path), running=running)
    _place(place, lines[0], found)
    with found.reading(folder.journal):
        opened(lines, key)
    for wrong in wrong_responses(lines):
        found.error(folder.journal, wrong)
    hashes = _hashes(folder)
    ended = lines[-1]["event"] == "session_ended" and not running
    if not running:
        check_tables(place, lines, _more(place, lines, found), found)
        _checksums(folder, lines, hashes, found)
    _recordings(folder, lines, hashes, found, running=running)
    _rebuilt(folder, found)
    return Checked(
        place,
        readable=True,
        running=running,
        chained="previous" in lines[-1],
        row=row_from(folder, contents, opened_or_none(place.study_folder)),
        trials=frozenset(progress_of(lines).presented),
        fingerprint=fingerprint(hashes) if ended else "",
    )


def _journal(folder: SessionFolder, found: Gathered, *, running: bool) -> Contents:
    """Return what the journal holds: no line where none can be gone by."""
    if not is_there(folder.journal):
        if never_begun(folder.path):
            if running:
                return NOTHING
            found.warning(
                folder.path,
                "was created, but the program ended before it wrote a journal: begin it again, or delete it",
            )
        else:
            found.error(folder.journal, f"is missing, {_BEGUN}")
        return NOTHING
    try:
        contents = journal.scan(folder.journal)
    except StoreError as error:
        found.failure(folder.journal, error)
        return NOTHING
    if contents.damage is not None:
        found.error(folder.journal, contents.damage.removeprefix(f"{folder.journal}, "))
    if contents.torn_bytes and not running:
        found.warning(folder.journal, f"its last {contents.torn_bytes} bytes are an incomplete line")
    if not contents.lines:
        if running or never_begun(folder.path):
            if not running:
                found.warning(folder.journal, "has no complete line: nothing was recorded")
        elif contents.damage is None:
            found.error(folder.journal, f"has no complete line, {_BEGUN}")
        return NOTHING
    for name in unknown_events(contents.lines):
        found.warning(folder.journal, f"has events {name!r}, which this version does not know")
    try:
        done = progress_of(contents.lines)
    except StoreError as error:
        found.error(folder.journal, str(error))
        return NOTHING
    if done.ended is None:
        if not running:
            found.warning(folder.path, "is unfinished: resume it, or leave it unfinished")
    elif contents.lines[-1]["event"] != "session_ended":
        found.error(folder.journal, "lines follow the session's end")
    return contents


def _receipt(folder: SessionFolder, lines: list[Line], key_hash: str | None, found: Gathered, *, running: bool) -> None:
    path = folder.receipt
    if not lines and not is_there(path):
        return  # claimed and never begun
    try:
        held = receipt.read(path)
    except StoreError as error:
        found.failure(path, error)
        return
    if missing := [name for name in receipt.FIELDS if name not in held]:
        found.error(path, f"lacks {', '.join(missing)}")
    if key_hash is not None and held["key_hash"] != key_hash:
        found.error(path, "contains the hash of another key")
    if not lines:
        return
    compared = [name for name in (*receipt.FACTS, "row_of") if name in held or name == "row_of"]
    if differing := [name for name in compared if held.get(name) != lines[0].get(name)]:
        found.error(path, f"{', '.join(differing)}: differ from the journal")
    if receipt.other_format(held, lines[0]):
        found.error(
            folder.journal, (f"has another format than {path.name} states: it was changed; restore it from a copy")
        )
    last = lines[-1]
    status = last["status"] if last["event"] == "session_ended" else receipt.UNFINISHED
    if held.get("status") != status and last["event"] == "session_ended" and not running:
        found.error(path, f"its status is {held.get('status')!r}, the journal's {status!r}; rebuild renews it")


def _place(place: Place, start: Line, found: Gathered) -> None:
    expected = {"participant": place.folder.participant, "session": place.folder.number, "study": place.study}
    for name, value in expected.items():
        if start.get(name) != value:
            found.error(
                place.folder.journal, (f"is of {name} {start.get(name)!r}, but is stored with those of {value!r}")
            )


def _rebuilt(folder: SessionFolder, found: Gathered) -> None:
    """Say that the proof of a session was made again after its end."""
    if not is_there(folder.rebuilt):
        return
    with found.reading(folder.rebuilt):
        for line in read_own(folder.rebuilt, study_root(folder.rebuilt)).decode("utf-8", "replace").splitlines():
            found.warning(folder.rebuilt, f"{shortened(line)}; only a copy of {FINGERPRINTS} proves more")


def _more(place: Place, lines: list[Line], found: Gathered) -> set[Path]:
    """Return the files that tell more than the journal, having said so."""
    telling: set[Path] = set()
    with contextlib.suppress(StoreError):  # said of receipt or journal already
        for path, what in beyond(place, lines):
            found.error(path, f"{what}: {RESTORE}")
            telling.add(path)
    return telling


def _hashes(folder: SessionFolder) -> dict[str, str]:
    """Return the checksums of the session's files as they are now; a file that cannot be read has none."""

    def hashed(name: str) -> str:
        try:
            return sha256(folder.path / name)
        except StoreError:
            return ""

    names = files(folder)
    with ThreadPoolExecutor(READERS) as readers:
        return dict(zip(names, readers.map(hashed, names), strict=True))


def _checksums(folder: SessionFolder, lines: list[Line], hashes: Mapping[str, str], found: Gathered) -> None:
    if lines[-1]["event"] != "session_ended":
        return
    if not is_there(folder.checksums):
        found.error(
            folder.checksums, ("is missing: was the program killed at the end of the session? rebuild creates it")
        )
        return
    with found.reading(folder.checksums):
        listed = read_checksums(folder)
        for name in sorted(listed.keys() | hashes.keys()):
            path = folder.path / name
            if name not in hashes:
                found.error(path, "is missing")
            elif name not in listed:
                found.error(path, "was added after the session ended")
            elif not hashes[name]:
                found.error(path, "cannot be read")
            elif hashes[name] != listed[name]:
                found.error(path, "has changed since the session ended (its checksum differs)")


def _recordings(
    folder: SessionFolder, lines: list[Line], hashes: Mapping[str, str], found: Gathered, *, running: bool
) -> None:
    """Check that every recording the journal tells of is there, whole and of this trial, and no other."""
    listed: set[str] = set()
    known: set[tuple[int, int, int | None]] = set()
    for line in lines:
        if line["event"] not in ("recorded", "recording_lost"):
            continue
        which = named(line)
        known.add((line["trial"], line["attempt"], line.get("interval")))
        if line["event"] == "recording_lost":
            found.warning(folder.recordings, f"{which} has none: {line['reason']}")
            continue
        if line["samples_unrecorded"]:
            found.warning(folder.path / line["recording"], f"lacks {line['samples_unrecorded']} samples")
        for kind, name, rows, digest in (
            ("samples", line["recording"], line["samples_recorded"], line["sha256"]),
            ("frames", line["recording_frames"], line["frames_recorded"], line["frames_sha256"]),
        ):
            listed.add(name)
            if name not in hashes:
                found.error(folder.path / name, f"is missing, but the journal mentions it ({which})")
                continue
            if hashes[name] != digest:
                found.error(folder.path / name, f"has changed since it was recorded ({which})")
            _facts(folder, line, kind, name, rows, found)
    if running:  # what is recorded is journalled with the next page
        return
    ends = lines[-1]["event"] == "session_ended"
    if lines[0].get("recordings"):
        for trial, attempt, interval in recordable(lines)[: None if ends else -1]:
            if (trial, attempt, interval) not in known:
                which = named({"trial": trial, "attempt": attempt, "interval": interval})
                found.warning(folder.recordings, f"{which} has none, and the journal gives no reason")
    of_trials = {
        path.relative_to(folder.path).as_posix()
        for recorded in recordable(lines)
        for path in recording_files(folder.recordings, *recorded)
    }
    for name in sorted(hashes.keys() - listed):
        if name.endswith(".parquet") and name not in of_trials:
            found.error(folder.path / name, "is of a trial that the journal never started")
        elif name.endswith(".parquet"):
            then = "" if ends else "; resuming the session adds it"
            found.warning(folder.path / name, f"is in no line of the journal{then}")


def _facts(folder: SessionFolder, line: Line, kind: str, name: str, rows: int, found: Gathered) -> None:
    from study_app.store import recording_files as recording  # noqa: PLC0415 - loads the Parquet library, where there are recordings

    path = folder.path / name
    with found.reading(path):
        facts: dict[str, Any] = recording.read_facts(path)
        expected = {
            "participant": folder.participant,
            "session": folder.number,
            "trial": line["trial"],
            "attempt": line["attempt"],
            "kind": kind,
            "rows": rows,
            "interval": line.get("interval"),
        }
        for fact, value in expected.items():
            if facts.get(fact) != value:
                found.error(path, f"holds {fact} {facts.get(fact)!r}, the journal says {value!r}")
