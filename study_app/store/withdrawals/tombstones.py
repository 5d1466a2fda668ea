"""``withdrawals.jsonl``: a tombstone for each participant whose data were erased, and nothing that this person gave."""

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from study_app.errors import StoreError
from study_app.store.atomic import append_line, cannot_read, open_regular, read_regular
from study_app.store.checksums import read_checksums, sha256
from study_app.store.folders import ID_PATTERN, SessionFolder, StudyFolder
from study_app.store.journals.journal_events import holds
from study_app.store.journals.parsing import parse_json
from study_app.store.verification.fingerprints import fingerprint


@dataclass(frozen=True, slots=True)
class ErasedSession:
    """What proves which session was erased.

    Attributes
    ----------
    session : int
        Its number.
    begun : str
        SHA-256 of the journal's first line: the same in every copy of the session; empty where it has none.
    checksums : str
        SHA-256 of its ``checksums.sha256``; empty where it has none.
    fingerprint : str
        Its line in ``fingerprints.txt``; empty where it had not ended.
    """

    session: int
    begun: str
    checksums: str
    fingerprint: str


@dataclass(frozen=True, slots=True)
class Tombstone:
    """One withdrawal; a line of ``withdrawals.jsonl``. ``at`` is when the data were erased from that folder."""

    participant: str
    at: str
    by: str
    reason: str
    sessions: tuple[ErasedSession, ...]


def describe_session(session: SessionFolder) -> ErasedSession:
    """Return what proves which session this is, as far as its files can be read."""
    try:
        with open_regular(session.journal) as file:
            first = file.readline()
        begun = hashlib.sha256(first).hexdigest() if first.endswith(b"\n") else ""
    except OSError:
        begun = ""
    try:
        proof, checksums = fingerprint(read_checksums(session)), sha256(session.checksums)
    except StoreError:
        proof = checksums = ""
    return ErasedSession(session.number, begun, checksums, proof)


def bury(study: StudyFolder, tombstone: Tombstone) -> None:
    """Add a tombstone to the study's list.

    Raises
    ------
    StoreError
        The list cannot be written.
    """
    append_line(study.withdrawals, json.dumps(asdict(tombstone), ensure_ascii=False).encode() + b"\n")


def tombstones(study: StudyFolder) -> dict[str, Tombstone]:
    """Return the withdrawals of a study by participant, in the order in which they were made.

    Raises
    ------
    StoreError
        The list cannot be read, or a line of it is not a withdrawal.
    """
    try:
        content = read_regular(study.withdrawals)
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except OSError as error:
        raise cannot_read(study.withdrawals, error) from error
    found: dict[str, Tombstone] = {}
    for number, line in enumerate(content.splitlines(), start=1):
        if line.strip():
            tombstone = _tombstone(study.withdrawals, number, line)
            found[tombstone.participant] = tombstone
    return found


def _tombstone(path: Path, number: int, line: bytes) -> Tombstone:
    try:
        held: dict[str, Any] = parse_json(line)
        sessions = tuple(ErasedSession(**one) for one in held.pop("sessions"))
        made = Tombstone(**held, sessions=sessions)
        proofs = (text for one in sessions for text in (one.begun, one.checksums, one.fingerprint))
        texts = (made.participant, made.by, made.reason, *proofs)
        typed = all(isinstance(text, str) for text in texts) and all(isinstance(one.session, int) for one in sessions)
        if typed and holds("at", made.at) and ID_PATTERN.fullmatch(made.participant):
            return made
    except (ValueError, KeyError, TypeError, AttributeError):
        pass
    raise StoreError(
        f"{path}, line {number} is not a withdrawal: restore it from a copy; if it is an incomplete last line, "
        "remove it and withdraw again"
    )
