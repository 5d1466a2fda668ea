"""Blocks of levels, summarised: conduct, answers at each level, sensitivities and settings.

A block of levels has them over all levels of a standard, a block of conditions for each comparison, and ratings for
each level against the lowest.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
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
    GroupAnswers,
    LevelAnswers,
    LevelConduct,
    LevelsFound,
    LevelTimes,
    SensitivityFound,
    SettingFound,
    Summary,
    WithheldForce,
)
from study_app.analysis.levels.thresholds import (
    answers_timed,
    estimated_exponents,
    mean_over,
    thresholds,
    tracks,
    weber_exponents,
)
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
    return tuple(_levels_of_block(study, block, timed, opened, bounds.get(block.id)) for block in main)


def _levels_of_block(
    study: Study,
    block: LevelBlock,
    timed: pd.DataFrame,
    opened: pd.DataFrame | None,
    bounds: tuple[float, float] | None,
) -> LevelsFound:
    counted = timed[(timed["block"] == block.id) & timed["counted"] & timed["response"].notna()]
    stimulus = block.stimulus
    found = LevelsFound(
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
        guess_rate=block.design.guess_rate if block.has_correct_answer else None,
        bounds=bounds,
        own_units=_chooses_units(block),
        family=None if block.assumed is None else block.assumed.family,
        adaptive=block.method is not None and block.method.adaptive,
        published=tuple(PublishedValue(**one.model_dump(exclude={"block"})) for one in block.published),
        device=study.own_dynamics,
    )
    if stimulus is not None:
        found = replace(
            found,
            vary=stimulus.vary,
            quantity=quantity_words(stimulus.vary),
            unit=quantity(stimulus.vary).unit,
            level_kind=stimulus.level_kind,
            spacing=stimulus.spacing,
        )
    if opened is None:
        return found
    estimated = tuple(thresholds(block, opened))
    exponents = () if stimulus is None else weber_exponents(estimated, stimulus.level_kind)
    return replace(
        found,
        answers=tuple(_level_answers(block, opened, bounds)),
        thresholds=estimated,
        exponents=(*estimated_exponents(block, opened), *exponents),
        level_times=tuple(_level_times(block, opened)),
        withheld=tuple(_withheld(block, study.intervals)),
        conduct=tuple(level_conduct(block, opened, study.intervals)),
        catches=tuple(catch_answers(block, opened)),
        sensitivities=tuple(sensitivities(block, opened)),
        settings=tuple(settings(block, opened)),
    )


def _time_numbers(answers: pd.DataFrame) -> dict[str, Any]:
    seconds = answers["response_s"].dropna().to_numpy(dtype=float)
    low, middle, high = quartiles_or_none(seconds)
    return {"n": len(seconds), "median": middle, "q1": low, "q3": high}


def _chooses_units(block: LevelBlock) -> bool:
    """Return whether each participant chooses the unit of the numbers named: there is no modulus."""
    return block.design.reply == "number" and block.design.first is None


def _analysed(block: LevelBlock, opened: pd.DataFrame, answer: str = "response") -> pd.DataFrame:
    """Return the rows of a block that are analysed, those with this column known."""
    return opened[(opened["block"] == block.id) & opened["analysed"] & opened[answer].notna()]


def _level_answers(
    block: LevelBlock, opened: pd.DataFrame, bounds: tuple[float, float] | None
) -> Iterator[LevelAnswers]:
    """Yield the answers at each level, and apart those to catch trials: of all participants, then of each."""
    if block.design.adjusts:
        return
    rows = _analysed(block, opened)
    if block.stimulus is None:
        places = {setting.condition: place for place, setting in enumerate(block.settings)}
        rows = rows.assign(comparison=rows["track"], place=rows["track"].map(places), catch=False)
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
    own = answered.groupby(["participant", "level"])["log"].mean().groupby("participant").mean()
    return dict(own - own.mean())


def _at_level(
    block: LevelBlock, rows: pd.DataFrame, bounds: tuple[float, float] | None, units: Mapping[str, float]
) -> Iterator[LevelAnswers]:
    summary = SUMMARIES[block.design.reply]
    share = summary == "share"
    numbers = rows["success" if share else "value"].to_numpy(dtype=float)
    numbers = np.log(numbers) if summary == "geometric mean" else numbers
    first = rows.iloc[0]
    make = partial(
        LevelAnswers,
        standard=number_or_none(first["standard"]),
        level=number_or_none(first["level"]),
        comparison=first["comparison"] if isinstance(first["comparison"], str) else number_or_none(first["comparison"]),
        catch=bool(first["catch"]),
    )
    summarised = partial(_summarised, summary, (0.0, 1.0) if share else bounds)
    people = rows["participant"].to_numpy()
    own = {person: numbers[people == person] for person in sorted(set(people))}
    value, low, high = summarised(np.array([one.mean() - units.get(person, 0.0) for person, one in own.items()]))
    count = int(numbers.sum()) if share else None
    yield make(None, n=len(numbers), participants=len(own), count=count, value=value, low=low, high=high)
    for person, one in own.items():
        value, low, high = summarised(one)
        if share:
            count = int(one.sum())
            exact = clopper_pearson(count, len(one))
            low, high = exact.low, exact.high
        yield make(person, n=len(one), participants=1, count=count, value=value, low=low, high=high)


def _summarised(
    summary: Summary, bounds: tuple[float, float] | None, values: Array
) -> tuple[float, float | None, float | None]:
    """Return the mean of shares, points or logarithms and its 95 % interval within bounds, as numbers of their kind."""
    low, high = student_interval(values)
    if summary == "geometric mean":
        low, high = (None if end is None else math.exp(end) for end in (low, high))
        return math.exp(values.mean()), low, high
    if bounds is not None and low is not None and high is not None:
        low, high = max(low, bounds[0]), min(high, bounds[1])
    return float(values.mean()), low, high


def _by_levels(rows: pd.DataFrame) -> Iterator[tuple[float | None, float, float, pd.DataFrame]]:
    """Yield standard, lowest and highest level, and their rows: many levels in `MOST_LEVELS` ranges of neighbours."""
    for standard, at_standard in rows[rows["level"].notna()].groupby("standard", dropna=False, sort=True):
        level = at_standard["level"].astype(float)
        levels = np.unique(level.to_numpy())
        for some in np.array_split(levels, min(len(levels), MOST_LEVELS)):
            here = at_standard[level.between(some[0], some[-1])]
            yield number_or_none(standard), float(some[0]), float(some[-1]), here


def _level_times(block: LevelBlock, opened: pd.DataFrame) -> Iterator[LevelTimes]:
    """Yield the times of correct and of other answers by level."""
    rows = _analysed(block, opened, "right")
    for standard, low, high, here in _by_levels(rows[rows["response_s"].notna()]):
        seconds, right = here["response_s"].to_numpy(dtype=float), here["right"].to_numpy(dtype=bool)
        (right_n, right_s), (wrong_n, wrong_s) = (
            (len(some), float(np.median(some)) if len(some) else None) for some in (seconds[right], seconds[~right])
        )
        yield LevelTimes(standard, low, high, right_n, right_s, wrong_n, wrong_s)


def _withheld(block: LevelBlock, intervals: pd.DataFrame) -> Iterator[WithheldForce]:
    """Yield what safety withheld of the force in comparisons whose link is varied, by level."""
    if block.stimulus is None or block.stimulus.vary not in OF_LINK:
        return
    rows = intervals[(intervals["block"] == block.id) & (intervals["presented"] == "comparison")]
    for standard, low, high, here in _by_levels(rows[rows["withheld_share"].notna()]):
        percent = 100 * here["withheld_share"].to_numpy(dtype=float)
        yield WithheldForce(standard, low, high, len(percent), float(percent.mean()), float(percent.max()))


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
    rows = _analysed(block, opened)
    match block.design.reply:
        case "choice":
            by = "standard" if block.stimulus is not None else "track"
            for which, some in rows.groupby(by, dropna=False, sort=True):
                where = {"standard": number_or_none(which)} if by == "standard" else {"comparison": str(which)}
                people = some.groupby("participant", sort=True)
                yield from _with_group([_of_choices(block, str(person), one, where) for person, one in people])
        case "rating":
            lowest, *levels = sorted(rows["level"].dropna().unique()) or [None]
            for level in levels:
                people = rows.groupby("participant", sort=True)
                own = [_of_ratings(str(person), one, lowest, level) for person, one in people]
                yield from _with_group([one for one in own if one is not None])
        case "number" | "setting":
            return


def _with_group(own: Sequence[SensitivityFound]) -> Iterator[SensitivityFound]:
    """Yield the group's means over participants before the participants."""
    if own:
        shares = {answer: float(np.mean([one.shares[answer] for one in own])) for answer in own[0].shares}
        yield replace(mean_over(own, "d_prime", "criterion", "other"), shares=shares)
    yield from own


