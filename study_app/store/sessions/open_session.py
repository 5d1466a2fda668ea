"""An open session: its journal grows while the session runs, and its status is set at the end.

While the session runs only one program has it open. The journal is the primary record; tables, receipt and checksums
are derived from it.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

from study_app.errors import StoreError, as_argument
from study_app.outlets.markers import Marker, marker_of
from study_app.outlets.session_outlets import Outlets
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.blinded.blinding import Key, open_events, opened_key, recorded_protocol, seal_event
from study_app.store.exclusions import exclude_incomplete
from study_app.store.files import csv_files
from study_app.store.files.atomic import write_file
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.integrity.checksums import fingerprint, note_fingerprint, write_checksums
from study_app.store.integrity.folder_lock import FolderLock
from study_app.store.journals import journal_events as events
from study_app.store.journals.journal import Journal
from study_app.store.recorder import LEAVING_S, Kept, Recorder
from study_app.store.session_progress.missing_trials import MissingTrials
from study_app.store.session_progress.progress import progress_of
from study_app.store.tables import session_tables
from study_app.store.tables.study_files import update_participants


@dataclass(frozen=True, slots=True)
class Place:
    """The location of a session's files: study folder, session folder and the study's name."""

    study_folder: StudyFolder
    folder: SessionFolder
    study: str


class SessionStore:
    """The open session: ``append`` adds to its journal, tables follow the journal, ``finish`` sets its status.

    ``journal`` receives events, ``lock`` locks the folder until it is released; ``key`` translates codes while the
    session runs; ``clock`` gives the journal's times; ``recorder`` records the trials' samples and frames, or is None
    in a session without recordings; ``behind`` is why the tables on disk are older than the journal, or None;
    ``fingerprint`` is empty until the session has ended. Made by `begin_session`, or by ``recovery.reopen_store`` from
    ``lines`` written before.
    """

    def __init__(
        self,
        place: Place,
        journal: Journal,
        key: Key,
        session_receipt: dict[str, Any],
        lock: FolderLock,
        *,
        lines: Sequence[events.Event] = (),
        recorder: Recorder | None = None,
    ) -> None:
        self.place = place
        self.key = key
        self.clock = journal.clock
        self.recorder = recorder
        self.behind: StoreError | None = None
        self.fingerprint = ""
        self.journal = journal
        self._receipt = session_receipt
        self.lock = lock
        self._lines: list[events.Event] = list(lines)
        self._written: dict[Path, bytes] = {}
        self._results: list[Kept] = []
        self._is_over = False
        self._ended_s: float | None = None
        self.outlets: Outlets | None = None
        self._sent_marker: Marker | None = None  # of the line that could not be written
        self._outlets_lost: set[str] = set()  # that are journalled
        self._reached_s: list[float] = []  # in the running task of a sealed session

    @property
    def folder(self) -> SessionFolder:
        """The session's folder."""
        return self.place.folder

    @property
    def lines(self) -> tuple[events.Event, ...]:
        """The lines of the journal so far."""
        return tuple(self._lines)

    def as_recorded(self, protocol: Protocol) -> Protocol:
        """Return the protocol with the estimator, effects and laws resolved when the session began.

        Raises
        ------
        StoreError
            The receipt cannot be decrypted with the study's key.
        """
        return recorded_protocol(protocol, self._receipt, self.key)

    def attach(self, outlets: Outlets) -> None:
        """Start sending markers of the session's events, beginning with its start or resumption."""
        self.outlets = outlets
        self._send_marker(
            next(
                line
                for line in reversed(self._lines)
                if isinstance(line, events.SessionStarted | events.SessionResumed)
            )
        )

    def append(self, event: events.Event, *, t_s: float | None = None, waits: bool = True) -> None:
        """Add an event to the journal; with ``waits`` it is on the disk when this returns, else soon after.

        ``t_s`` is its time [s since the clock's origin], by default now. Fields that reveal a condition are sealed.
        While measures are sealed, a reached target only sends its marker at once; it is written at the end of its task.

        Raises
        ------
        StoreError
            The event was not written, or is not on the disk; the journal is unchanged, and the call can be repeated.
        """
        event = replace(event, t_s=self.clock.seconds() if t_s is None else t_s)
        if self._lines:
            start = events.start_of(self._lines)
            if start.measures_sealed and isinstance(event, events.TargetReached):
                self._hold_target(event)
                return
            event = seal_event(start, self._add_targets(event), self.key)
        self._send_marker(event)
        self._lines.append(self.journal.append(event, t_s=event.t_s, waits=waits))
        self._sent_marker = None

    def _hold_target(self, event: events.TargetReached) -> None:
        """Send the marker of a reached target and hold its time, which is written sealed at the end of the task."""
        self._send_marker(event)
        self._sent_marker = None
        if event.t_task_s is not None:
            self._reached_s.append(round(event.t_task_s, 6))

    def _add_targets(self, event: events.Event) -> events.Event:
        """Return the end of a task with the held times of the reached targets."""
        if isinstance(event, events.TrialStarted | events.IntervalStarted):
            self._reached_s = []
        if isinstance(event, events.EndOfTask) and self._reached_s:
            return replace(event, reached_s=self._reached_s)
        return event

    def _send_marker(self, event: events.Event) -> None:
        """Send the marker of an event, before the disk is waited for, and only once if its line is written again."""
        if self.outlets is None:
            return
        marker = marker_of(event.event, event.t_s, self.clock.origin_ns, event.fields())
        if marker is not None and marker != self._sent_marker:
            self.outlets.mark(marker)
            self._sent_marker = marker

    def check_flushed(self) -> None:
        """Raise if lines that were not waited for could not be flushed, and are still not on the disk.

        Raises
        ------
        StoreError
            A flush failed; the message gives the reason.
        """
        self.journal.check_flushed()

    def write_tables(self) -> None:
        """Update the session's tables from its journal.

        While the session runs only changed tables are written, without a flush, since the participant waits for the
        next page; at its end all are rewritten and flushed. A table that cannot be written now (open in another
        program, no space) does not stop the session: nothing is lost, since tables are made from the journal.
        ``behind`` gives the reason, and the next call tries again. Results of recordings since the last call are
        journalled first.
        """
        try:
            self._keep_recordings()
            for path, content in table_files(self.place, self._lines, opened_key(self.place.study_folder)):
                if self.journal.is_closed or self._written.get(path) != content:
                    write_file(path, content, waits=self.journal.is_closed)
                    self._written[path] = content
        except StoreError as error:
            self.behind = error
        else:
            self.behind = None

    def finish(self, status: str, reason: str = "") -> None:
        """Write the session's last line, its receipt, all tables, checksums and fingerprint, and close it.

        A completed session is recorded as incomplete if more trials are missing than the study permits; then the rule
        `exclusions.MISSING_RULE` excludes it.

        Raises
        ------
        StoreError
            A file could not be written; earlier journal lines are safe. A repeated call continues from there.
        """
        if self._is_over or not self.journal.is_closed:
            if self.recorder is not None:
                self.recorder.close()
            self._keep_recordings()
            self._ended_s = (
                self.clock.seconds() if self._ended_s is None else self._ended_s
            )  # the same at a second attempt
            missing = self.missing_trials
            if status == events.COMPLETED and missing.exceed:
                status, reason = events.INCOMPLETE, str(missing)
            ended = events.SessionEnded(status=status, reason=reason, within_limits=self._sealed_verdict())
            self.append(ended, t_s=self._ended_s)
            self.journal.close()
            self._receipt |= {"status": status, "reason": reason, "ended_at": self._lines[-1].at}
        self.write_tables()
        failures = [] if self.behind is None else [self.behind]
        table = partial(update_participants, self.place.study_folder, self.place.study)
        for write in (self._write_proofs, table, self._exclude_incomplete):
            try:
                write()
            except StoreError as error:
                failures.append(error)
        self.lock.release()
        if failures:
            raise StoreError(
                f"{failures[0]}; the journal is complete: run liquid-study rebuild {as_argument(self.folder.path)} to "
                "write what is missing"
            ) from failures[0]
        self._is_over = True

    def _sealed_verdict(self) -> bool | None:
        """Return whether all main trials are within all limits; None if not sealed, or if nothing was measured."""
        if not events.start_of(self._lines).measures_sealed:
            return None
        with contextlib.suppress(StoreError):  # a changed line must not prevent the end; `verify` reports it
            validity = session_tables.participant_row(open_events(self._lines, self.key))["validity"]
            return None if validity is None else validity == session_tables.VALID
        return None

    @property
    def missing_trials(self) -> MissingTrials:
        """The undelivered main trials so far."""
        return progress_of(self._lines).missing_trials

    def _exclude_incomplete(self) -> None:
        if self._receipt["status"] == events.INCOMPLETE:
            study, session = self.place.study_folder.path, self.place.folder
            exclude_incomplete(study, session.participant, session.number, str(self._receipt["reason"]))

    def close(self) -> None:
        """Close the session without an end; it stays unfinished.

        Raises
        ------
        StoreError
            The last lines could not be flushed.
        """
        self._is_over = True
        if self.journal.is_forked:
            return
        if self.recorder is not None:
            self.recorder.close(LEAVING_S)
        if not self.journal.is_closed:
            with contextlib.suppress(StoreError):  # `reopen_store` finds recordings without a line in the journal
                self._keep_recordings()
                if self._outlets_lost:
                    self._write_receipt()
        try:
            self.journal.close()
        finally:
            self.lock.release()

    def note_resumed(self, entry: Mapping[str, Any]) -> None:
        """Add the data of the resumption to the receipt."""
        self._receipt["resumed"] = [*self._receipt.get("resumed", ()), dict(entry)]
        self._write_receipt()

    def _write_receipt(self) -> None:
        """Write the receipt with the failures of outlets and their final counts of lost samples."""
        if self.outlets is not None and (lost := self.outlets.lost):
            entry = (self._receipt, *self._receipt.get("resumed", ()))[-1]
            entry["outlets_lost"] = dict(lost)
        receipt.write(self.folder.receipt, self._receipt)

    def _write_proofs(self) -> None:
        """Write the receipt first and then the proofs, which include its checksum."""
        self._write_receipt()
        value = fingerprint(write_checksums(self.folder), self._lines)
        if not self.fingerprint:
            note_fingerprint(self.place.study_folder, self.folder, value)
        self.fingerprint = value

    def _keep_recordings(self) -> None:
        """Write the results of recordings (files, or the reason for a loss) and failures of outlets to the journal."""
        if self.recorder is not None:
            self._results += self.recorder.collect_results()
        while self._results:
            self.append(self._results[0], waits=False)
            del self._results[0]
        for outlet, reason in ({} if self.outlets is None else self.outlets.lost).items():
            if outlet not in self._outlets_lost:
                self.append(events.OutletLost(outlet=outlet, reason=reason), waits=False)
                self._outlets_lost.add(outlet)

    def __enter__(self) -> SessionStore:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            self.close()
        except StoreError as failed:
            if error is None:
                raise
            error.add_note(str(failed))


def table_files(place: Place, lines: Sequence[events.Event], key: Key | None) -> tuple[tuple[Path, bytes], ...]:
    """Return path and content of each table of the session, made from the journal's lines alone.

    ``key`` is the study's opened key; without it the sealed columns are left out.
    """
    lines = open_events(lines, key)
    rows = session_tables.SessionRows(lines)
    columns = session_tables.table_columns(lines, opened=key is not None)
    return tuple(
        (place.folder.table(place.study, name), csv_files.csv_bytes(table_columns, rows.table(name)))
        for name, table_columns in columns.items()
    )
