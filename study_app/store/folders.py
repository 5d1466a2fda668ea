"""Where everything lies: names and folders of a study's results, and which participant ids they can hold.

::

    results/<study>/
      dataset_description.json  exclusions.csv  exclusions_reversed.jsonl  fingerprints.txt  .psychds-ignore
      blinding/key.sealed  blinding/reveals.jsonl
      data/
        study-<study>_description-participants_data.csv
        sub-P007/ses-01/
          journal.jsonl  receipt.json  checksums.sha256
          subject-P007_session-01_task-<study>_description-responses_data.csv
          subject-P007_session-01_task-<study>_description-trials_data.csv
          recordings/trial-003.parquet  recordings/trial-003_frames.parquet  recordings/trial-003_attempt-2.parquet ...

Names follow Psych-DS: key-value pairs whose values are letters and digits only.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from study_app.errors import StoreError
from study_app.store.sessions.unstarted_sessions import abandoned

MAX_ID_LENGTH = 32
MAX_SESSION = 99
RESERVED_IDS = ("pilot", "test")
REBUILT = "rebuilt.txt"
FINGERPRINTS = "fingerprints.txt"

_ID = re.compile(r"[A-Za-z0-9]+")
_NUMBERED = re.compile(r"P([0-9]+)")
_SESSION_FOLDER = re.compile(r"ses-([0-9]{2})")


@dataclass(frozen=True, slots=True)
class SessionFolder:
    """One participant's one session."""

    path: Path
    participant: str
    number: int

    @property
    def journal(self) -> Path:
        """What happened, line by line."""
        return self.path / "journal.jsonl"

    @property
    def receipt(self) -> Path:
        """What ran: protocol, seed, versions, device, hashes."""
        return self.path / "receipt.json"

    @property
    def checksums(self) -> Path:
        """SHA-256 of every file, when the session had ended."""
        return self.path / "checksums.sha256"

    @property
    def rebuilt(self) -> Path:
        """When and why checksums or fingerprint were made again after the session had ended."""
        return self.path / REBUILT

    @property
    def crash(self) -> Path:
        """Where the program stood when it crashed; there while the session runs, and after a crash."""
        return self.path / "crash.txt"

    @property
    def recordings(self) -> Path:
        """Samples and frames of the trials."""
        return self.path / "recordings"

    def table(self, study: str, name: str) -> Path:
        """Return the file of table ``name`` (responses or trials)."""
        return self.path / (
            f"subject-{self.participant}_session-{self.number:02d}_task-{study}_description-{name}_data.csv"
        )


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """The results of one study."""

    path: Path

    @property
    def description(self) -> Path:
        """The Psych-DS description of every column."""
        return self.path / "dataset_description.json"

    @property
    def ignore(self) -> Path:
        """What a validator of Psych-DS need not look at."""
        return self.path / ".psychds-ignore"

    @property
    def exclusions(self) -> Path:
        """What is left out of the analysis, by whom and why."""
        return self.path / "exclusions.csv"

    @property
    def reversed_exclusions(self) -> Path:
        """The exclusions that were taken back, by whom and why."""
        return self.path / "exclusions_reversed.jsonl"

    @property
    def fingerprints(self) -> Path:
        """A line for every session that ended: what tells it from any other."""
        return self.path / FINGERPRINTS

    @property
    def blinding(self) -> Path:
        """The folder of key and reveals."""
        return self.path / "blinding"

    @property
    def key(self) -> Path:
        """The sealed key: which code stands for which condition."""
        return self.blinding / "key.sealed"

    @property
    def reveals(self) -> Path:
        """Who opened the key, when and why."""
        return self.blinding / "reveals.jsonl"

    @property
    def data(self) -> Path:
        """The folder of all tables."""
        return self.path / "data"

    def participants(self, study: str) -> Path:
        """Return the table of all sessions."""
        return self.data / f"study-{study}_description-participants_data.csv"

    def session(self, participant: str, number: int) -> SessionFolder:
        """Return where that session lies or would lie."""
        return SessionFolder(self.data / f"sub-{participant}" / f"ses-{number:02d}", participant, number)

    def sessions(self) -> tuple[SessionFolder, ...]:
        """Return the sessions that were begun, by participant and number."""
        found = [
            SessionFolder(path, path.parent.name.removeprefix("sub-"), int(match[1]))
            for path in self.data.glob("sub-*/ses-*")
            if (match := _SESSION_FOLDER.fullmatch(path.name))
        ]
        return tuple(sorted(found, key=lambda session: (session.participant, session.number)))

    def ids(self) -> tuple[str, ...]:
        """Return the participant ids that were used, sorted."""
        return tuple(sorted({session.participant for session in self.sessions()}))


