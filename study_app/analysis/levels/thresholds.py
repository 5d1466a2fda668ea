"""Tracks of a block of levels, thresholds of participants, groups and sites, and their exponents.

Fits take all counted answers of a participant at the levels delivered to the hand: trials of one requested level lie
at the mean of their delivered levels.

An exponent of n is Stevens' power law, answer ∝ levelⁿ (Stevens 1957, Psychological Review 64, 153).

An exponent of 1 is Weber's law, JND ∝ standard; 0 is a constant JND.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from study_app.analysis.data.blocks import LevelBlock, compared_percent
from study_app.analysis.data.measures import number_or_none
from study_app.analysis.data.study_tables import Study
from study_app.analysis.levels.results import ExponentFound, LevelsFound, SensitivityFound, SettingFound, ThresholdFound
from study_app.analysis.results import SiteThresholds
from study_app.analysis.statistics.outcome import Array, student_interval
from study_app.analysis.statistics.rank_tests import groups_differ
from study_app.analysis.statistics.thresholds import drift, group_mean, p_of_fit
from study_app.protocol.trials.methods import Answer, TrackSetting
from study_app.protocol.trials.presentation import arrangement_of
from study_app.protocol.trials.stimuli import DELAY, FORCE_DELAY, Stimulus, analysis_grid
from study_app.psychophysics.families import level_at
from study_app.psychophysics.grid import Grid, fit

R = TypeVar("R", ExponentFound, SensitivityFound, SettingFound)

TRACK: Final = ["participant", "session", "block", "code"]
"""What one track is in the rows of `tracks`."""
PRESENTATION: Final = ["participant", "session", "trial", "attempt"]
OF_INTERVALS: Final = ("force_mean_n", "mean_speed_mps")
"""What a trial's row repeats of each of its intervals."""
_DELIVERED: Final = tuple(f"{what}_{letter}" for what in ("value", "delay_error_ms") for letter in "CS")
"""Means over the intervals of a trial that presented the comparison, and over those that presented the standard."""
_TYPES: Final = {
    "track": "string",
    "comparison": "Float64",
    "comparison_interval": "Int64",
    "right": "boolean",
    "success": "boolean",
    "analysed": "boolean",
    "level_delivered": "Float64",
}
"""What follows from a trial's arrangement, level and answer."""
_READ: Final = ("block", "code", "index", "counted", "arrangement", "standard", "level", "response", *_DELIVERED)


def answers_timed(study: Study) -> pd.DataFrame:
    """Return all answers after trials of levels, with ``response_s``: from the question to the first choice [s]."""
    rows = study.answered
    if not study.levels:
        return rows.iloc[:0].assign(response_s=pd.Series(dtype="Float64"))
    rows = rows[rows["block"].isin([block.id for block in study.levels]).fillna(False)]
    return rows.assign(response_s=(rows["first_choice_s"] - rows["onset_s"]).astype("Float64").round(6))


def tracks(study: Study) -> pd.DataFrame:
    """Return the last attempt at each trial of levels, with what it presented; the key must be open.

    ``right`` says whether the answer was correct, ``success`` what it counts as for a psychometric function;
    ``analysed`` is false where the trial does not count or presents the modulus of a magnitude estimation; ``reversal``
    says where an up–down track changed its direction.
    """
    by_id = {block.id: block for block in study.levels}
    rows = study.trials[study.trials["block"].isin(list(by_id))]
    rows = rows.sort_values("attempt").drop_duplicates(PRESENTATION[:-1], keep="last").sort_index()
    answers = answers_timed(study)[[*PRESENTATION, "response", "value", "response_s"]]
    found = rows.merge(_presented(study.intervals), on=PRESENTATION, how="left")
    found = found.merge(answers, on=PRESENTATION, how="left")
    found["slot"] = found.groupby(TRACK).cumcount() + 1
    track_rows = [_track_row(by_id[row["block"]], row) for row in found[list(_READ)].to_dict("records")]
    found = found.drop(columns=list(_DELIVERED))
    found = found.join(pd.DataFrame(track_rows, index=found.index, columns=list(_TYPES)).astype(_TYPES))
    return found.assign(reversal=_reversals(found, by_id))


def setting_of(block: LevelBlock, track: str) -> TrackSetting | None:
    """Return what the levels of a track ("8/1") were chosen for; None where conditions are compared."""
    number = track.rpartition("/")[2]
    return None if block.stimulus is None else TrackSetting(block.stimulus, block.design, int(number))


