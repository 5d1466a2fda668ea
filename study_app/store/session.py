"""A session's place on the disk: claimed once, appended to while it runs, closed with a status."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import study_app
from study_app.errors import StoreError
from study_app.protocol.load import protocol_hash
from study_app.protocol.model import Protocol
from study_app.protocol.schedule import stream
from study_app.store import receipt, tables
from study_app.store.atomic import cannot_write, sync_folder, write_file
from study_app.store.blinding import Key, open_or_draw_key
from study_app.store.columns import RESPONSES, TRIALS
from study_app.store.description import check_study, write_description
from study_app.store.journal import Journal, Line, SessionClock
from study_app.store.layout import SessionFolder, StudyFolder, check_participant, check_unused, used_id
from study_app.store.participants import write_participants


@dataclass(frozen=True, slots=True)
class Place:
    """Where a session's files go: the study's folder, the session's in it, and the study's name."""

    study_folder: StudyFolder
    folder: SessionFolder
    study: str


class SessionStore:
    """The open session: ``append`` is durable when it returns, tables follow the journal, ``finish`` says how it ended.

    ``key`` translates codes while the session runs; ``clock`` is the one the journal is stamped from; ``behind`` is why
    the tables on disk are older than the journal, or None. Made by `begin`.
    """

    def __init__(self, place: Place, journal: Journal, key: Key, session_receipt: dict[str, Any]) -> None:
        self.place = place
        self.key = key
        self.clock = journal.clock
        self.behind: StoreError | None = None
        self._journal = journal
        self._receipt = session_receipt
        self._lines: list[Line] = []
        self._written: dict[Path, bytes] = {}

    @property
    def folder(self) -> SessionFolder:
        """The session's folder."""
        return self.place.folder

    def append(self, event: str, *, t_s: float | None = None, **fields: Any) -> None:
        """Put an event into the journal; it is on the disk when this returns.

        ``t_s`` is when it happened [s since the clock's origin], by default now.

        Raises
        ------
        StoreError
            It is not on the disk; the journal is as before and can be tried again.
        """
        self._lines.append(self._journal.append(event, t_s=t_s, **fields))

    def write_tables(self) -> None:
        """Bring the session's tables up to date with its journal.

        A table that cannot be replaced now (open in another program, no space) stops no session: nothing is lost, since
        tables are made from the journal. ``behind`` says why, and the next call tries again.
        """
        try:
            for path, content in table_files(self.place, self._lines):
                if self._written.get(path) != content:
                    write_file(path, content)
                    self._written[path] = content
        except StoreError as error:
            self.behind = error
        else:
            self.behind = None

    def finish(self, status: str, reason: str = "") -> None:
        """Write the session's last line, its receipt and all tables, and close it.

        Raises
        ------
        StoreError
            One of them could not be written; what was journalled before is safe.
        """
        self.append("session_ended", status=status, reason=reason)
        self._journal.close()
        self._receipt |= {"status": status, "reason": reason, "ended_at": self._lines[-1]["at"]}
        self.write_tables()
        failures = [] if self.behind is None else [self.behind]
        try:
            receipt.write(self.folder.receipt, self._receipt)
        except StoreError as error:
            failures.append(error)
        try:
            write_participants(self.place.study_folder, self.place.study)
        except StoreError as error:
            failures.append(error)
        if failures:
            raise failures[0]

    def close(self) -> None:
        """Let go of the journal without an end; the session stays unfinished."""
        self._journal.close()

    def __enter__(self) -> SessionStore:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


def table_files(place: Place, lines: Sequence[Line]) -> tuple[tuple[Path, bytes], ...]:
    """Return the session's tables as files: paths and contents, from the journal's lines alone."""
    return (
        (place.folder.table(place.study, "responses"), tables.csv_bytes(RESPONSES, tables.responses(lines))),
        (place.folder.table(place.study, "trials"), tables.csv_bytes(TRIALS, tables.trials(lines))),
    )


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
    clock: SessionClock | None = None,
) -> SessionStore:
    """Claim a session in the study folder ``results`` and write everything that must be there before the first trial.

    The folder is created exclusively: of two programs that want one id, one gets it. On any failure the claimed folder
    is taken away again.

    Parameters
    ----------
    source : bytes
        The protocol's file as it is, hashed into the receipt.
    device, screens : mapping
        Descriptions for the receipt; ``device["name"]`` names the device in the participants table.
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
    _make_folder(study_folder.path)
    key = open_or_draw_key(study_folder.path, protocol, stream(seed, "blinding").random if simulated else None)
    place = Place(study_folder, study_folder.session(participant, session), protocol.study.name)
    facts = {
        "participant": participant,
        "session": session,
        "study": protocol.study.name,
        "seed": seed,
        "language": language,
        "operator": operator,
        "simulated": simulated,
        "pilot": pilot,
        "key_hash": key.hash,
        "protocol_hash": protocol_hash(source),
        "version": study_app.__version__,
    }
    started = {**facts, "device": device.get("name"), "limits": protocol.limits.model_dump(mode="json")}
    first_receipt = {
        "format": 1,
        "status": receipt.UNFINISHED,
        "reason": "",
        "started_at": clock.at(0),
        "ended_at": None,
        **facts,
        **_surroundings(protocol, device, screens, clock),
    }
    _claim(place)
    try:
        return _open(place, clock, key, first_receipt, started, protocol)
    except BaseException:
        _unclaim(place)
        raise


def _surroundings(
    protocol: Protocol, device: Mapping[str, Any], screens: Mapping[str, Any], clock: SessionClock
) -> dict[str, Any]:
    """Return the receipt's part about what the session ran with."""
    return {
        "generator": receipt.GENERATOR,
        "versions": receipt.versions(),
        "device": dict(device),
        "screens": dict(screens),
        "clock": {"origin_ns": clock.origin_ns, "origin_at": clock.at(0)},
        "protocol": receipt.without_conditions(protocol),
    }


def _make_folder(path: Path) -> None:
    """Create the study's folder, which several programs may share."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(path, error) from error


def _claim(place: Place) -> None:
    """Create the session's folder, which must not exist."""
    path = place.folder.path
    try:
        path.mkdir(parents=True)
        for above in (path.parent, path.parent.parent, path.parent.parent.parent):
            sync_folder(above)
    except FileExistsError as error:
        raise used_id(place.study_folder, place.folder.participant, place.folder.number) from error
    except OSError as error:
        raise cannot_write(path, error) from error


def _unclaim(place: Place) -> None:
    """Take the claimed folder away again, and the participant's if it holds nothing else."""
    shutil.rmtree(place.folder.path, ignore_errors=True)
    with contextlib.suppress(OSError):
        place.folder.path.parent.rmdir()


def _open(
    place: Place,
    clock: SessionClock,
    key: Key,
    session_receipt: dict[str, Any],
    started: Mapping[str, Any],
    protocol: Protocol,
) -> SessionStore:
    """Write receipt, first line, tables and description into the claimed folder."""
    receipt.write(place.folder.receipt, session_receipt)
    store = SessionStore(place, Journal.create(place.folder.journal, clock), key, session_receipt)
    with contextlib.ExitStack() as failing:
        failing.callback(store.close)
        store.append("session_started", t_s=0.0, **started)
        store.write_tables()
        if store.behind is not None:
            raise store.behind
        write_participants(place.study_folder, place.study)
        write_description(place.study_folder, protocol.study)
        failing.pop_all()
    return store
