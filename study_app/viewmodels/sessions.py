"""What a row says of a session, as values. No Qt here."""

import contextlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Literal, TypeAlias

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.exclusions import Exclusion, exclusions
from study_app.store.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.sessions.folder_lock import is_open
from study_app.store.sites.merged import session_in
from study_app.store.study_runs import run_of
from study_app.store.tables.study_files import participants

Kind: TypeAlias = Literal["", "pilot", "simulated", "sample"]
KINDS: dict[Kind, str] = {"": "Participants", "pilot": "Pilot", "simulated": "Simulated", "sample": "Sample"}
"""What sessions are, with the words for a filter; simulated are rehearsals and sessions on simulated devices, but no
pilots."""
SAMPLE = "sample-"


@dataclass(frozen=True, slots=True)
class SessionFacts:
    """A session as a row shows it.

    ``status`` is the table's, or "running" where a program has the session open. ``excluded`` is why the analysis
    excludes all of it, None where it does not; ``lost`` counts recordings that could not be stored, ``reconnected`` how
    often the device failed and was connected again, ``outlets_lost`` streams and ports that failed.
    """

    participant: str
    session: int
    study: str
    started: datetime
    status: str
    validity: str | None
    answers: int
    answers_of: int | None
    simulated: bool
    pilot: bool
    folder: Path
    excluded: str | None = None
    lost: int = 0
    reconnected: int = 0
    outlets_lost: int = 0

    @property
    def version(self) -> str:
        """The study's version that it was run with, by its receipt, which is read then; "" where that does not say."""
        run = run_of(SessionFolder(self.folder, self.participant, self.session).receipt)
        return "" if run is None else run.version

    @property
    def kind(self) -> Kind:
        """The kind "sample", "simulated" or "pilot"; "" for a session of a participant.

        Samples are the simulated sessions that ship with the program, in a folder whose name begins with "sample-". A
        pilot stays one where its first steps or its device were simulated.
        """
        if self.simulated and self.folder.parents[2].name.startswith(SAMPLE):
            return "sample"
        if self.pilot:
            return "pilot"
        return "simulated" if self.simulated else ""

    @property
    def needs_care(self) -> bool:
        """Whether it was begun and never ended."""
        return self.status in {"unfinished", "damaged"}

    @property
    def counts(self) -> bool:
        """Whether its answers enter measures and figures."""
        return self.status == "completed" and self.excluded is None

    @property
    def name(self) -> str:
        """The participant, and which session it is where it is not the first."""
        return self.participant if self.session == 1 else f"{self.participant}, session {self.session}"


def sessions(results: Path, answers_of: Mapping[str, int]) -> tuple[SessionFacts, ...]:
    """Return the sessions in all study folders under ``results``: those that need care first, then the newest.

    ``answers_of`` says how many answers a whole session of a study has. Folders that hold no study are passed over.
    """
    found: list[SessionFacts] = []
    for data in sorted(results.glob("*/data")):
        with contextlib.suppress(StoreError):  # not ours, or not readable: the commands say why when asked about it
            rows = participants(StudyFolder(data.parent))
            found += session_facts(data.parent, rows, _exclusions(data.parent), answers_of)
    return tuple(sorted(found, key=lambda session: (not session.needs_care, -session.started.timestamp())))


def session_facts(
    study: Path, rows: Iterable[Mapping[str, Any]], listed: Iterable[Exclusion], answers_of: Mapping[str, int]
) -> list[SessionFacts]:
    """Return the rows of a study's participants as facts; ``listed`` is what is excluded from the analysis."""
    reasons = {(one.participant, one.session): one.reason for one in listed if one.trial is None}
    placed = [(row, session_in(study, row["participant"], int(row["session"]))) for row in rows]
    counts = [
        journal.count_events(session.journal, "recording_lost", "device_reconnected", "outlet_lost")
        for _, session in placed
    ]
    return [
        SessionFacts(
            participant=row["participant"],
            session=int(row["session"]),
            study=str(row["study"]),
            started=_started(_began(row, session), session.path),
            status="running" if row["status"] == "unfinished" and is_open(session.path) else row["status"],
            validity=row["validity"],
            answers=int(row["responses"] or 0),
            answers_of=answers_of.get(row["study"]),
            simulated=bool(row["simulated"]),
            pilot=bool(row["pilot"]),
            folder=session.path,
            excluded=reasons.get((row["participant"], int(row["session"]))),
            lost=lost,
            reconnected=reconnected,
            outlets_lost=outlets_lost,
        )
        for (row, session), (lost, reconnected, outlets_lost) in zip(placed, counts, strict=True)
    ]


def _began(row: Mapping[str, Any], session: SessionFolder) -> object:
    """Return when a session began; of a pilot that was played from a later step when it was played."""
    if row["pilot"] and row["simulated"] and row.get("resumed"):
        with contextlib.suppress(StoreError):
            return receipt.began_at(receipt.read(session.receipt))
    return row["session_started_at"]


def _started(time: object, folder: Path) -> datetime:
    """Return when a session began; where its journal is too damaged to tell, when its folder last changed."""
    with contextlib.suppress(ValueError):
        return datetime.fromisoformat(str(time))
    with contextlib.suppress(OSError):
        return datetime.fromtimestamp(folder.stat().st_mtime).astimezone()
    return datetime.fromtimestamp(0).astimezone()


def _exclusions(study: Path) -> tuple[Exclusion, ...]:
    """Return what is left out; nothing where the list cannot be read, which the commands complain of."""
    with contextlib.suppress(StoreError):
        return exclusions(study)
    return ()


def started_words(started: datetime, now: datetime) -> str:
    """Return when a session began as people say it: "Today 09:31", "Yesterday 16:11", "18 Nov 15:20"."""
    days = (now.date() - started.date()).days
    day = {0: "Today", 1: "Yesterday"}.get(days, f"{started.day} {started:%b}")
    year = "" if started.year == now.year else f" {started.year}"
    return f"{day}{year} {started:%H:%M}"