def answers_of(rows: pd.DataFrame) -> list[Answer]:
    """Return the answers of one track as its method heard them: those that were not counted, too."""
    heard = _heard(rows)
    return list(zip(heard["level"].astype(float), heard["success"].astype(bool), strict=True))


def _heard(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows whose answers moved their track, in order: neither catch trials nor the standard alone."""
    compared = rows["success"].notna() & rows["level"].notna() & rows["arrangement"].str.contains("C").fillna(False)
    return rows[compared & ~rows["catch"].fillna(False).astype(bool)].sort_values("trial")


def _reversals(found: pd.DataFrame, blocks: Mapping[str, LevelBlock]) -> pd.Series[Any]:
    """Return whether the direction of its track changed at each trial; missing where the method has no steps."""
    reversal = pd.Series(pd.NA, index=found.index, dtype="boolean")
    for _, rows in found.groupby(TRACK, sort=False):
        block = blocks[rows["block"].iloc[0]]
        setting = setting_of(block, rows["track"].iloc[0])
        if setting is None or block.method is None or block.method.target_percent is None:
            continue
        at, places = block.method.reversals(setting, answers_of(rows)), _heard(rows).index
        reversal[places] = False
        reversal[places[list(at)]] = True
    return reversal


def _track_row(block: LevelBlock, row: Mapping[Any, Any]) -> dict[str, Any]:
    track = next(one.condition for one in block.settings if one.code == row["code"])
    found: dict[str, Any] = {**dict.fromkeys(_TYPES, pd.NA), "track": track}
    found["analysed"] = bool(row["counted"]) and not block.presents_modulus(int(row["index"]))
    letters = row["arrangement"]
    if pd.isna(letters) or len(letters) < block.design.intervals:  # the trial ended before its last interval
        return found
    if letters.count("C") == 1 and block.design.intervals > 1:
        found["comparison_interval"] = letters.index("C") + 1
    if block.stimulus is not None and not pd.isna(row["level"]):
        standard = None if pd.isna(row["standard"]) else float(row["standard"])
        found["comparison"] = block.stimulus.comparison(standard, float(row["level"]))
        found["level_delivered"] = _level_delivered(block.stimulus, standard, found["comparison"], row)
    if not pd.isna(row["response"]):
        arrangement, answer = arrangement_of(block.design, letters), str(row["response"])
        correct, success = block.design.is_correct(arrangement, answer), block.design.success(arrangement, answer)
        if block.has_correct_answer and correct is not None:
            found["right"] = correct
        found["success"] = pd.NA if success is None else success
    return found


def _level_delivered(stimulus: Stimulus, standard: float | None, comparison: float, row: Mapping[Any, Any]) -> Any:
    """Return the level at which the comparison was delivered; missing where it was not measured, or not presented.

    Of a delay it is the requested one and how much more late the comparison's frames were than the standard's.
    """
    value, of_standard, error_ms, of_standard_ms = (row[name] for name in _DELIVERED)
    if stimulus.vary == DELAY:
        if pd.isna(error_ms):
            return pd.NA
        late_ms = float(error_ms) - (0.0 if pd.isna(of_standard_ms) else float(of_standard_ms))
        return stimulus.level_between(standard, comparison + late_ms)
    if pd.isna(value):
        return pd.NA
    if stimulus.vary == FORCE_DELAY and standard is not None and not pd.isna(of_standard):
        return stimulus.level_between(standard, standard + float(value) - float(of_standard))
    return stimulus.level_between(standard if pd.isna(of_standard) else float(of_standard), float(value))


def _presented(intervals: pd.DataFrame) -> pd.DataFrame:
    """Return a row per presentation: standard, level, arrangement, and of each interval force and speed."""
    ordered = intervals.sort_values([*PRESENTATION, "interval"])
    letters = ordered["presented"].map({"comparison": "C", "standard": "S"}).fillna("?")
    found = ordered.groupby(PRESENTATION, sort=False)[["standard", "level", "catch", "setting"]].first()
    presented: dict[Any, str] = {}
    for which, letter in zip(zip(*(ordered[name] for name in PRESENTATION), strict=True), letters, strict=True):
        presented[which] = presented.get(which, "") + letter
    found["arrangement"] = pd.Series(presented, dtype="string").reindex(found.index)
    for name, what in (("value_delivered", "value"), ("delay_error_mean_ms", "delay_error_ms")):
        means = ordered.assign(letter=letters).groupby([*PRESENTATION, "letter"])[name].mean().unstack("letter")
        for letter in "CS":
            found[f"{what}_{letter}"] = means.get(letter, pd.NA)
    for name in OF_INTERVALS:
        wide = ordered.pivot(index=PRESENTATION, columns="interval", values=name)
        found = found.join(wide.rename(columns={number: f"{name}_{number}" for number in wide.columns}))
    return found.reset_index()


@dataclass(frozen=True, slots=True)
class Counts:
    """Answers of one participant at one standard, by level in u: shape (k,) each.

    ``places``, shape (n,), are the levels of the rows.
    """

    levels: Array
    successes: Array
    failures: Array
    places: NDArray[np.int64]


def counts_of(stimulus: Stimulus, rows: pd.DataFrame) -> Counts:
    """Return counts by level from rows of tracks, each at the mean of its delivered levels."""
    asked, places = np.unique(rows["level"].to_numpy(dtype=float), return_inverse=True)
    each = rows["level_delivered"].astype("Float64").to_numpy(dtype=float, na_value=math.nan)
    known, k = np.isfinite(each), len(asked)
    measured = np.bincount(places[known], minlength=k)
    delivered = np.bincount(places[known], each[known], minlength=k) / np.maximum(measured, 1)
    has_place = (measured > 0) & ((delivered > 0) | (stimulus.spacing == "linear"))
    placed = np.where(has_place & (asked != 0), delivered, asked)
    successes = np.asarray(np.bincount(places, rows["success"].to_numpy(dtype=float), minlength=k), float)
    return Counts(
        levels=np.array([stimulus.coordinate(float(level)) for level in placed]),
        successes=successes,
        failures=np.asarray(np.bincount(places, minlength=k) - successes, float),
        places=np.asarray(places, np.int64),
    )


def thresholds(block: LevelBlock, opened: pd.DataFrame) -> Iterator[ThresholdFound]:
    """Yield the group's threshold of each standard, followed by those of its participants."""
    assumed, stimulus = block.assumed, block.stimulus
    if assumed is None or stimulus is None:
        return
    grid = analysis_grid(stimulus, block.design, assumed)
    all_rows = opened[(opened["block"] == block.id) & opened["success"].notna()].sort_values(["session", "trial"])
    for standard, at_standard in all_rows.groupby("standard", dropna=False, sort=True):
        own = [
            _own(block, stimulus, grid, standard, person, one)
            for person, one in at_standard.groupby("participant")
            if one["analysed"].any()
        ]
        if own:
            yield _with_compared(stimulus, _group(stimulus, standard, own), own)
        yield from own


def _own(
    block: LevelBlock, stimulus: Stimulus, grid: Grid, standard: Any, person: Any, heard: pd.DataFrame
) -> ThresholdFound:
    """Return a participant's threshold; of the rows those that are analysed enter the fit."""
    rows = heard[heard["analysed"]]
    counts = counts_of(stimulus, rows)
    answers = counts.levels, counts.successes, counts.failures
    found, flat = fit(*answers, grid), fit(*answers, replace(grid, width_prior=None))
    level_of, threshold, (low, high) = stimulus.level_of, found.threshold, found.interval
    width, guess, lapse = found.others
    psi, shown = found.success(counts.levels), counts.levels[np.isfinite(counts.levels)]
    percent, compared = compared_percent(block.published), math.nan
    if percent is not None:
        compared = level_at(grid.family, percent, threshold, *found.others)
    return ThresholdFound(
        participant=str(person),
        standard=number_or_none(standard),
        n=len(rows),
        threshold=level_of(threshold),
        low=level_of(low),
        high=level_of(high),
        width=width,
        lapse=lapse,
        guess=guess,
        flat_width=level_of(flat.threshold),
        beyond="above" if threshold > shown.max() else "below" if threshold < shown.min() else None,
        variance=found.variance,
        fit_p=p_of_fit(counts.successes, counts.successes + counts.failures, psi),
        drift=drift(rows["success"].to_numpy(dtype=bool), psi[counts.places]),
        reversal_mean=_reversal_mean(block, stimulus, heard),
        target_percent=None if block.method is None else block.method.target_percent,
        compared=None if math.isnan(compared) else level_of(compared),
    )


def _reversal_mean(block: LevelBlock, stimulus: Stimulus, heard: pd.DataFrame) -> float | None:
    """Return the mean, in u, of the classical estimates of the tracks; None where none has any."""
    if block.method is None or block.method.target_percent is None:
        return None
    means = []
    for _, rows in heard.groupby(TRACK, sort=True):
        setting = setting_of(block, rows["track"].iloc[0])
        mean = None if setting is None else block.method.reversal_mean(setting, answers_of(rows))
        means += [] if mean is None else [stimulus.coordinate(mean)]
    return stimulus.level_of(float(np.mean(means))) if means else None


def _group(stimulus: Stimulus, standard: Any, own: Sequence[ThresholdFound]) -> ThresholdFound:
    mean, low, high = _mean(stimulus, [one.threshold for one in own], own)
    return ThresholdFound(None, number_or_none(standard), len(own), mean, low, high)


def _with_compared(stimulus: Stimulus, group: ThresholdFound, own: Sequence[ThresholdFound]) -> ThresholdFound:
    """Return the group with its level at the published percentage, where all participants have theirs."""
    compared = [one.compared for one in own if one.compared is not None]
    if len(compared) < len(own):
        return group
    mean, low, high = _mean(stimulus, compared, own)
    return replace(group, compared=mean, compared_low=low, compared_high=high)


def _mean(
    stimulus: Stimulus, levels: Sequence[float], own: Sequence[ThresholdFound]
) -> tuple[float, float | None, float | None]:
    """Return the random-effects mean of participants' levels with its interval, by the variances of thresholds."""
    mean = group_mean([stimulus.coordinate(level) for level in levels], [one.variance or 0.0 for one in own])
    low, high = (None if end is None else stimulus.level_of(end) for end in (mean.low, mean.high))
    return stimulus.level_of(mean.mean), low, high


PLACES: Final = 40


def psychometric_bands(
    block: LevelBlock, opened: pd.DataFrame, people: tuple[str, ...], ends: tuple[float, float]
) -> Mapping[str, Array]:
    """Return the band of each participant, shape (3, k): u, and the ends of the pointwise band there.

    The block has one standard; ``ends`` are the smallest and the largest u.
    """
    assumed, stimulus = block.assumed, block.stimulus
    if assumed is None or stimulus is None:
        return {}
    grid, u = analysis_grid(stimulus, block.design, assumed), np.linspace(*ends, PLACES)
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["success"].notna()]
    found = {}
    for person, own in rows[rows["participant"].isin(people)].groupby("participant"):
        counts = counts_of(stimulus, own)
        posterior = fit(counts.levels, counts.successes, counts.failures, grid)
        found[str(person)] = np.array([u, *posterior.band(u)])
    return found


Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class TrackCourse:
    """The answers of one participant at one standard in the order of the trials, shape (n,) each.

    ``levels`` were requested; ``tracks`` count from 1; ``catches`` are catch trials, ``noises`` presented the standard
    alone: neither has a level that its track chose; ``low`` and ``high`` are the ends, as levels, of the 95 %
    interval of the threshold from the answers so far.
    """

    participant: str
    standard: float | None
    tracks: NDArray[np.int64]
    levels: Array
    successes: Flags
    reversals: Flags
    catches: Flags
    noises: Flags
    low: Array
    high: Array


