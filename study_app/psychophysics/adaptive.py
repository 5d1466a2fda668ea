"""Adaptive methods: the choice of a track's next level, and tracks of many simulated observers at once.

**Up–down staircases**: the level falls after a number of successes in a row and rises after each failure. With the
ratio of steps by García-Pérez 1998, a rule converges to the same percentage for all widths of the observer's function;
with equal steps, the percentage depends on the width.

**QUEST+**: the next level minimises the expected uncertainty after its answer. Watson 2017 minimises the entropy of all
parameters. Prins 2013 minimises that of the threshold's marginal distribution, so that no trials are spent on the width
or the lapse rate; this is the default here.

**Simulated observers** answer according to a psychometric function, so their tracks show the best performance of a
method. Levels are in the coordinate u; the caller provides the uniform random numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from study_app.psychophysics.families import Family, Floats, success
from study_app.psychophysics.grid import Grid, Values, fit, quantile, tables
from study_app.psychophysics.person_fit import PersonAnswers, with_preference

# The level presented, in the coordinate u, and whether it was a success; in the order of presentation.
_Answer: TypeAlias = tuple[float, bool]

RATIOS: Final = {1: 0.2845, 2: 0.5488, 3: 0.7393, 4: 0.8415}
"""Ratio of the step down to the step up, by the number of successes in a row before a step down."""
_DROPPED: Final = 2
"""Number of first reversals that are left out, because they depend on the first level of the track."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Staircase:
    """An up–down rule.

    Attributes
    ----------
    down_after : int
        Number of successes in a row before a step down.
    step_up : float
        Step after a failure, in the coordinate u.
    ratio : float
        Step down over step up.
    low, high : float
        The domain, in the coordinate u.
    begin : float
        The first level.
    """

    down_after: int
    step_up: float
    ratio: float
    low: float
    high: float
    begin: float

    @property
    def converges_to(self) -> float:
        """The probability of success at which the expected change is zero."""
        return converges_to(self.down_after, self.ratio)

    def next(self, answers: Sequence[_Answer]) -> float:
        """Return the next level: one step from the last one presented, or the same level."""
        if not answers:
            return self.begin
        last = answers[-1][0]
        return min(max(last + self._steps(answers)[-1], self.low), self.high)

    def reversals_at(self, answers: Sequence[_Answer]) -> list[int]:
        """Return the indices of the trials at which the direction changed."""
        trials, last_move = [], 0.0
        for trial, move in enumerate(self._steps(answers)):
            if move * last_move < 0.0:
                trials.append(trial)
            last_move = move or last_move
        return trials

    def reversals(self, answers: Sequence[_Answer]) -> list[float]:
        """Return the levels of the trials at which the direction changed."""
        return [answers[place][0] for place in self.reversals_at(answers)]

    def mean_of_reversals(self, answers: Sequence[_Answer], average: int) -> float | None:
        """Return the mean of the last even number of reversals, up to ``average``; None if there are too few.

        The first two and those at an end of the domain are excluded.
        """
        levels = [level for level in self.reversals(answers)[_DROPPED:] if self.low < level < self.high]
        count = min(len(levels), average) // 2 * 2
        return sum(levels[-count:]) / count if count else None

    def _steps(self, answers: Sequence[_Answer]) -> list[float]:
        """Return the step after each answer; 0 after a success that does not complete a row."""
        steps, successes = [], 0
        for _, correct in answers:
            successes = successes + 1 if correct else 0
            if not correct:
                steps.append(self.step_up)
            elif successes == self.down_after:
                steps.append(-self.ratio * self.step_up)
                successes = 0
            else:
                steps.append(0.0)
        return steps


def converges_to(down_after: int, ratio: float) -> float:
    """Return the probability of success to which a rule converges: (1 + ratio)^(−1/down_after)."""
    return float((1.0 + ratio) ** (-1.0 / down_after))


_Learn: TypeAlias = Literal["threshold", "all"]

_TIE_NATS: Final = 1e-9
"""Tolerance for equal expected entropies, which rounding on other processors changes by about 1e-15."""


