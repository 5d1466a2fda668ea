"""Whether participants recognise which liquid they felt, and how far two ways of naming agree.

Cohen (1960), Educ. Psychol. Meas. 20, 37–46; its standard error: Fleiss, Cohen & Everitt (1969), Psychol. Bull. 72,
323–327.

What a participant names is the single label rated highest ("this liquid behaves like …"); equal highest ratings are
undecided. Chance is what remains when the settings are exchanged within each participant.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from study_app.analysis.statistics.outcome import (
    FEW,
    TOO_FEW,
    Array,
    Interval,
    Lattice,
    Outcome,
    Whole,
    checked,
    clopper_pearson,
    of_values,
    percentiles,
    resamples,
    total,
)
from study_app.errors import AnalysisError

SURE: Final = 0.95


@dataclass(frozen=True, slots=True)
class Kappa:
    """Cohen's kappa of ``n`` pairs of names; None with ``note`` where it does not exist.

    ``interval`` takes the pairs to be independent.
    """

    n: int
    kappa: float | None
    agreement: float | None
    expected: float | None
    interval: Interval | None
    note: str


def kappa(table: ArrayLike) -> Kappa:
    """Return Cohen's kappa of a square table of counts.

    Raises
    ------
    AnalysisError
        The table is not square or holds something else than counts.
    """
    counts = checked(table, "categories of one, categories of the other")
    if counts.shape[0] != counts.shape[1] or not (counts >= 0).all():
        raise AnalysisError(
            f"a table of shape {counts.shape} is not a square table of counts: give one row and one column per category"
        )
    n = int(counts.sum())
    if n == 0:
        return Kappa(0, None, None, None, None, "nothing was named")
    shares = counts / n
    agreed = float(np.trace(shares))
    rows, columns = shares.sum(axis=1), shares.sum(axis=0)
    expected = float(rows @ columns)
    if expected == 1.0:
        return Kappa(n, None, agreed, expected, None, "no variation: always the same name for the same thing")
    found = (agreed - expected) / (1 - expected)
    error = _kappa_error(shares, rows, columns, agreed, expected, n)
    reach = float(norm.ppf((1 + SURE) / 2)) * error
    interval = Interval(found - reach, min(1.0, found + reach), SURE, "normal, answers taken as independent")
    return Kappa(n, found, agreed, expected, interval if error > 0.0 else None, "")


def _kappa_error(shares: Array, rows: Array, columns: Array, agreed: float, expected: float, n: int) -> float:
    """Return the standard error of kappa (Fleiss, Cohen & Everitt 1969, eq. 13)."""
    found = (agreed - expected) / (1 - expected)
    ends = columns[:, None] + rows[None, :]
    off = shares * ends**2
    np.fill_diagonal(off, 0.0)
    diagonal = np.diag(shares) * (1 - (rows + columns) * (1 - found)) ** 2
    variance = diagonal.sum() + (1 - found) ** 2 * off.sum() - (found - expected * (1 - found)) ** 2
    return math.sqrt(max(0.0, float(variance))) / ((1 - expected) * math.sqrt(n))


UNDECIDED: Final = -1
UNANSWERED: Final = -2
MOST: Final = 8
"""All orders of more settings are too many to go through."""


@dataclass(frozen=True, slots=True)
class HitRate:
    """How often one setting was given its own name: ``hits`` of ``n`` answers, with a Clopper-Pearson interval."""

    setting: int
    hits: int
    n: int
    rate: float | None
    interval: Interval | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Recognition(Outcome):
    """Hits in all (``statistic``), tested against ``expected`` hits by chance; ``effect`` is kappa of decided answers.

    ``table`` counts names: one row a setting, one column a label, then undecided, then unanswered. ``rates`` has one
    entry for each setting that has a label of its own.
    """

    expected: float | None
    table: tuple[tuple[int, ...], ...]
    rates: tuple[HitRate, ...]
    decided: int
    undecided: int
    unanswered: int


def named(ratings: ArrayLike) -> Whole:
    """Return which label each participant named for each setting.

    Parameters
    ----------
    ratings : (participants, settings, labels) array
        Agreement with "this liquid behaves like <label>"; NaN where it is missing.

    Returns
    -------
    (participants, settings) array
        The label's place, ``UNDECIDED`` where several are highest, ``UNANSWERED`` where a rating is missing.
    """
    array = checked(ratings, "participants, settings, labels")
    missing = np.isnan(array).any(axis=2)
    filled = np.where(np.isnan(array), -np.inf, array)
    tied = (filled == filled.max(axis=2, keepdims=True)).sum(axis=2) > 1
    return np.where(missing, UNANSWERED, np.where(tied, UNDECIDED, filled.argmax(axis=2))).astype(np.int64)


def recognition(names: ArrayLike, truth: Sequence[int | None], labels: int, *, seed: int | None = 1) -> Recognition:
    """Test whether settings were named for what they were, more often than by chance.

    Parameters
    ----------
    names : (participants, settings) array
        As ``named`` gives them.
    truth : sequence
        The right label's place for each setting; None where there is no label for it.
    labels : int
        How many labels there were to choose from.
    seed : int, optional
        For the bootstrap interval of kappa, from ten participants; None: no interval.

    Raises
    ------
    AnalysisError
        Names and truth do not fit together.
    """
    given = _names(names, truth, labels)
    used = (given != UNANSWERED).any(axis=1)
    right = np.array([UNANSWERED - 1 if label is None else label for label in truth])
    hits = int((given == right).sum())
    chance = total(_chance(tuple(row), tuple(right.tolist())) for row in given.tolist())
    effect, interval, reason = _kappa(given, right, labels, seed)
    n = int(used.sum())
    return Recognition(
        test="recognition by name",
        n=n,
        dropped=int((~used).sum()),
        statistic_name="hits",
        statistic=float(hits) if n else None,
        p=chance.at_least(hits) if n else None,
        smallest_p=chance.highest if n else None,
        method="exact permutation of the settings within participants, one-sided",
        effect_name="Cohen's kappa of decided answers",
        effect=effect,
        interval=interval,
        no_interval=reason,
        note=_note(n, int((given == UNDECIDED).sum()), chance.highest),
        expected=chance.mean if n else None,
        table=tuple(tuple(int((column == label).sum()) for label in _columns(labels)) for column in given.T),
        rates=tuple(_rate(given, setting, label) for setting, label in enumerate(truth) if label is not None),
        decided=int((given >= 0).sum()),
        undecided=int((given == UNDECIDED).sum()),
        unanswered=int((given == UNANSWERED).sum()),
    )


def _names(names: ArrayLike, truth: Sequence[int | None], labels: int) -> Whole:
    given = checked(names, "participants, settings")
    if given.shape[1] != len(truth) or not 2 <= len(truth) <= MOST:
        raise AnalysisError(f"{given.shape[1]} settings with names, {len(truth)} true names; give as many, 2 to {MOST}")
    if not np.isin(given, _columns(labels)).all() or not {*truth} <= {None, *range(labels)}:
        raise AnalysisError(
            f"a name is none of {labels} labels; give places 0 to {labels - 1}, -1 undecided, -2 missing"
        )
    return given.astype(np.int64)


def _columns(labels: int) -> list[int]:
    return [*range(labels), UNDECIDED, UNANSWERED]


@lru_cache(maxsize=1024)
def _chance(row: tuple[int, ...], right: tuple[int, ...]) -> Lattice:
    """Return the distribution of one participant's hits when the names change places among answered settings."""
    answered = np.array(row) != UNANSWERED
    names, wanted = np.array(row)[answered], np.array(right)[answered]
    if not len(names):
        return of_values([0])
    orders = np.array(list(permutations(range(len(names)))))
    return of_values((names[orders] == wanted).sum(axis=1).tolist())


