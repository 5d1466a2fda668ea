"""Beginning a session: check its ID, claim its folder once, and write the files needed before the first trial."""

import contextlib
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path
from typing import Any

import study_app
from study_app.errors import StoreError
from study_app.ids import read_as
from study_app.protocol.load import protocol_hash
from study_app.protocol.model import Protocol
from study_app.protocol.randomization import stream
from study_app.protocol.source import StudySource
from study_app.protocol.trials import LEVEL_RULES
from study_app.store import receipt
from study_app.store.blinded.allocation import Allocation, allocate, allocation_of, check_session
from study_app.store.blinded.blinding import Key, open_or_draw_key, reveals, sealed_model
from study_app.store.files.atomic import (
    cannot_write,
    is_there,
    make_folder,
    move,
    remove_old_temporary_files,
    sync_folder,
    system_message,
    temporary_path,
)
from study_app.store.files.folders import ID_PATTERN, SessionFolder, StudyFolder
from study_app.store.integrity.folder_lock import (
    FolderLock,
    create_locked_folder,
    is_abandoned,
    remove_abandoned_claims,
    take_over_folder,
)
from study_app.store.journals import journal
from study_app.store.journals.journal import FORMAT, Journal, SessionClock
from study_app.store.journals.journal_events import Allocated, SessionStarted, start_of
from study_app.store.recorder import Recorder
from study_app.store.sessions.open_session import Place, SessionStore
from study_app.store.tables.study_files import check_study, update_participants, write_description
from study_app.store.versions.study_versions import saver_of
from study_app.store.withdrawals import tombstones

_MAX_ID_LENGTH = 32
MAX_SESSION = 99
_RESERVED_IDS = ("pilot", "test")
_NUMBERED = re.compile(r"P([0-9]+)")


@dataclass(frozen=True, slots=True)
class SessionStart:
    """The initial data of a session, stored in its first line and its receipt.

    Parameters
    ----------
    participant : str
        The participant's id.
    seed : int
        Seed of all its randomness.
    operator : str
        Name or initials of the operator.
    language : str
        The language of the participant's pages.
    device : mapping
        Description for the receipt; ``device["name"]`` names the device in the participants table.
    screens : mapping
        Description for the receipt.
    simulated : bool
        Whether the participant, or the hand, is simulated.
    session : int
        Number of the participant's session, from 1.
    pilot : bool
        Whether the session is a pilot.
    recordings : bool
        Whether the trials' samples and frames are recorded, by the ``recorder`` of the store.
    motors_masked : mapping, optional
        The masking of motor noise, for the receipt; None if the operator was not asked.
    outlets : mapping, optional
        The outlets to other programs, for the receipt; None without any.
    video : mapping, optional
        Description of camera and footage for the receipt; None in a study without a video.
    row_of : str, optional
        The id of the replaced participant; None if nobody is replaced, or to keep that of the first session.
    group : str, optional
        The participant's pre-existing group; None in a study without these, or to keep that of the first session.
    """

    participant: str
    _: KW_ONLY
    seed: int
    operator: str
    language: str
    device: Mapping[str, Any]
    screens: Mapping[str, Any]
    simulated: bool
    session: int = 1
    pilot: bool = False
    recordings: bool = False
    motors_masked: Mapping[str, Any] | None = None
    outlets: Mapping[str, Any] | None = None
    video: Mapping[str, Any] | None = None
    row_of: str | None = None
    group: str | None = None


