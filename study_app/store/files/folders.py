"""Names and folders of a study's results, and the permitted participant ids.

::

    results/<study>/
      dataset_description.json  exclusions.csv  exclusions_reversed.jsonl  fingerprints.txt  withdrawals.jsonl
      .psychds-ignore
      blinding/key.sealed  blinding/reveals.jsonl  blinding/allocated/001.json ...
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
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from study_app.errors import StoreError
from study_app.protocol.source import unprintable_character

ReportProgress: TypeAlias = Callable[[str, float], object]
"""Callback with the current step and the fraction done."""
REBUILT = "rebuilt.txt"
FINGERPRINTS = "fingerprints.txt"
PREREGISTRATION = "preregistration.md"

ID_PATTERN = re.compile(r"[A-Za-z0-9]+")
PARTICIPANT_ID = re.compile(r"[A-Za-z0-9]{1,32}")
STUDY_NAME = re.compile(r"[a-z][a-z0-9]{0,39}")  # as in a protocol
RECORDING_NAME = re.compile(r"recordings/trial-[0-9]{3,}(_attempt-[0-9]+)?(_interval-[0-9]+)?(_frames)?\.parquet")
_SESSION_FOLDER = re.compile(r"ses-([0-9]{2})")


class _FixedPath:
    """Descriptor of a file or folder with a fixed name in its owner's folder ``path``."""

    def __init__(self, *names: str) -> None:
        self._names = names

    def __get__(self, owner: SessionFolder | StudyFolder, kind: type | None = None) -> Path:
        return owner.path.joinpath(*self._names)


@dataclass(frozen=True, slots=True)
class SessionFolder:
    """The folder of one session of one participant."""

    path: Path
    participant: str
    number: int

    journal = _FixedPath("journal.jsonl")
    """The journal: one line per event."""
    receipt = _FixedPath("receipt.json")
    """The receipt: protocol, seed, versions, device, hashes."""
    checksums = _FixedPath("checksums.sha256")
    """SHA-256 of every file at the session's end."""
    rebuilt = _FixedPath(REBUILT)
    """When and why checksums or fingerprint were made again after the session had ended."""
    crash = _FixedPath("crash.txt")
    """The stack trace of a crash; it exists while the session runs and after a crash."""
    recordings = _FixedPath("recordings")
    """Samples and frames of the trials."""

    def table(self, study: str, name: str) -> Path:
        """Return the file of table ``name`` (responses or trials)."""
        return self.path / (
            f"subject-{self.participant}_session-{self.number:02d}_task-{study}_description-{name}_data.csv"
        )


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """The results folder of one study."""

    path: Path

    description = _FixedPath("dataset_description.json")
    """The Psych-DS description of every column."""
    ignore = _FixedPath(".psychds-ignore")
    """Paths that validators of Psych-DS ignore."""
    exclusions = _FixedPath("exclusions.csv")
    """Exclusions from the analysis, with who decided and the reason."""
    reversed_exclusions = _FixedPath("exclusions_reversed.jsonl")
    """Reversed exclusions, with who decided and the reason."""
    fingerprints = _FixedPath(FINGERPRINTS)
    """The fingerprint of every session that ended."""
    withdrawals = _FixedPath("withdrawals.jsonl")
    """A record for each participant whose data were erased."""
    preregistration = _FixedPath(PREREGISTRATION)
    """The plan of the study, if it was preregistered."""
    blinding = _FixedPath("blinding")
    """The folder of key and reveals."""
    key = _FixedPath("blinding", "key.sealed")
    """The sealed key: which code stands for which condition."""
    allocated = _FixedPath("blinding", "allocated")
    """The folder of the participants' entries in the allocation to groups."""

    def allocation(self, entry: int, group: str | None = None, replacement: str | None = None) -> Path:
        """Return the file of an entry in the allocation or a pre-existing ``group``; ``replacement`` is an ID."""
        parts = (group, f"{entry:03d}", replacement)
        return self.allocated / f"{'-'.join(part for part in parts if part is not None)}.json"

    reveals = _FixedPath("blinding", "reveals.jsonl")
    """Who opened the key, when and why."""
    data = _FixedPath("data")
    """The folder of all tables."""

    def participants(self, study: str) -> Path:
        """Return the table of all sessions."""
        return self.data / f"study-{study}_description-participants_data.csv"

    def session(self, participant: str, number: int) -> SessionFolder:
        """Return the folder of a session, which need not exist."""
        return SessionFolder(self.data / f"sub-{participant}" / f"ses-{number:02d}", participant, number)

    def sessions(self) -> tuple[SessionFolder, ...]:
        """Return the session folders by participant and number, without folders of other names, such as copies."""
        try:
            paths = list(self.data.glob("sub-*/ses-*"))
        except FileNotFoundError:  # a participant was withdrawn in the meantime
            return self.sessions()
        sessions = [
            SessionFolder(path, participant, int(match[1]))
            for path in paths
            if (match := _SESSION_FOLDER.fullmatch(path.name))
            and PARTICIPANT_ID.fullmatch(participant := path.parent.name.removeprefix("sub-"))
        ]
        return tuple(sorted(sessions, key=lambda session: (session.participant, session.number)))

    def ids(self) -> tuple[str, ...]:
        """Return the participant ids that were used, sorted."""
        return tuple(sorted({session.participant for session in self.sessions()}))


