"""The report's permutation tests over thousands of simulated studies at once.

All of them meet the same random rearrangements of participants' answers; sums over participants are then products of
matrices of whole numbers, exact in single precision. Each p is (1 + those as extreme) / (1 + ``DRAWS``).
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from study_app.analysis.statistics.equivalence.power import equivalent as shows_equivalence
from study_app.analysis.statistics.equivalence.power import sizes
from study_app.analysis.tables.measures import Array

DRAWS: Final = 1999
"""Rearrangements; the report goes through all of them, or draws more."""

Single = NDArray[np.float32]


def ranks(answers: Array) -> Single:
    """Return (doubled) ranks among the settings of ``answers`` (…, settings, items): (…, settings, items)."""
    found: Any = np.ones(answers.shape, dtype=np.float32)
    for other in range(answers.shape[-2]):
        there = answers[..., other : other + 1, :]
        found += (there < answers) * np.float32(2) + (there == answers)
    return np.asarray(found)


def friedman(ranked: Single, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return Friedman's p of every item, and of the sum of their statistics over all items (global test).

    Parameters
    ----------
    ranked : (studies, participants, settings, items) array

    Returns
    -------
    (studies, items), (studies,) array
    """
    studies, n, k, items = ranked.shape
    orders = rng.random((DRAWS, n, k)).argsort(axis=-1)
    columns = np.ascontiguousarray(ranked.transpose(1, 2, 0, 3)).reshape(n * k, studies * items)
    middle = np.float32(n * (k + 1))
    seen = ((ranked.sum(axis=1) - middle) ** 2).sum(axis=1)
    squares = np.zeros((DRAWS, studies * items), dtype=np.float32)
    picked = np.zeros((DRAWS, n, k), dtype=np.float32)
    for setting in range(k):
        picked[:] = 0
        np.put_along_axis(picked, orders[..., setting : setting + 1], np.float32(1), axis=-1)
        sums = picked.reshape(DRAWS, n * k) @ columns
        sums -= middle
        sums *= sums
        squares += sums
    squares = squares.reshape(DRAWS, studies, items)
    spread = ((ranked - np.float32(k + 1)) ** 2).sum(axis=(1, 2))
    weights = np.divide(1.0, spread, out=np.zeros(spread.shape), where=spread > 0)
    of_all = np.einsum("dsi,si->ds", squares, weights.astype(np.float32))
    seen_of_all = np.einsum("si,si->s", seen, weights.astype(np.float32))
    return _p(squares, seen), _p(of_all, seen_of_all * np.float32(1 - 1e-5))


def trend(ranked: Single, rng: np.random.Generator) -> Array:
    """Return Page's one-sided p (studies, items) that answers rise; ``ranked``: (studies, people, settings, items)."""
    studies, n, k, items = ranked.shape
    weights = (rng.random((DRAWS, n, k)).argsort(axis=-1) + 1).astype(np.float32)
    columns = np.ascontiguousarray(ranked.transpose(1, 2, 0, 3)).reshape(n * k, studies * items)
    drawn = (weights.reshape(DRAWS, n * k) @ columns).reshape(DRAWS, studies, items)
    seen = np.einsum("snki,k->si", ranked, np.arange(1, k + 1, dtype=np.float32))
    return _p(drawn, seen)


def signed(answers: Array, rng: np.random.Generator) -> Array:
    """Return the p (studies, items) of Wilcoxon's signed ranks for ``answers`` (studies, people, 2, items)."""
    differences = answers[:, :, 0] - answers[:, :, 1]
    studies, n, items = differences.shape
    flat = differences.transpose(0, 2, 1).reshape(-1, n)
    ranked = sizes(flat).astype(np.float32)
    whole = ranked.sum(axis=1)
    up = (rng.random((DRAWS, n)) < 0.5).astype(np.float32) @ ranked.T
    seen = np.where(flat > 0, ranked, 0).sum(axis=1)
    p = _p(np.maximum(up, whole - up), np.maximum(seen, whole - seen))
    return p.reshape(studies, items)


def _p(drawn: Single, seen: Single) -> Array:
    """Return the share of drawn statistics (draws, …) that are as extreme as those seen (…)."""
    return np.asarray((1 + (drawn >= seen).sum(axis=0)) / (1 + DRAWS))


def equivalent(differences: Array, bound: float, alpha: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return whether equivalence within ± ``bound`` is shown as in the report.

    Parameters
    ----------
    differences : (studies, participants, …) array
    """
    rows = np.moveaxis(differences, 1, -1)
    shown = shows_equivalence(rows.reshape(-1, rows.shape[-1]), bound, alpha, rng, DRAWS)
    return np.asarray(shown.reshape(rows.shape[:-1]))


def holm(ps: Array, alpha: float) -> NDArray[np.bool_]:
    """Return which tests of families (…, members) Holm's procedure rejects."""
    return _rejected(ps, alpha / np.arange(ps.shape[-1], 0, -1), stops=True)


def false_discovery(ps: Array, alpha: float) -> NDArray[np.bool_]:
    """Return which tests of families (…, members) Benjamini and Hochberg's procedure rejects."""
    members = ps.shape[-1]
    return _rejected(ps, alpha * np.arange(1, members + 1) / members, stops=False)


def _rejected(ps: Array, limits: Array, *, stops: bool) -> NDArray[np.bool_]:
    """Return the tests whose sorted p keep the ``limits``: up to the first that does not, or to the last that does."""
    order = ps.argsort(axis=-1)
    kept = np.take_along_axis(ps, order, axis=-1) <= limits + 1e-12
    if stops:
        found = np.logical_and.accumulate(kept, axis=-1)
    else:
        found = np.logical_or.accumulate(kept[..., ::-1], axis=-1)[..., ::-1]
    back = np.empty(ps.shape, dtype=bool)
    np.put_along_axis(back, order, found, axis=-1)
    return back
