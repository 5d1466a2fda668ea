"""Recreates the files derived from a session's journal."""

from dataclasses import dataclass
from pathlib import Path

from study_app.store import receipt
from study_app.store.atomic import is_there, sweep, write_file
from study_app.store.blinded.sealing import opened_key
from study_app.store.checksums import note_rebuilt, read_checksums, renew_checksums
from study_app.store.folders import SessionFolder, locate
from study_app.store.journals import journal
from study_app.store.journals.cut_journal import refuse_if_cut
from study_app.store.journals.journal import Line
from study_app.store.progress import progress_of
from study_app.store.recorder import hashes_of
from study_app.store.sessions.folder_lock import open_alone
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.tables.participants import write_participants
from study_app.store.verification.fingerprints import fingerprint, listed, note_fingerprint, place_of


@dataclass(frozen=True, slots=True)
class Rebuilt:
    """The result of `rebuild`.

    ``rewritten`` files were missing or differed from the journal, ``swept`` were temporary files of a killed program;
    ``torn_bytes`` at the journal's end are an incomplete line, and were not changed.
    """

    rewritten: tuple[Path, ...]
    swept: tuple[Path, ...]
    torn_bytes: int


def rebuild(session_folder: Path) -> Rebuilt:
    """Recreate the files derived from a session's journal.

    These are its tables, the study's table of participants, the receipt's status and the checksums and fingerprint of a
    finished session. Correct files are not changed. Recreated checksums or fingerprints are noted permanently in
    ``rebuilt.txt``: they prove nothing about earlier changes.

    Raises
    ------
    StoreError
        It is not a session folder, open in another program, or its journal is empty, damaged or tells less than the
        session's other files; or a file cannot be written.
    """
    study_folder, folder = locate(session_folder)
    with open_alone(folder.path):
        contents = journal.whole(folder.journal)
        place = Place(study_folder, folder, progress_of(contents.lines).start["study"])
        refuse_if_cut(place, contents.lines)
        swept = sweep(folder.path) + (sweep(folder.recordings) if is_there(folder.recordings) else ())
        table = study_folder.participants(place.study)
        before = _content(table)
        tables = table_files(place, contents.lines, opened_key(study_folder))
        rewritten = [path for path, content in tables if _renew(path, content)]
        rewritten += _renew_receipt(folder, contents.lines)
        write_participants(study_folder, place.study, whole=True)
        rewritten += [table] if _content(table) != before else []
        ended = contents.lines[-1]["event"] == "session_ended"
        if ended:
            rewritten += _renew_proof(place, contents.lines, rewritten)
        return Rebuilt(tuple(rewritten), swept, contents.torn_bytes)


def _renew(path: Path, content: bytes) -> bool:
    if _content(path) == content:
        return False
    write_file(path, content)
    return True


def _renew_receipt(folder: SessionFolder, lines: list[Line]) -> list[Path]:
    """Set the receipt's end from the journal; a missing receipt cannot be recreated."""
    last = lines[-1]
    if last["event"] != "session_ended" or not is_there(folder.receipt):
        return []
    held = receipt.read(folder.receipt)
    ended = {"status": last["status"], "reason": last["reason"], "ended_at": last["at"]}
    if all(held.get(name) == value for name, value in ended.items()):
        return []
    receipt.write(folder.receipt, held | ended)
    return [folder.receipt]


def _renew_proof(place: Place, lines: list[Line], rewritten: list[Path]) -> list[Path]:
    """Renew the checksums, and list the fingerprint where it is missing; return what was written.

    Sessions of format 1 have none.
    """
    study, folder = place.study_folder, place.folder
    there = {session for _, session in listed(study.fingerprints)}
    has_none = "previous" in lines[-1] and place_of(study, folder) not in there
    noted = [folder.rebuilt] if has_none else []
    if has_none:
        note_rebuilt(folder, f"{study.fingerprints.name} had no fingerprint of the session")
    if not renew_checksums(folder, [*rewritten, *noted], hashes_of(lines)):
        return []
    if has_none:
        note_fingerprint(study, folder, fingerprint(read_checksums(folder)))
        return [folder.checksums, folder.rebuilt, study.fingerprints]
    return [folder.checksums, folder.rebuilt]


def _content(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None
