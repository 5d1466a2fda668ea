"""Beginning a session: its place on the disk is claimed once, and what must be there before the first trial written."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import study_app
from study_app.errors import StoreError
from study_app.protocol.load import protocol_hash
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import stream
from study_app.protocol.source.liquid_files import unbundled
from study_app.store import receipt
from study_app.store.atomic import beside, cannot_write, is_there, sweep_old, sync_folder
from study_app.store.blinded.blinding import Key, open_or_draw_key, reveals
from study_app.store.clock import SessionClock
from study_app.store.folders import StudyFolder
from study_app.store.journals.journal import FORMAT
from study_app.store.journals.journal_writer import Journal
from study_app.store.recorder import Recorder
from study_app.store.sessions.folder_lock import Opening, create_opened
from study_app.store.sessions.open_session import Place, SessionStore
from study_app.store.sessions.participant_ids import check_participant, check_unused, used_id
from study_app.store.sessions.unstarted_sessions import sweep_claims, take_over
from study_app.store.tables.participants import write_participants
from study_app.store.tables.study_description import check_study, write_description

__all__ = ["Place", "SessionStore", "begin"]


def begin(
    results: Path,
    protocol: Protocol,
    source: bytes,
    participant: str,
    *,
    session: int = 1,
    seed: int,
    operator: str,
    language: str,
    device: Mapping[str, Any],
    screens: Mapping[str, Any],
    simulated: bool,
    pilot: bool = False,
    recordings: bool = False,
    clock: SessionClock | None = None,
) -> SessionStore:
    """Claim a session in the study folder ``results`` and write everything that must be there before the first trial.

    The folder is created exclusively: of two programs that want one id, one gets it. A folder that a program claimed
    which was ended before it wrote a line is taken over. On any failure the claimed folder is taken away again.

    Parameters
    ----------
    source : bytes
        The protocol's file as it is, hashed into the receipt.
    device, screens : mapping
        Descriptions for the receipt; ``device["name"]`` names the device in the participants table.
    recordings : bool
        Whether the trials' samples and frames are kept, through the ``recorder`` of the store.
    clock : SessionClock, optional
        Its origin is the session's; by default the system's monotonic clock from now.

    Raises
    ------
    StoreError
        The id is used, reserved or misspelt, the folder cannot be written or holds something else, or the key is not in
        order.
    """
    study_folder = StudyFolder(Path(results))
    check_participant(participant, pilot=pilot)
    check_study(study_folder, protocol.study.name)
    check_unused(study_folder, participant, session)
    clock = clock if clock is not None else SessionClock()
    make_folder(study_folder.path)
    key = open_or_draw_key(
        study_folder.path, protocol, stream(seed, "blinding").random if simulated else None, unbundled(source)[1]
    )
    place = Place(study_folder, study_folder.session(participant, session), protocol.study.name)
    started, first_receipt = first_words(
        protocol,
        source,
        participant,
        session=session,
        seed=seed,
        operator=operator,
        language=language,
        device=device,
        screens=screens,
        simulated=simulated,
        pilot=pilot,
        recordings=recordings,
        key_hash=key.hash,
        measures_sealed=not reveals(study_folder.path),
        clock=clock,
    )
    opening = _claim(place)
    try:
        return _open(place, opening, clock, key, first_receipt, started, protocol)
    except BaseException:
        _unclaim(place, opening)
        raise


def first_words(
    protocol: Protocol,
    source: bytes,
    participant: str,
    *,
    session: int,
    seed: int,
    operator: str,
    language: str,
    device: Mapping[str, Any],
    screens: Mapping[str, Any],
    simulated: bool,
    pilot: bool,
    recordings: bool,
    key_hash: str,
    measures_sealed: bool,
    clock: SessionClock,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the fields of a session's first line, and its receipt as it is before the first trial."""
    facts = {
        "participant": participant,
        "session": session,
        "study": protocol.study.name,
        "seed": seed,
        "language": language,
        "operator": operator,
        "simulated": simulated,
        "pilot": pilot,
        "recordings": recordings,
        "key_hash": key_hash,
        "protocol_hash": protocol_hash(source),
        "version": study_app.__version__,
    }
    limits = protocol.limits.model_dump(mode="json")
    started = {"format": FORMAT, **facts, "device": device.get("name"), "limits": limits}
    started["measures_sealed"] = measures_sealed
    first_receipt = {
        "format": FORMAT,
        "status": receipt.UNFINISHED,
        "reason": "",
        "started_at": clock.at(0),
        "ended_at": None,
        "resumed": [],
        **facts,
        "generator": receipt.GENERATOR,
        **surroundings(device, screens, clock),
        "protocol": receipt.without_conditions(protocol),
    }
    return started, first_receipt