def _of_ratings(person: str, rows: pd.DataFrame, lowest: float, level: float) -> SensitivityFound | None:
    noise, signal = (rows.loc[rows["level"] == at, "value"].dropna().to_numpy(float) for at in (lowest, level))
    found = rating(noise, signal)
    one = SensitivityFound(participant=person, n=len(noise) + len(signal), shares={}, level=float(level))
    return None if found is None else _measured(one, found)


def _of_choices(
    block: LevelBlock, person: str, rows: pd.DataFrame, where: Mapping[str, float | str | None]
) -> SensitivityFound:
    design = block.design
    pairs = zip(rows["arrangement"].astype(str), rows["response"].astype(str), strict=True)
    counts = Counter((arrangement_of(design, letters), answer) for letters, answer in pairs)
    given = Counter(rows["response"].astype(str))
    found = design.sensitivity(counts, roving=block.standards_rove) if block.has_correct_answer else None
    shares = {answer: given[answer] / len(rows) for answer in design.answers}
    one = SensitivityFound(person, len(rows), shares, **where)  # type: ignore[arg-type]  # standard or comparison
    return one if found is None else _measured(one, found)


def _measured(one: SensitivityFound, found: Sensitivity) -> SensitivityFound:
    half = math.nan if found.variance is None else Z_95 * math.sqrt(found.variance)
    return replace(
        one,
        d_prime=found.d_prime,
        low=number_or_none(found.d_prime - half),
        high=number_or_none(found.d_prime + half),
        criterion=found.criterion,
        model=found.model,
        other=found.other,
    )


