"""Whether a study folder is what it says: every file against the journals, the dictionary, the checksums and the key.

Nothing is changed. An error is a file that cannot be trusted as it is; a warning is something to know before the
analysis, such as a session that was not finished. No sentence shows a condition.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from study_app.errors import StoreError
from study_app.protocol.model import StudyHead
from study_app.store import blinding, cells, exclusions, psychds, receipt, tables
from study_app.store.abandoned import never_begun
from study_app.store.atomic import is_there, temporaries
from study_app.store.blinding import Key
from study_app.store.columns import EXCLUSIONS, PARTICIPANTS
from study_app.store.description import described_study, describes_alike, description_bytes
from study_app.store.findings import Finding, Gathered
from study_app.store.journal import Line
from study_app.store.layout import StudyFolder
from study_app.store.leaks import certain_telltales, find_leaks
from study_app.store.open_session import Place
from study_app.store.participants import row_of
from study_app.store.verify_session import check_session, check_table

Journals: TypeAlias = list[tuple[Place, list[Line]]]


@dataclass(frozen=True, slots=True)
class Findings:
    """What `verify` found in so many sessions; ``psychds`` is what a validator of that format would say."""

    errors: tuple[Finding, ...]
    warnings: tuple[Finding, ...]
    psychds: psychds.PsychDs
    sessions: int

    @property
    def sound(self) -> bool:
        """Whether there is no error, nor one of the format's."""
        return not self.errors and not self.psychds.errors


def verify(folder: Path) -> Findings:
    """Check the study in ``folder``, all of it.

    Raises
    ------
    StoreError
        It is no study's folder.
    """
    study = StudyFolder(folder)
    name = described_study(study)
    if name is None:
        raise StoreError(
            f"{folder} is no study's folder (no {study.description.name}): name one such as results/rek2024"
        )
    found = Gathered(folder)
    key = _key(study, found)
    journals: Journals = []
    for session in study.sessions():
        place = Place(study, session, name)
        journals.append((place, check_session(place, key.hash if key else None, found)))
    _participants(study, name, journals, found)
    _description(study, found)
    _exclusions(study, journals, found)
    _reveals(study, key, found)
    _blinding(study, key, found)
    for path in (*temporaries(folder), *temporaries(study.data)):
        found.warning(path, "was left half-written by a program that was ended, or is just being written")
    return Findings(tuple(found.errors), tuple(found.warnings), psychds.validate(folder), len(journals))


def _key(study: StudyFolder, found: Gathered) -> Key | None:
    try:
        return blinding.read_key(study.path)
    except StoreError as error:
        found.failure(study.key, error)
        return None


def _participants(study: StudyFolder, name: str, journals: Journals, found: Gathered) -> None:
    """Check the table of all sessions, where each session's journal could be read."""
    if any(not lines and not never_begun(place.folder.path) for place, lines in journals):
        return
    begun = [(place, lines) for place, lines in journals if lines]
    content = tables.csv_bytes(PARTICIPANTS, [row for place, _ in begun for row in row_of(place.folder)])
    running = {number for number, (_, lines) in enumerate(begun, start=2) if lines[-1]["event"] != "session_ended"}
    check_table(study.participants(name), content, "participants", found, may_be_behind=running.__contains__)


def _description(study: StudyFolder, found: Gathered) -> None:
    """Compare the description with what this version writes for the study as one of the receipts has it."""
    heads: set[bytes] = set()
    for protocol in _published(study):
        with contextlib.suppress(KeyError, TypeError, ValueError):  # said of the receipt already
            heads.add(description_bytes(StudyHead.model_validate(protocol["study"])))
    if not heads or study.description.read_bytes() in heads:
        return
    if any(describes_alike(study.description.read_bytes(), head) for head in heads):
        found.warning(study.description, "describes the columns as an earlier version of the program did")
    else:
        found.error(study.description, "is not what this version writes for the study in the receipts")


def _published(study: StudyFolder) -> list[dict[str, Any]]:
    """Return the protocols of the receipts that can be read."""
    protocols = []
    for session in study.sessions():
        with contextlib.suppress(StoreError):  # said of the receipt already
            protocols.append(receipt.read(session.receipt).get("protocol"))
    return [protocol for protocol in protocols if isinstance(protocol, dict)]


def _exclusions(study: StudyFolder, journals: Journals, found: Gathered) -> None:
    with found.reading(study.exclusions):
        rows = exclusions.exclusions(study.path)
        if not is_there(study.exclusions):
            return
        for problem in cells.problems(exclusions.without_mark(study.exclusions.read_bytes()), EXCLUSIONS):
            found.error(study.exclusions, problem)
        trials = {
            (place.folder.participant, place.folder.number): {line.get("trial") for line in lines}
            for place, lines in journals
        }
        for row in rows:
            known = trials.get((row.participant, row.session))
            if known is None or row.trial not in known | {None}:
                found.error(study.exclusions, f"there is no {exclusions.named(row)}")


def _reveals(study: StudyFolder, key: Key | None, found: Gathered) -> None:
    with found.reading(study.reveals):
        for line in blinding.unreadable_reveals(study.path):
            found.warning(study.reveals, f"line {line} records no reveal: it was torn by a power cut, or changed")
        for number, record in enumerate(blinding.reveals(study.path), start=1):
            if lacking := [name for name in ("at", "by", "reason", "key_hash") if not record.get(name)]:
                found.error(study.reveals, f"reveal {number} lacks {', '.join(lacking)}")
            elif key is not None and record["key_hash"] != key.hash:
                found.error(study.reveals, f"reveal {number} was of another key")


def _blinding(study: StudyFolder, key: Key | None, found: Gathered) -> None:
    """Say where a condition is told before the key was revealed, but not which."""
    published = _published(study)
    if key is None or blinding.reveals(study.path) or not published:
        return
    for leak in find_leaks(study.path, certain_telltales(key.tables, published[:1])):
        found.warning(study.path, f"{leak.place} tells a condition, though the key is sealed")