def _kappa(given: Whole, right: Whole, labels: int, seed: int | None) -> tuple[float | None, Interval | None, str]:
    """Return kappa over decided answers, its interval by resampling participants, or why there is none."""
    used = (given >= 0) & (right >= 0)
    tables = np.zeros((len(given), labels, labels))
    people, settings = np.nonzero(used)
    np.add.at(tables, (people, right[settings], given[people, settings]), 1)
    tables = tables[used.any(axis=1)]
    whole = kappa(tables.sum(axis=0))
    if whole.kappa is None:
        return None, None, f"no interval: {whole.note}"
    if seed is None:
        return whole.kappa, None, "no interval: none was asked for"
    if len(tables) < FEW:
        return whole.kappa, None, TOO_FEW
    samples = np.concatenate([_kappas(tables, rows) for rows in resamples(len(tables), seed)])
    samples = samples[~np.isnan(samples)]
    if np.ptp(samples) == 0.0:
        return whole.kappa, None, "no interval: all participants gave the same names"
    return whole.kappa, percentiles(samples), ""


def _kappas(tables: Array, rows: Whole) -> Array:
    """Return kappa (draws,) of the summed ``tables`` (n, labels, labels) of resampled participants (draws, n)."""
    times = np.array([np.bincount(row, minlength=len(tables)) for row in rows])
    shares = np.tensordot(times, tables, axes=1)
    shares /= shares.sum(axis=(1, 2), keepdims=True)
    agreed = np.trace(shares, axis1=1, axis2=2)
    expected = (shares.sum(axis=1) * shares.sum(axis=2)).sum(axis=1)
    values: Array = np.where(expected < 1.0, (agreed - expected) / np.where(expected < 1.0, 1 - expected, 1.0), np.nan)
    return values


def _rate(given: Whole, setting: int, label: int) -> HitRate:
    answers = given[given[:, setting] != UNANSWERED, setting]
    n, hits = len(answers), int((answers == label).sum())
    if not n:
        return HitRate(setting, 0, 0, None, None)
    return HitRate(setting, hits, n, hits / n, clopper_pearson(hits, n))


def _note(n: int, undecided: int, smallest: float) -> str:
    if n == 0:
        return "no participant rated all labels of a setting"
    if smallest == 1.0:
        return "no variation: every participant gave all settings the same name or none"
    if undecided:
        return f"{undecided} undecided answer{'s count' if undecided > 1 else ' counts'} as no hit"
    return ""
