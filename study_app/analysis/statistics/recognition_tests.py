"""Tests of whether participants recognise the liquids that they feel, and Cohen's kappa of the names that they give.

Cohen (1960), Educ. Psychol. Meas. 20, 37–46.

A participant names the label with the highest rating ("this liquid behaves like …"); if several ratings are highest,
the answer is undecided. The distribution by chance exchanges the settings within each participant. A single setting is
recognised if participants use its name more often for it than for each other setting (McNemar 1947, Psychometrika 12,
153–157), so that a liquid that is confused with another is not recognised.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import permutations
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtr

from study_app.analysis.statistics.outcome import (
    SAMPLES,
    Array,
    Interval,
    Lattice,
    Outcome,
    Whole,
    checked_values,
    clopper_pearson,
    holm,
    sum_distribution,
    uniform_lattice,
)
from study_app.errors import AnalysisError


def kappa(tables: ArrayLike) -> Array:
    """Return Cohen's kappa (…) of tables (…, labels, labels); NaN without answers or with only one name.

    The tables count answers by correct name (rows) and given name (columns).
    """
    counts = np.asarray(tables, dtype=np.float64)
    n = counts.sum(axis=(-2, -1), keepdims=True)
    proportions = np.divide(counts, n, out=np.zeros_like(counts), where=n > 0)
    agreed = np.trace(proportions, axis1=-2, axis2=-1)
    expected = (proportions.sum(axis=-2) * proportions.sum(axis=-1)).sum(axis=-1)
    exists = (n[..., 0, 0] > 0) & (expected < 1.0)
    return np.where(exists, (agreed - expected) / np.where(exists, 1 - expected, 1.0), np.nan)


_Flags: TypeAlias = NDArray[np.bool_]

UNDECIDED: Final = -1
UNANSWERED: Final = -2
MOST: Final = 8
"""The most settings whose orders are all enumerated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HitRate:
    """The correct answers for one setting: ``hits`` of ``n``, with a Clopper–Pearson interval.

    ``p`` is the largest p of the tests against each other setting, reached for ``rival``: that the name is used more
    often for this setting. ``p_adjusted`` is Holm-corrected across the settings with a name. None without an answer or
    another setting.
    """

    setting: int
    hits: int
    n: int
    rate: float | None
    interval: Interval | None
    rival: int | None = None
    p: float | None = None
    p_adjusted: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Recognition(Outcome):
    """Total hits (``statistic``), tested against ``expected`` hits by chance; ``effect`` is kappa of decided answers.

    ``table`` counts names: one row per setting, one column per label, then undecided and unanswered. ``rates`` has one
    entry for each setting with its own label.
    """

    expected: float | None
    table: tuple[tuple[int, ...], ...]
    rates: tuple[HitRate, ...]
    decided: int
    undecided: int
    unanswered: int


def named_labels(ratings: ArrayLike) -> Whole:
    """Return the index of the label that each participant named for each setting (participants, settings).

    ``ratings`` (participants, settings, labels) are agreement with "this liquid behaves like <label>". ``UNDECIDED`` if
    several are highest, ``UNANSWERED`` if a rating is missing.
    """
    array = checked_values(ratings, "participants, settings, labels")
    missing = np.isnan(array).any(axis=2)
    filled = np.where(np.isnan(array), -np.inf, array)
    tied = (filled == filled.max(axis=2, keepdims=True)).sum(axis=2) > 1
    return np.where(missing, UNANSWERED, np.where(tied, UNDECIDED, filled.argmax(axis=2))).astype(np.int64)


def recognition(names: ArrayLike, truth: Sequence[int | None], labels: int, *, seed: int | None = 1) -> Recognition:
    """Test whether settings were named correctly more often than by chance.

    ``names`` (participants, settings) are from `named_labels`, ``truth`` is the index of the correct label for each
    setting, None if there is none; ``seed`` is for the bootstrap interval of kappa, which needs two participants.
    """
    given = _check_names(names, truth, labels)
    has_answers = (given != UNANSWERED).any(axis=1)
    correct = np.array([UNANSWERED - 1 if label is None else label for label in truth])
    hits = int((given == correct).sum())
    chance = sum_distribution(_hits_by_chance(tuple(row), tuple(correct.tolist())) for row in given.tolist())
    effect, interval, reason = _kappa_with_interval(given, correct, labels, seed)
    n = int(has_answers.sum())
    return Recognition(
        test="recognition by name",
        n=n,
        dropped=int((~has_answers).sum()),
        statistic_name="hits",
        statistic=float(hits) if n else None,
        p=chance.at_least(hits) if n else None,
        smallest_p=chance.highest if n else None,
        method="exact permutation of the conditions within participants, one-sided",
        effect_name="Cohen's kappa for decided answers",
        effect=effect,
        interval=interval,
        no_interval=reason,
        note=_recognition_note(n, int((given == UNDECIDED).sum()), chance.highest),
        expected=chance.mean if n else None,
        table=tuple(tuple(int((column == label).sum()) for label in _table_columns(labels)) for column in given.T),
        rates=_hit_rates(given, truth),
        decided=int((given >= 0).sum()),
        undecided=int((given == UNDECIDED).sum()),
        unanswered=int((given == UNANSWERED).sum()),
    )


