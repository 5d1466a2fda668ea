"""The proofs that a session has not changed since its end: ``checksums.sha256`` and the study's list of fingerprints.

``checksums.sha256`` has the SHA-256 of every file at the session's end, in the format of ``sha256sum -c``. The
fingerprint of a session is the beginning of a SHA-256 of its checksums without those of its tables, which `verify`
compares with the journal. Each study's ``fingerprints.txt`` has a line for every session that ended. A copy of it that
is kept elsewhere proves that no session was changed, added or removed since.
"""

import base64
import hashlib
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import TypeAlias

import study_app
from study_app.errors import StoreError
from study_app.store.files.atomic import (
    append_line,
    cannot_read,
    open_regular,
    paths_in,
    read_if_there,
    read_own,
    study_root,
    write_file,
)
from study_app.store.files.folders import REBUILT, SessionFolder, StudyFolder
from study_app.store.journals.journal_events import Event, Recorded

_LINE = re.compile(r"([0-9a-f]{64})  (.+)")
_SESSION_FILE = re.compile(
    r"journal\.jsonl|journal-torn-\d+\.txt|receipt\.json|checksums\.sha256|rebuilt\.txt|crash\.txt|"
    r"subject-[A-Za-z0-9]+_session-\d\d_task-[a-z0-9]+_description-[a-z]+_data\.csv|"
    r"trial-\d{3,}(_attempt-\d+)?(_interval-\d+)?(_frames)?\.\w+"
)
_SYSTEM_FILE = (
    r"desktop\.ini|(?:eh)?thumbs(?:_vista)?\.db(?::.*)?|folder\.jpg|icon\r|~\$.*|~syncthing~.*|~wr[a-z]\d+\.tmp|"
    r".*\(.*conflicted copy.*\).*|.*(?-i:-(?:DESKTOP|LAPTOP)-[A-Z0-9]{4,12})(?:-\d+)?\..*|@eaDir|__MACOSX|"
    r"\$RECYCLE\.BIN|System Volume Information|lost\+found|"
    r"(?:journal|receipt|checksums|rebuilt|crash|subject-.*_data|trial-\d{3,}(?:_attempt-\d+)?(?:_interval-\d+)?(?:_frames)?)"
    r"(?:\.(?:jsonl|json|sha256|txt|csv|parquet)(?:~|\.bak)|(?:[ (\[~-]|_conflict|\.sync-conflict-).*"
    r"\.(?:jsonl|json|sha256|txt|csv|parquet))"
)
"""Files of Windows, macOS, Office and file-sharing programs, and copies of a session's own files, such as
"journal (1).jsonl" or "receipt-HOST.json". Hidden files are matched separately."""
_FINGERPRINT = re.compile(
    r"([a-z2-7]{4}-[a-z2-7]{4}-[a-z2-7]{4})(?:-([a-z2-7]{2}))?\s+((?:sites/[A-Za-z0-9]{1,32}/)?"
    r"(?:data/sub-[A-Za-z0-9]{1,32}/ses-[0-9]{2}|"
    r"(?:withdrawals\.jsonl|exclusions\.csv)/sub-[A-Za-z0-9]{1,32}|reveals\.jsonl))\s*"
)
Proofs: TypeAlias = tuple[tuple[str, str], ...]
"""Pairs of a fingerprint and the session or record that it belongs to."""


def write_checksums(session: SessionFolder) -> dict[str, str]:
    """Write the SHA-256 of every file of the session; return path in the folder → SHA-256."""
    sums = {name: file_hash(session, name) for name in session_files(session)}
    write_file(session.checksums, checksum_bytes(sums))
    return sums