def begin_session(
    results: Path, protocol: Protocol, source: bytes, start: SessionStart, *, clock: SessionClock | None = None
) -> SessionStore:
    """Claim a session in the study folder ``results`` and write all files needed before the first trial.

    The folder is created exclusively: if two programs request the same id, only one gets it. A folder that another
    program claimed but left before writing a line is taken over. On any failure the claimed folder is removed.

    Parameters
    ----------
    results : Path
        The study folder.
    protocol : Protocol
        The protocol to run.
    source : bytes
        The content of the protocol's file, hashed into the receipt.
    start : SessionStart
        Participant, device and other initial data.
    clock : SessionClock, optional
        Its origin is the session's; by default the system's monotonic clock from now.

    Raises
    ------
    StoreError
        The id is used, reserved or misspelt, the folder cannot be written or has other contents, or the key is
        invalid.
    """
    study_folder = StudyFolder(Path(results))
    check_participant(start.participant, pilot=start.pilot)
    check_study(study_folder, protocol.study.name)
    used_ids(study_folder).check_unused(start.participant, start.session)
    check_session(study_folder, protocol, start.participant, start.session, group=start.group, row_of=start.row_of)
    clock = clock if clock is not None else SessionClock()
    make_folder(study_folder.path)
    draw = stream(start.seed, "blinding").random if start.simulated else None
    key = open_or_draw_key(study_folder.path, protocol, draw, StudySource.split(source).liquids)
    place = Place(study_folder, study_folder.session(start.participant, start.session), protocol.study.name)
    sealed = not reveals(study_folder.path)
    lock = _create_locked_folder(place)
    try:
        _check_path_length(place)
        allocation = allocate(study_folder, key, start.participant, group=start.group, row_of=start.row_of)
        group = None if allocation is None else allocation.group
        protocol.for_session(group, start.session)  # raises an error if the group does not have this session
        started, first_receipt = first_records(
            protocol, source, start, key_hash=key.hash, measures_sealed=sealed, clock=clock, allocation=allocation
        )
        first_receipt["resolved"] = sealed_model(protocol, start.participant, start.session, key)
        return _write_session(place, lock, clock, key, first_receipt, started, protocol)
    except BaseException:
        _release_claim(place, lock)
        raise


def first_records(
    protocol: Protocol,
    source: bytes,
    start: SessionStart,
    *,
    key_hash: str,
    measures_sealed: bool,
    clock: SessionClock,
    allocation: Allocation | None = None,
) -> tuple[SessionStarted, dict[str, Any]]:
    """Return a session's first line and its receipt before the first trial."""
    row_of, group = start.row_of, None
    if allocation is not None:
        row_of = allocation.replaces if allocation.place_in_group else row_of
        group = allocation.group if allocation.is_preexisting else None
    fields: dict[str, Any] = {
        "participant": start.participant,
        "session": start.session,
        "study": protocol.study.name,
        "seed": start.seed,
        "language": start.language,
        "operator": start.operator,
        "simulated": start.simulated,
        "pilot": start.pilot,
        "recordings": start.recordings,
        "key_hash": key_hash,
        "protocol_hash": protocol_hash(source),
        "version": study_app.__version__,
        **{name: value for name, value in (("row_of", row_of), ("group", group)) if value is not None},
    }
    limits = protocol.limits.model_dump(mode="json")
    started = SessionStarted(
        **fields,
        format=FORMAT,
        device=start.device.get("name"),
        limits=limits,
        measures_sealed=measures_sealed,
        own_codes=True if measures_sealed and protocol.study.codes == "participant" else None,
        protocol_format=protocol.format if protocol.format > 1 else None,
        intervals=True if any(block.design is not None for block in protocol.blocks.values()) else None,
        entry=None if allocation is None else allocation.entry,
        place_in_group=True if allocation is not None and allocation.place_in_group else None,
    )
    first_receipt = {
        "format": FORMAT,
        "status": receipt.UNFINISHED,
        "reason": "",
        "started_at": clock.at(0),
        "ended_at": None,
        "resumed": [],
        **fields,
        **({"saved_by": saver} if (saver := saver_of(fields["protocol_hash"])) else {}),
        "generator": receipt.GENERATOR,
        **session_environment(
            protocol, start.device, start.screens, clock, start.motors_masked, start.outlets, start.video
        ),
        "protocol": receipt.without_conditions(protocol),
    }
    return started, first_receipt


def note_allocation(store: SessionStore) -> None:
    """Write the participant's sealed group to the journal, unless that of an earlier session contains it."""
    study, folder, start = store.place.study_folder, store.place.folder, start_of(store.lines)
    if start.entry is None or start.group is not None:
        return
    sessions = [session for session in study.sessions() if session.participant == folder.participant]
    lines = [line for session in sessions if is_there(session.journal) for line in journal.scan(session.journal).lines]
    if any(isinstance(line, Allocated) for line in lines):
        return
    allocation = allocation_of(study, store.key, folder.participant)
    if allocation is not None:
        store.append(Allocated(entry=allocation.entry, sealed=allocation.sealed))


def make_recorder(place: Place, start: SessionStarted, clock: SessionClock, key: Key) -> Recorder | None:
    """Return the recorder that a session's first line requires, or None for a session without recordings."""
    if not start.recordings:
        return None
    fields = {
        name: getattr(start, name) for name in ("study", "participant", "session", "simulated", "pilot", "version")
    }
    facts, secret = {**fields, "origin_ns": clock.origin_ns}, key.nonce if start.measures_sealed else None
    return Recorder(place.folder.recordings, facts, secret=secret, waits=start.simulated)


