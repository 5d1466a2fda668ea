"""Exact distributions of sums of independent whole numbers, by convolution: every rearrangement, none enumerated."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.stats import rankdata

from study_app.analysis.statistics.outcome import Array, Whole

COMPARED: Final = 20_000
"""Up to so many pairs of values ranks are counted, which is quicker than sorting."""

SPARSE: Final = 8
"""Up to so many values a convolution is quicker as so many shifted sums."""


@dataclass(frozen=True, slots=True)
class Lattice:
    """Probabilities of ``start``, ``start`` + 1, …; the first and the last are not 0."""

    start: int
    probabilities: Array

    def plus(self, other: Lattice) -> Lattice:
        """Return the distribution of the sum of this and an independent ``other``."""
        held = np.flatnonzero(other.probabilities)
        if len(held) > SPARSE:
            summed = np.convolve(self.probabilities, other.probabilities)
        else:
            summed = np.zeros(len(self.probabilities) + len(other.probabilities) - 1)
            for shift in held:
                summed[shift : shift + len(self.probabilities)] += other.probabilities[shift] * self.probabilities
        return Lattice(self.start + other.start, summed)

    def at_least(self, value: int) -> float:
        """Return the probability of ``value`` or more."""
        return min(1.0, float(self.probabilities[max(0, value - self.start) :].sum()))

    @property
    def highest(self) -> float:
        """The probability of the highest value: the smallest that ``at_least`` can give."""
        return float(self.probabilities[-1])

    @property
    def mean(self) -> float:
        """The expected value."""
        return float(np.average(self.start + np.arange(len(self.probabilities)), weights=self.probabilities))

    @property
    def variance(self) -> float:
        """The variance."""
        values = self.start + np.arange(len(self.probabilities))
        return float(np.average((values - self.mean) ** 2, weights=self.probabilities))


NOTHING: Final = Lattice(0, np.ones(1))
"""The sum of no number."""


def total(parts: Iterable[Lattice]) -> Lattice:
    """Return the distribution of the sum of independent ``parts``."""
    summed = NOTHING
    for part in parts:
        summed = summed.plus(part)
    return summed


def of_values(values: Iterable[int]) -> Lattice:
    """Return the distribution of one of ``values``, each equally likely."""
    numbers = np.fromiter(values, dtype=np.int64)
    counts = np.bincount(numbers - numbers.min())
    return Lattice(int(numbers.min()), counts / len(numbers))


def doubled_ranks(values: Array) -> Whole:
    """Return twice the ranks (n, k) within each row of ``values`` (n, k): whole numbers, with mid-ranks for ties."""
    if not values.size:
        return np.zeros(values.shape, dtype=np.int64)
    if values.shape[0] * values.shape[1] ** 2 <= COMPARED:
        below, equal = (compare(values[:, None], values[:, :, None]).sum(axis=2) for compare in (np.less, np.equal))
        return np.asarray(2 * below + equal + 1)
    ranks: Whole = np.rint(2 * rankdata(values, axis=1)).astype(np.int64)
    return ranks
