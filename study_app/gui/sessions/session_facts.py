"""Facts about sessions: the rows of their tables, with chips and filters, and the extent of a session."""

import contextlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

from study_app.errors import StoreError
from study_app.gui.theme.theme import Tone
from study_app.number_text import counted, duration_range
from study_app.protocol.descriptions import number_range
from study_app.protocol.model import Protocol
from study_app.protocol.orders import FormStep, PageStep, expected_duration_s, orders_of, variants
from study_app.store import receipt
from study_app.store.exclusions import Exclusion, exclusions
from study_app.store.files import TRIALS_MISSING, SessionFolder, StudyFolder
from study_app.store.integrity import is_open
from study_app.store.journals import journal
from study_app.store.journals.journal_events import REACHED_END
from study_app.store.merged import session_in
from study_app.store.session_progress import MissingTrials, progress_of
from study_app.store.tables import participant_rows
from study_app.store.versions import run_of

Kind: TypeAlias = Literal["", "pilot", "simulated", "sample"]
KINDS: dict[Kind, str] = {"": "Participants", "pilot": "Pilot", "simulated": "Simulated", "sample": "Sample"}
"""The kinds of sessions with their labels in a filter; "simulated" are rehearsals and sessions on simulated devices,
except pilots."""
SAMPLE = "sample-"


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionFacts:
    """The facts about a session that its row shows.

    ``status`` is that of the table, or "running" if a program has the session open. ``excluded`` is the reason why the
    whole session is excluded from the analysis, or None. ``lost`` counts recordings that could not be stored,
    ``reconnected`` reconnections of the device, ``outlets_lost`` failed streams and ports. ``missing`` are the
    undelivered trials, or None if all were delivered. ``group`` is "" without groups or while it is sealed.
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
    missing: MissingTrials | None = None
    group: str = ""

    @property
    def version(self) -> str:
        """The study's version in the session's receipt, or ""."""
        run = run_of(SessionFolder(self.folder, self.participant, self.session).receipt)
        return "" if run is None else run.version

    @property
    def kind(self) -> Kind:
        """The kind "sample", "simulated" or "pilot"; "" for a participant's session.

        Samples are the simulated sessions that ship with the program, in a folder whose name begins with "sample-". A
        pilot is still a pilot if its first steps or its device were simulated.
        """
        if self.simulated and self.folder.parents[2].name.startswith(SAMPLE):
            return "sample"
        if self.pilot:
            return "pilot"
        return "simulated" if self.simulated else ""

    @property
    def needs_care(self) -> bool:
        return self.status in {"unfinished", "damaged"}

    @property
    def is_counted(self) -> bool:
        return self.status in REACHED_END and self.excluded is None

    @property
    def name(self) -> str:
        """The participant, with the session's number unless it is the first."""
        return self.participant if self.session == 1 else f"{self.participant}, session {self.session}"


def sessions(results: Path, answers_of: Mapping[str, int]) -> tuple[SessionFacts, ...]:
    """Return the sessions in all study folders under ``results``: first those that need attention, then the newest.

    ``answers_of`` maps studies to the number of answers in a complete session. Folders without a study are skipped.
    """
    facts: list[SessionFacts] = []
    for data in sorted(results.glob("*/data")):
        with contextlib.suppress(StoreError):  # not a study folder, or unreadable, which the commands report
            rows = participant_rows(StudyFolder(data.parent))
            facts += session_facts(data.parent, rows, _exclusions(data.parent), answers_of)
    return tuple(sorted(facts, key=lambda session: (not session.needs_care, -session.started.timestamp())))


def session_facts(
    study: Path, rows: Iterable[Mapping[str, Any]], listed: Iterable[Exclusion], answers_of: Mapping[str, int]
) -> list[SessionFacts]:
    """Return the facts about a study's sessions; ``listed`` are the study's exclusions from the analysis."""
    reasons = {
        (exclusion.participant, exclusion.session): exclusion.reason for exclusion in listed if exclusion.trial is None
    }
    located = [(row, session_in(study, row["participant"], int(row["session"]))) for row in rows]
    counts = [
        journal.count_events(session.journal, "recording_lost", "device_reconnected", "outlet_lost")
        for _, session in located
    ]
    return [
        SessionFacts(
            participant=row["participant"],
            session=int(row["session"]),
            study=str(row["study"]),
            started=_start_time(_recorded_start(row, session), session.path),
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
            group=row.get("group") or "",
            missing=_missing_trials(session) if row.get(TRIALS_MISSING.name) else None,
        )
        for (row, session), (lost, reconnected, outlets_lost) in zip(located, counts, strict=True)
    ]


