"""The fit to the answers of one person, corrected for preferences and for a change of the threshold over the trials.

A preference for one of two intervals or for the last answer, and a changing threshold, reduce the proportion of correct
answers. Both are estimated from the answers, and their effects are removed from the posterior.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, reduce
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from study_app.psychophysics.families import CLIP, Floats, normal_cdf, success
from study_app.psychophysics.grid import Grid, Posterior, Values, log_likelihood, posterior, tables

PREFERENCE_SD: Final = 0.4
"""Standard deviation of preferences between people [SD of the decision]. [choice]"""
CHANGE_PRIOR: Final = 1.5
"""Prior of the change of a threshold from the first trial to the last, as a factor (one SD). [choice]"""
BEYOND_CHANCE: Final = 2.0
"""The smallest change that counts as significant [standard errors]."""
_PREFERENCE_STEP: Final = 0.1
"""Step to which preferences are rounded [SD of the decision], so that people can share tables."""
_PASSES: Final = 2
"""Number of fits with new estimates of preferences; the first threshold is too high."""
_CHANGES: Final = np.linspace(-2.5, 2.5, 9)
_CHANGE_WEIGHTS: Final = np.exp(-0.5 * _CHANGES**2)
"""The changes over which a posterior is averaged [SD of the prior], and their prior weights."""
EARLY_TRIALS: Final = 15.0
"""Number of trials in which an effect of practice is assumed to fall to 1/e. [choice]"""
BURST_TRIALS: Final = 10
"""The most consecutive trials in which people are assumed to answer at random. [choice]"""
_BURST_ODDS: Final = 1 / 200
"""Prior odds that such a burst begins at a trial. [choice]"""
MOST_CLUSTERED: Final = 0.8
"""Limit of the clustering of errors [standard errors], which at most 5 % of groups exceed if the model is correct.

