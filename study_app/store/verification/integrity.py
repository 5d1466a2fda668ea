"""Whether what an analysis reads of a session is what was recorded: its tables, its journal and its receipt.

`verify` checks everything and takes its time; this looks at the few files behind every number, each time they are read.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from study_app.errors import StoreError
from study_app.store.atomic import cause, is_there, read_regular
from study_app.store.blinded.sealing import opened_key
from study_app.store.checksums import hashed, read_checksums
from study_app.store.journals import journal
from study_app.store.journals.journal import Contents
from study_app.store.sessions.folder_lock import is_open
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.tables.csv_files import in_columns_of
from study_app.store.tables.session_tables import table_columns

CHANGED = "has changed since the session ended (its checksum differs)"
REBUILT_AFTER = "says that checksums or fingerprint were rewritten after the session ended"
COMPARE = "compare it with fingerprints stored elsewhere: liquid-study verify --fingerprints FILE"


@dataclass(frozen=True, slots=True)
class Doubt:
    """A file that is not what was recorded, and what to do about it."""

    path: Path
    what: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.path} {self.what}: {self.remedy}"


def doubts(place: Place) -> tuple[Doubt, ...]:
    """Return what cannot be trusted of a session's journal, receipt, tables and checksums: one doubt a file at most.

    Once the session has ended they are compared with their checksums: files that keep these are as they were when the
    tables were made from the journal. Where one does not, a table is compared with what the journal gives, unless the
    journal itself is doubtful. A session that is open in a program is not judged: its tables follow.
    """
    folder = place.folder
    if is_open(folder.path):
        return ()
    again = (Doubt(folder.rebuilt, REBUILT_AFTER, COMPARE),) if is_there(folder.rebuilt) else ()
    return again if _as_ended(place) else (*again, *_changed_since(place))


def _changed_since(place: Place) -> tuple[Doubt, ...]:
    """Return the doubts of a session whose files are not all as when it had ended, or that has not ended."""
    folder = place.folder
    restore = f"restore it from a copy; liquid-study verify {place.study_folder.path} checks everything"
    if not is_there(folder.journal):
        return (Doubt(folder.journal, "is missing, so the tables cannot be verified", restore),)
    try:
        contents = journal.scan(folder.journal)
    except StoreError as error:
        return (Doubt(folder.journal, f"cannot be read ({error})", restore),)
    if contents.damage is not None:
        return (Doubt(folder.journal, f"is damaged ({contents.damage.removeprefix(f'{folder.journal}, ')})", restore),)
    listed, sealed = _listed(place, contents)
    found = {doubt.path: doubt for doubt in sealed}
    changed = {path: Doubt(path, CHANGED, restore) for path in _changed(place, listed)}
    found |= {path: doubt for path, doubt in changed.items() if path in (folder.journal, folder.receipt)}
    if folder.journal not in found:
        found |= {doubt.path: doubt for doubt in _tables(place, contents, restore)}
    return tuple((changed | found).values())


def _listed(place: Place, contents: Contents) -> tuple[Mapping[str, str], tuple[Doubt, ...]]:
    """Return the checksums made when the session had ended, and what is wrong with their list.

    Where there is one the session had ended, even if its journal is incomplete.
    """
    ended = bool(contents.lines) and contents.lines[-1]["event"] == "session_ended"
    if not ended and not is_there(place.folder.checksums):
        return {}, ()
    try:
        return read_checksums(place.folder), ()
    except StoreError:
        remedy = f"restore it from a copy, or recreate it from the files with liquid-study rebuild {place.folder.path}"
        return {}, (Doubt(place.folder.checksums, "is missing or not a list of checksums", remedy),)


def _as_ended(place: Place) -> bool:
    """Return whether journal, receipt and tables are what the checksums of the session's end are of."""
    try:
        listed = read_checksums(place.folder)
        return all(listed.get(name) == hashed(place.folder, name) for name in _behind(place))
    except StoreError:
        return False


def _changed(place: Place, listed: Mapping[str, str]) -> Iterator[Path]:
    """Yield journal, receipt and tables that are not those the checksums are of; a missing one is said elsewhere."""
    for name, path in _behind(place).items():
        if name in listed and is_there(path) and _hash(place, name) != listed[name]:
            yield path


def _hash(place: Place, name: str) -> str:
    """Return the checksum of a file; none where it cannot be read."""
    try:
        return hashed(place.folder, name)
    except StoreError:
        return ""


def _behind(place: Place) -> dict[str, Path]:
    """Return the files behind every number: journal, receipt and tables, by their path in the session's folder."""
    folder = place.folder
    tables = [folder.table(place.study, name) for name in ("responses", "trials", "intervals")]
    there = [path for path in tables if path != tables[-1] or is_there(path)]  # few studies have intervals
    return {path.name: path for path in (folder.journal, folder.receipt, *there)}


def _tables(place: Place, contents: Contents, restore: str) -> Iterator[Doubt]:
    """Yield the tables that are not what the journal gives."""
    try:
        expected = table_files(place, contents.lines, opened_key(place.study_folder))
    except (StoreError, KeyError) as error:
        yield Doubt(place.folder.journal, f"gives no tables ({error})", restore)
        return
    tables = table_columns(contents.lines, opened=True)
    again = f"rebuild it from the journal with liquid-study rebuild {place.folder.path}"
    for (path, whole), name in zip(expected, tables, strict=True):
        try:
            there = read_regular(path)
        except FileNotFoundError:
            yield Doubt(path, "is missing", again)
            continue
        except OSError as error:
            yield Doubt(path, f"cannot be read ({cause(error)})", restore)
            continue
        content, _ = in_columns_of(there, whole, tables[name])
        if there != content:
            pairs = zip_longest(there.split(b"\n"), content.split(b"\n"))
            line = next(number for number, (ours, theirs) in enumerate(pairs, start=1) if ours != theirs)
            yield Doubt(path, f"differs from the journal, from line {line} on", again)
