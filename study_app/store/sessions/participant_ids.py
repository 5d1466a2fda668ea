"""Participant IDs: which are valid, which are used, and the next one."""

import re
from dataclasses import dataclass
from pathlib import Path

from study_app.errors import StoreError
from study_app.store.folders import ID_PATTERN, SessionFolder, StudyFolder
from study_app.store.sessions.unstarted_sessions import abandoned
from study_app.store.withdrawals.tombstones import tombstones

MAX_ID_LENGTH = 32
MAX_SESSION = 99
RESERVED_IDS = ("pilot", "test")
_NUMBERED = re.compile(r"P([0-9]+)")


def check_participant(participant: str, *, pilot: bool = False) -> None:
    """Reject an id that is unsuitable for file names or analyses.

    Raises
    ------
    StoreError
        Names the id and what is permitted.
    """
    if not ID_PATTERN.fullmatch(participant) or len(participant) > MAX_ID_LENGTH:
        raise StoreError(
            f"participant id {participant!r} cannot be used: only letters A-Z, a-z and digits 0-9 are permitted, "
            f"at most {MAX_ID_LENGTH}, no dash, space or underscore; for example P007"
        )
    if not pilot and participant.lower() in RESERVED_IDS:
        raise StoreError(
            f"participant id {participant!r} is reserved for pilot sessions, which are stored separately: use an id "
            "such as P007"
        )


@dataclass(frozen=True, slots=True)
class UsedIds:
    """The sessions of a study's folder as they were when it was read: ids and numbers are checked without the disk.

    ``held`` are participant and number of the sessions that were begun, or are claimed by a program that runs; ``ids``
    the ids of all folders; ``withdrawn`` are those of participants whose data were erased.
    """

    path: Path
    held: frozenset[tuple[str, int]]
    ids: tuple[str, ...]
    withdrawn: tuple[str, ...] = ()

    def numbers(self, participant: str) -> tuple[int, ...]:
        """Return the numbers of a participant's sessions."""
        return tuple(sorted(number for one, number in self.held if one == participant))

    def suggested(self) -> str:
        """Return the next free id: P001, P002 ...; those of sessions that were never begun are free again."""
        used = (*(participant for participant, _ in self.held), *self.withdrawn)
        matches = (_NUMBERED.fullmatch(participant.upper()) for participant in used)
        return f"P{max((int(match[1]) for match in matches if match), default=0) + 1:03d}"

    def check_unused(self, participant: str, number: int) -> None:
        """Reject a session that exists, or an id that differs from a used one only in capitals.

        A session that was claimed by an ended program, and never begun, can be begun.

        Raises
        ------
        StoreError
            Names the three ways to go on.
        """
        if not 1 <= number <= MAX_SESSION:
            raise StoreError(f"session number {number} cannot be used: it must be from 1 to {MAX_SESSION}")
        if participant.lower() in (used.lower() for used in self.withdrawn):
            raise StoreError(
                f"participant {participant} withdrew, so the id is not used again: use another id (next free: "
                f"{self.suggested()})"
            )
        for used in self.ids:
            if used != participant and used.lower() == participant.lower():
                raise StoreError(
                    f"participant id {participant!r} differs from the used {used!r} only in capitalisation: use "
                    f"{used!r} "
                    "with a new session number, or another id"
                )
        if (participant, number) in self.held:
            raise self.refusal(participant, number)

    def refusal(self, participant: str, number: int) -> StoreError:
        """Return the refusal of a used id, with the three ways to go on."""
        free = max(self.numbers(participant), default=number)
        return StoreError(
            f"participant {participant} already has session {number} in {self.path}: use a new session number "
            f"({free + 1}), resume that session, or use another id (next free: {self.suggested()}); nothing was changed"
        )


def used_ids(folder: StudyFolder) -> UsedIds:
    """Return which ids and session numbers of a study are used; nothing is touched."""
    sessions = folder.sessions()
    held = frozenset((one.participant, one.number) for one in sessions if not abandoned(one.path))
    return UsedIds(folder.path, held, tuple(sorted({one.participant for one in sessions})), tuple(tombstones(folder)))


def check_unused(folder: StudyFolder, participant: str, number: int) -> None:
    """Refuse a session that exists (see `UsedIds.check_unused`); nothing is touched."""
    used_ids(folder).check_unused(participant, number)


def refuse_never_begun(session: SessionFolder) -> None:
    """Refuse to resume a session that was claimed and never begun.

    Raises
    ------
    StoreError
        Says how it is begun.
    """
    if abandoned(session.path):
        raise StoreError(
            f"{session.path} was created, but the program ended before the session began, so it cannot be resumed: "
            f"begin a new session of participant {session.participant}, number {session.number} (run)"
        )


def used_id(folder: StudyFolder, participant: str, number: int) -> StoreError:
    """Return the refusal of a used id, with the three ways to go on."""
    return used_ids(folder).refusal(participant, number)