def session_environment(
    protocol: Protocol,
    device: Mapping[str, Any],
    screens: Mapping[str, Any],
    clock: SessionClock,
    motors_masked: Mapping[str, Any] | None = None,
    outlets: Mapping[str, Any] | None = None,
    video: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the receipt's section on device, screens and versions of a session that begins or is resumed."""
    optional = {"motors_masked": motors_masked, "outlets": outlets, "video": video}
    plug_ins = receipt.plug_ins_of(protocol, str(device.get("name")), outlets or ())
    return {
        "versions": receipt.versions(),
        "level_rules": LEVEL_RULES,
        "device": dict(device),
        "screens": dict(screens),
        "clock": {"origin_ns": clock.origin_ns, "origin_at": clock.at(0)},
        **{name: dict(value) for name, value in optional.items() if value is not None},
        **({"plug_ins": plug_ins} if plug_ins else {}),
    }


@dataclass(frozen=True, slots=True)
class UsedIds:
    """A snapshot of the sessions in a study's folder, for checking ids and numbers without reading the disk.

    ``held`` are participant and number of the sessions that were begun or that a running program has claimed, ``ids``
    the ids of all folders, and ``withdrawn`` the ids of participants whose data were erased.
    """

    path: Path
    held: frozenset[tuple[str, int]]
    ids: tuple[str, ...]
    withdrawn: tuple[str, ...] = ()

    def numbers(self, participant: str) -> tuple[int, ...]:
        """Return the session numbers of a participant."""
        return tuple(sorted(number for holder, number in self.held if holder == participant))

    def suggested(self) -> str:
        """Return the next free id: P001, P002 ...; ids of sessions that were never begun are free."""
        used = (*(participant for participant, _ in self.held), *self.withdrawn)
        matches = (_NUMBERED.fullmatch(participant.upper()) for participant in used)
        return f"P{max((int(match[1]) for match in matches if match), default=0) + 1:03d}"

    def check_unused(self, participant: str, number: int) -> None:
        """Reject an existing session, and a new id that differs from another only in case or that spreadsheets alter.

        A session that an ended program claimed but never began is accepted.

        Raises
        ------
        StoreError
            The session or id is used; the message names the three possible remedies.
        """
        if not 1 <= number <= MAX_SESSION:
            raise StoreError(f"session number {number} cannot be used: it must be from 1 to {MAX_SESSION}")
        if participant.lower() in (used.lower() for used in self.withdrawn):
            raise StoreError(
                f"participant {participant} withdrew, so the ID cannot be used again: use another ID (next "
                f"free: {self.suggested()})"
            )
        for used in self.ids:
            if used != participant and used.lower() == participant.lower():
                raise StoreError(
                    f"participant ID {participant!r} differs from the existing {used!r} only in capitalisation: "
                    f"use {used!r} with a new session number, or another ID"
                )
        if participant not in self.ids and (meaning := read_as(participant)):
            raise StoreError(
                f"participant ID {participant!r} cannot be used: spreadsheets and statistics programs read it "
                f"as {meaning}; use another ID, such as {self.suggested()}"
            )
        if (participant, number) in self.held:
            raise self.refusal(participant, number)

    def check_rehearsal(self, participants: Sequence[str]) -> None:
        """Raise StoreError if a session or withdrawal has the ID of one of a rehearsal's ``participants``."""
        used = {participant.lower() for participant in (*(held for held, _ in self.held), *self.withdrawn)}
        if taken := [participant for participant in participants if participant.lower() in used]:
            several = len(participants) > 1
            ids = f"IDs {participants[0]} to {participants[-1]}" if several else f"ID {taken[0]}"
            raise StoreError(
                f"{self.path} already contains participant {taken[0]}, and the rehearsal uses the {ids}: specify a new "
                "folder with --results, or delete this one if it contains only rehearsals; nothing was changed"
            )

    def refusal(self, participant: str, number: int) -> StoreError:
        """Return the error for a used id, with the three possible remedies."""
        free = max(self.numbers(participant), default=number)
        return StoreError(
            f"participant {participant} already has session {number} in {self.path}: use a new session number "
            f"({free + 1}), resume that session, or use another ID (next free: {self.suggested()}); nothing was "
            "changed"
        )


def used_ids(folder: StudyFolder) -> UsedIds:
    """Read the used ids and session numbers of a study."""
    sessions = folder.sessions()
    held = frozenset((session.participant, session.number) for session in sessions if not is_abandoned(session.path))
    return UsedIds(
        folder.path, held, tuple(sorted({session.participant for session in sessions})), tuple(tombstones(folder))
    )


def check_participant(participant: str, *, pilot: bool = False) -> None:
    """Reject an id that is unsuitable for file names or analyses.

    Raises
    ------
    StoreError
        The id is invalid; the message names the permitted characters.
    """
    if not ID_PATTERN.fullmatch(participant) or len(participant) > _MAX_ID_LENGTH:
        raise StoreError(
            f"participant ID {participant!r} cannot be used: use at most {_MAX_ID_LENGTH} letters A-Z, a-z and digits "
            "0-9, without dashes, spaces or underscores, such as P007"
        )
    if not pilot and participant.lower() in _RESERVED_IDS:
        raise StoreError(
            f"participant ID {participant!r} is reserved for pilot sessions, which are stored separately: use "
            "an ID such as P007"
        )


def refuse_never_begun(session: SessionFolder) -> None:
    """Raise an error for a session that was claimed but never begun: it cannot be resumed.

    Raises
    ------
    StoreError
        The session was never begun; the message says how to begin it.
    """
    if is_abandoned(session.path):
        raise StoreError(
            f"{session.path} was created, but the program ended before the session began, so it cannot be resumed: "
            f"run a new session with participant {session.participant} and session number {session.number}"
        )


def _create_locked_folder(place: Place) -> FolderLock:
    """Create the session's folder, locked by this program from the start; the session must not have been begun."""
    path = place.folder.path
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        remove_abandoned_claims(path.parent)
        lock = create_locked_folder(path) or take_over_folder(path)
    except OSError as error:
        raise cannot_write(path, error) from error
    except StoreError:
        _remove_if_empty(path.parent)
        raise
    if lock is None:
        raise used_ids(place.study_folder).refusal(place.folder.participant, place.folder.number)
    return lock


def _release_claim(place: Place, lock: FolderLock) -> None:
    """Remove the claimed folder in one step, and then the participant's folder if it is empty."""
    path = place.folder.path
    temporary = temporary_path(path)
    with contextlib.suppress(OSError):
        move(path, temporary)
    shutil.rmtree(temporary if is_there(temporary) else path, ignore_errors=True)
    lock.release()
    _remove_if_empty(path.parent)


def _check_path_length(place: Place) -> None:
    """Raise an error if the system cannot create the longest path of a session (Windows permits 259 characters)."""
    tables = (place.folder.table(place.study, name) for name in ("responses", "intervals"))
    recording = place.folder.recordings / "trial-0000_attempt-00_interval-0_frames.parquet"
    longest = temporary_path(max(*tables, recording, key=lambda path: len(str(path))))
    try:
        longest.parent.mkdir(exist_ok=True)
        longest.touch()
        longest.unlink()
        _remove_if_empty(place.folder.recordings)
    except OSError as error:
        raise StoreError(
            f"{longest} cannot be created ({system_message(error)}; {len(str(longest))} characters): move the "
            "workspace to a folder with a shorter path, such as C:\\Studies, or free disk space"
        ) from error


def _remove_if_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()


def _write_session(
    place: Place,
    lock: FolderLock,
    clock: SessionClock,
    key: Key,
    session_receipt: dict[str, Any],
    started: SessionStarted,
    protocol: Protocol,
) -> SessionStore:
    """Write receipt, first line, tables and description into the claimed folder; return the open session."""
    path = place.folder.path
    try:
        for parent in path.parents[:3]:
            sync_folder(parent)
    except OSError as error:
        raise cannot_write(path, error) from error
    recorder = make_recorder(place, started, clock, key)
    receipt.write(place.folder.receipt, session_receipt)
    journal = Journal.create(place.folder.journal, clock)
    store = SessionStore(place, journal, key, session_receipt, lock, recorder=recorder)
    with contextlib.ExitStack() as cleanup:
        cleanup.callback(journal.close)
        store.append(replace(started, receipt_hash=receipt.digest(session_receipt)), t_s=0.0)
        note_allocation(store)
        store.write_tables()
        if store.behind is not None:
            raise store.behind
        update_participants(place.study_folder, place.study)
        write_description(place.study_folder, protocol.study, intervals=bool(protocol.design_questions))
        for folder in (place.study_folder.path, place.study_folder.data):
            remove_old_temporary_files(folder)
        cleanup.pop_all()
    return store
