"""Blocks of levels, summarised: conduct, answers at each level, sensitivities and settings.

A block of levels has them over all levels of a standard, a block of conditions for each comparison, and ratings for
each level against the lowest.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import LevelBlock, PublishedValue, setting_name
from study_app.analysis.data.measures import number_or_none, quartiles_or_none
from study_app.analysis.data.study_tables import Study
from study_app.analysis.levels.results import (
    CatchAnswers,
    ExponentFound,
    GroupAnswers,
    LevelAnswers,
    LevelConduct,
    LevelsFound,
    LevelTimes,
    SensitivityFound,
    SettingFound,
    Summary,
    ThresholdFound,
    WithheldForce,
)
from study_app.analysis.levels.thresholds import answers_timed, estimated_exponents, thresholds, tracks, weber_exponents
from study_app.analysis.statistics.outcome import Array, clopper_pearson, student_interval
from study_app.analysis.statistics.thresholds import setting_statistics
from study_app.protocol.quantities import quantity, quantity_words
from study_app.protocol.trials.designs import Reply
from study_app.protocol.trials.presentation import arrangement_of
from study_app.protocol.trials.stimuli import OF_LINK, Stimulus
from study_app.psychophysics.detection import Sensitivity, rating

TRIAL = ["participant", "session", "trial"]
Z_95: Final = 1.959964

SUMMARIES: Final[dict[Reply, Summary]] = {
    "choice": "share",
    "rating": "mean",
    "number": "geometric mean",
    "setting": "settings",
}
"""How the answers at a level are summarised, by the reply that the design asks for."""

READ: Final = (
    *("participant", "session", "trial", "block", "code", "track", "catch", "standard", "level", "level_delivered"),
    *("comparison", "arrangement", "analysed", "response", "value", "success", "right", "response_s", "reversal"),
    "setting",
)
"""The columns of tracks that are read here."""

MOST_LEVELS: Final = 8
"""Rows of times to answer at a standard; of more levels, neighbours share a row."""


def levels_found(study: Study, rows: pd.DataFrame | None = None) -> tuple[LevelsFound, ...]:
    """Return what was answered in every main block of levels, in the order of the session.

    ``rows`` are those of `tracks`, where they are already known.
    """
    main = [block for block in study.levels if block.phase == "main"]
    if not main:
        return ()
    timed = answers_timed(study)
    opened = rows if rows is not None else tracks(study) if study.revealed else None
    opened = None if opened is None else opened[list(READ)]  # groups of few columns are made in less time
    bounds = {one.where.id: one.bounds for one in study.others.questions}
    return tuple(
        replace(
            _levels_of_block(one, timed[timed["block"] == one.id], opened, study.intervals, bounds.get(one.id)),
            device=study.own_dynamics,
        )
        for one in main
    )


def _levels_of_block(
    block: LevelBlock,
    answers: pd.DataFrame,
    opened: pd.DataFrame | None,
    intervals: pd.DataFrame,
    bounds: tuple[float, float] | None,
) -> LevelsFound:
    counted = answers[answers["counted"] & answers["response"].notna()]
    stimulus = block.stimulus
    estimated = () if opened is None else tuple(thresholds(block, opened))
    return LevelsFound(
        block=block.id,
        title=block.title,
        design=block.design.kind,
        revealed=opened is not None,
        times=tuple(
            GroupAnswers(
                one.code, setting_name(one, block.settings), _time_numbers(counted[counted["code"] == one.code])
            )
            for one in block.settings
        ),
        summary=SUMMARIES[block.design.reply],
        counts=block.counts,
        vary=None if stimulus is None else stimulus.vary,
        quantity=None if stimulus is None else quantity_words(stimulus.vary),
        unit=None if stimulus is None else quantity(stimulus.vary).unit,
        level_kind=None if stimulus is None else stimulus.level_kind,
        spacing="linear" if stimulus is None else stimulus.spacing,
        guess_rate=block.design.guess_rate if block.has_correct_answer else None,
        bounds=bounds,
        own_units=_chooses_units(block),
        answers=() if opened is None else tuple(_level_answers(block, opened, bounds)),
        thresholds=estimated,
        exponents=() if opened is None else tuple(_exponents(block, opened, estimated)),
        level_times=() if opened is None else tuple(_level_times(block, opened)),
        withheld=() if opened is None else tuple(_withheld(block, intervals)),
        conduct=() if opened is None else tuple(level_conduct(block, opened, intervals)),
        catches=() if opened is None else tuple(catch_answers(block, opened)),
        sensitivities=() if opened is None else tuple(sensitivities(block, opened)),
        family=None if block.assumed is None else block.assumed.family,
        adaptive=block.method is not None and block.method.adaptive,
        settings=() if opened is None else tuple(settings(block, opened)),
        published=tuple(PublishedValue(**one.model_dump(exclude={"block"})) for one in block.published),
    )


def _chooses_units(block: LevelBlock) -> bool:
    """Return whether each participant chooses the unit of the numbers named: there is no modulus."""
    return block.design.reply == "number" and block.design.first is None


def _level_answers(
    block: LevelBlock, opened: pd.DataFrame, bounds: tuple[float, float] | None
) -> Iterator[LevelAnswers]:
    """Yield the answers at each level, and apart those to catch trials: of all participants, then of each."""
    if block.design.adjusts:
        return
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["response"].notna()]
    if block.stimulus is None:
        rows = rows.assign(comparison=rows["track"], place=rows["track"].map(_places(block)))
        by = ["place"]
    else:
        rows = rows.assign(catch=rows["catch"].fillna(False).astype(bool))
        by = ["standard", "level", "catch"]
    units = _own_units(block, rows)
    for _, at_level in rows.groupby(by, dropna=False, sort=True):
        yield from _at_level(block, at_level, bounds, units)


def _own_units(block: LevelBlock, rows: pd.DataFrame) -> Mapping[str, float]:
    """Return ln of the unit that each participant chose for numbers, over the mean unit; nothing with a modulus.

    It is the mean over levels of the participant's mean ln answer.
    """
    if not _chooses_units(block):
        return {}
    answered = rows.assign(log=np.log(rows["value"].to_numpy(dtype=float)))
    logs = answered.groupby(["participant", "level"])["log"].mean()
    own = logs.groupby("participant").mean()
    return dict(own - own.mean())


def _at_level(
    block: LevelBlock, rows: pd.DataFrame, bounds: tuple[float, float] | None, units: Mapping[str, float]
) -> Iterator[LevelAnswers]:
    summary = SUMMARIES[block.design.reply]
    ends = (0.0, 1.0) if summary == "share" else bounds
    values = rows["success"] if summary == "share" else rows["value"]
    numbers = values.to_numpy(dtype=float)
    numbers = np.log(numbers) if summary == "geometric mean" else numbers
    first = rows.iloc[0]
    make = partial(
        LevelAnswers,
        standard=number_or_none(first["standard"]),
        level=number_or_none(first["level"]),
        comparison=first["comparison"] if isinstance(first["comparison"], str) else number_or_none(first["comparison"]),
        catch=block.stimulus is not None and bool(first["catch"]),
    )
    people = rows["participant"].to_numpy()
    own = {person: numbers[people == person] for person in sorted(set(people))}
    means = np.array([one.mean() - units.get(person, 0.0) for person, one in own.items()])
    count = int(numbers.sum()) if summary == "share" else None
    value, low, high = _summarised(summary, means, ends)
    yield make(None, n=len(numbers), participants=len(own), count=count, value=value, low=low, high=high)
    for person, one in own.items():
        value, low, high = _summarised(summary, one, ends)
        count = None
        if summary == "share":
            count = int(one.sum())
            exact = clopper_pearson(count, len(one))
            low, high = exact.low, exact.high
        yield make(person, n=len(one), participants=1, count=count, value=value, low=low, high=high)


def _summarised(
    summary: Summary, values: Array, bounds: tuple[float, float] | None
) -> tuple[float, float | None, float | None]:
    """Return the mean of shares, points or logarithms and its 95 % interval within bounds, as numbers of their kind."""
    low, high = student_interval(values)
    if summary == "geometric mean":
        low, high = (None if end is None else math.exp(end) for end in (low, high))
        return math.exp(values.mean()), low, high
    if bounds is not None and low is not None and high is not None:
        low, high = max(low, bounds[0]), min(high, bounds[1])
    return float(values.mean()), low, high


def _places(block: LevelBlock) -> dict[str | None, int]:
    """Return the place of each condition that is compared, in the order of the protocol."""
    return {setting.condition: place for place, setting in enumerate(block.settings)}


def _exponents(block: LevelBlock, opened: pd.DataFrame, estimated: Sequence[ThresholdFound]) -> Iterator[ExponentFound]:
    """Yield the exponents of a block: of its numbers over levels, or of its thresholds over standards."""
    if block.stimulus is not None:
        yield from estimated_exponents(block, opened)
        yield from weber_exponents(estimated, block.stimulus.level_kind)


def _level_times(block: LevelBlock, opened: pd.DataFrame) -> Iterator[LevelTimes]:
    """Yield the times of correct and of other answers by level; many levels in `MOST_LEVELS` ranges of neighbours."""
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["right"].notna()]
    rows = rows[rows["level"].notna() & rows["response_s"].notna()]
    for standard, at_standard in rows.groupby("standard", dropna=False, sort=True):
        levels = np.unique(at_standard["level"].to_numpy(dtype=float))
        for some in _ranges(levels):
            here = at_standard[at_standard["level"].astype(float).between(some[0], some[-1])]
            seconds, right = here["response_s"].to_numpy(dtype=float), here["right"].to_numpy(dtype=bool)
            (right_n, right_s), (wrong_n, wrong_s) = _median(seconds[right]), _median(seconds[~right])
            yield LevelTimes(
                number_or_none(standard), float(some[0]), float(some[-1]), right_n, right_s, wrong_n, wrong_s
            )


def _ranges(levels: Array) -> list[Array]:
    """Return ascending levels in at most `MOST_LEVELS` ranges of neighbours."""
    return np.array_split(levels, min(len(levels), MOST_LEVELS)) if len(levels) else []


def _median(seconds: Array) -> tuple[int, float | None]:
    return len(seconds), float(np.median(seconds)) if len(seconds) else None


def _withheld(block: LevelBlock, intervals: pd.DataFrame) -> Iterator[WithheldForce]:
    """Yield what safety withheld of the force in comparisons whose link is varied, by level as `_level_times`."""
    if block.stimulus is None or block.stimulus.vary not in OF_LINK:
        return
    rows = intervals[(intervals["block"] == block.id) & (intervals["presented"] == "comparison")]
    rows = rows[rows["level"].notna() & rows["withheld_share"].notna()]
    for standard, at_standard in rows.groupby("standard", dropna=False, sort=True):
        for some in _ranges(np.unique(at_standard["level"].to_numpy(dtype=float))):
            here = at_standard[at_standard["level"].astype(float).between(some[0], some[-1])]
            percent = 100 * here["withheld_share"].to_numpy(dtype=float)
            mean, most = float(percent.mean()), float(percent.max())
            yield WithheldForce(number_or_none(standard), float(some[0]), float(some[-1]), len(percent), mean, most)


def level_conduct(block: LevelBlock, opened: pd.DataFrame, intervals: pd.DataFrame) -> Iterator[LevelConduct]:
    """Yield the conduct of a block at each standard; ``intervals`` are those of all attempts, of the same sessions."""
    if block.stimulus is None:
        return
    own = opened[(opened["block"] == block.id) & opened["analysed"]]
    presented = intervals[intervals["block"] == block.id].merge(own[TRIAL], on=TRIAL)
    for standard, rows in own.groupby("standard", dropna=False, sort=True):
        here = presented.merge(rows[TRIAL], on=TRIAL)
        attempts = here.drop_duplicates([*TRIAL, "attempt"])
        last = here[here["counted"]]
        errors = (rows["level_delivered"] - rows["level"])[rows["level"] != 0].dropna().astype(float)
        reasons = Counter(word for words in here["invalid_reasons"].dropna() for word in set(str(words).split()))
        yield LevelConduct(
            standard=number_or_none(standard),
            trials=len(rows),
            repeated=len(attempts) - attempts[TRIAL].drop_duplicates().shape[0],
            reasons=dict(sorted(reasons.items())),
            measured=len(errors),
            error_mean=number_or_none(errors.mean()),
            error_largest=number_or_none(errors.abs().max()),
            pace_mps=number_or_none(last["pace_mps"].mean()),
            apparent_mass_kg=number_or_none(last["apparent_mass_kg"].mean()),
        )


def catch_answers(block: LevelBlock, opened: pd.DataFrame) -> Iterator[CatchAnswers]:
    """Yield the answers to catch trials of each session, also where they exclude it."""
    if block.wrong_most is None:
        return
    caught = opened[(opened["block"] == block.id) & opened["catch"].fillna(False) & opened["right"].notna()]
    for _, rows in caught.groupby(["participant", "session"], sort=True):
        wrong = int((~rows["right"].astype(bool)).sum())
        person, session = str(rows["participant"].iloc[0]), int(rows["session"].iloc[0])
        yield CatchAnswers(person, session, len(rows), wrong, block.wrong_most)


def sensitivities(block: LevelBlock, opened: pd.DataFrame) -> Iterator[SensitivityFound]:
    """Yield the group's sensitivity at each standard, to each condition or at each level, then its participants'."""
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["response"].notna()]
    match block.design.reply:
        case "choice":
            by = "standard" if block.stimulus is not None else "track"
            for which, some in rows.groupby(by, dropna=False, sort=True):
                where = {"standard": number_or_none(which)} if by == "standard" else {"comparison": str(which)}
                yield from _with_group([_of_choices(block, person, one, where) for person, one in _people(some)])
        case "rating":
            levels = sorted(rows["level"].dropna().unique())
            for level in levels[1:]:
                own = [_of_ratings(person, one, levels[0], level) for person, one in _people(rows)]
                yield from _with_group([one for one in own if one is not None])
        case "number" | "setting":
            return


def _with_group(own: Sequence[SensitivityFound]) -> Iterator[SensitivityFound]:
    """Yield the group's means over participants, d′ with Student's interval, before the participants."""
    if not own:
        return
    d_primes = _known(own, "d_prime")
    low, high = student_interval(d_primes) if len(d_primes) else (None, None)
    mean = partial(_mean_of, own)
    yield SensitivityFound(
        participant=None,
        n=len(own),
        shares={answer: float(np.mean([one.shares[answer] for one in own])) for answer in own[0].shares},
        standard=own[0].standard,
        comparison=own[0].comparison,
        level=own[0].level,
        d_prime=mean("d_prime"),
        low=low,
        high=high,
        criterion=mean("criterion"),
        model=own[0].model,
        other=mean("other"),
    )
    yield from own


def _known(own: Sequence[SensitivityFound], name: str) -> Any:
    return np.array([value for one in own if (value := getattr(one, name)) is not None], float)


def _mean_of(own: Sequence[SensitivityFound], name: str) -> float | None:
    values = _known(own, name)
    return float(values.mean()) if len(values) else None


def _of_ratings(person: str, rows: pd.DataFrame, lowest: float, level: float) -> SensitivityFound | None:
    noise, signal = (rows.loc[rows["level"] == at, "value"].dropna().to_numpy(float) for at in (lowest, level))
    found = rating(noise, signal)
    one = SensitivityFound(participant=person, n=len(noise) + len(signal), shares={}, level=float(level))
    return None if found is None else _measured(one, found)


def _measured(one: SensitivityFound, found: Sensitivity | None) -> SensitivityFound:
    if found is None:
        return one
    half = None if found.variance is None else Z_95 * math.sqrt(found.variance)
    return replace(
        one,
        d_prime=found.d_prime,
        low=None if half is None else found.d_prime - half,
        high=None if half is None else found.d_prime + half,
        criterion=found.criterion,
        model=found.model,
        other=found.other,
    )


def _people(rows: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    for person, own in rows.groupby("participant", sort=True):
        yield str(person), own


def _of_choices(
    block: LevelBlock, person: str, rows: pd.DataFrame, where: Mapping[str, float | str | None]
) -> SensitivityFound:
    design = block.design
    pairs = zip(rows["arrangement"].astype(str), rows["response"].astype(str), strict=True)
    counts = Counter((arrangement_of(design, letters), answer) for letters, answer in pairs)
    given = Counter(rows["response"].astype(str))
    found = design.sensitivity(counts, roving=block.standards_rove) if block.has_correct_answer else None
    one = SensitivityFound(
        participant=person,
        n=len(rows),
        shares={answer: given[answer] / len(rows) for answer in design.answers},
        **where,  # type: ignore[arg-type]  # standard or comparison
    )
    return _measured(one, found)


def settings(block: LevelBlock, opened: pd.DataFrame) -> Iterator[SettingFound]:
    """Yield the group's settings at each standard, followed by those of its participants; none of other designs."""
    stimulus = block.stimulus
    if stimulus is None or not block.design.adjusts:
        return
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["response"].notna()]
    rows = rows[rows["setting"].notna()]
    for _, at_standard in rows.groupby("standard", dropna=False, sort=True):
        known = None if pd.isna(which := at_standard["standard"].iloc[0]) else float(which)
        people = at_standard.groupby("participant", sort=True)
        own = [_setting_of_person(block, stimulus, str(person), known, some) for person, some in people]
        yield _group_setting(stimulus, known, own)
        yield from own


