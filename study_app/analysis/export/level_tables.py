"""The tables of a study with levels: intervals; once the key is open, trials, thresholds, settings and exponents."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import pandas as pd

from study_app.analysis.designs.level_summaries import levels_found
from study_app.analysis.export.delivered import JUDGED, Delivered, delivered
from study_app.analysis.results.level_results import ExponentFound, LevelsFound, SettingFound
from study_app.analysis.tables.study_tables import Study
from study_app.analysis.tables.tracks import OF_INTERVALS, tracks
from study_app.store.tables.columns import EXPONENTS, INTERVALS, OF_TRACKS, SETTINGS, THRESHOLDS, TRIALS_2, tables_of
from study_app.store.tables.csv_files import Column, header, unsealed

_OF_TRIAL: Final = ("study", "participant", "session", "simulated", "pilot", "group", "trial", "attempt", "block")
_OF_BLOCK: Final = ("phase", "part", "index", "code")
_BY_NAME: Final = {column.name: column for column in (*TRIALS_2, *INTERVALS)}

_OF_PERSON: Final = tuple(_BY_NAME[name] for name in ("study", "participant", "simulated", "pilot", "group"))
_OF_THRESHOLD: Final = (
    "n", "threshold", "low", "high", "beyond", "width", "lapse", "reversal_mean", "target_percent", "fit_p", "drift",
)  # fmt: skip
TYPES: Final = {"text": "string", "number": "Float64", "integer": "Int64", "flag": "boolean"}

TRACKS: Final = (*(_BY_NAME[name] for name in (*_OF_TRIAL, *_OF_BLOCK)), *JUDGED, *OF_TRACKS)


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
        found = levels_found(study, frame.rename(columns={"level_asked": "level"}))
        yield delivered("thresholds", (*_OF_PERSON, *THRESHOLDS), _thresholds(study, frame, found))
        if any(block.design.adjusts for block in study.levels):
            own = [(one.block, setting) for one in found for setting in one.own_settings]
            yield _of_people(study, frame, "settings", SETTINGS, own)
        if any(block.design.reply == "number" for block in study.levels):
            exponents = [(one.block, exponent) for one in found for exponent in one.own_power_exponents]
            yield _of_people(study, frame, "exponents", EXPONENTS, exponents)


def _of_people(
    study: Study,
    tracks: pd.DataFrame,
    name: str,
    columns: tuple[Column, ...],
    own: Sequence[tuple[str, SettingFound | ExponentFound]],
) -> Delivered:
    """Return a table of what was found for each participant in a block, named first."""
    rows = [
        _person(study, tracks, one.participant) | {"block": block, "levels": one.n, **_named(one, header(columns))}
        for block, one in own
    ]
    return delivered(name, (*_OF_PERSON, *columns), _frame(rows, (*_OF_PERSON, *columns)))


def _named(one: SettingFound | ExponentFound, names: Sequence[str]) -> dict[str, Any]:
    return {name: getattr(one, name) for name in names if hasattr(one, name)}


def _person(study: Study, tracks: pd.DataFrame, participant: str | None) -> dict[str, Any]:
    """Return what every row about a participant begins with."""
    groups = dict(zip(tracks["participant"], tracks["group"], strict=True))
    return {
        "study": study.name,
        "participant": participant,
        "simulated": study.simulated,
        "pilot": study.pilot,
        "group": groups[participant],
    }


def _frame(rows: Sequence[Mapping[str, Any]], columns: Sequence[Column]) -> pd.DataFrame:
    frame = pd.DataFrame(rows, columns=list(header(tuple(columns))))
    return frame.astype({column.name: TYPES[column.kind] for column in columns})


def _thresholds(study: Study, tracks: pd.DataFrame, levels: Sequence[LevelsFound]) -> pd.DataFrame:
    """Return a row per participant and standard, or condition that is compared, of the main blocks."""
    rows = [
        _person(study, tracks, participant)
        | {"block": found.block, "standard": standard, "condition": condition}
        | _measured(found, participant, standard, condition)
        for found in levels
        for participant, standard, condition in _estimated(found)
    ]
    return _frame(rows, (*_OF_PERSON, *THRESHOLDS))


def _estimated(found: LevelsFound) -> list[tuple[str | None, float | None, str | None]]:
    """Return participant, standard and compared condition of each row; a block of ratings has none."""
    return [
        (one.participant, one.standard, one.comparison)
        for one in found.sensitivities
        if one.participant is not None and one.level is None
    ]


def _measured(found: LevelsFound, *which: str | float | None) -> dict[str, Any]:
    threshold = next((one for one in found.own_thresholds if (one.participant, one.standard, None) == which), None)
    sensitivity = next(
        (one for one in found.sensitivities if (one.participant, one.standard, one.comparison) == which), None
    )
    held: dict[str, Any] = {}
    if sensitivity is not None:
        held = {name: getattr(sensitivity, name) for name in ("n", "d_prime", "criterion")}
        held |= {"d_prime_model": sensitivity.model, "d_prime_other": sensitivity.other}
        held["share_first"] = next(iter(sensitivity.shares.values()), None)
    if threshold is not None:
        held |= {name: getattr(threshold, name) for name in _OF_THRESHOLD}
        held["flat_width_threshold"] = threshold.flat_width
        exponents = {one.participant: one.exponent for one in found.exponents}
        held["weber_exponent"] = exponents.get(threshold.participant)
    return held


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
