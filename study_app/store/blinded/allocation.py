"""Groups of participants: assigned at random and sealed until the study is unblinded, or pre-existing and recorded.

Each participant has an entry, claimed by creating a file in ``blinding/allocated`` exclusively, so that two programs
get different entries. Only a participant who replaces the first one can get the same entry.

- **Randomised** (``NNN.json``): entries 1, 2 … in the order in which first sessions began. The group follows from entry
  and secret (`protocol.randomization.streams`); the file holds it sealed.
- **Pre-existing** (``GROUP-NNN.json``): entries 1, 2 … of each group, whose name is in the file and in journals.
- **Replacements** (``…NNN-PARTICIPANT.json``) take over the entry, and so the group and the place in it, of the
  participant whom they replace.

The place in the group assigns rows of squares. Folders that an earlier version began have entries without
``place_in_group``: there the number in the participant's id still assigns the rows, and a replacement has an entry of
its own.
"""

import json
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple

from study_app.errors import StoreError, StudyError
from study_app.protocol.model import Protocol
from study_app.protocol.participants import next_group
from study_app.protocol.randomization import enrolment_number, group_of
from study_app.store.blinded.blinding import Key, read_key
from study_app.store.blinded.sealing import open_text, seal_values
from study_app.store.files.atomic import (
    cannot_write,
    is_there,
    open_regular,
    parse_json,
    read_own,
    sync_folder,
    write_new_file,
)
from study_app.store.files.folders import StudyFolder

