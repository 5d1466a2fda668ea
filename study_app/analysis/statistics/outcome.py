"""The common result of all tests, and the distributions, intervals and corrections that tests share.

A result never contains NaN: a value that cannot be computed is None, and ``note`` or ``no_interval`` gives the reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Final, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import betaincinv, ndtr, ndtri, stdtrit

from study_app.errors import AnalysisError

Array: TypeAlias = NDArray[np.float64]
Whole: TypeAlias = NDArray[np.int64]

DRAWS: Final = 9999
"""Number of random permutations if a full enumeration takes too long; p is then (1 + extreme ones) / (1 + DRAWS)."""

_MOST_DRAWS: Final = 199_999
_LARGEST_SHARE: Final = 0.05
"""The smallest p that permutations can give, corrected for its family, is at most this proportion of alpha."""

SAMPLES: Final = 1999
"""Bootstrap samples of an interval."""

FEW: Final = 10
"""The fewest participants for a percentile bootstrap interval and for a test of slopes."""

_TOO_FEW: Final = f"no interval for fewer than {FEW} participants, because its coverage would be far too low"
NO_VARIATION: Final = "no variation: every participant gave the same answer in all conditions"


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A confidence interval with its ``level`` (0.95) and method."""

    low: float
    high: float
    level: float
    method: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """The values that a report prints for every test.

    ``n`` participants were used, ``dropped`` were not because of missing answers. ``statistic``, ``p`` and ``effect``
    are None if they do not exist; ``note`` then gives the reason, and otherwise a remark that must accompany the
    numbers. ``smallest_p`` is the smallest p that these participants could have produced given their ties; None if p is
    continuous. ``interval`` belongs to ``effect``; if it is None, ``no_interval`` gives the reason.
    """

    test: str
    n: int
    dropped: int
    statistic_name: str
    statistic: float | None = None
    p: float | None = None
    smallest_p: float | None = None
    method: str = "none"
    effect_name: str
    effect: float | None = None
    interval: Interval | None = None
    no_interval: str = ""
    note: str = ""


def checked_values(values: ArrayLike, axes: str) -> Array:
    """Return ``values`` as floats, with NaN for missing answers; ``axes`` names the axes: "participants, settings"."""
    array = np.asarray(values, dtype=np.float64)
    dimensions = axes.count(",") + 1
    if array.ndim != dimensions:
        raise AnalysisError(f"answers of shape {array.shape} cannot be tested; specify {dimensions} axes: {axes}")
    if np.isinf(array).any():
        raise AnalysisError("an answer is infinite; specify finite numbers, with NaN for missing answers")
    return array


def complete_rows(values: ArrayLike, *, at_least: int, why: str) -> tuple[Array, int]:
    """Return the rows of participants with answers in all settings (columns), and the number of dropped rows."""
    array = checked_values(values, "participants, settings")
    if array.shape[1] < at_least:
        raise AnalysisError(f"too few conditions ({array.shape[1]}): at least {at_least} are needed{why}")
    is_complete = ~np.isnan(array).any(axis=1)
    return array[is_complete], int((~is_complete).sum())


def draws_for(alpha: float, usual: int, members: int = 1) -> int:
    """Return the number of permutations of each of ``members`` tests, at least ``usual`` and enough for ``alpha``."""
    return min(_MOST_DRAWS, max(usual, math.ceil(members / (_LARGEST_SHARE * alpha))))


SIDES: Final = {"higher": "greater", "lower": "less", None: "two-sided"}
"""The alternative of a test by the expected direction of the first value."""

_NODES: Final = 200
"""Nodes of the quadrature over the statistic at a look."""


@lru_cache(maxsize=64)
def alpha_of_looks(looks: tuple[int, ...], alpha: float, spending: str) -> tuple[float, ...]:
    """Return the two-sided significance level at each look for an overall error rate of ``alpha``.

    Parameters
    ----------
    looks : tuple of int
        Number of participants at each look, ascending.
    alpha : float
        Overall error rate.
    spending : "obrien-fleming" | "pocock"
        Spending function (Lan & DeMets 1983, Biometrika 70, 659–663).

    Notes
    -----
    The cumulative sums of a study's data are a random walk; its density within the bounds of earlier looks is
    integrated numerically (Armitage, McPherson & Rowe 1969, J. R. Stat. Soc. A 132, 235–244).
    """
    proportions = np.array(looks) / looks[-1]
    spent = alpha * np.log1p((math.e - 1) * proportions)
    if spending == "obrien-fleming":
        spent = 4 * ndtr(ndtri(alpha / 4) / np.sqrt(proportions))
    nodes, node_weights = np.polynomial.legendre.leggauss(_NODES)
    alphas, places, weights, last_share = [], np.zeros(1), np.ones(1), 0.0
    for proportion, alpha_due in zip(proportions, np.diff(spent, prepend=0.0), strict=True):
        bound = float(
            brentq(_crossing_excess, 0.0, 40.0, (places, weights, math.sqrt(proportion - last_share), alpha_due))
        )
        inner_places = bound * nodes
        density = _normal_density(inner_places[:, None], places, math.sqrt(proportion - last_share)) @ weights
        places, weights, last_share = inner_places, density * bound * node_weights, proportion
        alphas.append(float(2 * ndtr(-bound / math.sqrt(proportion))))
    return tuple(alphas)


