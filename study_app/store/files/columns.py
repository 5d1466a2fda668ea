"""The column dictionary: the single definition of every column of every table.

Headers, ``dataset_description.json`` and the checks of a finished folder are derived from it. A column has the same
meaning in every table.
"""

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from study_app.haptics.model.layout import LIMITERS, SAMPLE_FIELDS, SampleField
from study_app.protocol.questions import KINDS
from study_app.store.files.csv_files import Column, Kind, optional

STUDY = Column("study", "text", "Short name of the study, from its protocol.")
_PARTICIPANT = Column("participant", "text", "The participant's ID: letters and digits, not a name.")
SESSION = Column("session", "integer", "Number of the participant's session.", minimum=1, maximum=99)
_SIMULATED = Column("simulated", "flag", "true if the participant and the device were simulated (a rehearsal).")
_PILOT = Column("pilot", "flag", "true if the session was a pilot session.")
_TRIAL = Column("trial", "integer", "Number of the trial in the session, in the order of presentation.", minimum=1)
_ATTEMPT = Column(
    "attempt", "integer", "1, or higher if the trial was repeated; only the last attempt is analysed.", minimum=1
)
BLOCK = Column("block", "text", "ID of the block of trials.")
_PHASE = Column(
    "phase",
    "text",
    "Purpose of the trial; only main trials are analysed.",
    levels=(
        ("main", "analysed"),
        ("practice", "learning the task"),
        ("baseline", "the undisturbed task to which later statements refer"),
    ),
)
_PART = optional("part", "integer", "Part of the study, as shown to the participant.", minimum=1)
_INDEX = Column("index", "integer", "Position of the trial in its block, counting from 1.", minimum=1)
CODE = Column(
    "code",
    "text",
    "Code for the condition presented (L1, D3 ...); the sealed key states which condition it stands for.",
)
_SESSION_COLUMNS = (STUDY, _PARTICIPANT, SESSION, _SIMULATED, _PILOT)
"""Columns that identify the session of a row."""
_TRIAL_COLUMNS = (_TRIAL, _ATTEMPT, BLOCK, _PHASE, _PART, _INDEX)
"""Columns that identify the trial of a row."""
_INVALID = (
    "invalid",
    "an interval was not delivered as requested, so the question was not asked and the trial was repeated",
)
_TRIAL_ONLY = ("of", "trial_started_at", "trial_started_s", "marked", "notes")
_LEVEL = "distance of the comparison from its standard, or the value itself, depending on the protocol"
PARTICIPANTS: tuple[Column, ...] = (
    *_SESSION_COLUMNS,
    Column(
        "status",
        "text",
        "How the session ended.",
        levels=(
            ("completed", "it reached its last page"),
            ("withdrawn", "the participant stopped"),
            ("aborted", "the operator stopped it"),
            ("broken", "the operator stopped it after the device, the servo or the program had failed"),
            ("damaged", "its journal is damaged; the row contains what could be read"),
            ("unfinished", "its end was not recorded: it is still running, or the program was killed"),
        ),
    ),
    Column("session_started_at", "time", "Time at which the session began."),
    optional("session_ended_at", "time", "Time at which the session ended."),
    Column("resumed", "integer", "Number of times the session was resumed after the program had ended.", minimum=0),
    optional("device", "text", "The haptic device."),
    Column("language", "text", "Language of the participant's pages."),
    Column("trials", "integer", "Number of completed main trials.", minimum=0),
    Column(
        "responses",
        "integer",
        "Number of answers in main trials and forms, including “cannot judge” answers.",
        minimum=0,
    ),
    optional(
        "validity",
        "text",
        "Whether the session's main trials were valid; n/a until the first has ended.",
        levels=(("valid", "all were valid"), ("invalid", "at least one was not valid")),
    ),
)
TRIALS_MISSING = optional(
    "trials_missing",
    "integer",
    "Number of main trials that were not answered because no presentation was delivered within the protocol's limits.",
    minimum=0,
)
"""A column of sessions in a study with trials of intervals."""
_INCOMPLETE = ("incomplete", "it reached its last page, but more trials are missing than the study permits")
GROUP = optional("group", "text", "The participant's group; n/a in a study without groups.", sealed=True)