def renew_checksums(session: SessionFolder, rewritten: Collection[Path]) -> bool:
    """Update the list for the ``rewritten`` files; return whether it changed.

    Other entries stay, so that they still prove the files at the session's end. A missing or invalid list is recreated.
    Every change is noted in ``rebuilt.txt``, which is listed as well.
    """
    try:
        listed = read_checksums(session)
    except StoreError:
        state = "was damaged" if session.checksums.exists() else "was missing"
        note_rebuilt(session, f"the list of checksums {state} and has been recreated from the existing files")
        write_checksums(session)
        return True
    names = [path.relative_to(session.path).as_posix() for path in rewritten if path.is_relative_to(session.path)]
    if not (changed := [name for name in names if file_hash(session, name) != listed.get(name)]):
        return False
    if others := [name for name in changed if name != REBUILT]:
        note_rebuilt(session, f"different checksums were listed for {', '.join(others)}")
    write_file(
        session.checksums, checksum_bytes(listed | {name: file_hash(session, name) for name in (*names, REBUILT)})
    )
    return True


def replace_checksums(session: SessionFolder, changes: Mapping[str, tuple[str, str]]) -> None:
    """Replace the SHA-256 of changed files if the list has the SHA-256 of their old contents.

    ``changes`` are the old and the new SHA-256 by path in the session's folder. A file with another SHA-256 in the list
    was changed after the session ended, which must remain visible.
    """
    listed = read_checksums(session)
    new = {name: after for name, (before, after) in changes.items() if listed.get(name) == before}
    if new:
        write_file(session.checksums, checksum_bytes(listed | new))


def note_rebuilt(session: SessionFolder, text: str) -> None:
    """Record permanently which proofs `rebuild` recreated, since these prove nothing about earlier changes."""
    at = datetime.now().astimezone().isoformat(timespec="seconds")
    line = f"{at} liquid-study {study_app.__version__} rebuild: {text}\n"
    append_line(session.rebuilt, line.encode("utf-8", "replace"))


def checksum_bytes(sums: Mapping[str, str]) -> bytes:
    """Return the content of the list: SHA-256 and path in the folder, sorted by path."""
    return "".join(f"{sums[name]}  {name}\n" for name in sorted(sums)).encode("utf-8", "surrogateescape")


def file_hash(session: SessionFolder, name: str) -> str:
    """Return the SHA-256 of the file ``name`` in the session's folder."""
    return sha256(session.path / name)


def read_checksums(session: SessionFolder) -> dict[str, str]:
    """Read the list; return path in the folder → SHA-256."""
    text = read_own(session.checksums, study_root(session.checksums)).decode("utf-8-sig", "surrogateescape")
    checksums: dict[str, str] = {}
    for line in text.splitlines():
        match = _LINE.fullmatch(line)
        if match is None:
            raise StoreError(f"{session.checksums} has a line that is not a checksum: restore it from a backup")
        checksums[match[2]] = match[1]
    if not checksums:
        raise StoreError(f"{session.checksums} is empty: restore it from a backup")
    return checksums


def session_files(session: SessionFolder) -> tuple[str, ...]:
    """Return the paths of the session's files in its folder; the list, crash traces and system files are omitted."""
    excluded = {session.checksums.name, session.crash.name}
    return tuple(name.as_posix() for name in _paths(session) if name.name not in excluded and not is_system_file(name))


def system_files(session: SessionFolder) -> tuple[str, ...]:
    """Return the paths of visible files that operating systems or file-sharing programs left in the folder."""
    return tuple(name.as_posix() for name in _paths(session) if is_system_file(name) and not _is_hidden(name))


def _paths(session: SessionFolder) -> list[Path]:
    relative_paths = (path.relative_to(session.path) for path in paths_in(session.path) if path.is_file())
    return sorted(relative_paths, key=Path.as_posix)


def _is_hidden(name: Path) -> bool:
    return any(part.startswith(".") for part in name.parts)


