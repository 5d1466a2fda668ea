"""The column dictionary: every column of every table, said once.

Headers, ``dataset_description.json`` and every check of a finished folder are made from these lines. Columns of one
name mean the same in every table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

from study_app.haptics.model.layout import LIMITER_NAMES

Kind: TypeAlias = Literal["text", "integer", "number", "flag", "time"]

MISSING = "n/a"


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its name, what its cells are, and what they mean.

    ``kind``: flags are ``true`` or ``false``, times ISO 8601 with zone. ``levels`` are all permitted values where
    these are few, each with its meaning. Where ``may_miss``, a cell can be ``n/a``. A ``sealed`` column can tell the
    condition: no table has it before the study's key was opened.
    """

    name: str
    kind: Kind
    description: str
    unit: str = ""
    levels: tuple[tuple[str, str], ...] = ()
    minimum: float | None = None
    maximum: float | None = None
    may_miss: bool = False
    sealed: bool = False


_STUDY = Column("study", "text", "Short name of the study, from its protocol.")
_PARTICIPANT = Column("participant", "text", "The participant's id: letters and digits, no name.")
_SESSION = Column("session", "integer", "Number of the participant's session.", minimum=1, maximum=99)
_SIMULATED = Column("simulated", "flag", "true where participant and device were simulated (a rehearsal).")
_PILOT = Column("pilot", "flag", "true where the session was a pilot.")
_TRIAL = Column("trial", "integer", "Number of the trial in the session, in the order of presentation.", minimum=1)
_ATTEMPT = Column(
    "attempt", "integer", "1, or higher where the trial was presented again; the highest counts.", minimum=1
)
_BLOCK = Column("block", "text", "Id of the block of trials.")
_PHASE = Column(
    "phase",
    "text",
    "What the trial is for; only main trials are analysed.",
    levels=(
        ("main", "counts"),
        ("practice", "learning the task"),
        ("baseline", "the undisturbed task that later statements compare with"),
    ),
)
_PART = Column("part", "integer", "Part of the study as the participant is told it.", minimum=1, may_miss=True)
_INDEX = Column("index", "integer", "Place of the trial in its block, from 1.", minimum=1)
_CODE = Column("code", "text", "What was presented, as a code (L1, D3 ...) that the sealed key translates.")

RESPONSES: tuple[Column, ...] = (
    _STUDY,
    _PARTICIPANT,
    _SESSION,
    _SIMULATED,
    _PILOT,
    _TRIAL,
    _ATTEMPT,
    _BLOCK,
    _PHASE,
    _PART,
    _INDEX,
    _CODE,
    Column("item", "text", "Id of the statement; its words are in the session's receipt."),
    Column("number", "integer", "Place of the statement on its page, from 1, as shown.", minimum=1),
    Column(
        "response",
        "integer",
        "The answer on the scale, from 1 (completely disagree) to 7 (completely agree).",
        minimum=1,
        maximum=7,
        may_miss=True,
    ),
    Column("cannot_judge", "flag", "true where the participant chose the answer off the scale."),
    Column("onset_s", "number", "When the statement was shown, on the session's clock.", "s", minimum=0, may_miss=True),
    Column(
        "first_choice_s",
        "number",
        "When an answer was first chosen, on the session's clock.",
        "s",
        minimum=0,
        may_miss=True,
    ),
    Column(
        "last_change_s",
        "number",
        "When the final answer was chosen, on the session's clock.",
        "s",
        minimum=0,
        may_miss=True,
    ),
    Column("changes", "integer", "How often an answer already chosen was changed.", minimum=0),
    Column("answered_at", "time", "When the page of statements was confirmed."),
)


def _measure(name: str, description: str, unit: str = "", *, sealed: bool = False) -> Column:
    return Column(name, "number", description, unit, minimum=0, may_miss=True, sealed=sealed)


def _count(name: str, description: str, *, sealed: bool = False) -> Column:
    return Column(name, "integer", description, minimum=0, may_miss=True, sealed=sealed)


def _delay_error(name: str, which: str) -> Column:
    return Column(name, "number", f"Visual delay, achieved less requested: {which}.", "ms", may_miss=True, sealed=True)


_LIMITERS = {
    "slope": "the slope limit bounded the change of force with speed",
    "non_finite": "a force that was not finite was replaced by zero",
    "energy": "the passivity controller changed the force",
    "norm": "the force was cut to the force limit",
    "slew": "the change of force was slowed",
    "fade": "the force was fading in or out",
    "stale": "the device had no new sample in time",
    "glitch": "a sample was refused as impossible",
    "stop": "the force was stopped",
    "estimator": "EWMA gave the velocity, because the Kalman filter's innovations were too large or the delay changed",
}

