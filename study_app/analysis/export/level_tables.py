"""The tables of a study with levels: intervals and, once the key is open, a row per trial with what it presented."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from study_app.analysis.export.delivered import JUDGED, Delivered, delivered
from study_app.analysis.tables.study import Study
from study_app.analysis.tables.tracks import OF_INTERVALS, tracks
from study_app.store.tables.column import Column, unsealed
from study_app.store.tables.columns import INTERVALS, TRIALS_2, tables_of

_OF_TRIAL: Final = ("study", "participant", "session", "simulated", "pilot", "group", "trial", "attempt", "block")
_OF_BLOCK: Final = ("phase", "part", "index", "code")
_BY_NAME: Final = {column.name: column for column in (*TRIALS_2, *INTERVALS)}

TRACKS: Final = (
    *(_BY_NAME[name] for name in (*_OF_TRIAL, *_OF_BLOCK)),
    *JUDGED,
    Column(
        "analysed",
        "flag",
        "true where the row counts and does not present the modulus of a magnitude estimation.",
    ),
    Column("track", "text", "What the code stands for: standard and number of the track (8/1), or the condition."),
    Column("slot", "integer", "Position of the trial among those of its code in the session, from 1.", minimum=1),
    _BY_NAME["catch"],
    _BY_NAME["standard"],
    replace(_BY_NAME["level"], name="level_asked"),
    Column(
        "level_delivered",
        "number",
        "The level at which the hand met the comparison: from the delivered values, and for a delay from the mean "
        "errors of the frames; n/a where it was not measured.",
        may_miss=True,
    ),
    Column(
        "comparison",
        "number",
        "The comparison at this level, in the unit of the varied number; n/a where conditions are compared.",
        may_miss=True,
    ),
    Column(
        "arrangement",
        "text",
        "What the intervals presented, in order: S the standard, C the comparison; n/a if none was presented.",
        may_miss=True,
    ),
    Column(
        "comparison_interval",
        "integer",
        "The interval that alone presented the comparison, from 1; n/a where there is none.",
        minimum=1,
        may_miss=True,
    ),
    Column("response", "text", "The answer; n/a without one.", may_miss=True),
    Column("value", "number", "The answer as a number, where it is one.", may_miss=True),
    Column("right", "flag", "true if the answer was correct; n/a where no answer is.", may_miss=True),
    Column(
        "response_s",
        "number",
        "Time from the question to the first choice of an answer.",
        "s",
        minimum=0,
        may_miss=True,
    ),
)


def level_tables(study: Study) -> Iterator[Delivered]:
    """Yield the tables of a study with levels; none of any other."""
    if not study.levels:
        return
    intervals = tables_of(study.protocol_format)["intervals"]
    intervals = intervals if study.revealed else unsealed(intervals)
    yield delivered("intervals", (*intervals, *JUDGED), study.intervals)
    if study.revealed:
        frame = tracks(study).rename(columns={"level": "level_asked"})
        yield delivered("tracks", (*TRACKS, *_of_intervals(study)), frame)


def _of_intervals(study: Study) -> tuple[Column, ...]:
    """Return the columns of force and speed, one for each interval that a trial has at most."""
    most = max(block.design.intervals for block in study.levels)
    return tuple(
        replace(column, name=f"{name}_{number}", description=f"{column.description} In interval {number}.")
        for name in OF_INTERVALS
        for column in (_BY_NAME[name],)
        for number in range(1, most + 1)
    )


def names_of_sealed(study: Study) -> set[str]:
    """Return the columns of intervals that no table has before the key is opened."""
    return {column.name for column in INTERVALS if column.sealed} if study.levels else set()