def is_system_file(name: Path) -> bool:
    """Return whether a relative path belongs to the operating system or to a file-sharing program."""
    if _SESSION_FILE.fullmatch(name.name) and len(name.parts) <= 2:
        return False
    return _is_hidden(name) or any(re.fullmatch(_SYSTEM_FILE, part, re.IGNORECASE) for part in name.parts)


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file.

    Raises
    ------
    StoreError
        The file cannot be read.
    """
    try:
        with open_regular(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise cannot_read(path, error) from error


def fingerprint(sums: Mapping[str, str], lines: Iterable[Event]) -> str:
    """Return the fingerprint of a session from its ``lines`` and the SHA-256 of its files by path.

    It is 60 bits, in base32, of the SHA-256 of the list of checksums. The list omits tables, the note of `rebuild`, and
    sealed recordings, since the journal has their SHA-256 before and after opening.
    """
    sealed = {
        name
        for line in lines
        if isinstance(line, Recorded) and line.sealed is not None
        for name in (line.recording, line.recording_frames)
    }
    proved = {name: sums[name] for name in sums if not name.endswith("_data.csv") and name not in {REBUILT, *sealed}}
    return proof_of(checksum_bytes(proved))


def proof_of(content: bytes) -> str:
    """Return the fingerprint of a text's bytes: 60 bits of their SHA-256 in base32."""
    letters = _base32(content)
    return "-".join(letters[at : at + 4] for at in (0, 4, 8))


def checked_line(proof: str, place: str) -> str:
    """Return a line to print, scan or mail, with two check characters that reveal a misread character."""
    return f"{proof}-{_check_characters(proof, place)}  {place}"


def _check_characters(proof: str, place: str) -> str:
    return _base32(f"{proof}  {place}".lower().encode())[:2]


def _base32(content: bytes) -> str:
    return base64.b32encode(hashlib.sha256(content).digest()).decode().lower()


def note_fingerprint(
    study: StudyFolder, session: SessionFolder, session_fingerprint: str, *, waits: bool = True
) -> None:
    """Add a session's fingerprint to the study's list; without ``waits`` nothing is flushed."""
    append_line(study.fingerprints, f"{session_fingerprint}  {place_of(study, session)}\n".encode(), waits=waits)


def place_of(study: StudyFolder, session: SessionFolder) -> str:
    """Return the name of a session in a list of fingerprints: its folder relative to the study's."""
    return session.path.relative_to(study.path).as_posix()


def read_list(path: Path) -> Proofs:
    """Return fingerprint and session of each valid line of a list; empty if there is no list."""
    return tuple((match[1], match[3]) for _, match in _match_lines(_list_text(path)) if match is not None)


def unreadable_lines(path: Path) -> tuple[int, ...]:
    """Return the numbers of the lines of a list that are not fingerprints."""
    return tuple(number for number, match in _match_lines(_list_text(path)) if match is None)


def parse_copy(path: Path, text: str) -> Proofs:
    """Return the fingerprint and the session or record in each line of a copy; raise StoreError for other lines."""
    proofs: list[tuple[str, str]] = []
    for number, match in _match_lines(text):
        if match is None:
            raise StoreError(
                f"{path}, line {number} is not a fingerprint: a line must look like 'k3vq-7m2p-xw4d  "
                "data/sub-P007/ses-01'; specify a copy of a study's fingerprints.txt"
            )
        if match[2] not in (None, _check_characters(match[1], match[3])):
            raise StoreError(
                f"{path}, line {number} was copied incorrectly: its last two characters do not match the rest"
            )
        proofs.append((match[1], match[3]))
    if not proofs:
        raise StoreError(f"{path} does not contain fingerprints: specify a copy of a study's fingerprints.txt")
    return tuple(proofs)


def _list_text(path: Path) -> str:
    return (read_if_there(path) or b"").decode("utf-8-sig", "replace")


def _match_lines(text: str) -> Iterator[tuple[int, re.Match[str] | None]]:
    """Yield number and fingerprint match of every line that is not blank; None for a line that does not match."""
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip():
            yield number, _FINGERPRINT.fullmatch(line.lower() if line.isupper() else line)