def courses(block: LevelBlock, opened: pd.DataFrame, most: int) -> Iterator[TrackCourse]:
    """Yield the first ``most`` courses of a block by participant and standard, from the rows of `tracks`."""
    assumed, stimulus = block.assumed, block.stimulus
    if assumed is None or stimulus is None:
        return
    grid = analysis_grid(stimulus, block.design, assumed)
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["success"].notna()]
    rows = rows.sort_values(["participant", "session", "trial"])
    for number, (_, own) in enumerate(rows.groupby(["participant", "standard"], dropna=False)):
        if number == most:
            return
        standard = own["standard"].iloc[0]
        counts = counts_of(stimulus, own)
        successes, ends = own["success"].to_numpy(dtype=bool), []
        so_far = np.zeros((2, len(counts.levels)))
        for place, right in zip(counts.places, successes, strict=True):
            so_far[0 if right else 1, place] += 1
            ends.append([stimulus.level_of(end) for end in fit(counts.levels, so_far[0], so_far[1], grid).interval])
        low, high = np.array(ends).T
        yield TrackCourse(
            participant=str(own["participant"].iloc[0]),
            standard=None if pd.isna(standard) else float(standard),
            tracks=np.array([int(name.rpartition("/")[2]) for name in own["track"]], np.int64),
            levels=own["level"].to_numpy(dtype=float),
            successes=successes,
            reversals=own["reversal"].fillna(False).to_numpy(dtype=bool),
            catches=own["catch"].fillna(False).to_numpy(dtype=bool),
            noises=~own["arrangement"].str.contains("C").to_numpy(dtype=bool),
            low=low,
            high=high,
        )


