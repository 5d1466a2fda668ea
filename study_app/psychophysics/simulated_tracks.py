"""Many tracks of simulated observers at once: the levels that a method chooses, and the answers to them.

The observers answer by a psychometric function, so that their tracks show the best performance of a method. Levels are
in the coordinate u; answers follow from uniform numbers that the caller draws.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from study_app.psychophysics.families import Family, Floats, success
from study_app.psychophysics.grid import quantile
from study_app.psychophysics.questplus import Search
from study_app.psychophysics.updown import Staircase

Counts: TypeAlias = tuple[Floats, Floats]
"""Successes and failures of each track at each level, (tracks, levels) arrays."""


@dataclass(frozen=True, eq=False)
class Observers:
    """The observers: one for each track.

    Attributes
    ----------
    family : {"weibull", "normal", "logistic"}
        Their psychometric function.
    thresholds : (tracks,) array
        In u.
    width : float
        From 5 to 95 %, in u.
    guess, lapse : float
        Guess rate and lapse rate.
    presented : callable, optional
        Maps requested to presented levels, both in u; by default they are equal.
    """

    family: Family
    thresholds: Floats
    width: float
    guess: float
    lapse: float
    presented: Callable[[Floats], Floats] | None = None

    def probability(self, levels: ArrayLike) -> Floats:
        """Return the probability of a success at ``levels``, one for each track or one for all."""
        if self.presented is not None:
            levels = self.presented(np.asarray(levels, float))
        return success(self.family, levels, self.thresholds, self.width, self.guess, self.lapse)


@dataclass(frozen=True, eq=False)
class Answers:
    """The levels presented and the answers.

    Attributes
    ----------
    levels : (tracks, trials) array
        In u; NaN after the end of a track.
    successes : (tracks, trials) array of bool
        False after the end of a track.
    """

    levels: Floats
    successes: NDArray[np.bool_]

    def first(self, trials: int) -> Answers:
        """Return the answers to the first trials of each track."""
        return Answers(self.levels[:, :trials], self.successes[:, :trials])

    def counts(self, places: Sequence[float]) -> Counts:
        """Return the successes and failures of each track at each of ``places``, counted at the nearest one.

        Parameters
        ----------
        places : sequence of float
            Levels, in u, ascending.
        """
        ascending = np.asarray(places, float)
        nearest = np.searchsorted((ascending[1:] + ascending[:-1]) / 2, self.levels)
        row, trial = np.nonzero(~np.isnan(self.levels))
        found = np.zeros((2, len(self.levels), len(ascending)))
        np.add.at(found, (np.where(self.successes[row, trial], 0, 1), row, nearest[row, trial]), 1.0)
        return found[0], found[1]


def constant_tracks(levels: Sequence[float], repetitions: int, observers: Observers, draws: Floats) -> Answers:
    """Return the answers to constant stimuli: each level ``repetitions`` times.

    Parameters
    ----------
    levels : sequence of float
        In u.
    repetitions : int
        Presentations of each level.
    observers : Observers
        Who answers.
    draws : (tracks, trials) array
        Uniform numbers in [0, 1).
    """
    presented = np.tile(np.asarray(levels, float), (len(draws), repetitions))
    return Answers(presented, draws < observers.probability(presented.T).T)


def staircase_tracks(
    staircase: Staircase, observers: Observers, draws: Floats, stop: tuple[int, int] | None = None
) -> Answers:
    """Return the tracks of an up–down rule.

    Parameters
    ----------
    staircase : Staircase
        The rule.
    observers : Observers
        Who answers.
    draws : (tracks, trials) array
        Uniform numbers in [0, 1).
    stop : tuple of int, optional
        Number of reversals after which a track ends, and its least number of answers.
    """
    tracks, trials = draws.shape
    levels, successes = np.full(draws.shape, np.nan), np.zeros(draws.shape, bool)
    now, running = np.full(tracks, staircase.begin), np.ones(tracks, bool)
    in_a_row, reversals, before = np.zeros(tracks, int), np.zeros(tracks, int), np.zeros(tracks)
    for trial in range(trials):
        right = draws[:, trial] < observers.probability(now)
        levels[running, trial], successes[:, trial] = now[running], right & running
        in_a_row = np.where(right, in_a_row + 1, 0)
        steps_down = in_a_row == staircase.down_after
        move = np.where(right, np.where(steps_down, -staircase.ratio * staircase.step_up, 0.0), staircase.step_up)
        in_a_row[steps_down] = 0
        reversals += move * before < 0.0
        before = np.where(move != 0.0, move, before)
        now = np.clip(now + move, staircase.low, staircase.high)
        if stop is not None:
            running &= (trial + 1 < stop[1]) | (reversals < stop[0])
    return Answers(levels, successes)


def search_tracks(
    search: Search,
    observers: Observers,
    draws: Floats,
    begin: int | None = None,
    noise: Floats | None = None,
    stop: tuple[float, int] | None = None,
) -> Answers:
    """Return the tracks of QUEST+.

    Parameters
    ----------
    search : Search
        Chooses the levels.
    observers : Observers
        Who answers.
    draws : (tracks, trials) array
        Uniform numbers in [0, 1).
    begin : int, optional
        Index of the first level; by default the search chooses it.
    noise : (tracks, noise trials) array, optional
        Uniform numbers for noise trials; the search uses their answers from the first trial on.
    stop : tuple, optional
        Width of the 95 % interval [u] at which a track ends, and its least number of answers.
    """
    tracks, trials = draws.shape
    levels, running = np.full(draws.shape, np.nan), np.ones(tracks, bool)
    successes = np.zeros(draws.shape, bool)
    at = np.asarray(search.levels, float)
    psi = search.psi.reshape(len(at), len(search.grid.thresholds), -1)
    posterior = np.tile(search.grid.prior.reshape(1, *psi.shape[1:]), (tracks, 1, 1))
    if noise is not None:
        yes = (noise < observers.guess).sum(axis=1)[:, None, None]
        log_likelihood = yes * np.log(psi[0]) + (noise.shape[1] - yes) * np.log1p(-psi[0])
        posterior *= np.exp(log_likelihood - log_likelihood.max(axis=(1, 2), keepdims=True))
    for trial in range(trials):
        posterior /= posterior.sum(axis=(1, 2), keepdims=True)
        if stop is not None and trial >= stop[1]:
            running &= _interval_widths(search, posterior) > stop[0]
        place = search.next_of(posterior) if trial or begin is None else np.full(tracks, begin)
        right = draws[:, trial] < observers.probability(at[place])
        levels[running, trial], successes[:, trial] = at[place[running]], right & running
        answered = psi[place]
        posterior *= np.where(right[:, None, None], answered, 1.0 - answered)
    return Answers(levels, successes)


def _interval_widths(search: Search, posterior: Floats) -> Floats:
    """Return the width of each track's equal-tailed 95 % interval [u]."""
    marginals = posterior.sum(axis=2)
    ends = [[quantile(search.grid.thresholds, one, share) for share in (0.025, 0.975)] for one in marginals]
    return np.diff(np.asarray(ends, float), axis=1)[:, 0]