def _setting_of_person(
    block: LevelBlock, stimulus: Stimulus, person: str, standard: float | None, rows: pd.DataFrame
) -> SettingFound:
    in_u = np.vectorize(stimulus.coordinate, otypes=[float])
    u, starts = (in_u(rows[name].to_numpy(dtype=float)) for name in ("setting", "level"))
    found = setting_statistics(u, starts > sum(stimulus.domain) / 2)
    compared = standard is not None and block.design.intervals > 1
    return SettingFound(
        participant=person,
        standard=standard,
        n=found.n,
        pse=stimulus.level_of(found.pse),
        low=_setting_level(stimulus, found.low),
        high=_setting_level(stimulus, found.high),
        jnd=found.jnd,
        constant_error=found.pse - stimulus.coordinate(standard) if compared and standard is not None else None,
        hysteresis=found.hysteresis,
        levels=tuple(rows["setting"].to_numpy(dtype=float).tolist()),
        started_high=tuple((starts > sum(stimulus.domain) / 2).tolist()),
    )


def _setting_level(stimulus: Stimulus, u: float | None) -> float | None:
    return None if u is None else stimulus.level_of(u)


def _group_setting(stimulus: Stimulus, standard: float | None, own: Sequence[SettingFound]) -> SettingFound:
    """Return the means over participants, with Student's interval of the PSE."""
    pse = np.array([stimulus.coordinate(one.pse) for one in own])
    low, high = student_interval(pse)
    return SettingFound(
        participant=None,
        standard=standard,
        n=len(own),
        pse=stimulus.level_of(float(pse.mean())),
        low=_setting_level(stimulus, low),
        high=_setting_level(stimulus, high),
        jnd=_mean_setting(own, lambda one: one.jnd),
        constant_error=_mean_setting(own, lambda one: one.constant_error),
        hysteresis=_mean_setting(own, lambda one: one.hysteresis),
    )


def _mean_setting(own: Sequence[SettingFound], value: Callable[[SettingFound], Any]) -> float | None:
    known = [number for one in own if (number := value(one)) is not None]
    return float(np.mean(known)) if known else None


def _time_numbers(answers: pd.DataFrame) -> dict[str, Any]:
    seconds = answers["response_s"].dropna().to_numpy(dtype=float)
    low, middle, high = quartiles_or_none(seconds)
    return {"n": len(seconds), "median": middle, "q1": low, "q3": high}
