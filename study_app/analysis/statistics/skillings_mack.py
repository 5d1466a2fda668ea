"""Friedman's test where single answers are missing.

Skillings & Mack (1981), Technometrics 23, 171–177. A participant contributes what he or she answered, if it is two
settings or more; answers must be missing for reasons that have nothing to do with them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import chi2 as chi_square
from scipy.stats import rankdata

from study_app.analysis.statistics.friedman import APPROXIMATE, DRAWN_UP_TO, NO_INTERVAL, shuffles
from study_app.analysis.statistics.outcome import DRAWS, NO_VARIATION, Array, Outcome, checked
from study_app.errors import AnalysisError


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillingsMack(Outcome):
    """Skillings and Mack's T with ``df`` degrees of freedom; ``p_chi2`` is its published approximation, without ties.

    ``effect`` is T over its largest possible value, which without missing answers is Kendall's W. ``missing`` counts
    the missing answers of the participants that were used. ``adjusted_sums`` has one entry a setting.
    """

    df: int
    p_chi2: float | None
    missing: int
    adjusted_sums: tuple[float, ...]


def skillings_mack(values: ArrayLike, *, draws: int = DRAWS, seed: int = 1) -> SkillingsMack:
    """Test whether settings are answered alike, using participants that miss some.

    Parameters
    ----------
    values : (participants, settings) array
        NaN where an answer is missing.
    draws : int
        Rearrangements drawn where not all can be listed.
    seed : int
        Of the rearrangements.

    Raises
    ------
    AnalysisError
        There are fewer than three settings.
    """
    array = checked(values, "participants, settings")
    k = array.shape[1]
    if k < 3:
        raise AnalysisError(f"{k} settings: at least 3 are needed; compare two by the signed ranks of pairs")
    used = (~np.isnan(array)).sum(axis=1) >= 2
    rows = array[used]
    scores = _scores(rows)
    inverse: Array = np.linalg.pinv(_covariance(~np.isnan(rows))).astype(np.float64)
    sums = scores.sum(axis=0)
    statistic = float(sums @ inverse @ sums)
    df = int(np.linalg.matrix_rank(inverse)) if len(rows) else 0
    note = "" if scores.any() else NO_VARIATION if len(rows) else "no participant answered under two settings"
    p_chi2 = None if note else float(chi_square.sf(statistic, df))
    p, smallest, method = (None, None, "none") if note else _p(scores, rows, inverse, draws, seed)
    ideal = _scores(np.where(np.isnan(rows), np.nan, np.arange(k))).sum(axis=0)
    return SkillingsMack(
        test="Skillings-Mack",
        n=len(rows),
        dropped=int((~used).sum()),
        statistic_name="T",
        statistic=None if note else statistic,
        p=p,
        smallest_p=smallest,
        method=method,
        effect_name="T over the T of full agreement",
        effect=None if note else statistic / float(ideal @ inverse @ ideal),
        no_interval=note or NO_INTERVAL,
        note=note,
        df=df,
        p_chi2=p_chi2,
        missing=int(np.isnan(rows).sum()),
        adjusted_sums=tuple(float(value) for value in sums),
    )


def _scores(rows: Array) -> Array:
    """Return centred, scaled ranks (n, k) of the answers of ``rows``; 0 where one is missing."""
    scores = np.zeros(rows.shape)
    for row, values in enumerate(rows):
        there = ~np.isnan(values)
        count = int(there.sum())
        scores[row, there] = (rankdata(values[there]) - (count + 1) / 2) * np.sqrt(12 / (count + 1))
    return scores


def _covariance(there: Array) -> Array:
    """Return the covariance (k, k) of the adjusted sums: −(how many participants answered both), rows sum to 0."""
    counts = there.astype(np.float64)
    covariance: Array = -(counts.T @ counts)
    np.fill_diagonal(covariance, 0.0)
    np.fill_diagonal(covariance, -covariance.sum(axis=1))
    return covariance


def _tied_covariance(scores: Array, there: NDArray[np.bool_]) -> Array:
    """Return the covariance (k, k) of the adjusted sums when each participant's own ``scores`` change places.

    Without ties it is ``_covariance``.
    """
    counts = there.sum(axis=1)
    spread = (scores**2).sum(axis=1) / (counts - 1) / counts
    weighted: Array = there * np.sqrt(spread)[:, None]
    covariance: Array = -(weighted.T @ weighted)
    np.fill_diagonal(covariance, 0.0)
    np.fill_diagonal(covariance, -covariance.sum(axis=1))
    return covariance


def _p(scores: Array, rows: Array, inverse: Array, draws: int, seed: int) -> tuple[float, float | None, str]:
    """Return p by shuffling each participant's given answers, the smallest it could have been, and the method."""
    sums = scores.sum(axis=0)
    if len(rows) > DRAWN_UP_TO:
        covariance = _tied_covariance(scores, ~np.isnan(rows))
        reached = float(sums @ np.linalg.pinv(covariance) @ sums)
        return float(chi_square.sf(reached, np.linalg.matrix_rank(covariance))), None, APPROXIMATE
    found = float(sums @ inverse @ sums)
    rng = np.random.default_rng(seed)
    drawn = np.zeros((draws, rows.shape[1]))
    for score, values in zip(scores, rows, strict=True):
        there = np.flatnonzero(~np.isnan(values))
        drawn[:, there] += score[there][shuffles(rng, draws, len(there))]
    statistics = np.einsum("dk,kl,dl->d", drawn, inverse, drawn)
    p = (1 + int((statistics >= found - 1e-9 * abs(found)).sum())) / (1 + draws)
    return p, 1 / (1 + draws), f"Monte Carlo permutation, {draws} draws, seed {seed}"
