"""What a session's folder tells: its record, stages, tracks and columns."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import groupby
from pathlib import Path
from statistics import median
from typing import Any, Final, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.devices.registry import discover
from study_app.errors import StoreError
from study_app.number_text import counted
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import FormStep, PageStep, Schedule, Step, Trial
from study_app.store.blinded.blinding import opened, opened_key
from study_app.store.delivered import beyond_limits
from study_app.store.exclusions import Exclusion, exclusions
from study_app.store.folders import SessionFolder, locate
from study_app.store.journals import journal
from study_app.store.journals.journal_events import Answer, Event, Note, Repeat, TrialStarted, start_of
from study_app.store.progress import Progress, TrialAnswer, progress_of
from study_app.store.tables import session_tables
from study_app.store.tables.study_files import row_of
from study_app.viewmodels.number_words import grouped
from study_app.viewmodels.sessions import SessionFacts, session_facts

Name: TypeAlias = Literal["participant", "study", "started", "status", "validity", "answers", "version"]
Tone: TypeAlias = Literal["ok", "warn", "bad", "accent", "neutral"]
Chipped: TypeAlias = tuple[Tone, str, str]
"""Tone, icon and word of a chip."""

STATUS: dict[str, Chipped] = {
    "completed": ("ok", "check", "Complete"),
    "running": ("accent", "play", "Running"),
    "unfinished": ("warn", "clock", "Interrupted"),
    "withdrawn": ("neutral", "cross", "Withdrawn"),
    "aborted": ("neutral", "cross", "Ended early"),
    "broken": ("bad", "warning", "Fault"),
    "damaged": ("bad", "warning", "Damaged"),
}
VALIDITY: dict[str | None, Chipped] = {
    "valid": ("ok", "check", "Valid"),
    "invalid": ("warn", "warning", "Out of limits"),
    None: ("neutral", "ring", "Open"),
}
LOST: Chipped = ("warn", "warning", "Recording lost")


class Column(NamedTuple):
    """What a column holds, its heading, and its share of the width; at least ``least`` px of it."""

    name: Name
    heading: str
    width: int
    least: int


def status_chip(facts: SessionFacts) -> Chipped:
    """Return what the chip says of how a session ended."""
    return STATUS.get(facts.status, ("neutral", "ring", facts.status.capitalize()))


def validity_chip(facts: SessionFacts) -> Chipped:
    """Return what the chip says of a session's limits and recordings, or that it does not count at all."""
    if facts.excluded is not None:
        return "neutral", "cross", "Excluded"
    if facts.lost and facts.validity != "invalid":
        return LOST
    return VALIDITY[None if facts.needs_care or facts.status == "running" else facts.validity]


def incidents(facts: SessionFacts) -> str:
    """Return what happened to device, recordings and outlets: "2 recordings lost, device reconnected", or nothing."""
    lost = f"{counted(facts.lost, 'recording')} lost" if facts.lost else ""
    times = "" if facts.reconnected == 1 else f" {facts.reconnected} times"
    outlets = f"{counted(facts.outlets_lost, 'outlet')} failed" if facts.outlets_lost else ""
    return ", ".join(filter(None, (lost, f"device reconnected{times}" if facts.reconnected else "", outlets)))


def answers_words(facts: SessionFacts) -> str:
    """Return "12 of 62", or "12" where the whole is not known."""
    return f"{facts.answers} of {facts.answers_of}" if facts.answers_of is not None else str(facts.answers)


def matching(words: str, status: str) -> Callable[[SessionFacts], bool]:
    """Return whether a session's participant holds ``words`` and its state is ``status`` ("" for any).

    ``status`` is one of `STATUS`, "excluded", "invalid" or "lost".
    """
    wanted = words.strip().lower()

    def matches(facts: SessionFacts) -> bool:
        if wanted not in facts.participant.lower():
            return False
        if status == "excluded":
            return facts.excluded is not None
        if status == "lost":
            return facts.lost > 0
        return status in {"", facts.status} or (status == "invalid" and facts.validity == "invalid")

    return matches


def states_of(found: Iterable[SessionFacts]) -> list[tuple[str, str]]:
    """Return the states that occur among sessions, with their words, in the order of `STATUS`."""
    there = list(found)
    states = [(status, word) for status, (_, _, word) in STATUS.items() if any(one.status == status for one in there)]
    if any(one.validity == "invalid" for one in there):
        states.append(("invalid", VALIDITY["invalid"][2]))
    if any(one.lost for one in there):
        states.append(("lost", LOST[2]))
    if any(one.excluded is not None for one in there):
        states.append(("excluded", "Excluded"))
    return states


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


# A block of more trials than this is one row of the rail ("Delay settings 1 to 7"), so that a day's study fits it.
ROWS_PER_BLOCK = 4


@dataclass(frozen=True, slots=True)
class Stage:
    """One row of the rail: the schedule's steps ``first`` to ``last`` under one neutral ``label``."""

    label: str
    first: int
    last: int