def with_missing_trials(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Return the columns of sessions with interval trials, of which some may be missing."""
    with_level = (
        replace(column, levels=(*column.levels, _INCOMPLETE)) if column.name == "status" else column
        for column in columns
    )
    return (*with_level, TRIALS_MISSING)


EXCLUSIONS: tuple[Column, ...] = (
    _PARTICIPANT,
    SESSION,
    replace(_TRIAL, description="Number of the trial; n/a if the whole session is excluded.", may_miss=True),
    Column(
        "rule_or_person", "text", "The rule that led to the exclusion, or the initials of the person who decided on it."
    ),
    Column("reason", "text", "Reason for the exclusion."),
    Column("excluded_at", "time", "Time of the decision."),
    optional("key_open", "flag", "Whether the study's key was open when the decision was made."),
)


def _measure(name: str, description: str, unit: str = "", **more: Any) -> Column:
    return optional(name, "number", description, unit=unit, minimum=0, **more)


def _signed(name: str, description: str, unit: str = "", **more: Any) -> Column:
    return optional(name, "number", description, unit=unit, sealed=True, **more)


def _count(name: str, description: str, **more: Any) -> Column:
    return optional(name, "integer", description, minimum=0, **more)


def _delay_error(name: str, which: str, of_trial: Literal["sum", "max", "mean"]) -> Column:
    description = f"{which} of the visual delay, achieved minus requested."
    return optional(name, "number", description, unit="ms", sealed=True, of_trial=of_trial)


RESPONSES: tuple[Column, ...] = (
    *_SESSION_COLUMNS,
    optional("form", "text", "ID of the questionnaire, if it was presented on its own; n/a for answers after a trial."),
    optional(
        "after_block",
        "text",
        "Block after which the form was shown; n/a for a form before the first block, and for answers after a trial.",
    ),
    *(replace(column, may_miss=True) for column in (*_TRIAL_COLUMNS, CODE)),
    Column("item", "text", "ID of the question; its text is in the session's receipt."),
    Column("kind", "text", f"Kind of question: {', '.join(KINDS.own)}."),
    Column("number", "integer", "Position of the question on the page as shown, counting from 1.", minimum=1),
    optional(
        "response",
        "text",
        "The answer: a point on the scale, a number, the ID of an option (several are separated by spaces), or a text.",
    ),
    optional("value", "number", "The answer as a number, if it is numeric."),
    Column("cannot_judge", "flag", "true if the participant chose “cannot judge” instead of an answer on the scale."),
    _measure("onset_s", "Time at which the statement was shown, on the session's clock.", "s"),
    _measure("first_choice_s", "Time at which an answer was first chosen, on the session's clock.", "s"),
    _measure("last_change_s", "Time at which the final answer was chosen, on the session's clock.", "s"),
    Column("changes", "integer", "Number of times the answer was changed.", minimum=0),
    Column("answered_at", "time", "Time at which the page of statements was confirmed."),
)


_TRIALS: tuple[Column, ...] = (
    *_SESSION_COLUMNS,
    *_TRIAL_COLUMNS,
    Column("of", "integer", "Number of trials in the block.", minimum=1),
    CODE,
    Column("trial_started_at", "time", "Time at which the trial began."),
    Column("trial_started_s", "number", "Time at which the trial began, on the session's clock.", unit="s", minimum=0),
    optional(
        "outcome",
        "text",
        "How the trial ended; n/a while it is running.",
        levels=(
            ("complete", "the task was completed"),
            ("timeout", "the time allowed for the task ran out"),
            ("interrupted", "the trial was paused, repeated or cancelled, or the program ended"),
        ),
    ),
    _measure(
        "duration_s",
        ("Time from the trial's first painted frame to the end of the task, on the device's clock."),
        "s",
        sealed=True,
    ),
    _count("targets_reached", "Number of targets reached.", sealed=True),
    _count("targets", "Number of targets to reach; n/a if the task does not have a fixed number of targets."),
    _count("ticks", "Number of servo ticks during the trial.", sealed=True),
    _measure("tick_rate_hz", "Achieved servo rate.", "Hz", of_trial="mean"),
    _measure("lateness_p99_ms", "99th percentile of the lateness of servo ticks.", "ms", of_trial="max"),
    _measure("worst_gap_ms", "Longest time between two servo ticks.", "ms", of_trial="max"),
    _count("overruns", "Number of servo deadlines that were skipped because a tick took too long."),
    _count("samples_dropped", "Number of telemetry samples that were overwritten before they were read."),
    _measure("path_length_m", "Length of the hand's path.", "m", sealed=True),
    _measure("mean_speed_mps", "Mean speed of the hand.", "m/s", sealed=True, of_trial="mean"),
    _measure("force_mean_n", "Mean magnitude of the force sent to the device.", "N", sealed=True, of_trial="mean"),
    _measure("force_peak_n", "Largest magnitude of the force sent to the device.", "N", sealed=True, of_trial="max"),
    _measure(
        "withheld_share",
        "Proportion of the force that the limits, the passivity controller and the device held back during the task; "
        "0.05 is 5 %.",
        sealed=True,
        of_trial="mean",
    ),
    _measure(
        "delivered_error",
        (
            "RMS error of the force sent, divided by the model's RMS force for the actual motion, from 0.2 s after the "
            "fade-in (0.05 is 5 %); n/a if the participant set the force, the study delays it, or it is below 0.05 N."
        ),
        sealed=True,
        of_trial="mean",
    ),
    _count(
        "loop_delay_ticks",
        "Largest number of ticks between a servo command and the moment at which its force acts, during the task.",
        of_trial="max",
    ),
    _count("loop_delay_changes", "Number of times the loop delay changed during the task."),
    _count(
        "device_delay_ticks",
        "Lower bound on the device's delay, in ticks, if an oscillation shows that the delay exceeds "
        "loop_delay_ticks by two or more.",
        sealed=True,
        of_trial="max",
    ),
    *(
        _count(f"limiter_{limiter.name}", f"Number of servo ticks in which {limiter.meaning}.", sealed=True)
        for limiter in sorted(LIMITERS)
    ),
    _count("frames", "Number of frames shown to the participant.", sealed=True),
    _count(
        "frames_late", "Number of frames whose delay exceeded the requested delay by more than the limit.", sealed=True
    ),
    _delay_error("delay_error_mean_ms", "Mean error", "mean"),
    _delay_error("delay_error_p95_ms", "95th percentile of the error", "max"),
    _delay_error("delay_error_max_ms", "Largest error", "max"),
    _measure(
        "first_frame_gap_ms",
        "Time from the start of the trial to its first painted frame, when the force and the task begin.",
        "ms",
        of_trial="max",
    ),
    _measure(
        "worst_frame_gap_ms",
        ("Longest time between two frames, or between the last frame and the end of the task."),
        "ms",
        of_trial="max",
    ),
    optional(
        "valid",
        "flag",
        (
            "true if the trial met the protocol's limits for lateness, gaps, delay error and the force held back; "
            "until unblinding, only the limits for lateness and gaps are applied."
        ),
    ),
    optional("recording", "text", "File with the trial's samples, in the session's folder; n/a if not stored."),
    optional("recording_frames", "text", "File with the frames shown, in the session's folder; n/a if not stored."),
    _count("samples_recorded", "Number of samples in the recording; n/a until unblinding."),
    _count("samples_unrecorded", "Number of samples missing from the recording because the disk was too slow."),
    optional(
        "recording_lost", "text", "Reason why the recording could not be stored; n/a if it was stored or not requested."
    ),
    Column("marked", "flag", "true if the operator marked the trial."),
    optional(
        "notes",
        "text",
        "The operator's notes from the start of this trial to the start of the next one, the reason for a repetition, "
        "and device failures, one per line.",
    ),
)


_OUTCOME_INDEX = [column.name for column in _TRIALS].index("outcome")


DELIVERED: tuple[Column, ...] = (
    _signed(
        "value_delivered",
        "Delivered value of the varied quantity, in its unit. For damping, the value fitted at the hand; for a force "
        "delay, the lag behind the model's force; for any other quantity, the requested value; n/a for a visual "
        "delay, whose error is in delay_error_mean_ms.",
    ),
    _signed(
        "force_share",
        "Proportion of the model's force that was sent to the hand after the lead-in, allowing for a lag; 1 is 100 %.",
    ),
    _signed("apparent_mass_kg", "Apparent mass fitted to the force, in addition to the damping.", "kg"),
    _measure("pace_mps", "RMS speed of the hand after the lead-in.", "m/s", sealed=True),
    _signed("setting", "Level that the participant set; n/a for intervals that were not adjusted."),
)
"""Columns of the stimulus that each interval delivered."""


_VIDEO: tuple[Column, ...] = (
    _count("video_frames", "Number of video frames shown; n/a if there is no video.", sealed=True),
    _count(
        "video_frames_late",
        "Number of video frames shown later than requested by more than one frame of the video.",
        sealed=True,
    ),
    _count(
        "video_frames_lost", "Number of video frames skipped between the first and the last frame shown.", sealed=True
    ),
    _signed(
        "video_delay_error_max_ms",
        ("Largest error of the video delay, achieved minus requested."),
        "ms",
        of_trial="max",
    ),
    _signed(
        "video_age_mean_ms",
        "Mean age of the camera's frames when they were ready, according to the source's time stamps; this age is "
        "added to the delay; n/a if the source does not report it, 0 for a file.",
        "ms",
        of_trial="mean",
    ),
)
"""Columns of the video that was shown."""


INTERVALS: tuple[Column, ...] = (
    *(column for column in _TRIALS[: _TRIALS.index(CODE) + 1] if column.name not in _TRIAL_ONLY),
    Column("interval", "integer", "Number of the interval in the trial, counting from 1.", minimum=1),
    Column(
        "interval_started_s", "number", "Time at which the interval began, on the session's clock.", unit="s", minimum=0
    ),
    _measure("gap_s", "Time from the end of the previous interval to the start of this one; n/a for the first.", "s"),
    optional(
        "presented",
        "text",
        "What the interval presented.",
        levels=(("standard", "the standard"), ("comparison", "the comparison")),
        sealed=True,
    ),
    optional("standard", "number", "The trial's standard, in the unit of the varied quantity.", sealed=True),
    optional("level", "number", f"The trial's level: {_LEVEL}.", sealed=True),
    optional("catch", "flag", "true for a catch trial, which presents the largest level.", sealed=True),
    optional(
        "invalid_reasons",
        "text",
        "Keys of the protocol's limits that the interval violated, separated by spaces; n/a if it was delivered as "
        "requested.",
    ),
    *DELIVERED,
    *(column for column in _TRIALS[_OUTCOME_INDEX:] if column.name not in _TRIAL_ONLY),
    *_VIDEO,
)
"""Intervals of the trials of a study with designs."""


TRIALS: tuple[Column, ...] = (
    *(replace(column, levels=(*column.levels, _INVALID)) if column.name == "outcome" else column for column in _TRIALS),
    *_VIDEO,
    _count("intervals", "Number of intervals presented in this attempt; n/a if the block does not have a design."),
    GROUP,
)


_TABLES = {"responses": RESPONSES, "trials": TRIALS, "intervals": INTERVALS, "participants": (*PARTICIPANTS, GROUP)}


SEALED = frozenset(column.name for column in (*TRIALS, *DELIVERED) if column.sealed)
"""Columns of a trial that tables omit until the key is opened (see ``blinding``)."""


def every_column(*, intervals: bool = False) -> tuple[Column, ...]:
    """Return every column of all tables once, in order of use; ``intervals`` adds those of studies with designs."""
    tables = dict(_TABLES)
    if intervals:
        tables["participants"] = with_missing_trials(tables["participants"])
    by_name: dict[str, Column] = {}
    for name, columns in tables.items():
        for column in columns if name != "intervals" or intervals else ():
            by_name.setdefault(column.name, column)
    return tuple(by_name.values())


FRAMES: tuple[Column, ...] = (
    Column("painted_ns", "integer", "Time at which the frame was shown, on the servo's clock.", unit="ns"),
    Column("sample_ns", "integer", "Time at which the displayed hand position was measured.", unit="ns"),
    Column("age_ns", "integer", "Achieved visual delay: painted_ns - sample_ns.", unit="ns"),
    Column(
        "video_frame",
        "integer",
        "Number of the video frame shown, counting from 0; -1 if there is no video.",
        minimum=-1,
    ),
    Column(
        "video_ns",
        "integer",
        "Time at which the video frame would have been due without a delay, on the servo's clock (when the camera's "
        "frame was ready, or the time in the file); 0 if there is no video.",
        unit="ns",
    ),
    Column(
        "video_age_ns",
        "integer",
        "Age of the camera's frame when it was ready, according to the source's time stamps: it was taken at video_ns "
        "- video_age_ns; -1 if the age is unknown or there is no video.",
        unit="ns",
        minimum=-1,
    ),
)


def _sample_columns(field: SampleField) -> list[Column]:
    """Return the columns of a recording that hold a field of ``layout.SAMPLE``."""
    kind: Kind = "flag" if field.stored is np.bool_ else "integer" if issubclass(field.stored, np.integer) else "number"
    meanings = [field.meaning.replace("{component}", meaning) for meaning in field.parts.values()] or [field.meaning]
    return [
        Column(name, kind, meaning, unit=field.unit, levels=field.levels, minimum=field.minimum, maximum=field.maximum)
        for name, meaning in zip(field.named(), meanings, strict=True)
    ]


SAMPLES = tuple(column for field in SAMPLE_FIELDS if field.meaning for column in _sample_columns(field))