TRIALS: tuple[Column, ...] = (
    _STUDY,
    _PARTICIPANT,
    _SESSION,
    _SIMULATED,
    _PILOT,
    _TRIAL,
    _ATTEMPT,
    _BLOCK,
    _PHASE,
    _PART,
    _INDEX,
    Column("of", "integer", "Number of trials in the block.", minimum=1),
    _CODE,
    Column("trial_started_at", "time", "When the trial began."),
    Column("trial_started_s", "number", "When the trial began, on the session's clock.", "s", minimum=0),
    Column(
        "outcome",
        "text",
        "How the trial ended; n/a while it runs.",
        levels=(
            ("complete", "the task was done"),
            ("timeout", "the task's time ran out"),
            ("interrupted", "stopped before its end: paused, repeated, broken off, or the program ended"),
        ),
        may_miss=True,
    ),
    _measure(
        "duration_s", "From the trial's first painted frame to the task's end, on the device's clock.", "s", sealed=True
    ),
    _count("targets_reached", "Targets reached.", sealed=True),
    _count("targets", "Targets to be reached; n/a where the task has none or no fixed number."),
    _count("ticks", "Ticks of the servo during the trial.", sealed=True),
    _measure("tick_rate_hz", "Rate of the servo, achieved.", "Hz"),
    _measure("lateness_p99_ms", "Lateness of the servo's ticks, 99th percentile.", "ms"),
    _measure("worst_gap_ms", "Longest time between two ticks of the servo.", "ms"),
    _count("overruns", "Deadlines of the servo that were skipped because a tick took too long."),
    _count("samples_dropped", "Samples of the telemetry that were overwritten before they were read."),
    _measure("path_length_m", "Length of the hand's path.", "m", sealed=True),
    _measure("mean_speed_mps", "Mean speed of the hand.", "m/s", sealed=True),
    _measure("force_mean_n", "Mean magnitude of the force sent to the device.", "N", sealed=True),
    _measure("force_peak_n", "Largest magnitude of the force sent to the device.", "N", sealed=True),
    _measure(
        "withheld_share",
        "Share of the force that passivity controller, slew limit and device withheld in the task: 0.05 is 5 %.",
        sealed=True,
    ),
    _count("loop_delay_ticks", "Ticks from a command of the servo until its force acts, the most in the task."),
    _count("loop_delay_changes", "How often that number of ticks changed in the task."),
    *(
        _count(f"limiter_{name}", f"Ticks of the servo in which {_LIMITERS[name]}.", sealed=True)
        for name in LIMITER_NAMES
    ),
    _count("frames", "Frames shown to the participant.", sealed=True),
    _count("frames_late", "Frames whose delay was more than the limit over the one asked for.", sealed=True),
    _delay_error("delay_error_mean_ms", "mean"),
    _delay_error("delay_error_p95_ms", "95th percentile"),
    _delay_error("delay_error_max_ms", "largest"),
    _measure(
        "first_frame_gap_ms",
        "From the trial's beginning to its first painted frame, with which force and task begin.",
        "ms",
    ),
    _measure(
        "worst_frame_gap_ms", "Longest time that one frame stood before the next was shown or the task ended.", "ms"
    ),
    Column(
        "valid",
        "flag",
        "true where the trial kept the protocol's limits of lateness, gaps, delay error and force withheld; until "
        "unblinding those of lateness and gaps.",
        may_miss=True,
    ),
    Column(
        "recording",
        "text",
        "File of the trial's samples, in the session's folder; n/a where none was kept.",
        may_miss=True,
    ),
    Column(
        "recording_frames",
        "text",
        "File of the frames shown, in the session's folder; n/a where none was kept.",
        may_miss=True,
    ),
    _count("samples_recorded", "Samples in the recording."),
    _count("samples_unrecorded", "Samples that the recording lacks, since the disk did not keep up."),
    Column(
        "recording_lost",
        "text",
        "Why the trial's recording could not be kept; n/a where it was, or where none was to be.",
        may_miss=True,
    ),
    Column("marked", "flag", "true where the operator marked the trial."),
    Column(
        "notes",
        "text",
        "The operator's notes from this trial's beginning to the next one's, why it was repeated, and how its device "
        "failed, one a line.",
        may_miss=True,
    ),
)