def operator_language(protocol: Protocol) -> str:
    """Return the language in which the operator reads a study's own texts: English, or the study's first."""
    return "en" if "en" in protocol.study.languages else protocol.study.languages[0]


def stages(protocol: Protocol, schedule: Schedule) -> tuple[Stage, ...]:
    """Return the rows of the rail: pages and settings one by one, longer blocks as one row."""
    language = operator_language(protocol)
    rows: list[Stage] = []
    index = 0
    while index < len(schedule.steps):
        step = schedule.steps[index]
        if not isinstance(step, Trial):
            rows.append(Stage(step_title(protocol, step, language), index, index))
            index += 1
            continue
        last = index
        while last + 1 < len(schedule.steps) and _same_block(step, schedule.steps[last + 1]):
            last += 1
        rows.extend(_block_rows(protocol, schedule, index, last, language))
        index = last + 1
    return tuple(rows)


def step_title(protocol: Protocol, step: PageStep | FormStep, language: str) -> str:
    """Return the title of a page or form."""
    if isinstance(step, FormStep):
        return form_title(protocol, step.form, language)
    return protocol.text(protocol.pages[step.page_id].title, language)


def form_title(protocol: Protocol, form: str, language: str) -> str:
    """Return the title of a form, or its id as words."""
    title = protocol.questionnaires[form].title
    return form.replace("_", " ").capitalize() if title is None else protocol.text(title, language)


def _same_block(trial: Trial, other: Step) -> bool:
    return isinstance(other, Trial) and other.block == trial.block


def _block_rows(protocol: Protocol, schedule: Schedule, first: int, last: int, language: str) -> list[Stage]:
    trials = [step for step in schedule.steps[first : last + 1] if isinstance(step, Trial)]
    if len(trials) <= ROWS_PER_BLOCK:
        return [Stage(trial.label(protocol, language), first + i, first + i) for i, trial in enumerate(trials)]
    label = protocol.text(protocol.blocks[trials[0].block].setting_label, language)
    return [Stage(f"{label} {trials[0].index} to {trials[-1].index}", first, last)]


LONG_RUN: Final = 8
"""So many equal answers in a row are marked."""
UNDELIVERED: Final[Mapping[str, str]] = {
    "lateness_ms": "the servo was late",
    "worst_gap_ms": "the servo missed ticks",
    "delay_error_ms": "the visual delay was not kept",
    "frame_gap_ms": "frames were late or missing",
    "withheld_percent": "force was withheld for safety",
    "targets_percent": "too few targets were reached",
    "level_error_percent": "the force was not as requested",
    "level_error_ms": "the visual delays did not differ as requested",
    "pace_error_percent": "the hand did not keep the pace",
    "force_limit_n": "the force limit was reached",
}
"""Why an interval was invalid, by the key of the limit that it broke."""
FAST_S: Final = 0.3
"""A median time to answer below this is marked [s]."""


def track_words(progress: Progress, schedule: Schedule, trial: Trial, choices: Mapping[str, str]) -> tuple[str, ...]:
    """Return lines on the track of ``trial``; ``choices`` are its answers in words.

    A line that ends in "check" deserves attention.
    """
    own = [one.number for one in schedule.trials if (one.block, one.code) == (trial.block, trial.code)]
    answers = [progress.trial_answers[number] for number in own if number in progress.trial_answers]
    limits = Counter(limit for number in own for limit in progress.undelivered.get(number, ()))
    behind = [number for number in own if progress.steps.get(number, progress.here) < progress.here]
    given_up = [number for number in behind if number in progress.undelivered and number not in progress.trial_answers]
    reasons = Counter(reason for number in own for reason in progress.repeated.get(number, ()))
    return (
        f"Track {trial.code}: {len(answers)} of at most {grouped(len(own))} answered",
        *(_of_answers(answers, choices) if answers else ()),
        *(f"repeated {count}: {reason}" for reason, count in reasons.items()),
        *(f"not delivered {count}: {UNDELIVERED.get(limit, limit)}" for limit, count in limits.items()),
        *([f"{len(given_up)} unanswered: no attempt was delivered"] if given_up else []),
    )


def unanswered_words(progress: Progress) -> str:
    """Return how many trials an ended session left unanswered since no attempt was delivered; "" for none."""
    count = sum(number not in progress.trial_answers for number in progress.undelivered)
    return f"{counted(count, 'trial')} unanswered: no attempt was delivered" if count else ""


def _of_answers(answers: Sequence[TrialAnswer], choices: Mapping[str, str]) -> list[str]:
    given = [str(one.value) for one in answers]
    shares = ", ".join(f"{words} {100 * given.count(choice) / len(given):.0f} %" for choice, words in choices.items())
    run = max(len(list(same)) for _, same in groupby(given))
    lines = [*([shares] if shares else []), f"longest run {run}" + (": check" if run >= LONG_RUN else "")]
    seconds = [one.seconds for one in answers if one.seconds is not None]
    if seconds:
        middle = median(seconds)
        lines.append(f"median answer time {middle:.2f} s" + (": check" if middle < FAST_S else ""))
    return lines