@dataclass(frozen=True)
class Search:
    """The parameter grid and levels among which QUEST+ chooses.

    Attributes
    ----------
    grid : Grid
        The parameters, and their prior.
    levels : tuple of float
        The levels that may be presented, in the coordinate u, ascending.
    learn : {"threshold", "all"}
        The parameters whose entropy is minimised.
    noise : bool
        Whether the first level is that of noise trials, which the search never chooses.
    """

    grid: Grid
    levels: Values
    learn: _Learn = "threshold"
    noise: bool = False

    @property
    def psi(self) -> NDArray[np.float64]:
        """The probability of success at each level of each cell, of shape (levels, …)."""
        return tables(self.grid, self.levels)[0]

    def expected_entropy(self, posteriors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the expected entropy [nat] after an answer, of shape (tracks, levels), from posteriors (tracks, …)."""
        cells = posteriors.reshape(len(posteriors), len(self.grid.thresholds), -1)
        psi = self.psi.reshape(len(self.levels), *cells.shape[1:])
        if self.learn == "threshold":
            succeeded = np.matmul(cells.transpose(1, 0, 2), psi.transpose(1, 2, 0))  # (thresholds, tracks, levels)
            before, axis = cells.sum(axis=2).T[:, :, None], 0
        else:
            succeeded = (psi[None] * cells[:, None]).reshape(len(cells), len(psi), -1)
            before, axis = cells.reshape(len(cells), 1, -1), -1
        return _weighted_entropy(succeeded, axis) + _weighted_entropy(before - succeeded, axis)

    def choose_levels(self, posteriors: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the index of each track's next level, (tracks,); the lowest in case of a tie."""
        first = int(self.noise)
        entropy = self.expected_entropy(posteriors)[:, first:]
        return first + np.asarray((entropy <= entropy.min(axis=1, keepdims=True) + _TIE_NATS).argmax(axis=1), np.int64)

    def next(self, successes: ArrayLike, failures: ArrayLike) -> int:
        """Return the index of the next level to present, from counts of answers to each level."""
        return int(self.choose_levels(fit(self.levels, successes, failures, self.grid).weights[None])[0])


def _weighted_entropy(joint: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Return p times the entropy of ``joint`` / p, where p is the sum of ``joint`` over an axis."""
    total, terms = joint.sum(axis=axis), np.log(np.maximum(joint, 1e-300))
    terms *= joint
    return np.asarray(total * np.log(total) - terms.sum(axis=axis), float)


class Answers(NamedTuple):
    """The presented levels and the answers.

    Attributes
    ----------
    levels : (tracks, trials) array
        In u; NaN after the end of a track.
    successes : (tracks, trials) array of bool
        False after the end of a track.
    towards, before : (tracks, trials) array
        The correct answer, and the previous answer: 1 the first of two intervals, −1 the second, 0 neither.
    done : (tracks, trials) array
        The fraction of trials done, from 0 to 1.
    """

    levels: Floats
    successes: NDArray[np.bool_]
    towards: Floats
    before: Floats
    done: Floats

    def first(self, trials: int | None) -> Answers:
        """Return the answers to the first trials of each track; None means all trials."""
        return Answers(**{name: of_tracks[:, :trials] for name, of_tracks in self._asdict().items()})

    def person_answers(self, places: Floats) -> list[PersonAnswers]:
        """Return the answers of each track, with levels in u rounded to the nearest of the ascending ``places``."""
        nearest, presented = np.searchsorted((places[1:] + places[:-1]) / 2, self.levels), ~np.isnan(self.levels)
        of_tracks = {**self._asdict(), "places": nearest}
        return [
            PersonAnswers(**{**{name: values[track][trials] for name, values in of_tracks.items()}, "levels": places})
            for track, trials in enumerate(presented)
        ]


# Yields the level of the next trial of each track and whether the track continues; receives whether answers succeed.
Choice: TypeAlias = Generator[tuple[Floats, NDArray[np.bool_]], NDArray[np.bool_], None]


@dataclass(frozen=True, eq=False, kw_only=True)
class Observers:
    """Simulated observers, one per track.

    Attributes
    ----------
    family : {"weibull", "normal", "logistic"}
        Their psychometric function.
    thresholds : (tracks,) array
        In u.
    width : float or (tracks,) array
        From 5 to 95 %, in u.
    guess, lapse : float or (tracks,) array
        Guess rate and lapse rate.
    presented : callable, optional
        Maps requested to presented levels, both in u; by default they are equal.
    moves : float or (tracks,) array
        Rise of the threshold from the first trial to the last, in u.
    criterion, repeats : float or (tracks,) array
        Preference for the first of two intervals, and for the last answer [SD of the decision].
    towards : (tracks, trials) array, optional
        1 if the first interval is correct, otherwise −1; None without two intervals.
    """

    family: Family
    thresholds: Floats
    width: ArrayLike
    guess: float | Floats
    lapse: float | Floats
    presented: Callable[[Floats], Floats] | None = None
    moves: float | Floats = 0.0
    criterion: float | Floats = 0.0
    repeats: float | Floats = 0.0
    towards: Floats | None = None

    def probability(self, levels: ArrayLike, done: ArrayLike = 0.5) -> Floats:
        """Return the probability of a success at ``levels``, one for each track or one for all.

        ``done`` is the fraction of trials already done, from 0 to 1.
        """
        if self.presented is not None:
            levels = self.presented(np.asarray(levels, float))
        thresholds = self.thresholds + np.asarray(self.moves, float) * (np.asarray(done, float) - 0.5)
        return success(self.family, levels, thresholds, self.width, self.guess, self.lapse)

    def answers(self, draws: Floats, choices: Choice) -> Answers:
        """Return the answers to levels from ``choices``, using uniform numbers ``draws`` (tracks, trials)."""
        tracks, trials = draws.shape
        levels, successes, before = np.full(draws.shape, np.nan), np.zeros(draws.shape, bool), np.zeros(draws.shape)
        towards = np.zeros(draws.shape) if self.towards is None else self.towards
        done = np.broadcast_to(np.arange(trials) / max(1, trials - 1), draws.shape)
        last_answers, (current, running) = np.zeros(tracks), next(choices)
        for trial in range(trials):
            psi = self.probability(current, done[0, trial])
            psi = with_preference(psi, self.lapse, towards[:, trial] * (self.criterion + self.repeats * last_answers))
            correct, before[:, trial] = draws[:, trial] < psi, last_answers
            levels[running, trial], successes[:, trial] = current[running], correct & running
            last_answers = np.where(correct, towards[:, trial], -towards[:, trial])
            if trial + 1 < trials:
                current, running = choices.send(correct)
        return Answers(levels=levels, successes=successes, towards=towards, before=before, done=done)


def constant_tracks(levels: Sequence[float], repetitions: int, observers: Observers, draws: Floats) -> Answers:
    """Return the answers to constant stimuli: each level ``repetitions`` times.

    Parameters
    ----------
    levels : sequence of float
        In u.
    repetitions : int
        Presentations of each level.
    observers : Observers
        The simulated observers.
    draws : (tracks, trials) array
        Uniform numbers in [0, 1).
    """
    tracks = len(draws)

    def choose() -> Choice:
        for level in np.tile(np.asarray(levels, float), repetitions):
            yield np.full(tracks, level), np.ones(tracks, bool)

    return observers.answers(draws, choose())


def staircase_tracks(
    staircase: Staircase, observers: Observers, draws: Floats, stop: tuple[int, int] | None = None
) -> Answers:
    """Return the tracks of an up–down rule.

    Parameters
    ----------
    staircase : Staircase
        The rule.
    observers : Observers
        The simulated observers.
    draws : (tracks, trials) array
        Uniform numbers in [0, 1).
    stop : tuple of int, optional
        Number of reversals after which a track ends, and the smallest number of answers.
    """
    tracks = len(draws)

    def choose() -> Choice:
        current, running = np.full(tracks, staircase.begin), np.ones(tracks, bool)
        in_a_row, reversals, last_move = np.zeros(tracks, int), np.zeros(tracks, int), np.zeros(tracks)
        for answered in count(1):
            correct = yield current, running
            in_a_row = np.where(correct, in_a_row + 1, 0)
            steps_down = in_a_row == staircase.down_after
            move = np.where(correct, np.where(steps_down, -staircase.ratio * staircase.step_up, 0.0), staircase.step_up)
            in_a_row[steps_down] = 0
            reversals += move * last_move < 0.0
            last_move = np.where(move != 0.0, move, last_move)
            current = np.clip(current + move, staircase.low, staircase.high)
            if stop is not None:
                running = running & ((answered < stop[1]) | (reversals < stop[0]))

    return observers.answers(draws, choose())


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
        The simulated observers.
    draws : (tracks, trials) array
        Uniform numbers in [0, 1).
    begin : int, optional
        Index of the first level; by default the search chooses it.
    noise : (tracks, noise trials) array, optional
        Uniform numbers for noise trials; the search uses their answers from the first trial on.
    stop : tuple, optional
        Width of the 95 % interval [u] at which a track ends, and the smallest number of answers.
    """
    tracks, levels = len(draws), np.asarray(search.levels, float)

    def choose() -> Choice:
        running = np.ones(tracks, bool)
        psi = search.psi.reshape(len(levels), len(search.grid.thresholds), -1)
        posterior = np.tile(search.grid.prior.reshape(1, *psi.shape[1:]), (tracks, 1, 1))
        if noise is not None:
            yes = (noise < observers.guess).sum(axis=1)[:, None, None]
            log_likelihood = yes * np.log(psi[0]) + (noise.shape[1] - yes) * np.log1p(-psi[0])
            posterior *= np.exp(log_likelihood - log_likelihood.max(axis=(1, 2), keepdims=True))
        for trial in count():
            posterior /= posterior.sum(axis=(1, 2), keepdims=True)
            if stop is not None and trial >= stop[1]:
                thresholds, marginals = search.grid.thresholds, posterior.sum(axis=2)
                ends = [[quantile(thresholds, weights, p) for p in (0.025, 0.975)] for weights in marginals]
                running = running & (np.diff(np.asarray(ends, float), axis=1)[:, 0] > stop[0])
            place = search.choose_levels(posterior) if trial or begin is None else np.full(tracks, begin)
            correct = yield levels[place], running
            posterior *= np.where(correct[:, None, None], psi[place], 1.0 - psi[place])

    return observers.answers(draws, choose())
