"""Groups of different participants compared by ranks: participants are exchanged between groups, all equally likely.

One value per participant: Kruskal and Wallis (1952), J. Am. Stat. Assoc. 47, 583–621, corrected for ties. Several
values of each (a profile): the same share of the sum of squares between groups, of their mean vectors (Anderson 2001,
Austral Ecol. 26, 32–46, with Euclidean distances).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc
from scipy.stats import rankdata

from study_app.analysis.statistics.outcome import DRAWS, Array, Outcome, Whole, checked
from study_app.errors import AnalysisError

EXACT_UP_TO: Final = 50_000
"""So many allocations of participants to groups are gone through (two groups: of eight or nine); beyond, p is drawn."""

AT_ONCE: Final = 500
ROUNDING: Final = 1e-9
"""Sums of the same numbers in another order differ by less than this, relatively."""

NO_INTERVAL: Final = "no interval for the share between groups: it cannot be negative"


@dataclass(frozen=True, slots=True, kw_only=True)
class GroupsDiffer(Outcome):
    """H = (n − 1) · ``effect``, the share of the sum of squares of ranks that lies between groups (ε² of one value).

    ``p_chi2`` is the approximate p of one value, with ``df`` degrees of freedom; None of a profile, which has none.
    ``sizes`` are the numbers of participants in the groups.
    """

    statistic_name: str = "H"
    effect_name: str = "share between groups"
    df: int
    p_chi2: float | None = None
    sizes: tuple[int, ...] = ()


def groups_differ(
    values: ArrayLike, groups: Sequence[str], *, test: str = "Kruskal-Wallis", draws: int = DRAWS, seed: int = 1
) -> GroupsDiffer:
    """Test whether groups of participants have the same values.

    Parameters
    ----------
    values : (participants, k) array
        One value of each, which is ranked here; or several, used as they are. NaN where one is missing: such
        participants are dropped.
    groups : sequence of str
        The group of each participant.
    test : str
        What the test is called.
    draws, seed : int
        For a drawn p, where going through all allocations would take too long.

    Raises
    ------
    AnalysisError
        There are more or fewer groups than participants.
    """
    array = checked(values, "participants, values")
    if len(groups) != len(array):
        raise AnalysisError(f"{len(array)} participants and {len(groups)} groups: give the group of each participant")
    whole = ~np.isnan(array).any(axis=1)
    names, labels = np.unique(np.asarray(groups, dtype=np.str_)[whole], return_inverse=True)
    rows, n = array[whole], int(whole.sum())
    ranks = rankdata(rows, axis=0) if rows.shape[1] == 1 else rows
    centred = ranks - ranks.mean(axis=0) if n else ranks
    total = float((centred**2).sum())
    sizes = tuple(int(count) for count in np.bincount(labels, minlength=len(names)))
    dropped, df = int((~whole).sum()), max(0, len(names) - 1)
    if note := _impossible(len(names), n, total):
        return GroupsDiffer(test=test, n=n, dropped=dropped, df=df, sizes=sizes, note=note, no_interval=note)
    found = float(_between(centred, labels[None], len(names))[0])
    p, smallest, method = _p(centred, labels, found, draws, seed)
    statistic = (n - 1) * found / total
    return GroupsDiffer(
        test=test,
        n=n,
        dropped=dropped,
        statistic=statistic,
        p=p,
        smallest_p=smallest,
        method=method,
        effect=found / total,
        no_interval=NO_INTERVAL,
        df=df,
        p_chi2=float(chdtrc(df, statistic)) if rows.shape[1] == 1 else None,
        sizes=sizes,
    )


def _impossible(groups: int, n: int, total: float) -> str:
    if groups < 2:
        return "fewer than two groups have participants with all answers"
    if n == groups:
        return "each group has one participant"
    return "" if total > ROUNDING else "no variation: all participants answered alike"


def _between(centred: Array, labels: NDArray[np.intp], groups: int) -> Array:
    """Return the sums of squares between groups (allocations,) of centred values (n, k) for labels (allocations, n)."""
    found: Array = np.zeros(len(labels))
    for group in range(groups):
        members = labels == group
        sums = members.astype(np.float64) @ centred
        found += (sums**2).sum(axis=1) / members.sum(axis=1)
    return found


def _p(centred: Array, labels: NDArray[np.intp], found: float, draws: int, seed: int) -> tuple[float, float, str]:
    """Return p, the smallest it could have been, and how it was found."""
    sizes = np.bincount(labels)
    log_ways = math.lgamma(len(labels) + 1) - sum(math.lgamma(size + 1) for size in sizes)
    reached_by = found * (1 - ROUNDING)
    if log_ways <= math.log(EXACT_UP_TO):
        every = np.array(list(_allocations(tuple(sizes.tolist()), len(labels))), dtype=np.intp)
        reached = np.concatenate(
            [_between(centred, every[at : at + AT_ONCE], len(sizes)) for at in range(0, len(every), AT_ONCE)]
        )
        p = float((reached >= reached_by).mean())
        return p, float((reached >= reached.max() * (1 - ROUNDING)).mean()), "exact permutation of participants"
    rng = np.random.default_rng(seed)
    above = 0
    for done in range(0, draws, AT_ONCE):
        drawn = rng.permuted(np.tile(labels, (min(AT_ONCE, draws - done), 1)), axis=1)
        above += int((_between(centred, drawn, len(sizes)) >= reached_by).sum())
    least = max(1 / (1 + draws), math.exp(-log_ways))
    return (1 + above) / (1 + draws), least, f"Monte Carlo permutation of participants, {draws} draws, seed {seed}"


def _allocations(sizes: tuple[int, ...], n: int) -> Iterator[Whole]:
    """Yield every allocation of n participants to groups of these sizes, as the group of each."""
    labels = np.full(n, len(sizes) - 1, dtype=np.int64)

    def fill(group: int, free: tuple[int, ...]) -> Iterator[Whole]:
        if group == len(sizes) - 1:
            yield labels.copy()
            return
        for chosen in combinations(free, sizes[group]):
            labels[list(chosen)] = group
            yield from fill(group + 1, tuple(one for one in free if one not in chosen))
            labels[list(chosen)] = len(sizes) - 1

    yield from fill(0, tuple(range(n)))
