"""Rows of the intervals of trials, and their summary in the trial's row."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from study_app.store.tables.column import header
from study_app.store.tables.columns import INTERVALS
from study_app.store.tables.csv_files import Row

_PRESENTED: Final = {"S": "standard", "C": "comparison"}
_LONGEST: Final = frozenset(
    {
        "lateness_p99_ms",
        "worst_gap_ms",
        "force_peak_n",
        "loop_delay_ticks",
        "delay_error_p95_ms",
        "delay_error_max_ms",
        "first_frame_gap_ms",
        "worst_frame_gap_ms",
        "video_delay_error_max_ms",
    }
)
"""Columns in which a trial has the maximum of its intervals."""
_MEANS: Final = frozenset(
    {
        "tick_rate_hz",
        "mean_speed_mps",
        "force_mean_n",
        "withheld_share",
        "delivered_error",
        "delay_error_mean_ms",
        "video_age_mean_ms",
    }
)
"""Of these a trial has the mean of its intervals; of what is left the sum."""


def interval_row(trial: Row, started: Mapping[str, Any], line: Mapping[str, Any], before: Row | None) -> Row:
    """Return the row of an interval that begins.

    Parameters
    ----------
    trial : Row
        The trial's row.
    started : mapping
        The line on the trial's beginning; without level and arrangement while they are sealed.
    line : mapping
        The line on the interval's beginning.
    before : Row or None
        The row of the interval before, of the same attempt.
    """
    row: Row = {name: trial.get(name) for name in header(INTERVALS)} | dict.fromkeys(_OF_THE_END)
    number = line["interval"]
    ended_s = None if before is None else before["ended_s"]
    arrangement = started.get("arrangement")
    return row | {
        "interval": number,
        "interval_started_s": line["t_s"],
        "gap_s": None if ended_s is None else round(line["t_s"] - ended_s, 6),
        "presented": None if arrangement is None else _PRESENTED[arrangement[number - 1]],
        "standard": started.get("standard"),
        "level": started.get("level"),
        "catch": started.get("catch"),
    }


_OF_THE_END = header(INTERVALS[[column.name for column in INTERVALS].index("invalid_reasons") :])


def combined(intervals: Iterable[Row], names: Sequence[str]) -> Row:
    """Return the measures of a trial from all its intervals; None for those measured in none."""
    rows = list(intervals)
    return {name: _combined(name, [row[name] for row in rows if row.get(name) is not None]) for name in names}


def _combined(name: str, values: list[Any]) -> Any:
    if not values:
        return None
    if name in _LONGEST:
        return max(values)
    total = sum(values)
    found = total / len(values) if name in _MEANS else total
    return round(found, 6) if isinstance(found, float) else found