def site_thresholds(study: Study, levels: Sequence[LevelsFound], seed: int) -> Iterator[SiteThresholds]:
    """Yield the comparison of sites at each standard of each block; nothing where the study is not merged or sealed."""
    for found in levels if study.sites else ():
        for standard in dict.fromkeys(one.standard for one in found.own_thresholds):
            own = [one for one in found.own_thresholds if one.standard == standard]
            thresholds = tuple(one.threshold for one in own)
            of_sites = tuple(study.site_of(str(one.participant)) for one in own)
            sites = tuple(dict.fromkeys(of_sites))
            medians = [
                np.median([value for value, at in zip(thresholds, of_sites, strict=True) if at == site])
                for site in sites
            ]
            yield SiteThresholds(
                found.block,
                found.title,
                standard,
                sites,
                tuple(map(float, medians)),
                thresholds,
                of_sites,
                groups_differ(np.array(thresholds)[:, None], of_sites, seed=seed),
            )


def estimate_slope(levels: ArrayLike, answers: ArrayLike) -> float:
    """Return the least-squares slope of the mean ln answer at each level on ln level.

    Parameters
    ----------
    levels, answers : (n,) array
        Of each trial, at two different levels or more, all above zero.
    """
    log_levels, log_answers = (np.log(np.asarray(one, float)) for one in (levels, answers))
    places, which = np.unique(log_levels, return_inverse=True)
    means = np.bincount(which, log_answers) / np.bincount(which)
    return float(np.polyfit(places, means, 1)[0])


