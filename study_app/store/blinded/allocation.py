"""The allocation of participants to groups: once per participant, and sealed until the study is unblinded.

The participants of a folder have entries 1, 2 … in the order in which their first sessions began. An entry is claimed
by creating ``blinding/allocated/NNN.json`` exclusively, so that two programs get different entries; it is never
assigned again. The file has the entry, the participant, and, sealed, the group, which follows from entry and secret
(`protocol.streams`).
"""

import json
from dataclasses import dataclass, field
from pathlib import Path

from study_app.errors import StoreError
from study_app.protocol.groups import refuse_beyond_last
from study_app.protocol.model import Protocol
from study_app.protocol.orders.durations import own_protocol
from study_app.protocol.streams import group_of
from study_app.store.atomic import (
    cannot_write,
    is_there,
    open_regular,
    parse_json,
    read_own,
    sync_folder,
    write_through,
)
from study_app.store.blinded.blinding import Key, read_key
from study_app.store.blinded.sealing import open_text, seal
from study_app.store.folders import StudyFolder


@dataclass(frozen=True, slots=True)
class Allocation:
    """A participant's entry and group; ``sealed`` is the group as stored in journal and file."""

    entry: int
    group: str = field(repr=False)
    sealed: str


@dataclass(frozen=True, slots=True)
class Claim:
    """The content of an entry's file; ``participant`` is empty if the program ended before it was written."""

    path: Path
    entry: int
    participant: str
    sealed: str


def allocate(study: StudyFolder, key: Key, participant: str, *, waits: bool = True) -> Allocation | None:
    """Return the allocation of a participant; claim the next entry for a new one. None in a study without groups."""
    if not key.groups:
        return None
    if (known := allocated(study, key, participant)) is not None:
        return known
    folder = study.allocated
    entry = max([*(claim.entry for claim in claims(study)), *entries_begun(study).values()], default=0)
    try:
        folder.mkdir(exist_ok=True)
        while True:
            entry += 1
            allocation = _allocation(key, entry, participant)
            held = {"entry": entry, "participant": participant, "sealed": allocation.sealed}
            try:
                write_through(study.allocation(entry), json.dumps(held).encode() + b"\n", waits=waits)
            except FileExistsError:  # another program was first
                continue
            if waits:
                sync_folder(folder)
            return allocation
    except OSError as error:
        raise cannot_write(folder, error) from error


def allocated(study: StudyFolder, key: Key, participant: str) -> Allocation | None:
    """Return the allocation of a participant, None where there is none yet."""
    for claim in claims(study):
        if claim.participant != participant:
            continue
        found = _allocation(key, claim.entry, participant)
        if group_in(claim, key) != found.group:
            raise StoreError(f"{claim.path} was changed: restore it from a copy")
        return found
    if (entry := entries_begun(study).get(participant)) is not None:
        raise StoreError(
            f"{study.allocation(entry)} is missing, though participant {participant} has entry {entry}: restore it "
            "from a copy"
        )
    return None


def check_session(study: StudyFolder, protocol: Protocol, participant: str, session: int) -> None:
    """Reject a session that the participant does not have, as far as known; nothing is claimed.

    Raises
    ------
    StudyError
        No participant has it, or this one's group has fewer sessions; or the study's key cannot be read.
    """
    refuse_beyond_last(protocol, session)
    if protocol.groups and is_there(study.key):
        known = allocated(study, read_key(study.path), participant)
        if known is not None:
            own_protocol(protocol, known.group, session)


def session_protocol(study: StudyFolder, protocol: Protocol, participant: str, session: int) -> Protocol:
    """Return the protocol of a participant's session, whose group was allocated; nothing is claimed.

    Raises
    ------
    StudyError
        The participant has no entry, or fewer sessions; or the study's key cannot be read.
    """
    if not protocol.groups:
        return own_protocol(protocol, None, session)
    allocation = allocated(study, read_key(study.path), participant)
    if allocation is None:
        raise StoreError(f"participant {participant} has no entry in {study.allocated}: restore it from a copy")
    return own_protocol(protocol, allocation.group, session)


def claims(study: StudyFolder) -> list[Claim]:
    """Return the contents of all entries' files, in order."""
    paths = [path for path in study.allocated.glob("*.json") if path.stem.isdecimal()]
    return [_claim(study, path) for path in sorted(paths, key=lambda path: int(path.stem))]


def group_in(claim: Claim, key: Key) -> str | None:
    """Return the group sealed in an entry's file; None if the file was changed."""
    opened = open_text(_whose(claim.entry, claim.participant), claim.sealed, key.nonce, frozenset({"group"}))
    return None if opened is None else opened.get("group")


def entries_begun(study: StudyFolder) -> dict[str, int]:
    """Return the entry of each participant with a session, as the first lines of the journals have it."""
    found: dict[str, int] = {}
    for session in study.sessions():
        try:
            with open_regular(session.journal) as file:
                start = parse_json(file.readline())
        except (OSError, ValueError):  # not begun, or damaged: `verify` reports it
            continue
        if isinstance(start, dict) and isinstance(start.get("entry"), int):
            found[session.participant] = start["entry"]
    return found


def _claim(study: StudyFolder, path: Path) -> Claim:
    """Return the content of an entry's file; nothing if it is damaged."""
    entry = int(path.stem)
    try:
        held = parse_json(read_own(path, study.path))
        if held["entry"] == entry and isinstance(held["participant"], str) and isinstance(held["sealed"], str):
            return Claim(path, entry, held["participant"], held["sealed"])
    except (StoreError, ValueError, KeyError, TypeError):
        pass
    return Claim(path, entry, "", "")


def _allocation(key: Key, entry: int, participant: str) -> Allocation:
    group = group_of(key.groups, key.nonce, entry)
    return Allocation(entry, group, seal(_whose(entry, participant), {"group": group}, key.nonce))


def _whose(entry: int, participant: str) -> list[object]:
    return ["allocated", entry, participant]