def _missing_trials(session: SessionFolder) -> MissingTrials | None:
    """Return the undelivered trials of a session; None if its journal cannot be read."""
    with contextlib.suppress(StoreError):
        return progress_of(journal.read(session.journal)).missing_trials
    return None


def _recorded_start(row: Mapping[str, Any], session: SessionFolder) -> object:
    """Return the start time of a session; for a pilot played from a later step, the time of playing."""
    if row["pilot"] and row["simulated"] and row.get("resumed"):
        with contextlib.suppress(StoreError):
            return receipt.began_at(receipt.read(session.receipt))
    return row["session_started_at"]


def _start_time(time: object, folder: Path) -> datetime:
    """Return the start time of a session; for a damaged journal, the time of the folder's last change."""
    with contextlib.suppress(ValueError):
        return datetime.fromisoformat(str(time))
    with contextlib.suppress(OSError):
        return datetime.fromtimestamp(folder.stat().st_mtime).astimezone()
    return datetime.fromtimestamp(0).astimezone()


def _exclusions(study: Path) -> tuple[Exclusion, ...]:
    """Return the exclusions; empty if the list cannot be read, which the commands report."""
    with contextlib.suppress(StoreError):
        return exclusions(study)
    return ()


def start_time_text(started: datetime, now: datetime) -> str:
    """Return a start in the time zone of ``now`` as text: "Today 09:31", "Yesterday 16:11", "18 Nov 15:20"."""
    started = started.astimezone(now.tzinfo)
    days = (now.date() - started.date()).days
    day = {0: "Today", 1: "Yesterday"}.get(days, f"{started.day} {started:%b}")
    year = "" if started.year == now.year else f" {started.year}"
    return f"{day}{year} {started:%H:%M}"


_Name: TypeAlias = Literal["participant", "study", "started", "status", "validity", "answers", "version"]
_ChipState: TypeAlias = tuple[Tone, str, str]
"""Tone, icon and word of a chip."""

_STATUS: dict[str, _ChipState] = {
    "completed": ("ok", "check", "Complete"),
    "incomplete": ("warn", "warning", "Incomplete"),
    "running": ("accent", "play", "Running"),
    "unfinished": ("warn", "clock", "Interrupted"),
    "withdrawn": ("neutral", "cross", "Withdrawn"),
    "aborted": ("neutral", "cross", "Ended early"),
    "broken": ("bad", "warning", "Fault"),
    "damaged": ("bad", "warning", "Damaged"),
}
VALIDITY: dict[str | None, _ChipState] = {
    "valid": ("ok", "check", "Valid"),
    "invalid": ("warn", "warning", "Out of limits"),
    None: ("neutral", "ring", "Open"),
}
LOST: _ChipState = ("warn", "warning", "Recording lost")
_MISSING: _ChipState = ("warn", "warning", "Trials missing")


LIMIT_WORDS: Mapping[str, tuple[str, str]] = {
    "lateness_p99_ms": ("tick lateness (99th percentile)", "ms"),
    "worst_gap_ms": ("longest time between two ticks", "ms"),
    "delay_error_p95_ms": ("delay error (95th percentile)", "ms"),
    "first_frame_gap_ms": ("time before the first frame", "ms"),
    "worst_frame_gap_ms": ("longest time between two frames", "ms"),
    "withheld_share": ("proportion of the force held back", "%"),
    "targets_reached": ("targets reached (minimum)", "%"),
}
"""The description and unit of every measure that has a limit."""


def broken_limit_text(measure: str, value: float, limit: float) -> str:
    """Return a sentence about a violated limit."""
    description, unit = LIMIT_WORDS[measure]
    return f"{description}: {value:.3g} {unit}, limit {limit:g} {unit}"


class Column(NamedTuple):
    """A column: its content, its heading, its fraction of the width, and its minimum width ``least`` [px]."""

    name: _Name
    heading: str
    width: int
    least: int


def status_chip(facts: SessionFacts) -> _ChipState:
    """Return the chip with the status of a session."""
    return _STATUS.get(facts.status, ("neutral", "ring", facts.status.capitalize()))