def settings(block: LevelBlock, opened: pd.DataFrame) -> Iterator[SettingFound]:
    """Yield the group's settings at each standard, followed by those of its participants; none of other designs."""
    stimulus = block.stimulus
    if stimulus is None or not block.design.adjusts:
        return
    rows = _analysed(block, opened)
    for standard, at_standard in rows[rows["setting"].notna()].groupby("standard", dropna=False, sort=True):
        people = at_standard.groupby("participant", sort=True)
        own = [_setting(block, stimulus, str(person), number_or_none(standard), some) for person, some in people]
        others = ("jnd", "constant_error", "hysteresis")
        group = mean_over(own, "pse", *others, coordinate=stimulus.coordinate, level_of=stimulus.level_of)
        yield replace(group, levels=(), started_high=())
        yield from own


def _setting(
    block: LevelBlock, stimulus: Stimulus, person: str, standard: float | None, rows: pd.DataFrame
) -> SettingFound:
    in_u = np.vectorize(stimulus.coordinate, otypes=[float])
    u, starts = (in_u(rows[name].to_numpy(dtype=float)) for name in ("setting", "level"))
    started_high = starts > sum(stimulus.domain) / 2
    found = setting_statistics(u, started_high)
    compared = standard is not None and block.design.intervals > 1
    low, high = (None if end is None else stimulus.level_of(end) for end in (found.low, found.high))
    return SettingFound(
        participant=person,
        standard=standard,
        n=found.n,
        pse=stimulus.level_of(found.pse),
        low=low,
        high=high,
        jnd=found.jnd,
        constant_error=found.pse - stimulus.coordinate(standard) if compared and standard is not None else None,
        hysteresis=found.hysteresis,
        levels=tuple(rows["setting"].to_numpy(dtype=float).tolist()),
        started_high=tuple(started_high.tolist()),
    )
