"""Sensitivity and bias in a block with a design: d′, criterion and shares of the answers, per participant and group.

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

from study_app.analysis.results.level_results import SensitivityFound
from study_app.analysis.statistics.student_interval import student_interval
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.analysis.tables.measures import number_or_none
from study_app.protocol.trials.presentation import arrangement_of
from study_app.psychophysics.detection import Sensitivity, rating

Z_95: Final = 1.959964


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


def _with_group(own: Sequence[SensitivityFound]) -> Iterator[SensitivityFound]:
    """Yield the group's means over participants, d′ with Student's interval, before the participants."""
    if not own:
        return
    d_primes = _known(own, "d_prime")
    low, high = student_interval(d_primes) if len(d_primes) else (None, None)
    mean = partial(_mean, own)
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


def _mean(own: Sequence[SensitivityFound], name: str) -> float | None:
    values = _known(own, name)
    return float(values.mean()) if len(values) else None