_STEM: Final = re.compile(r"(?:[a-z0-9_]+-)?[0-9]{3,}(?:-[A-Za-z0-9]+)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Allocation:
    """A participant's entry and group; ``sealed`` is the group as stored in journal and file, "" if pre-existing.

    ``replaces`` is the participant whose entry it was; ``place_in_group`` tells whether the place in the group assigns
    rows of squares.
    """

    entry: int
    group: str = field(repr=False)
    sealed: str
    replaces: str | None
    place_in_group: bool

    @property
    def is_preexisting(self) -> bool:
        """Whether the group is pre-existing, and therefore recorded in plain text."""
        return not self.sealed


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """The content of an entry's file; ``participant`` is empty if the program ended before it was written.

    ``group`` is a pre-existing group, otherwise None.
    """

    path: Path
    entry: int = 0
    participant: str = ""
    sealed: str = ""
    group: str | None = None
    replaces: str | None = None
    place_in_group: bool = False


class RecordedEntry(NamedTuple):
    """A participant's entry, pre-existing group and replaced participant, as in the first line of a journal."""

    entry: int
    group: str | None
    replaces: str | None


class Entries:
    """The entries of a study's folder, read once: reading them for each new participant would be quadratic."""

    def __init__(self, study: StudyFolder) -> None:
        self._study = study
        held = claims(study)
        self.counts_places = _places_assign_rows(held)
        self._by_participant: dict[str, Claim] = {}
        self._last: dict[str | None, int] = {}
        for claim in held:
            self.add(claim)

    @cached_property
    def recorded(self) -> dict[str, RecordedEntry]:
        """The entries in the journals, read on first use."""
        return recorded_entries(self._study)

    @cached_property
    def _last_recorded(self) -> int:
        return max((recorded.entry for recorded in self.recorded.values()), default=0)

    def add(self, claim: Claim) -> None:
        """Add a claim."""
        self._by_participant.setdefault(claim.participant, claim)
        self._last[claim.group] = max(claim.entry, self._last.get(claim.group, 0))

    def claim_of(self, participant: str | None) -> Claim | None:
        """Return the claim of a participant."""
        return self._by_participant.get(participant) if participant else None

    def last_entry(self, group: str | None) -> int:
        """Return the last entry of a pre-existing ``group``, or of the whole study if None; 0 if there is none.

        Only the last entry of the whole study includes the entries in journals.
        """
        if group is not None:
            return self._last.get(group, 0)
        return max(self._last_recorded, *self._last.values(), 0)


def allocate(
    study: StudyFolder,
    key: Key,
    participant: str,
    *,
    group: str | None = None,
    row_of: str | None = None,
    waits: bool = True,
    entries: Entries | None = None,
) -> Allocation | None:
    """Return the allocation of a participant, claiming an entry if there is none yet; None in a study without groups.

    ``group`` is a new participant's pre-existing group, ``row_of`` the participant who is replaced; both were checked
    (`check_choice`). A new claim is added to ``entries``, the entries read before.
    """
    if not key.groups and group is None and not is_there(study.allocated):
        return None
    entries = Entries(study) if entries is None else entries
    if (known := allocation_of(study, key, participant, entries)) is not None:
        return known
    replaced = entries.claim_of(row_of) if entries.counts_places else None
    group = None if key.groups else group
    entry = entries.last_entry(group) if replaced is None else replaced.entry - 1
    try:
        study.allocated.mkdir(exist_ok=True)
        while True:
            entry += 1
            path = study.allocation(entry, group, participant if replaced is not None else None)
            claim = Claim(
                path=path,
                entry=entry,
                participant=participant,
                sealed="" if group is not None else _seal_group(key, entry, participant),
                group=group,
                replaces=None if replaced is None else replaced.participant,
                place_in_group=entries.counts_places,
            )
            try:
                write_new_file(path, json.dumps(_claim_content(claim)).encode() + b"\n", waits=waits)
            except FileExistsError:  # another program claimed this entry first
                if replaced is not None:
                    raise StoreError(f"{path} has been changed: restore it from a backup") from None
                continue
            if waits:
                sync_folder(study.allocated)
            entries.add(claim)
            return _allocation(claim, key)
    except OSError as error:
        raise cannot_write(study.allocated, error) from error


def allocation_of(study: StudyFolder, key: Key, participant: str, entries: Entries | None = None) -> Allocation | None:
    """Return the allocation of a participant, or None if there is none yet."""
    entries = Entries(study) if entries is None else entries
    if (claim := entries.claim_of(participant)) is not None:
        if not is_unchanged(claim, key):
            raise StoreError(f"{claim.path} has been changed: restore it from a backup")
        return _allocation(claim, key)
    if (entry := entries.recorded.get(participant)) is not None:
        path = study.allocation(entry.entry, entry.group, None if entry.replaces is None else participant)
        raise StoreError(
            f"{path} is missing, although participant {participant} has entry {entry.entry}: restore it from a backup"
        )
    return None


def check_session(
    study: StudyFolder,
    protocol: Protocol,
    participant: str,
    session: int,
    *,
    group: str | None = None,
    row_of: str | None = None,
) -> None:
    """Reject a session that the participant cannot have; nothing is claimed.

    Raises
    ------
    StudyError
        No participant has this session, or the group has fewer; group or replaced participant are rejected
        (`check_choice`); or the study's key cannot be read.
    """
    protocol.check_session_number(session)
    check_choice(protocol, claims(study), participant, group=group, row_of=row_of)
    if protocol.groups and is_there(study.key):
        known = allocation_of(study, read_key(study.path), participant)
        group = group if known is None else known.group
    if group is not None:
        protocol.for_session(group, session)


def check_choice(
    protocol: Protocol, held: Sequence[Claim], participant: str, *, group: str | None, row_of: str | None
) -> None:
    """Raise StudyError if the group or replaced participant contradicts the protocol or the ``held`` claims."""
    name, own_claim = protocol.study.name, _claim_of(held, participant)
    if group is not None and not protocol.asks_group:
        why = "assigns participants to its groups at random" if protocol.groups else "does not have groups"
        raise StudyError(f"group {group!r}: {name} {why}; omit the group")
    permitted = ", ".join(protocol.groups)
    if protocol.asks_group and group is None and own_claim is None:
        raise StudyError(
            f"the group is missing: {name} has pre-existing groups; specify the group of {participant} with --group: "
            f"{permitted}"
        )
    if group is not None and group not in protocol.groups:
        raise StudyError(f"group {group!r}: {name} does not have this group; permitted: {permitted}")
    if protocol.asks_group and own_claim is not None and own_claim.group not in protocol.groups:
        raise StudyError(
            f"participant {participant} is recorded in group {own_claim.group}, which no longer exists in {name}"
        )
    if own_claim is not None and group not in (None, own_claim.group):
        raise StudyError(
            f"participant {participant} is recorded in group {own_claim.group}, not {group}; specify {own_claim.group}"
        )
    if row_of is not None and protocol.groups:
        _check_replaced(held, participant, own_claim, group=group, row_of=row_of)


def _check_replaced(
    held: Sequence[Claim], participant: str, own_claim: Claim | None, *, group: str | None, row_of: str
) -> None:
    replaced = _claim_of(held, row_of)
    if not _places_assign_rows(held):
        if enrolment_number(row_of) is None:
            raise StudyError(
                f"participant {row_of!r} cannot be replaced: this folder is from an earlier version, which assigns "
                "rows by the number in the ID; specify an ID with a number, such as P007"
            )
    elif own_claim is not None:
        if own_claim.replaces != row_of:
            now = "nobody" if own_claim.replaces is None else own_claim.replaces
            raise StudyError(f"{row_of!r} cannot be replaced: {participant} is recorded as replacing {now}")
    elif replaced is None:
        raise StudyError(
            f"participant {row_of!r} cannot be replaced: this ID does not exist in this folder; specify an existing ID"
        )
    elif replaced.group != group:
        raise StudyError(
            f"participant {row_of!r} in group {replaced.group} cannot be replaced by {participant} in group {group}; "
            "replace a participant from the same group"
        )


def simulated_groups(
    study: StudyFolder, protocol: Protocol, participants: Iterable[str], group: str | None
) -> dict[str, str | None]:
    """Return the group of each new simulated participant: ``group``, or pre-existing groups in the planned ratio.

    StudyError rejects an impossible ``group`` (`check_choice`).
    """
    held = claims(study)
    by_participant = {claim.participant: claim for claim in reversed(held)}
    sizes = Counter(claim.group for claim in held if claim.group in protocol.groups and claim.replaces is None)
    groups: dict[str, str | None] = {}
    for participant in participants:
        known = by_participant.get(participant)
        assigned = group
        if assigned is None and known is None and protocol.asks_group:
            assigned = next_group(protocol.shares, sizes)
            sizes[assigned] += 1
        check_choice(protocol, () if known is None else (known,), participant, group=assigned, row_of=None)
        groups[participant] = assigned
    return groups


def session_protocol(study: StudyFolder, protocol: Protocol, participant: str, session: int) -> Protocol:
    """Return the protocol of a session of a participant whose group is known; nothing is claimed.

    Raises
    ------
    StudyError
        The participant has no entry, or fewer sessions; or the study's key cannot be read.
    """
    return protocol.for_session(_known_group(study, protocol, participant), session)


def planned_sessions(study: StudyFolder, protocol: Protocol, participant: str) -> int:
    """Return how many sessions the protocol plans for a participant whose group is known; 1 if it does not say.

    Errors as in `session_protocol`.
    """
    return protocol.session_count(_known_group(study, protocol, participant)) or 1


def _known_group(study: StudyFolder, protocol: Protocol, participant: str) -> str | None:
    """Return a participant's group, None in a study without groups."""
    if not protocol.groups:
        return None
    allocation = allocation_of(study, read_key(study.path), participant)
    if allocation is None:
        raise StoreError(
            f"participant {participant} does not have an entry in {study.allocated}: restore it from a backup"
        )
    return allocation.group


def claims(study: StudyFolder) -> list[Claim]:
    """Return the contents of all entries' files by group and entry; replacements follow the replaced participant."""
    paths = [path for path in study.allocated.glob("*.json") if _STEM.fullmatch(path.stem)]
    all_claims = [_read_claim(study, path) for path in paths]
    return sorted(
        all_claims, key=lambda claim: (claim.group or "", claim.entry, claim.replaces is not None, claim.path)
    )


def _places_assign_rows(held: Iterable[Claim]) -> bool:
    """Return whether the place in a group assigns rows of squares, as in all folders but those of earlier versions."""
    return all(claim.place_in_group for claim in held if claim.participant)


def is_unchanged(claim: Claim, key: Key) -> bool:
    """Return whether an entry's file contains the group that the key assigns, or a pre-existing group."""
    if claim.group is not None or not key.groups:
        return claim.group is not None and not key.groups
    opened = open_text(_entry_owner(claim.entry, claim.participant), claim.sealed, key.nonce, frozenset({"group"}))
    return opened is not None and opened.get("group") == group_of(key.groups, key.nonce, claim.entry)


def recorded_entries(study: StudyFolder) -> dict[str, RecordedEntry]:
    """Return the entry of each participant with a session, from the first lines of the journals."""
    by_participant: dict[str, RecordedEntry] = {}
    for session in study.sessions():
        try:
            with open_regular(session.journal) as file:
                start = parse_json(file.readline())
        except (OSError, ValueError):  # not begun, or damaged: `verify` reports it
            continue
        if isinstance(start, dict) and isinstance(start.get("entry"), int):
            replaces = start.get("row_of") if start.get("place_in_group") else None
            by_participant[session.participant] = RecordedEntry(start["entry"], start.get("group"), replaces)
    return by_participant


def _claim_of(held: Iterable[Claim], participant: str | None) -> Claim | None:
    return next((claim for claim in held if participant and claim.participant == participant), None)


def _claim_content(claim: Claim) -> dict[str, Any]:
    """Return the content of an entry's file."""
    optional = {
        "group": claim.group,
        "replaces": claim.replaces,
        "place_in_group": claim.place_in_group or None,
        "sealed": claim.sealed or None,
    }
    required = {"entry": claim.entry, "participant": claim.participant}
    return required | {name: value for name, value in optional.items() if value is not None}


def _read_claim(study: StudyFolder, path: Path) -> Claim:
    """Read the claim in an entry's file; it is empty if the file is damaged."""
    try:
        content = parse_json(read_own(path, study.path))
        claim = Claim(
            path=path,
            entry=content["entry"],
            participant=content["participant"],
            sealed=content.get("sealed", ""),
            group=content.get("group"),
            replaces=content.get("replaces"),
            place_in_group=content.get("place_in_group", False),
        )
        expected_path = study.allocation(claim.entry, claim.group, claim.participant if claim.replaces else None)
        if expected_path == path and _claim_content(claim) == content:
            return claim
    except (StoreError, ValueError, KeyError, TypeError, AttributeError):
        pass
    return Claim(path=path)


def _allocation(claim: Claim, key: Key) -> Allocation:
    group = claim.group if claim.group is not None else group_of(key.groups, key.nonce, claim.entry)
    return Allocation(
        entry=claim.entry,
        group=group,
        sealed=claim.sealed,
        replaces=claim.replaces,
        place_in_group=claim.place_in_group,
    )


def _seal_group(key: Key, entry: int, participant: str) -> str:
    return seal_values(_entry_owner(entry, participant), {"group": group_of(key.groups, key.nonce, entry)}, key.nonce)


def _entry_owner(entry: int, participant: str) -> list[object]:
    return ["allocated", entry, participant]
