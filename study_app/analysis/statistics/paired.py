"""Two settings compared within participants: exact signed ranks, matched rank-biserial, superiority of pairs."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from study_app.analysis.statistics.exact_distributions import Lattice, doubled_ranks
from study_app.analysis.statistics.outcome import Array, Interval, Outcome, Whole, checked
from study_app.errors import AnalysisError

Alternative: TypeAlias = Literal["two-sided", "greater", "less"]

EXACT_UP_TO: Final = 200
"""Up to so many pairs p is exact; beyond that normal, corrected for ties."""

INTERVAL_FROM: Final = 6
"""Below so many pairs with a difference no test can be significant, and no interval is shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Paired(Outcome):
    """Wilcoxon's V, the ranks of positive differences; ``effect`` is the matched rank-biserial correlation.

    ``zeros`` pairs were equal. ``superiority`` is P(x > y) − P(x < y) over participants (Cliff's delta of pairs).
    ``median_difference`` is that of all pairs.
    """

    zeros: int
    superiority: float | None
    median_difference: float | None


def paired(x: ArrayLike, y: ArrayLike, *, alpha: float = 0.05) -> Paired:
    """Compare answers of the same participants under two settings; equal pairs are left out, as by R and JASP.

    Parameters
    ----------
    x, y : (participants,) arrays
        NaN where an answer is missing: that pair is dropped.
    alpha : float
        What p is compared with: the note says where so few pairs cannot reach it.

    Raises
    ------
    AnalysisError
        ``x`` and ``y`` differ in length.
    """
    first, second = checked(x, "participants"), checked(y, "participants")
    if len(first) != len(second):
        raise AnalysisError(f"{len(first)} and {len(second)} answers are no pairs; give one of each per participant")
    both = first - second
    differences = both[~np.isnan(both)]
    n, dropped = len(differences), int(np.isnan(both).sum())
    ranks, signs = signed(differences)
    v = int(ranks[signs > 0].sum())
    all_ranks = int(ranks.sum())
    effect = (2 * v - all_ranks) / all_ranks if len(ranks) else None
    p, smallest, method = signed_p(ranks, v)
    interval, reason = _fisher(effect, len(ranks))
    return Paired(
        test="Wilcoxon signed ranks",
        n=n,
        dropped=dropped,
        statistic_name="V",
        statistic=v / 2 if len(ranks) else None,
        p=p,
        smallest_p=smallest,
        method=f"{method}, two-sided; equal pairs left out (Wilcoxon)",
        effect_name="matched rank-biserial correlation",
        effect=effect,
        interval=interval,
        no_interval=reason,
        note=_note(n, len(ranks), smallest, effect, alpha),
        zeros=int((differences == 0.0).sum()),
        superiority=float(np.sign(differences).mean()) if n else None,
        median_difference=float(np.median(differences)) if n else None,
    )


def signed(differences: Array) -> tuple[Whole, Array]:
    """Return the (doubled) ranks and the signs of the differences that are not 0."""
    kept = differences[differences != 0.0]
    # Differences of decimals that should tie differ in the last bit: 0.3 - 0.1 and 0.2.
    return doubled_ranks(np.round(np.abs(kept), 9)[None])[0], np.sign(kept)


def signed_p(ranks: Whole, v: int, alternative: Alternative = "two-sided") -> tuple[float | None, float | None, str]:
    """Return p of the (doubled) ranks ``v`` of positive differences, the smallest p, and the method.

    None without any difference. Every sign of every rank is equally likely.
    """
    n, both = len(ranks), 2 if alternative == "two-sided" else 1
    if n == 0:
        return None, None, "none"
    below = int(ranks.sum()) - v
    tail = v if alternative == "greater" else below if alternative == "less" else max(v, below)
    if n > EXACT_UP_TO:
        deviation = (tail - ranks.sum() / 2) / math.sqrt(float((ranks.astype(float) ** 2).sum()) / 4)
        return min(1.0, both * float(norm.sf(deviation))), None, "normal approximation, corrected for ties"
    sums = _sums(tuple(sorted(ranks.tolist())))
    return min(1.0, both * sums.at_least(tail)), min(1.0, both * sums.highest), "exact permutation of signs"


@lru_cache(maxsize=4096)
def _sums(ranks: tuple[int, ...]) -> Lattice:
    """Return the distribution of the sum of the ranks that are positive, each of them with probability 1/2."""
    ways, highest = np.zeros(sum(ranks) + 1), 0
    ways[0] = 1.0
    for rank in ranks:
        ways[rank : highest + rank + 1] += ways[: highest + 1].copy()
        highest += rank
    return Lattice(0, ways / 2.0 ** len(ranks))


def _fisher(effect: float | None, n: int) -> tuple[Interval | None, str]:
    """Return the 95 % Fisher-z interval of a rank-biserial correlation of ``n`` pairs, or why there is none."""
    if effect is None:
        return None, "no interval: no pair differs"
    if n < INTERVAL_FROM:
        return None, f"no interval below {INTERVAL_FROM} pairs that differ: it would cover far less than it claims"
    if abs(effect) == 1.0:
        return None, f"no interval: all {n} pairs that differ went one way"
    deviation = math.sqrt((2 * n**3 + 3 * n**2 + n) / 6) / (n * (n + 1) / 2)
    reach = float(norm.ppf(0.975)) * deviation
    low, high = math.tanh(math.atanh(effect) - reach), math.tanh(math.atanh(effect) + reach)
    return Interval(low, high, 0.95, "Fisher z, approximate: covers about 90 % up to two dozen pairs"), ""


def _note(n: int, different: int, smallest: float | None, effect: float | None, alpha: float) -> str:
    if n == 0:
        return "no participant answered under both settings"
    if smallest is None:
        return f"all {n} pairs are equal"
    if smallest > alpha:
        return f"cannot reach p ≤ {alpha:g}: {different} pairs that differ can give {smallest:.4g} at least"
    return f"all {different} pairs that differ went one way" if effect is not None and abs(effect) == 1.0 else ""