def estimated_exponents(block: LevelBlock, opened: pd.DataFrame) -> Iterator[ExponentFound]:
    """Yield the exponent of the group, followed by those of the participants with answers at two levels or more.

    Trials of one requested level are at the mean of their delivered levels.
    """
    if block.design.reply != "number":
        return
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & (opened["value"] > 0) & (opened["level"] > 0)]
    own = []
    for person, of_person in rows.groupby("participant", sort=True):
        asked = of_person["level"].astype(float)
        delivered = of_person["level_delivered"].astype(float).groupby(asked).transform("mean")
        levels = delivered.where(delivered > 0, asked).to_numpy()
        if (count := len(np.unique(levels))) >= 2:
            own.append(ExponentFound(str(person), count, estimate_slope(levels, of_person["value"].astype(float))))
    if own:
        yield mean_over(own, "exponent")
    yield from own


def mean_over(
    own: Sequence[R],
    middle: str,
    *others: str,
    coordinate: Callable[[float], float] = float,
    level_of: Callable[[float], float] = float,
) -> R:
    """Return the group of these participants: means over those in whom a number is known.

    That of ``middle`` is a mean in the coordinate u with Student's 95 % interval.
    """
    known = {name: [value for one in own if (value := getattr(one, name)) is not None] for name in (middle, *others)}
    means: dict[str, Any] = {name: float(np.mean(values)) if values else None for name, values in known.items()}
    u = np.array([coordinate(value) for value in known.pop(middle)])
    ends = student_interval(u) if len(u) else (None, None)
    low, high = (None if end is None else level_of(end) for end in ends)
    means[middle] = level_of(float(u.mean())) if len(u) else None
    return replace(own[0], participant=None, n=len(own), low=low, high=high, **means)


def jnd_slope(standards: ArrayLike, jnds: ArrayLike) -> float:
    """Return the least-squares slope of ln JND on ln standard.

    Parameters
    ----------
    standards, jnds : (k,) array
        Two different standards or more, and the JND at each, all above zero, in the same unit.
    """
    slope, _ = np.polyfit(np.log(np.asarray(standards, float)), np.log(np.asarray(jnds, float)), 1)
    return float(slope)


def weber_exponents(thresholds: Sequence[ThresholdFound], level_kind: str) -> Iterator[ExponentFound]:
    """Yield the exponent of the group, followed by those of the participants with thresholds at two standards or more.

    Parameters
    ----------
    level_kind : str
        What a level is. A JND is weber × standard, or the difference itself; a value has none.
    """
    if level_kind == "value":
        return
    own = []
    for person in dict.fromkeys(one.participant for one in thresholds if one.participant is not None):
        places = [
            (one.standard, one.threshold * (one.standard if level_kind == "weber" else 1.0))
            for one in thresholds
            if one.participant == person and one.standard is not None and one.standard > 0 and one.threshold > 0
        ]
        if len(places) >= 2:
            own.append(ExponentFound(person, len(places), jnd_slope(*np.array(places).T)))
    if own:
        yield mean_over(own, "exponent")
    yield from own