_MOST_REPORTS: Final = 200
"""The most reports, from the first look to the last, over which the error rate is integrated."""


@lru_cache(maxsize=64)
def error_of_every_report(looks: tuple[int, ...], alpha: float, spending: str) -> float:
    """Return the error rate of a study that is tested after every participant from the first look onwards.

    Each test uses the alpha of the last look that is reached; for the parameters see `alpha_of_looks`.
    """
    levels = np.array(alpha_of_looks(looks, alpha, spending))
    reports = np.unique([*np.linspace(looks[0], looks[-1], _MOST_REPORTS).round().astype(int), *looks])
    reached = np.searchsorted(looks, reports, side="right") - 1
    nodes, node_weights = np.polynomial.legendre.leggauss(_NODES)
    error, places, weights, last_share = 0.0, np.zeros(1), np.ones(1), 0.0
    for proportion, level in zip(reports / looks[-1], levels[reached], strict=True):
        bound, step = float(-ndtri(level / 2)) * math.sqrt(proportion), math.sqrt(proportion - last_share)
        error += _crossing_excess(bound, places, weights, step, 0.0)
        inner_places = bound * nodes
        density = _normal_density(inner_places[:, None], places, step) @ weights
        places, weights, last_share = inner_places, density * bound * node_weights, proportion
    return error


def _normal_density(values: Array, means: Array, sd: float) -> Array:
    density: Array = np.exp(-(((values - means) / sd) ** 2) / 2) / (sd * math.sqrt(2 * math.pi))
    return density


def _crossing_excess(bound: float, places: Array, weights: Array, step: float, target: float) -> float:
    """Return the probability that a walk leaves ± ``bound`` in its next step, minus ``target``.

    ``places`` and ``weights`` are the distribution before the step, ``step`` is the SD of the step.
    """
    return float(weights @ (ndtr((places - bound) / step) + ndtr((-bound - places) / step))) - target


@lru_cache(maxsize=4096)
def clopper_pearson(count: int, n: int) -> Interval:
    """Return the exact 95 % interval of the proportion ``count`` / ``n``."""
    low = float(betaincinv(count, n - count + 1, 0.025)) if count else 0.0
    high = float(betaincinv(count + 1, n - count, 0.975)) if count < n else 1.0
    return Interval(low=low, high=high, level=0.95, method="Clopper-Pearson")


