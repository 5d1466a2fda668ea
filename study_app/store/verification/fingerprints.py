"""The fingerprint of a session that has ended: twelve characters that no other session can have.

It is the beginning of a SHA-256 over the session's checksums, but for those of its tables, which are made from the
journal and compared with it by `verify`. Each study's ``fingerprints.txt`` has a line for every session that ended; a
copy of it that is kept elsewhere proves that none of them was changed, added or removed since.
"""

import base64
import hashlib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from study_app.errors import StoreError
from study_app.store.atomic import append_line, cannot_read, read_regular
from study_app.store.checksums import checksum_bytes
from study_app.store.folders import REBUILT, SessionFolder, StudyFolder

_LINE = re.compile(r"([a-z2-7]{4}-[a-z2-7]{4}-[a-z2-7]{4})\s+(data/sub-[A-Za-z0-9]{1,32}/ses-[0-9]{2})\s*")


def fingerprint(sums: Mapping[str, str]) -> str:
    """Return the fingerprint of a session whose files (by path in its folder) have these SHA-256.

    60 bits of the SHA-256 of their list, without tables and the note of `rebuild`, in the letters and digits of base32.
    """
    proved = {name: sums[name] for name in sums if not name.endswith("_data.csv") and name != REBUILT}
    letters = base64.b32encode(hashlib.sha256(checksum_bytes(proved)).digest()).decode().lower()
    return "-".join(letters[at : at + 4] for at in (0, 4, 8))


def note_fingerprint(study: StudyFolder, session: SessionFolder, found: str, *, waits: bool = True) -> None:
    """Add a session's fingerprint to the study's list; without ``waits`` nothing is flushed.

    Raises
    ------
    StoreError
        The list cannot be written.
    """
    append_line(study.fingerprints, f"{found}  {place_of(study, session)}\n".encode(), waits=waits)


def place_of(study: StudyFolder, session: SessionFolder) -> str:
    """Return how a list of fingerprints names a session: its folder in the study's."""
    return session.path.relative_to(study.path).as_posix()


def listed(path: Path) -> tuple[tuple[str, str], ...]:
    """Return fingerprint and session of every line of a list, which is empty where there is none; others are left out.

    Raises
    ------
    StoreError
        It cannot be read.
    """
    return tuple((match[1], match[2]) for _, match in _lines(path) if match is not None)


def unreadable(path: Path) -> tuple[int, ...]:
    """Return the numbers of the lines of a list that hold no fingerprint."""
    return tuple(number for number, match in _lines(path) if match is None)


def read_copy(path: Path) -> tuple[tuple[str, str], ...]:
    """Return fingerprint and session of every line of a copy, which holds nothing else.

    Raises
    ------
    StoreError
        It cannot be read, holds none, or something else.
    """
    if not path.is_file():
        raise StoreError(f"{path} is not a file: name a copy of a study's fingerprints.txt")
    if wrong := unreadable(path):
        raise StoreError(
            f"{path}, line {wrong[0]} is not a fingerprint: a line must be such as "
            "'k3vq-7m2p-xw4d  data/sub-P007/ses-01'; name a copy of a study's fingerprints.txt"
        )
    if not (found := listed(path)):
        raise StoreError(f"{path} has no fingerprint: name a copy of a study's fingerprints.txt")
    return found


def _lines(path: Path) -> Iterator[tuple[int, re.Match[str] | None]]:
    try:
        text = read_regular(path).decode("utf-8-sig", "replace")
    except FileNotFoundError:
        return
    except OSError as error:
        raise cannot_read(path, error) from error
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip():
            yield number, _LINE.fullmatch(line.lower() if line.isupper() else line)