def locate(path: Path) -> tuple[StudyFolder, SessionFolder]:
    """Return the study and the session whose folder ``path`` is.

    Raises
    ------
    StoreError
        It is no session's folder.
    """
    folder = path.resolve()
    number = _SESSION_FOLDER.fullmatch(folder.name)
    participant = folder.parent.name.removeprefix("sub-")
    named = number is not None and folder.parent.name.startswith("sub-") and _ID.fullmatch(participant)
    if not named or folder.parent.parent.name != "data" or not folder.is_dir():
        raise StoreError(f"{path} is no session's folder: name one such as results/rek2024/data/sub-P007/ses-01")
    return StudyFolder(folder.parents[2]), SessionFolder(folder, participant, int(number[1]) if number else 0)


def study_folder(results: Path, study: str, *, pilot: bool = False) -> StudyFolder:
    """Return the folder of ``study`` under ``results``; pilot sessions have one of their own."""
    return StudyFolder(results / (f"{study}-pilot" if pilot else study))


def rehearsal_folder(results: Path, study: str) -> Path:
    """Return a folder for a rehearsal that does not exist yet, apart from every participant's data."""
    number = 1
    while (folder := results / f"{study}-rehearsal-{number}").exists():
        number += 1
    return folder


def check_participant(participant: str, *, pilot: bool = False) -> None:
    """Refuse an id that file names or analysts cannot take.

    Raises
    ------
    StoreError
        Names the id and what is permitted.
    """
    if not _ID.fullmatch(participant) or len(participant) > MAX_ID_LENGTH:
        raise StoreError(
            f"participant id {participant!r} cannot be used: only letters A-Z, a-z and digits 0-9 are permitted, "
            f"at most {MAX_ID_LENGTH}, no dash, space or underscore; for example P007"
        )
    if not pilot and participant.lower() in RESERVED_IDS:
        raise StoreError(
            f"participant id {participant!r} is kept for pilot sessions, so that no trial run lands among the data: "
            "use an id such as P007"
        )


@dataclass(frozen=True, slots=True)
class UsedIds:
    """The sessions of a study's folder as they were when it was read: ids and numbers are checked without the disk.

    ``held`` are participant and number of the sessions that were begun, or are claimed by a program that runs; ``ids``
    the ids of all folders.
    """

    path: Path
    held: frozenset[tuple[str, int]]
    ids: tuple[str, ...]

    def numbers(self, participant: str) -> tuple[int, ...]:
        """Return the numbers of a participant's sessions."""
        return tuple(sorted(number for one, number in self.held if one == participant))

    def suggested(self) -> str:
        """Return the next free id: P001, P002 ...; those of sessions that were never begun are free again."""
        matches = (_NUMBERED.fullmatch(participant.upper()) for participant, _ in self.held)
        return f"P{max((int(match[1]) for match in matches if match), default=0) + 1:03d}"

    def check_unused(self, participant: str, number: int) -> None:
        """Refuse a session that exists, or an id that differs from a used one in nothing but capitals.

        A session that was claimed by a program that is gone, and never begun, can be begun.

        Raises
        ------
        StoreError
            Names the three ways to go on.
        """
        if not 1 <= number <= MAX_SESSION:
            raise StoreError(f"session number {number} cannot be used: it must be from 1 to {MAX_SESSION}")
        for used in self.ids:
            if used != participant and used.lower() == participant.lower():
                raise StoreError(
                    f"participant id {participant!r} differs from the used {used!r} in capitals alone: use {used!r} "
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
    return UsedIds(folder.path, held, tuple(sorted({one.participant for one in sessions})))


def check_unused(folder: StudyFolder, participant: str, number: int) -> None:
    """Refuse a session that exists (see `UsedIds.check_unused`); nothing is touched."""
    used_ids(folder).check_unused(participant, number)


def refuse_never_begun(session: SessionFolder) -> None:
    """Refuse to go on with a session that was claimed and never begun.

    Raises
    ------
    StoreError
        Says how it is begun.
    """
    if abandoned(session.path):
        raise StoreError(
            f"{session.path} was claimed, and its program was ended before the session began, so that nothing can go "
            f"on: begin it as a new session of participant {session.participant}, number {session.number} (run)"
        )


def used_id(folder: StudyFolder, participant: str, number: int) -> StoreError:
    """Return the refusal of a used id, with the three ways to go on."""
    return used_ids(folder).refusal(participant, number)


def suggest_id(folder: StudyFolder) -> str:
    """Return the next free id (see `UsedIds.suggested`)."""
    return used_ids(folder).suggested()