It is low because the fit absorbs part of every cluster. [choice]
"""
_SCORING_STEPS: Final = 10
_STEP: Final = 0.01
"""Step of the threshold in numerical derivatives [widths]."""


class PersonAnswers(NamedTuple):
    """The answers of one person.

    Attributes
    ----------
    levels : (k,) array
        The levels presented, ascending, in the coordinate u.
    places : (n,) array
        Index of the level of each trial.
    successes : (n,) array of bool
        Whether answers are successes.
    towards, before : (n,) array
        The correct answer, and the previous answer: 1 the first of two intervals, −1 the second, 0 neither.
    done : (n,) array
        The fraction of trials done, from 0 to 1.
    """

    levels: Floats
    places: NDArray[np.int64]
    successes: NDArray[np.bool_]
    towards: Floats
    before: Floats
    done: Floats

    def first(self, n: int) -> PersonAnswers:
        """Return the first n answers."""
        first = {name: values[:n] for name, values in self._asdict().items()}
        return PersonAnswers(**{**first, "levels": self.levels})

    def fit(self, grid: Grid, *, two_intervals: bool) -> PersonFit:
        """Return the fit to the answers.

        Parameters
        ----------
        grid : Grid
            The cells and their prior.
        two_intervals : bool
            Whether one of two intervals is correct, so that a person may prefer one.
        """
        shifts = np.zeros(len(self.places))
        parts = _likelihoods(self, shifts, grid)
        fitted = posterior(grid, [reduce(np.add, parts.values())])
        for _ in range(_PASSES if two_intervals else 0):
            new_shifts = _preferences(self, fitted)
            if np.array_equal(new_shifts, shifts):
                break
            shifts, parts = new_shifts, _likelihoods(self, new_shifts, grid)
            fitted = posterior(grid, [reduce(np.add, parts.values())])
        score, information = _time_score(self, fitted, shifts, self.done)
        sd, has_changed = math.log10(CHANGE_PRIOR) * fitted.decade, score**2 > BEYOND_CHANCE**2 * information
        change = score / (information + sd**-2) if sd else 0.0
        if has_changed:
            grid = replace(grid, session_sd=math.hypot(grid.session_sd, change / fitted.decade / math.sqrt(12)))
        return PersonFit(self, shifts, change, has_changed, _posterior(parts, sd * _CHANGES, grid, _CHANGE_WEIGHTS))


@dataclass(frozen=True, slots=True)
class PersonFit:
    """The fit to a person's answers.

    Attributes
    ----------
    answers : PersonAnswers
        The answers.
    shifts : (n,) array
        Shift of each decision towards the correct answer due to a preference [SD].
    change : float
        Most probable rise of the threshold from the first trial to the last, in u.
    has_changed : bool
        Whether the change is significant; the threshold's uncertainty then includes the standard deviation of a
        uniform change, in addition to that between sessions.
    flat : Posterior
        The posterior corrected for both, with a flat prior on the width; its grid has the actual prior of the width.
    """

    answers: PersonAnswers
    shifts: Floats
    change: float
    has_changed: bool
    flat: Posterior

    def expected(self, posterior: Posterior) -> Floats:
        """Return the proportion of successes in each trial (n,), predicted with all median parameters."""
        psi = posterior.success(self.answers.levels)
        return with_preference(psi[self.answers.places], posterior.others.lapse, self.shifts)

    def posterior_after(self, n: int) -> Posterior:
        """Return the posterior from the first n answers, with the preferences and the change found from all answers."""
        if n == len(self.shifts):
            return self.flat
        grid = self.flat.grid
        return _posterior(_likelihoods(self.answers.first(n), self.shifts[:n], grid), np.array([self.change]), grid)


def _likelihoods(answers: PersonAnswers, shifts: Floats, grid: Grid) -> dict[float, NDArray[np.float64]]:
    """Return the log likelihood of the answers before (−1), at (0) and after (1) the middle trial."""
    flat = replace(grid, width_prior=None, session_sd=0.0)
    u, k = tuple(answers.levels.tolist()), len(answers.levels)
    log_likelihoods = dict.fromkeys((-1.0, 0.0, 1.0), np.zeros(grid.shape))
    halves = np.sign(answers.done - 0.5)
    for half, shift in {*zip(halves.tolist(), shifts.tolist(), strict=True)}:
        selected = (halves == half) & (shifts == shift)
        right, wrong = (
            np.bincount(answers.places[selected & outcomes], minlength=k)
            for outcomes in (answers.successes, ~answers.successes)
        )
        logarithms = _shifted_tables(flat, u, shift) if shift else tables(flat, u)[1:]
        log_likelihoods[half] = log_likelihoods[half] + log_likelihood(right, wrong, *logarithms)
    return log_likelihoods


def _posterior(
    parts: dict[float, NDArray[np.float64]], changes: Floats, grid: Grid, weights: ArrayLike = 1.0
) -> Posterior:
    """Return the posterior of the threshold at the middle trial; each half of the trials has its own mean threshold.

    It is averaged over ``changes`` of the threshold from the first trial to the last [u], with prior ``weights``.
    """
    cells = changes / 4 / (grid.thresholds[1] - grid.thresholds[0])
    logarithms = [
        reduce(np.add, [_shift_cells(likelihood, half * moved) for half, likelihood in parts.items()])
        for moved in cells
    ]
    return replace(posterior(replace(grid, width_prior=None), logarithms, weights), grid=grid)


def _shift_cells(values: NDArray[np.float64], cells: float) -> NDArray[np.float64]:
    """Return the values shifted by a number of threshold cells, interpolated; the end values are repeated."""
    if not cells:
        return values
    whole = math.floor(cells)
    proportion = cells - whole
    neighbours = values[np.clip(np.arange(len(values) + 1) + whole, 0, len(values) - 1)]
    return np.asarray(neighbours[:-1] * (1.0 - proportion) + neighbours[1:] * proportion, float)


def _time_score(answers: PersonAnswers, fitted: Posterior, shifts: Floats, course: Floats) -> tuple[float, float]:
    """Return score and information, at zero change, for a threshold that changes like ``course`` (n,) [1/u, 1/u²].

    ``fitted`` is the posterior for a constant threshold; ``shifts`` (n,) are the shifts of the decisions [SD].
    """
    y, u, others = answers.successes.astype(float), answers.levels, fitted.others
    below, above, psi = (
        with_preference(success(fitted.grid.family, u, at, **others._asdict())[answers.places], others.lapse, shifts)
        for at in (fitted.threshold - _STEP * others.width, fitted.threshold + _STEP * others.width, fitted.threshold)
    )
    psi, slope = np.clip(psi, CLIP, 1.0 - CLIP), (above - below) / (2 * _STEP * others.width)
    information = slope**2 / (psi * (1.0 - psi))
    if not information.any():
        return 0.0, 0.0
    course = course - np.average(course, weights=information)
    return float((slope * (y - psi) / (psi * (1.0 - psi)) * course).sum()), float((information * course**2).sum())


def early_change(fits: Sequence[tuple[PersonFit, Posterior]]) -> float | None:
    """Return the rise of a group's thresholds after the first trials in standard errors; None if unknown.

    The time course decays exponentially over `EARLY_TRIALS`, like practice; scores and information are summed over all
    members, each with a separate posterior.
    """
    return _standard_errors(
        [
            _time_score(fit.answers, posterior, fit.shifts, -np.exp(-np.arange(len(fit.shifts)) / EARLY_TRIALS))
            for fit, posterior in fits
        ]
    )


def error_bursts(fits: Sequence[tuple[PersonFit, Posterior]]) -> float | None:
    """Return the clustering of errors in standard errors, positive if errors follow errors; None if unknown.

    Each error, minus the expected error rate, is weighted by the probability that the person answered at random just
    before. Its variance given the previous answers is known, even if these determined the level.
    """
    return _standard_errors(
        [_burst_score(fit.answers.successes, fit.expected(posterior), posterior) for fit, posterior in fits]
    )


def _burst_score(successes: NDArray[np.bool_], psi: Floats, fitted: Posterior) -> tuple[float, float]:
    """Return the weighted sum of errors minus expected errors, and its variance."""
    guesses, n = fitted.grid.guesses or (), len(psi)
    chance, evidence = guesses[0] if len(guesses) == 1 else 0.5, np.zeros(n)
    ratios = np.log(np.where(successes, chance / psi, (1.0 - chance) / (1.0 - psi)))
    total = np.concatenate(([0.0], np.cumsum(ratios)))
    for k in range(1, min(BURST_TRIALS, n)):
        evidence[k:] += np.exp(total[k:n] - total[: n - k])
    weights = evidence / (evidence + 1.0 / _BURST_ODDS)
    return float(weights @ (psi - successes)), float(weights**2 @ (psi * (1.0 - psi)))


def _standard_errors(scores: Sequence[tuple[float, float]]) -> float | None:
    score, information = np.sum(scores, axis=0)
    return float(score / math.sqrt(information)) if information else None


@cache
def _normal_table() -> tuple[Floats, Floats]:
    """Return z and the normal distribution function; linear interpolation has an error of at most 1e-7."""
    z = np.linspace(-8.0, 8.0, 16001)
    return z, normal_cdf(z)


def _shift_probabilities(shares: ArrayLike, shift: ArrayLike) -> Floats:
    """Return decision probabilities after a preference shifts the decision variable by ``shift`` [SD]."""
    z, of_z = _normal_table()
    deviates = np.asarray(np.interp(np.asarray(shares, float), of_z, z), float)
    return np.asarray(np.interp(deviates + np.asarray(shift, float), z, of_z), float)


def _preferences(answers: PersonAnswers, fitted: Posterior) -> Floats:
    """Return the shift of each decision between two intervals towards the correct one due to preferences (n,) [SD].

    It is a probit regression with lapses, in which the contribution of the levels is fixed. Its coefficients are the
    preferences for the first interval and for the previous answer. They have a normal prior, because removing
    preferences that are due to chance would bias thresholds downwards. Without lapses, errors in easy trials would
    appear to be preferences if a person's function is wider than assumed. ``fitted`` is the posterior of these answers.
    """
    (z, of_z), first, lapse = _normal_table(), answers.towards, fitted.others.lapse
    unbiased = ((fitted.success(answers.levels) - lapse) / (1.0 - 2.0 * lapse))[answers.places]
    evidence = first * np.interp(np.clip(unbiased, 0.5, 0.999), of_z, z)
    chosen = np.where(answers.successes, first, -first)
    both_orders = bool(np.ptp(first))  # with only one order, the preference for an interval is unknown
    constant = np.abs(first) if both_orders else np.zeros(len(first))
    predictors, weights = np.column_stack([constant, answers.before]), np.zeros(2)
    for _ in range(_SCORING_STEPS):
        decision = chosen * (evidence + predictors @ weights)
        proportion = np.clip(lapse + (1.0 - 2.0 * lapse) * np.interp(decision, z, of_z), CLIP, 1.0 - CLIP)
        slope = (1.0 - 2.0 * lapse) * np.exp(-0.5 * decision**2) / math.sqrt(2 * math.pi)
        information = (predictors.T * (slope**2 / (proportion * (1.0 - proportion)))) @ predictors + np.eye(
            2
        ) / PREFERENCE_SD**2
        weights += np.linalg.solve(
            information, predictors.T @ (chosen * slope / proportion) - weights / PREFERENCE_SD**2
        )
    return np.asarray(first * np.round(predictors @ weights / _PREFERENCE_STEP) * _PREFERENCE_STEP + 0.0, float)


def with_preference(psi: ArrayLike, lapse: ArrayLike, shift: ArrayLike) -> Floats:
    """Return ψ for two intervals if a preference shifts the decision towards the correct one by ``shift`` [SD]."""
    psi, lapse = np.asarray(psi, float), np.asarray(lapse, float)
    if not np.any(shift):
        return psi
    unbiased = np.clip((psi - lapse) / (1.0 - 2.0 * lapse), CLIP, 1.0 - CLIP)
    return np.asarray(
        np.clip(lapse + (1.0 - 2.0 * lapse) * _shift_probabilities(unbiased, shift), CLIP, 1.0 - CLIP), float
    )


@lru_cache(maxsize=32)
def _shifted_tables(grid: Grid, levels: Values, shift: float) -> tuple[Floats, Floats]:
    """Return log ψ and log(1 − ψ) of each level and cell for two intervals with decisions shifted by ``shift`` [SD]."""
    unbiased = replace(grid, lapses=(0.0,), lapse_prior=(1.0,)).success(levels)
    lapses = np.array(grid.lapses)[:, None]
    psi = np.clip(lapses + (1.0 - 2.0 * lapses) * _shift_probabilities(unbiased, shift), CLIP, 1.0 - CLIP)
    return np.log(psi), np.log1p(-psi)