PARTICIPANTS: tuple[Column, ...] = (
    _STUDY,
    _PARTICIPANT,
    _SESSION,
    _SIMULATED,
    _PILOT,
    Column(
        "status",
        "text",
        "How the session ended.",
        levels=(
            ("completed", "it went to its last page"),
            ("withdrawn", "the participant stopped"),
            ("aborted", "the operator stopped it"),
            ("broken", "the operator stopped it after device, servo or program had failed"),
            ("damaged", "its journal is damaged: the row says what could be read"),
            ("unfinished", "no end recorded: it runs still, or its program was ended from outside"),
        ),
    ),
    Column("session_started_at", "time", "When the session began."),
    Column("session_ended_at", "time", "When the session ended.", may_miss=True),
    Column("resumed", "integer", "How often it was taken up again after its program had ended.", minimum=0),
    Column("device", "text", "The haptic device.", may_miss=True),
    Column("language", "text", "Language of the participant's pages."),
    Column("trials", "integer", "Main trials that ran to their end.", minimum=0),
    Column("responses", "integer", "Answers given in main trials, those off the scale included.", minimum=0),
    Column(
        "validity",
        "text",
        "Whether the session's main trials were valid; n/a before the first has ended.",
        levels=(("valid", "all did"), ("invalid", "at least one did not")),
        may_miss=True,
    ),
)

EXCLUSIONS: tuple[Column, ...] = (
    _PARTICIPANT,
    _SESSION,
    replace(_TRIAL, description="Number of the trial; n/a where the whole session is left out.", may_miss=True),
    Column("rule_or_person", "text", "The rule, or the initials of the person, that leaves it out."),
    Column("reason", "text", "Why it is left out of the analysis."),
    Column("excluded_at", "time", "When that was decided."),
)

TABLES: dict[str, tuple[Column, ...]] = {
    "responses": RESPONSES,
    "trials": TRIALS,
    "participants": PARTICIPANTS,
}


LATER = frozenset(
    {
        "first_frame_gap_ms",
        "withheld_share",
        "loop_delay_ticks",
        "loop_delay_changes",
        "limiter_estimator",
        "recording_lost",
    }
)
"""Columns that earlier versions did not write: a table without them is read as if they held n/a."""


SEALED = frozenset(column.name for column in TRIALS if column.sealed)
"""Columns of a trial that no table has before the key was opened (see ``sealing``)."""


def unsealed(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Return the columns that a table has before the key was opened."""
    return tuple(column for column in columns if not column.sealed)


def columns_held(
    names: Sequence[str], columns: Sequence[Column], may_lack: frozenset[str] = LATER
) -> tuple[Column, ...]:
    """Return the columns that a table with these names must hold: all but those of ``may_lack`` that it lacks."""
    return tuple(column for column in columns if column.name in names or column.name not in may_lack)


def header(columns: tuple[Column, ...]) -> tuple[str, ...]:
    """Return the column names in file order."""
    return tuple(column.name for column in columns)


def every_column() -> tuple[Column, ...]:
    """Return each column of all tables once, in the order of first use."""
    return tuple({column.name: column for columns in TABLES.values() for column in columns}.values())


def variable(column: Column) -> dict[str, Any]:
    """Return ``column`` as a schema.org PropertyValue for ``dataset_description.json``."""
    meanings = "; ".join(f"{level}: {meaning}" for level, meaning in column.levels)
    described: dict[str, Any] = {
        "@type": "PropertyValue",
        "name": column.name,
        "description": f"{column.description} Levels: {meanings}." if meanings else column.description,
        "valuePattern": cell_pattern(column),
    }
    if column.unit:
        described["unitText"] = column.unit
    if column.minimum is not None:
        described["minValue"] = column.minimum
    if column.maximum is not None:
        described["maxValue"] = column.maximum
    return described


_PATTERNS: dict[Kind, str] = {
    "text": r"[\s\S]*",
    "integer": r"-?[0-9]+",
    "number": r"-?[0-9]+(\.[0-9]+)?(e[+-]?[0-9]+)?",
    "flag": "true|false",
    "time": r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}\.[0-9]{3}[+-][0-9]{2}:[0-9]{2}",
}


def cell_pattern(column: Column) -> str:
    """Return the regular expression of a whole cell."""
    value = "|".join(level for level, _ in column.levels) if column.levels else _PATTERNS[column.kind]
    return f"({value}|{MISSING})" if column.may_miss else f"({value})"
