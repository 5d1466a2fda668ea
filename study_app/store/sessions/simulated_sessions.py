"""Sessions of simulated answers, each written completely at its end.

Answers of people are flushed to the disk before they have effects. Simulated answers can be repeated from their seed,
so this module does not wait for the disk. A session is stored with all its files or not at all, and a power cut may
lose the last sessions. The files are those of a real session.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from study_app.protocol.model import Protocol
from study_app.protocol.randomization import stream
from study_app.protocol.source import StudySource
from study_app.store import receipt
from study_app.store.blinded.allocation import Entries, allocate
from study_app.store.blinded.blinding import open_or_draw_key, opened_key, reveals, seal_event
from study_app.store.files.atomic import create_folder, make_folder
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.checksums import checksum_bytes, fingerprint, note_fingerprint
from study_app.store.integrity.folder_lock import FolderLock, lock_folder
from study_app.store.journals.journal import SessionClock, line_bytes, line_of
from study_app.store.journals.journal_events import Allocated, Event, SessionEnded, plain_json, read_event, start_of
from study_app.store.sessions.begin import SessionStart, check_participant, first_records, used_ids
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.tables.study_files import check_study, update_participants, write_description


class SimulatedStudy:
    """A study folder for sessions of simulated answers; the participants table is updated when the ``with`` block ends.

    Until then the study's folder itself is open in this program.

    Parameters
    ----------
    results : Path
        The study folder.
    protocol : Protocol
        The protocol to answer.
    source : bytes
        The content of the protocol's file, hashed into the receipts.
    participants : tuple of str
        Ids of all participants to be simulated; none may be in use.
    seed : int
        Seed of the sessions and of the key.
    device : mapping
        Description for the receipts.
    screens : mapping
        Description for the receipts.

    Raises
    ------
    StoreError
        The folder has other contents, or an id is used or misspelt, and nothing was changed; or it cannot be
        written.
    """

    def __init__(
        self,
        results: Path,
        protocol: Protocol,
        source: bytes,
        participants: tuple[str, ...],
        *,
        seed: int,
        device: Mapping[str, Any],
        screens: Mapping[str, Any],
    ) -> None:
        self.folder = StudyFolder(Path(results))
        check_study(self.folder, protocol.study.name)
        for participant in participants:
            check_participant(participant)
        used_ids(self.folder).check_rehearsal(participants)
        make_folder(self.folder.path)
        self.key = open_or_draw_key(
            self.folder.path, protocol, stream(seed, "blinding").random, StudySource.split(source).liquids
        )
        self.protocol = protocol
        self.entries = Entries(self.folder)
        self._lock: FolderLock | None = None
        start = SessionStart(
            "",
            seed=seed,
            operator="",
            language=protocol.study.languages[0],
            device=device,
            screens=screens,
            simulated=True,
        )
        sealed_measures = not reveals(self.folder.path)
        self.started, first_receipt = first_records(
            protocol, source, start, key_hash=self.key.hash, measures_sealed=sealed_measures, clock=SessionClock()
        )
        self.receipt = plain_json(first_receipt)

    def begin(
        self, participant: str, clock: SessionClock, group: str | None = None, *, session: int = 1
    ) -> SimulatedSession:
        """Return a new session, in a pre-existing ``group`` if the study has these; it is written at its end."""
        return SimulatedSession(self, participant, clock, group, session=session)

    def keep(self, session: SimulatedSession) -> None:
        """Store a finished session.

        Raises
        ------
        StoreError
            Another program wrote the session first, or it cannot be written.
        """
        place, lines, key = session.place, session.lines, opened_key(self.folder)
        ended = {**lines[-1].fields(), "ended_at": lines[-1].at}
        text = json.dumps({**session.receipt, **ended}, indent=2, ensure_ascii=False)
        files = {
            place.folder.journal.name: bytes(session.content),
            place.folder.receipt.name: f"{text}\n".encode("utf-8", "backslashreplace"),
            **{path.name: content for path, content in table_files(place, lines, key)},
        }
        sums = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
        path = place.folder.path
        make_folder(path.parent, waits=False)
        if not create_folder(path, {**files, place.folder.checksums.name: checksum_bytes(sums)}, waits=False):
            raise used_ids(self.folder).refusal(place.folder.participant, place.folder.number)
        note_fingerprint(self.folder, place.folder, fingerprint(sums, lines), waits=False)

    def __enter__(self) -> Self:
        """Write the study's description, which identifies its folder."""
        self._lock = lock_folder(self.folder.path)
        write_description(self.folder, self.protocol.study, intervals=bool(self.protocol.design_questions))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Update the participants table with the finished sessions."""
        try:
            update_participants(self.folder, self.protocol.study.name)
        finally:
            if self._lock is not None:
                self._lock.release()


class SimulatedSession:
    """A simulated session with the interface of ``open_session.SessionStore``, kept in memory until its end.

    ``protocol`` is that of the session: in a study with groups, with the steps of the participant's group. ``planned``
    is the participant's number of sessions; 1 if the protocol does not say.
    """

    def __init__(
        self, study: SimulatedStudy, participant: str, clock: SessionClock, group: str | None, *, session: int
    ) -> None:
        name = study.protocol.study.name
        self.place = Place(study.folder, study.folder.session(participant, session), name)
        self.clock = clock
        self.lines: list[Event] = []
        self.content = bytearray()  # of the journal
        self._hash = hashlib.sha256()
        self._study = study
        allocation = allocate(study.folder, study.key, participant, group=group, waits=False, entries=study.entries)
        own_group = None if allocation is None else allocation.group
        self.planned = study.protocol.session_count(own_group) or 1
        self.protocol = study.protocol.for_session(own_group, session)
        started_at = clock.at(0)
        times = {"started_at": started_at, "clock": {"origin_ns": clock.origin_ns, "origin_at": started_at}}
        group_field = {} if group is None else {"group": group}
        identity = {"participant": participant, "session": session, **group_field}
        self.receipt = {**study.receipt, **identity, **times}
        own_fields: dict[str, Any] = {**identity, "receipt_hash": receipt.digest(self.receipt)}
        if allocation is not None:
            own_fields |= {"entry": allocation.entry, "place_in_group": allocation.place_in_group or None}
        self.append(replace(study.started, **own_fields), t_s=0.0)
        if allocation is not None and not allocation.is_preexisting and session == 1:
            self.append(Allocated(entry=allocation.entry, sealed=allocation.sealed))

    def append(self, event: Event, *, t_s: float | None = None) -> None:
        """Store a line of the journal in memory; ``t_s`` is its time [s], by default now."""
        if self.lines:
            event = seal_event(start_of(self.lines), event, self._study.key)
        line = line_of(event, len(self.lines) + 1, self.clock, t_s, previous=self._hash.hexdigest())
        self.lines.append(read_event(line))
        content = line_bytes(line)
        self.content += content
        self._hash.update(content)

    def write_tables(self) -> None:
        """Do nothing: tables are written at the end."""

    def finish(self, status: str, reason: str = "") -> None:
        """Write the whole session.

        Raises
        ------
        StoreError
            The session cannot be written, or exists already.
        """
        self.append(SessionEnded(status=status, reason=reason))
        self._study.keep(self)