def _check_names(names: ArrayLike, truth: Sequence[int | None], labels: int) -> Whole:
    given = checked_values(names, "participants, settings")
    if given.shape[1] != len(truth) or not 2 <= len(truth) <= MOST:
        raise AnalysisError(
            f"names were given to {given.shape[1]} conditions, but there are {len(truth)} true names; specify the "
            f"same number of each, from 2 to {MOST}"
        )
    if not np.isin(given, _table_columns(labels)).all() or not {*truth} <= {None, *range(labels)}:
        raise AnalysisError(
            f"an answer is outside the {labels} labels; specify each answer as the position of a label (0 to "
            f"{labels - 1}), -1 for undecided or -2 for missing"
        )
    return given.astype(np.int64)


def _table_columns(labels: int) -> list[int]:
    return [*range(labels), UNDECIDED, UNANSWERED]


@lru_cache(maxsize=1024)
def _hits_by_chance(given_names: tuple[int, ...], correct_names: tuple[int, ...]) -> Lattice:
    """Return the distribution of one participant's hits if the names are permuted among the answered settings."""
    answered = np.array(given_names) != UNANSWERED
    names, correct = np.array(given_names)[answered], np.array(correct_names)[answered]
    if not len(names):
        return uniform_lattice([0])
    orders = np.array(list(permutations(range(len(names)))))
    return uniform_lattice((names[orders] == correct).sum(axis=1).tolist())


def _kappa_with_interval(
    given: Whole, right: Whole, labels: int, seed: int | None
) -> tuple[float | None, Interval | None, str]:
    """Return kappa over decided answers, its interval, and the reason if there is none.

    The interval is from a bootstrap of the proportion of correct answers (Gaffke 2005) with an additional participant,
    whose answers are all incorrect for the lower end and all correct for the upper end; so it is not empty if all
    participants agree. The agreement expected by chance is fixed at its observed value.
    """
    is_decided = (given >= 0) & (right >= 0)
    tables = np.zeros((len(given), labels, labels))
    people, settings = np.nonzero(is_decided)
    np.add.at(tables, (people, right[settings], given[people, settings]), 1)
    tables = tables[is_decided.any(axis=1)]
    pooled_kappa = float(kappa(tables.sum(axis=0)))
    if math.isnan(pooled_kappa):
        why = "only one name was used, and for only one liquid" if is_decided.any() else "no liquid was named"
        return None, None, f"no interval: {why}"

    if seed is None:
        return pooled_kappa, None, "no interval was requested"
    if (n := len(tables)) < 2:
        return pooled_kappa, None, "no interval: there is only one participant"
    correct, decided = np.trace(tables, axis1=1, axis2=2), tables.sum(axis=(1, 2))
    weights = np.random.default_rng(seed).standard_exponential((SAMPLES, n + 1))
    extra_answers = weights[:, n] * decided.max()
    all_decided = weights[:, :n] @ decided + extra_answers
    lowest, highest = (weights[:, :n] @ correct + extra_correct for extra_correct in (0.0, extra_answers))
    expected = _chance_agreement(tables.sum(axis=0))
    low, high = (
        (float(np.quantile(proportions / all_decided, end)) - expected) / (1.0 - expected)
        for proportions, end in ((lowest, 0.025), (highest, 0.975))
    )
    method = (
        "bootstrap over participants and one additional participant, who is always incorrect (lower end) or always "
        "correct (upper end; Gaffke 2005)"
    )
    return pooled_kappa, Interval(low=low, high=high, level=0.95, method=method), ""


def _chance_agreement(table: Array) -> float:
    """Return the proportion of agreement expected by chance, from a table of counts."""
    proportions = table / table.sum()
    return float((proportions.sum(axis=0) * proportions.sum(axis=1)).sum())


def _hit_rates(given: Whole, truth: Sequence[int | None]) -> tuple[HitRate, ...]:
    rates = [_hit_rate(given, setting, label, truth) for setting, label in enumerate(truth) if label is not None]
    adjusted = holm([rate.p for rate in rates])
    return tuple(replace(rate, p_adjusted=p) for rate, p in zip(rates, adjusted, strict=True))


def _hit_rate(given: Whole, setting: int, label: int, truth: Sequence[int | None]) -> HitRate:
    answers = given[given[:, setting] != UNANSWERED, setting]
    n, hits = len(answers), int((answers == label).sum())
    if not n:
        return HitRate(setting=setting, hits=0, n=0, rate=None, interval=None)
    ps = {
        other: _mcnemar_p(
            given[:, setting] == label, given[:, other] == label, (given[:, [setting, other]] != UNANSWERED)
        )
        for other, name in enumerate(truth)
        if name != label
    }
    rival = max(ps, key=lambda other: ps[other], default=None)
    p = None if rival is None else ps[rival]
    return HitRate(setting=setting, hits=hits, n=n, rate=hits / n, interval=clopper_pearson(hits, n), rival=rival, p=p)


def _mcnemar_p(named: _Flags, named_other: _Flags, answered: _Flags) -> float:
    """Return the exact one-sided p that a name is used more often for one setting than for another.

    ``named`` and ``named_other`` (n,) tell whether each participant used the name for the first and for the second
    setting, and ``answered`` (n, 2) whether the participant answered in each of them.
    """
    both = answered.all(axis=1)
    more, less = int((named & ~named_other & both).sum()), int((named_other & ~named & both).sum())
    return float(bdtr(less, more + less, 0.5)) if more + less else 1.0


def _recognition_note(n: int, undecided: int, smallest: float) -> str:
    if n == 0:
        return "no participant rated all labels in any condition"
    if smallest == 1.0:
        return "no variation: every participant gave the same name to all conditions, or did not name any"
    if undecided:
        return f"{undecided} undecided answer{'s count' if undecided > 1 else ' counts'} as incorrect"
    return ""
