"""The record of a session, as its page shows it. No Qt here."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from study_app.devices.registry import discover
from study_app.errors import StoreError
from study_app.gui.sessions.session_facts import SessionFacts, incidents, session_facts
from study_app.number_text import counted
from study_app.store.blinded.blinding import opened, opened_key
from study_app.store.delivered import beyond_limits
from study_app.store.exclusions import Exclusion, exclusions
from study_app.store.folders import SessionFolder, locate
from study_app.store.journals import journal
from study_app.store.journals.journal_events import Answer, Event, Note, Repeat, TrialStarted, start_of
from study_app.store.progress import progress_of
from study_app.store.tables import session_tables
from study_app.store.tables.study_files import row_of

MOST_POINTS = 2000  # of a drawn curve
LIMIT_WORDS: Mapping[str, tuple[str, str]] = {
    "lateness_p99_ms": ("lateness of ticks (99th percentile)", "ms"),
    "worst_gap_ms": ("longest time between two ticks", "ms"),
    "delay_error_p95_ms": ("error of the delay (95th percentile)", "ms"),
    "first_frame_gap_ms": ("time before the first frame", "ms"),
    "worst_frame_gap_ms": ("longest time between two frames", "ms"),
    "withheld_share": ("share of the force withheld", "%"),
    "targets_reached": ("targets reached, at least", "%"),
}
"""Of every measure that a limit judges: what it is, and its unit."""
MOTION_HIDDEN = "Hidden while the study is blinded: with this device, the recorded motion would reveal the liquid."
NO_MOTION = "This trial has no recording."


@dataclass(frozen=True, slots=True)
class TrialRecord:
    """One presentation of a trial.

    ``broken`` has a sentence for each limit that was broken; ``valid`` is None where nothing was measured; ``excluded``
    is why it is excluded from the analysis, None where it is not. ``unconfirmed`` are choices on a page that was left
    before they were confirmed, as "item: value": they are in no table. ``lost`` is why the recording could not be
    stored, "" where it was or none was requested.
    """

    number: int
    attempt: int
    words: str
    outcome: str
    valid: bool | None
    broken: tuple[str, ...]
    answers: int
    unconfirmed: tuple[str, ...]
    notes: str
    recording: Path | None
    lost: str
    excluded: str | None


@dataclass(frozen=True, slots=True)
class SessionRecord:
    """A session's page; ``motion_hidden`` is why no motion is shown, "" where it may be."""

    facts: SessionFacts
    about: str
    limits: str
    trials: tuple[TrialRecord, ...]
    notes: tuple[str, ...]
    files: tuple[tuple[str, int], ...]
    left_out: tuple[Exclusion, ...]
    motion_hidden: str


def read_record(folder: Path) -> SessionRecord:
    """Return what a session's folder holds.

    Raises
    ------
    StoreError
        It is no session's folder, or its journal or the list of exclusions cannot be read.
    """
    study, session = locate(folder)
    key = opened_key(study)
    lines = opened(journal.read(session.journal), key)
    if not lines:
        raise StoreError(f"{session.journal} has no line: the session did not begin")
    listed = exclusions(study.path)
    (facts,) = session_facts(study.path, row_of(session, key), listed, {})
    own = tuple(one for one in listed if one.what[:2] == (facts.participant, facts.session))
    start = start_of(lines)
    rows = session_tables.trials(lines)
    trials = _trials(session, rows, lines, start.limits, own)
    measured = any(device.name == start.device and not device.motion_shows_force for device in discover().devices)
    return SessionRecord(
        facts=facts,
        about=_about(lines, incidents(facts)),
        limits=limits_sentence(trials, sealed=key is None and bool(start.measures_sealed)),
        trials=trials,
        notes=tuple(_notes(lines)),
        files=tuple((name, (session.path / name).stat().st_size) for name in _files(session)),
        left_out=own,
        motion_hidden="" if measured or key is not None else MOTION_HIDDEN,
    )


def limits_sentence(trials: Sequence[TrialRecord], *, sealed: bool) -> str:
    """Return how many trials kept the study's limits, and what that means."""
    judged = [one for one in trials if one.valid is not None]
    outside = [one for one in judged if not one.valid]
    later = " Delay error, withheld force and targets reached are judged once the study is unblinded." if sealed else ""
    if not judged:
        return f"No trial has been measured yet.{later}"
    if not outside:
        return f"All {counted(len(judged), 'measured trial')} met the limits of the study.{later}"
    return (
        f"Out of limits: {len(outside)} of {counted(len(judged), 'measured trial')} exceeded a limit of the study. The "
        "answers are kept and still count; exclude those you do not trust. The column “Limits” and the line below "
        f"the table name the limit.{later}"
    )