def check_study_name(name: object) -> str:
    """Return ``name`` if it is permitted as a study's name.

    Raises
    ------
    ValueError
        The name is invalid for a study and its files.
    """
    if not isinstance(name, str) or not STUDY_NAME.fullmatch(name):
        raise ValueError("a study with this name does not exist")
    return name


def locate_session(path: Path) -> tuple[StudyFolder, SessionFolder]:
    """Return the study folder and session folder of the session in ``path``.

    Raises
    ------
    StoreError
        The path is not in a session folder.
    """
    folder = path.resolve()
    number = _SESSION_FOLDER.fullmatch(folder.name)
    participant = folder.parent.name.removeprefix("sub-")
    is_session = number is not None and folder.parent.name.startswith("sub-") and ID_PATTERN.fullmatch(participant)
    if not is_session or folder.parent.parent.name != "data" or not folder.is_dir():
        raise StoreError(
            f"{path} is not a session folder: specify one such as results/rek2024/data/sub-P007/ses-01, or a name that "
            "liquid-study sessions lists"
        )
    return StudyFolder(folder.parents[2]), SessionFolder(folder, participant, int(number[1]) if number else 0)


def study_folder(results: Path, study: str, *, pilot: bool = False) -> StudyFolder:
    """Return the folder of ``study`` under ``results``; pilot sessions have their own."""
    return StudyFolder(results / (f"{study}-pilot" if pilot else study))


def rehearsal_folder(results: Path, study: str) -> Path:
    """Return a new path for the folder of a rehearsal, separate from participants' data."""
    return _unused_folder(results, f"{study}-rehearsal")


def kept_pilot_folder(results: Path, study: str) -> Path:
    """Return a new path for the folder of a stored pilot; each pilot has its own key and therefore its own folder."""
    return _unused_folder(results, f"{study}-pilot")


def _unused_folder(results: Path, name: str) -> Path:
    """Return the first of NAME-1, NAME-2 … that does not exist."""
    number = 1
    while (folder := results / f"{name}-{number}").exists():
        number += 1
    return folder


def check_name_and_reason(by: str, reason: str, purpose: str) -> tuple[str, str]:
    """Return a person's name and a reason as stored with the data, with single spaces.

    Raises
    ------
    StoreError
        Name or reason is empty (``purpose`` states why they are required) or contains unprintable characters.
    """
    for name, text in (("by", by), ("reason", reason)):
        if not text.strip():
            raise StoreError(f"--{name} is empty: {purpose}")
        if (letter := unprintable_character(text, "\t\n\r")) is not None:
            raise StoreError(f"--{name} contains the character U+{ord(letter):04X}, which cannot be printed: remove it")
    return " ".join(by.split()), " ".join(reason.split())