def bootstrap(
    n: int, seed: int | None, statistic: Callable[[Whole], Array], constant_reason: str
) -> tuple[Interval | None, str]:
    """Return the 95 % percentile bootstrap interval of a statistic, or None and the reason why there is none.

    Without ``seed`` there is no interval. ``statistic`` returns the values (draws,) for indices of participants
    (draws, n), NaN if they are undefined; ``constant_reason`` is the reason if all values are equal.
    """
    if seed is None:
        return None, "no interval was requested"
    if n < FEW:
        return None, _TOO_FEW
    rng = np.random.default_rng(seed)
    rows = max(1, 1_000_000 // n)
    tables = (rng.integers(0, n, (min(rows, SAMPLES - done), n)) for done in range(0, SAMPLES, rows))
    samples = np.concatenate([statistic(table) for table in tables])
    samples = samples[~np.isnan(samples)]
    if np.ptp(samples) == 0.0:
        return None, constant_reason
    low, high = np.quantile(samples, [0.025, 0.975])
    method = f"percentile bootstrap over participants, {SAMPLES} resamples"
    return Interval(low=float(low), high=float(high), level=0.95, method=method), ""


def monte_carlo_p(is_extreme: NDArray[np.bool_], seed: int, least: float) -> tuple[float, float, str]:
    """Return p, the smallest possible p, and a description of the method for random permutations.

    ``is_extreme`` (draws,) is whether each permutation is at least as extreme as the data. ``least`` is the smallest
    p of a full enumeration.
    """
    draws = len(is_extreme)
    method = f"Monte Carlo permutation, {draws} draws, seed {seed}"
    return (1 + int(is_extreme.sum())) / (1 + draws), max(least, 1 / (1 + draws)), method


def p_of_draws(drawn: NDArray[np.floating], observed: NDArray[np.floating]) -> Array:
    """Return p (…): the proportion of random statistics (draws, …) that are at least as large as the observed ones (…).

    If no draw is as large, p follows from a Pearson type III distribution with the first three moments of the draws, so
    that verdicts at a small alpha do not depend on the number of draws.
    """
    from scipy.stats import pearson3, skew  # noqa: PLC0415 - takes half a second, and reports do not need it

    p = np.asarray((1 + (drawn >= observed).sum(axis=0)) / (1 + len(drawn)))
    if (has_no_other := p * (1 + len(drawn)) < 1.5).any():
        draws = drawn[:, has_no_other].astype(np.float64)
        tail = pearson3.sf(observed[has_no_other], skew(draws), draws.mean(axis=0), draws.std(axis=0))
        p[has_no_other] = np.fmin(p[has_no_other], tail)
    return p


@dataclass(frozen=True, slots=True)
class Lattice:
    """A distribution of integers: the probabilities of ``start``, ``start`` + 1, …; the first and last are not 0."""

    start: int
    probabilities: Array

    def plus(self, other: Lattice) -> Lattice:
        """Return the distribution of the sum of this and an independent ``other``."""
        return Lattice(self.start + other.start, np.convolve(self.probabilities, other.probabilities))

    def at_least(self, value: int) -> float:
        """Return the probability of ``value`` or more."""
        return min(1.0, float(self.probabilities[max(0, value - self.start) :].sum()))

    @property
    def highest(self) -> float:
        """The probability of the highest value, the smallest possible result of ``at_least``."""
        return float(self.probabilities[-1])

    @property
    def mean(self) -> float:
        """The expected value."""
        return float(np.average(self.start + np.arange(len(self.probabilities)), weights=self.probabilities))


def sum_distribution(parts: Iterable[Lattice]) -> Lattice:
    """Return the distribution of the sum of independent ``parts``; an empty sum is 0."""
    return reduce(Lattice.plus, parts, Lattice(0, np.ones(1)))


def uniform_lattice(values: Iterable[int]) -> Lattice:
    """Return the distribution of a random element of ``values``, all equally likely."""
    numbers = np.fromiter(values, dtype=np.int64)
    counts = np.bincount(numbers - numbers.min())
    return Lattice(int(numbers.min()), counts / len(numbers))


def doubled_ranks(values: Array) -> Whole:
    """Return twice the ranks (n, k) within each row of ``values`` (n, k): whole numbers, with mid-ranks for ties."""
    return np.asarray(np.rint(2 * pd.DataFrame(values).rank(axis=1).to_numpy()), np.int64)


_ROUNDING: Final = 1e-12
"""Relative spread below which values are treated as equal."""


def student_interval(values: Array, level: float = 0.95) -> tuple[float | None, float | None]:
    """Return the confidence interval of a mean (Student 1908); None for a single value and for equal ones."""
    n = len(values)
    if n < 2 or (spread := float(np.std(values, ddof=1))) <= _ROUNDING * float(np.abs(values).max()):
        return None, None
    half = float(stdtrit(n - 1, (1 + level) / 2)) * spread / math.sqrt(n)
    return float(values.mean()) - half, float(values.mean()) + half


def holm(ps: Sequence[float | None]) -> tuple[float | None, ...]:
    """Return Holm's adjusted p of each test of a family (Holm 1979, Scand. J. Stat. 6, 65–70).

    None, for a test without p, stays None but counts as a member of the family.
    """
    known = _drop_missing_ps(ps)
    adjusted: list[float | None] = [None] * len(ps)
    highest = 0.0
    for place, member in enumerate(sorted(known, key=lambda member: known[member])):
        highest = max(highest, min(1.0, (len(ps) - place) * known[member]))
        adjusted[member] = highest
    return tuple(adjusted)


def false_discovery(ps: Sequence[float | None]) -> tuple[float | None, ...]:
    """Return p values adjusted for the false discovery rate (Benjamini & Hochberg 1995), for exploratory tests.

    None stays None and counts as a test with p = 1.
    """
    known = _drop_missing_ps(ps)
    if not known:
        return (None,) * len(ps)
    adjusted: list[float | None] = [None] * len(ps)
    lowest = 1.0
    for rank, member in reversed(list(enumerate(sorted(known, key=lambda member: known[member]), start=1))):
        lowest = adjusted[member] = min(lowest, known[member] * len(ps) / rank)
    return tuple(adjusted)


def _drop_missing_ps(ps: Sequence[float | None]) -> dict[int, float]:
    known = {member: p for member, p in enumerate(ps) if p is not None}
    for p in known.values():
        if not 0.0 <= p <= 1.0:
            raise AnalysisError(f"p = {p} cannot be adjusted; specify a p value from 0 to 1, or None if there is none")
    return known