def validity_chip(facts: SessionFacts) -> _ChipState:
    """Return the chip with the validity of a session, or its exclusion."""
    if facts.excluded is not None:
        return "neutral", "cross", "Excluded"
    if facts.validity != "invalid" and (facts.missing or facts.lost):
        return _MISSING if facts.missing else LOST
    return VALIDITY[None if facts.needs_care or facts.status == "running" else facts.validity]


def incidents_text(facts: SessionFacts) -> str:
    """Return the incidents of device, recordings and outlets: "2 recordings lost, device reconnected"; "" if none."""
    lost = f"{counted(facts.lost, 'recording')} lost" if facts.lost else ""
    times = "" if facts.reconnected == 1 else f" {facts.reconnected} times"
    outlets = f"{counted(facts.outlets_lost, 'outlet')} failed" if facts.outlets_lost else ""
    return ", ".join(filter(None, (lost, f"device reconnected{times}" if facts.reconnected else "", outlets)))


def answers_text(facts: SessionFacts) -> str:
    """Return "12 of 62", or "12" if the total is unknown."""
    return f"{facts.answers} of {facts.answers_of}" if facts.answers_of is not None else str(facts.answers)


def session_filter(text: str, status: str) -> Callable[[SessionFacts], bool]:
    """Return a predicate: whether participant or group contain ``text`` and the state is ``status`` ("" for any).

    ``status`` is one of `_STATUS`, "excluded", "invalid" or "lost".
    """
    search_text = text.strip().lower()

    def matches(facts: SessionFacts) -> bool:
        if search_text not in facts.participant.lower() and search_text not in facts.group.lower():
            return False
        if status == "excluded":
            return facts.excluded is not None
        if status == "lost":
            return facts.lost > 0
        return status in {"", facts.status} or (status == "invalid" and facts.validity == "invalid")

    return matches


def occurring_states(sessions: Iterable[SessionFacts]) -> list[tuple[str, str]]:
    """Return the states that occur among sessions with their labels, in the order of `_STATUS`."""
    listed = list(sessions)
    states = [
        (status, word)
        for status, (_, _, word) in _STATUS.items()
        if any(session.status == status for session in listed)
    ]
    if any(session.validity == "invalid" for session in listed):
        states.append(("invalid", VALIDITY["invalid"][2]))
    if any(session.lost for session in listed):
        states.append(("lost", LOST[2]))
    if any(session.excluded is not None for session in listed):
        states.append(("excluded", "Excluded"))
    return states


def operator_language(protocol: Protocol) -> str:
    """Return the operator's language for a study's texts: English, or the study's first."""
    return "en" if "en" in protocol.study.languages else protocol.study.languages[0]


def step_title(protocol: Protocol, step: PageStep | FormStep, language: str) -> str:
    """Return the title of a page or form."""
    if isinstance(step, FormStep):
        return _form_title(protocol, step.form, language)
    return protocol.text(protocol.pages[step.page_id].title, language)


def _form_title(protocol: Protocol, form: str, language: str) -> str:
    """Return the title of a form or, without one, its ID as words."""
    title = protocol.questionnaires[form].title
    return form.replace("_", " ").capitalize() if title is None else protocol.text(title, language)


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """Parts, settings, answers and expected duration [s] of each kind of session of a study.

    ``setting`` is the noun for a trial's content: "setting", or "trial" if blocks have designs.
    """

    parts: tuple[int, ...]
    settings: tuple[int, ...]
    setting: str
    answers: tuple[int, ...]
    expected_s: tuple[float, ...]

    @property
    def duration(self) -> str:
        """The expected duration as text, as a range if the kinds of sessions differ."""
        return duration_range(min(self.expected_s), max(self.expected_s))


def extent_of(protocol: Protocol) -> Extent:
    """Return the extent of a study's sessions: parts, settings, answers and duration."""
    sessions = [variant.protocol for variant in variants(protocol)]
    orders = [orders_of(session) for session in sessions]
    return Extent(
        parts=tuple(session.parts for session in sessions),
        settings=tuple(sum(block.trials for block in order.blocks if block.phase == "main") for order in orders),
        setting="setting" if all(block.design is None for block in protocol.blocks.values()) else "trial",
        answers=tuple(order.answers for order in orders),
        expected_s=tuple(expected_duration_s(session) for session in sessions),
    )


def count_range_text(numbers: Sequence[int], word: str) -> str:
    """Return "1 part", "2 parts", or "1 to 2 parts" if sessions differ."""
    return f"{number_range(numbers)} {word}" if set(numbers) == {1} else f"{number_range(numbers)} {word}s"
