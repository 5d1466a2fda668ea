"""Detects a journal that has lost lines, because other files of its session contain more: it is not used."""

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.atomic import is_there, paths_in, read_own
from study_app.store.folders import SessionFolder
from study_app.store.journals.journal import Line
from study_app.store.journals.journal_events import unknown_events
from study_app.store.journals.parsing import RECORDING_NAME
from study_app.store.progress import recordable
from study_app.store.recorder import recording_files
from study_app.store.sessions.open_session import Place
from study_app.store.tables import session_tables
from study_app.store.verification.fingerprints import listed, place_of

RESTORE = "restore the journal from a copy"


def refuse_if_cut(place: Place, lines: Sequence[Line]) -> None:
    """Reject a journal with less information than the session's other files, which would be replaced.

    Raises
    ------
    StoreError
        Names the file that contains more, or an event of another version; or one of them cannot be read.
    """
    for name in unknown_events(lines):
        raise StoreError(
            f"{place.folder.journal} has events {name!r}, which this version does not know: use the version that wrote "
            "them"
        )
    for path, what in (*beyond(place, lines), *_ended_or_recorded(place, lines)):
        raise StoreError(f"{path} {what}: {RESTORE}")


def beyond(place: Place, lines: Sequence[Line]) -> Iterator[tuple[Path, str]]:
    """Yield each of receipt, checksums and tables that contains more than the journal, with a description.

    A session that has ended has a complete journal. After a power cut the trials table may have one more trial, since
    the line of a trial's start is not flushed at once; answers are.

    Raises
    ------
    StoreError
        The receipt is there and cannot be read.
    """
    folder = place.folder
    ended = lines[-1]["event"] == "session_ended"
    held = receipt.read(folder.receipt) if is_there(folder.receipt) else {}
    if not ended and (status := held.get("status", receipt.UNFINISHED)) != receipt.UNFINISHED:
        yield folder.receipt, f"its status is {status!r}, the journal's {receipt.UNFINISHED!r}"
    if len(held.get("resumed", ())) > sum(line["event"] == "session_resumed" for line in lines):
        yield folder.receipt, "says that the session was resumed more often than the journal does"
    if ended:
        return
    if is_there(folder.checksums):
        yield folder.checksums, "was written after the session ended, but the journal has no end"
    for name, rows, spare in (
        ("responses", session_tables.responses(lines), 0),
        ("trials", session_tables.trials(lines), 1),
        ("intervals", session_tables.SessionRows(lines).intervals, 1),
    ):
        path = folder.table(place.study, name)
        if (there := _rows(path, place.study_folder.path)) > len(rows) + spare:
            yield path, f"has {there} rows, and the journal gives {len(rows)}"


def _ended_or_recorded(place: Place, lines: Sequence[Line]) -> Iterator[tuple[Path, str]]:
    """Yield the study's fingerprints and the recordings that contain more than a journal without an end."""
    folder, study = place.folder, place.study_folder
    if lines[-1]["event"] == "session_ended":
        return
    if place_of(study, folder) in {session for _, session in listed(study.fingerprints)}:
        yield study.fingerprints, f"lists {place_of(study, folder)} as ended, but its journal has no end"
    of_trials = {path for which in recordable(lines) for path in recording_files(folder.recordings, *which)}
    for path in sorted(set(_recordings(folder)) - of_trials):
        yield path, "is of a trial that the journal never started"


def _recordings(folder: SessionFolder) -> Iterator[Path]:
    for path in paths_in(folder.recordings):
        if RECORDING_NAME.fullmatch(path.relative_to(folder.path).as_posix()):
            yield path


def _rows(path: Path, root: Path) -> int:
    """Return the number of rows of a table; 0 if it is not a table, which is made again without a loss."""
    try:
        text = read_own(path, root).decode("utf-8", "replace")
        names, *rows = list(csv.reader(io.StringIO(text, newline=""))) or [[]]
    except (StoreError, csv.Error):
        return 0
    return sum(len(row) == len(names) > 1 for row in rows)
