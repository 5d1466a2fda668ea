"""Checks a trial's measures against the limits of its protocol."""

from collections.abc import Mapping
from typing import Any, TypeAlias

Broken: TypeAlias = tuple[str, float, float]
"""A measured column that breaks a limit, its value and the limit, both in the limit's unit: ms or percent."""

# Columns of a trial's row and the protocol's limit for each.
_JUDGED = (
    ("lateness_p99_ms", "lateness_ms"),
    ("worst_gap_ms", "worst_gap_ms"),
    ("delay_error_p95_ms", "delay_error_ms"),
    ("first_frame_gap_ms", "frame_gap_ms"),
    ("worst_frame_gap_ms", "frame_gap_ms"),
    ("withheld_share", "withheld_percent"),
)
_LEAST = "targets_reached"  # judged by "targets_percent": the only measure with a least value


def within_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> bool | None:
    """Return whether a trial's measured columns are within the protocol's limits, by size; None without measurements.

    ``limits`` are those of the journal's first line, or ``Limits`` of a protocol as a mapping.
    """
    judged = _judged(measured, limits)
    return not beyond_limits(measured, limits) if judged else None


def beyond_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> tuple[Broken, ...]:
    """Return which of a trial's measured columns break a limit: the column's name, its value and the limit.

    Value and limit are in the limit's unit, ms or percent.
    """
    return tuple(one for one in _judged(measured, limits) if not _keeps(*one))


def broken_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> tuple[str, ...]:
    """Return the limits that a trial's or an interval's measured columns break, by their keys in the protocol."""
    keys = dict(_JUDGED) | {_LEAST: "targets_percent"}
    return tuple(dict.fromkeys(keys[measure] for measure, _, _ in beyond_limits(measured, limits)))


def _keeps(measure: str, value: float, limit: float) -> bool:
    return value >= limit if measure == _LEAST else abs(value) <= limit


def _judged(measured: Mapping[str, Any], limits: Mapping[str, float]) -> list[Broken]:
    judged = [
        (measure, measured[measure] * (100 if limit.endswith("_percent") else 1), limits[limit])
        for measure, limit in _JUDGED
        if measured.get(measure) is not None and limit in limits
    ]
    reached, targets = measured.get(_LEAST), measured.get("targets")
    if "targets_percent" in limits and reached is not None and targets:
        judged.append((_LEAST, 100 * reached / targets, limits["targets_percent"]))
    return judged