def motion(recording: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times (n,) [s] and positions of the hand (n, 3) [m] of a recording, thinned to at most `MOST_POINTS`.

    Raises
    ------
    StoreError
        It cannot be read.
    """
    from study_app.store.recordings import read_samples  # noqa: PLC0415 - pyarrow: only once it is needed

    samples = read_samples(recording)
    thinned = samples[:: max(1, -(-len(samples) // MOST_POINTS))]
    times_s = (thinned["time_ns"] - (thinned["time_ns"][0] if len(thinned) else 0)) * 1e-9
    return np.asarray(times_s, np.float64), np.array(thinned["position_m"], np.float64)


def _trials(
    session: SessionFolder,
    rows: Sequence[Mapping[str, Any]],
    lines: Sequence[Event],
    limits: Mapping[str, float],
    own: Sequence[Exclusion],
) -> tuple[TrialRecord, ...]:
    reasons = {one.trial: one.reason for one in own}
    answered: dict[tuple[int, int], int] = {}
    unconfirmed = progress_of(lines).unconfirmed
    for row in session_tables.responses(lines):
        which = (row["trial"], row["attempt"])
        answered[which] = answered.get(which, 0) + (row["first_choice_s"] is not None)
    return tuple(
        TrialRecord(
            number=row["trial"],
            attempt=row["attempt"],
            words=_words(row),
            outcome=row["outcome"] or "running",
            valid=row["valid"],
            broken=tuple(broken_words(*one) for one in beyond_limits(row, limits)),
            answers=answered.get((row["trial"], row["attempt"]), 0),
            unconfirmed=_choices(unconfirmed.get((row["trial"], row["attempt"]), {})),
            notes=" · ".join(_row_notes(row)),
            recording=session.path / row["recording"] if row["recording"] else None,
            lost=row["recording_lost"] or "",
            excluded=reasons.get(row["trial"]),
        )
        for row in rows
    )


def _choices(given: Mapping[str, Answer]) -> tuple[str, ...]:
    """Return choices as "item: value", in the order in which the items were first answered."""
    chosen = sorted(given.items(), key=lambda one: one[1].first_s or 0.0)
    return tuple(f"{item}: {'cannot judge' if one.value is None else one.value}" for item, one in chosen)


def _row_notes(row: Mapping[str, Any]) -> list[str]:
    said = [("recording lost", row["recording_lost"]), ("marked", row["marked"])]
    return [word for word, holds in said if holds] + (row["notes"] or "").splitlines()


def broken_words(measure: str, value: float, limit: float) -> str:
    """Return a sentence on a limit that was broken."""
    what, unit = LIMIT_WORDS[measure]
    return f"{what}: {value:.3g} {unit}, limit {limit:g} {unit}"


def _words(row: Mapping[str, Any]) -> str:
    """Return what was presented without a condition: "Part 1, L2", "practice, 2nd attempt"."""
    phase = f"Part {row['part']}" if row["part"] is not None else str(row["phase"]).capitalize()
    again = "" if row["attempt"] == 1 else f", attempt {row['attempt']}"
    return f"{phase}, {row['code']}{again}"


def _about(lines: Sequence[Event], happened: str) -> str:
    start, row = start_of(lines), session_tables.participant(lines)
    ended = row["session_ended_at"]
    said = [
        f"Device {start.device}",
        f"language {row['language']}",
        f"operator {start.operator}" if start.operator else "",
        f"seed {start.seed}",
        f"ended {datetime.fromisoformat(ended):%H:%M}" if ended else "not ended",
        counted(row["resumed"], "resume") if row["resumed"] else "",
        happened,
    ]
    return "  ·  ".join(filter(None, said))


def _notes(lines: Sequence[Event]) -> list[str]:
    trial, found = None, []
    for line in lines:
        if isinstance(line, TrialStarted):  # recordings of the trial before are reported later
            trial = line.trial
        if not isinstance(line, Note | Repeat):
            continue
        text = f"repeated: {line.reason}" if isinstance(line, Repeat) else line.text or "marked"
        where = "before the first trial" if trial is None else f"trial {trial}"
        found.append(f"{datetime.fromisoformat(line.at):%H:%M}, {where}: {text}")
    return found


def _files(session: SessionFolder) -> list[str]:
    return sorted(path.relative_to(session.path).as_posix() for path in session.path.rglob("*") if path.is_file())