def make_recorder(place: Place, start: Mapping[str, Any], clock: SessionClock) -> Recorder | None:
    """Return the recorder of a session as its first line says, or None where it keeps no recordings."""
    if not start.get("recordings"):
        return None
    facts = {name: start[name] for name in ("study", "participant", "session", "simulated", "pilot", "version")}
    return Recorder(place.folder.recordings, {**facts, "origin_ns": clock.origin_ns}, waits=start["simulated"])


def surroundings(device: Mapping[str, Any], screens: Mapping[str, Any], clock: SessionClock) -> dict[str, Any]:
    """Return the receipt's part about what the session runs with, from its beginning or since it was resumed."""
    return {
        "versions": receipt.versions(),
        "device": dict(device),
        "screens": dict(screens),
        "clock": {"origin_ns": clock.origin_ns, "origin_at": clock.at(0)},
    }


def make_folder(path: Path) -> None:
    """Create the study's folder, which several programs may share, and let no power cut take it or one above it."""
    path = path.absolute()
    missing = [level for level in (path, *path.parents) if not is_there(level)]
    try:
        path.mkdir(parents=True, exist_ok=True)
        for level in missing:
            sync_folder(level.parent)
    except OSError as error:
        raise cannot_write(path, error) from error


def _claim(place: Place) -> Opening:
    """Create the session's folder, which must not have been begun, open in this program from the first moment on."""
    path = place.folder.path
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        sweep_claims(path.parent)
        opening = create_opened(path) or take_over(path)
    except OSError as error:
        raise cannot_write(path, error) from error
    except StoreError:
        _take_away_empty(path.parent)
        raise
    if opening is None:
        raise used_id(place.study_folder, place.folder.participant, place.folder.number)
    return opening


def _sync_above(path: Path) -> None:
    """Let no power cut take the session's folder, or one above it."""
    try:
        for above in (path.parent, path.parent.parent, path.parent.parent.parent):
            sync_folder(above)
    except OSError as error:
        raise cannot_write(path, error) from error


def _unclaim(place: Place, opening: Opening) -> None:
    """Take the claimed folder away again in one step, and the participant's if it holds nothing else."""
    path = place.folder.path
    away = beside(path)
    with contextlib.suppress(OSError):
        path.rename(away)
    shutil.rmtree(away if is_there(away) else path, ignore_errors=True)
    opening.release()
    _take_away_empty(path.parent)


def _take_away_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()


def _open(
    place: Place,
    opening: Opening,
    clock: SessionClock,
    key: Key,
    session_receipt: dict[str, Any],
    started: Mapping[str, Any],
    protocol: Protocol,
) -> SessionStore:
    """Write receipt, first line, tables and description into the claimed folder."""
    _sync_above(place.folder.path)
    recorder = make_recorder(place, started, clock)
    receipt.write(place.folder.receipt, session_receipt)
    journal = Journal.create(place.folder.journal, clock)
    store = SessionStore(place, journal, key, session_receipt, opening, recorder=recorder)
    with contextlib.ExitStack() as failing:
        failing.callback(journal.close)
        store.append("session_started", t_s=0.0, **started)
        store.write_tables()
        if store.behind is not None:
            raise store.behind
        write_participants(place.study_folder, place.study)
        write_description(place.study_folder, protocol.study)
        for folder in (place.study_folder.path, place.study_folder.data):
            sweep_old(folder)
        failing.pop_all()
    return store
