"""Adaptive methods: the level that a track presents next, and many tracks of simulated observers at once.

**Up–down staircases**: the level falls after successes in a row and rises after each failure. The ratio of the steps is
that of García-Pérez 1998, at which a rule converges to the same percentage whatever the observer's spread; equal steps
converge to percentages that depend on it.

**QUEST+**: the next level is the one whose answer is expected to leave the least uncertainty. Watson 2017 minimises the
entropy of all parameters. Prins 2013 minimises that of the threshold's marginal alone, so that levels are not spent on
the width or the lapse rate; that is the default here.

**Simulated observers** answer by a psychometric function, so that their tracks show the best performance of a method.
Levels are in the coordinate u; answers follow from uniform numbers that the caller draws.
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
from study_app.psychophysics.person_fit import Given, preferred

# The level presented, in the coordinate u, and whether it was a success; in the order of presentation.
_Answer: TypeAlias = tuple[float, bool]

RATIOS: Final = {1: 0.2845, 2: 0.5488, 3: 0.7393, 4: 0.8415}
"""Ratio of the step down to the step up, by the number of successes in a row before a step down."""
_DROPPED: Final = 2
"""Number of first reversals left out, which depend on the start of the track."""


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
        return min(max(last + self._moves(answers)[-1], self.low), self.high)

    def reversals_at(self, answers: Sequence[_Answer]) -> list[int]:
        """Return the indices of the trials at which the direction changed."""
        places, before = [], 0.0
        for place, move in enumerate(self._moves(answers)):
            if move * before < 0.0:
                places.append(place)
            before = move or before
        return places

    def reversals(self, answers: Sequence[_Answer]) -> list[float]:
        """Return the levels of the trials at which the direction changed."""
        return [answers[place][0] for place in self.reversals_at(answers)]

    def mean_of_reversals(self, answers: Sequence[_Answer], average: int) -> float | None:
        """Return the mean of the last even number of reversals, up to ``average``; None if there are too few.

        The first two and those at an end of the domain are excluded.
        """
        kept = [level for level in self.reversals(answers)[_DROPPED:] if self.low < level < self.high]
        count = min(len(kept), average) // 2 * 2
        return sum(kept[-count:]) / count if count else None

    def _moves(self, answers: Sequence[_Answer]) -> list[float]:
        """Return the step that each answer causes; 0 while successes in a row are too few."""
        moves, successes = [], 0
        for _, right in answers:
            successes = successes + 1 if right else 0
            if not right:
                moves.append(self.step_up)
            elif successes == self.down_after:
                moves.append(-self.ratio * self.step_up)
                successes = 0
            else:
                moves.append(0.0)
        return moves


def converges_to(down_after: int, ratio: float) -> float:
    """Return the probability of success to which a rule converges: (1 + ratio)^(−1/down_after)."""
    return float((1.0 + ratio) ** (-1.0 / down_after))


_Learn: TypeAlias = Literal["threshold", "all"]

_TIE_NATS: Final = 1e-9
"""Expected entropies closer than this are equal: rounding on another processor shifts them by 1e-15."""


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
        Whether the first of the levels is that of noise trials, which is never chosen.
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
        """Return the entropy [nat] expected after an answer, (tracks, levels), of posteriors (tracks, …)."""
        cells = posteriors.reshape(len(posteriors), len(self.grid.thresholds), -1)
        psi = self.psi.reshape(len(self.levels), *cells.shape[1:])
        if self.learn == "threshold":
            succeeded = np.matmul(cells.transpose(1, 0, 2), psi.transpose(1, 2, 0))  # (thresholds, tracks, levels)
            before, axis = cells.sum(axis=2).T[:, :, None], 0
        else:
            succeeded = (psi[None] * cells[:, None]).reshape(len(cells), len(psi), -1)
            before, axis = cells.reshape(len(cells), 1, -1), -1
        return _weighted_entropy(succeeded, axis) + _weighted_entropy(before - succeeded, axis)

    def next_of(self, posteriors: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the index of each track's next level, (tracks,); the lowest in case of a tie."""
        first = int(self.noise)
        entropy = self.expected_entropy(posteriors)[:, first:]
        return first + np.asarray((entropy <= entropy.min(axis=1, keepdims=True) + _TIE_NATS).argmax(axis=1), np.int64)

    def next(self, successes: ArrayLike, failures: ArrayLike) -> int:
        """Return the index of the next level to present, from counts of answers to each level."""
        return int(self.next_of(fit(self.levels, successes, failures, self.grid).weights[None])[0])


def _weighted_entropy(joint: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Return p × the entropy of joint/p, for the sum p over an axis of ``joint``."""
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
        """Return the answers to the first trials of each track, or (None) to all."""
        return Answers(**{name: of_tracks[:, :trials] for name, of_tracks in self._asdict().items()})

    def given(self, places: Floats) -> list[Given]:
        """Return the answers of each track, with levels in u rounded to the nearest of the ascending ``places``."""
        nearest, known = np.searchsorted((places[1:] + places[:-1]) / 2, self.levels), ~np.isnan(self.levels)
        of_tracks = {**self._asdict(), "places": nearest}
        return [
            Given(**{**{name: values[track][own] for name, values in of_tracks.items()}, "levels": places})
            for track, own in enumerate(known)
        ]


# The level of the next trial of each track, and whether the track goes on; followed by whether answers are successes.
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

    def answers(self, draws: Floats, chosen: Choice) -> Answers:
        """Return the answers, using uniform numbers (tracks, trials); each level is chosen from the earlier answers."""
        tracks, trials = draws.shape
        levels, successes, before = np.full(draws.shape, np.nan), np.zeros(draws.shape, bool), np.zeros(draws.shape)
        towards = np.zeros(draws.shape) if self.towards is None else self.towards
        done = np.broadcast_to(np.arange(trials) / max(1, trials - 1), draws.shape)
        said, (now, running) = np.zeros(tracks), next(chosen)
        for trial in range(trials):
            psi = self.probability(now, done[0, trial])
            psi = preferred(psi, self.lapse, towards[:, trial] * (self.criterion + self.repeats * said))
            right, before[:, trial] = draws[:, trial] < psi, said
            levels[running, trial], successes[:, trial] = now[running], right & running
            said = np.where(right, towards[:, trial], -towards[:, trial])
            if trial + 1 < trials:
                now, running = chosen.send(right)
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

    def chosen() -> Choice:
        for level in np.tile(np.asarray(levels, float), repetitions):
            yield np.full(tracks, level), np.ones(tracks, bool)

    return observers.answers(draws, chosen())


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
        Number of reversals after which a track ends, and its least number of answers.
    """
    tracks = len(draws)

    def chosen() -> Choice:
        now, running = np.full(tracks, staircase.begin), np.ones(tracks, bool)
        in_a_row, reversals, before = np.zeros(tracks, int), np.zeros(tracks, int), np.zeros(tracks)
        for answered in count(1):
            right = yield now, running
            in_a_row = np.where(right, in_a_row + 1, 0)
            steps_down = in_a_row == staircase.down_after
            move = np.where(right, np.where(steps_down, -staircase.ratio * staircase.step_up, 0.0), staircase.step_up)
            in_a_row[steps_down] = 0
            reversals += move * before < 0.0
            before = np.where(move != 0.0, move, before)
            now = np.clip(now + move, staircase.low, staircase.high)
            if stop is not None:
                running = running & ((answered < stop[1]) | (reversals < stop[0]))

    return observers.answers(draws, chosen())


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
        Width of the 95 % interval [u] at which a track ends, and its least number of answers.
    """
    tracks, at = len(draws), np.asarray(search.levels, float)

    def chosen() -> Choice:
        running = np.ones(tracks, bool)
        psi = search.psi.reshape(len(at), len(search.grid.thresholds), -1)
        posterior = np.tile(search.grid.prior.reshape(1, *psi.shape[1:]), (tracks, 1, 1))
        if noise is not None:
            yes = (noise < observers.guess).sum(axis=1)[:, None, None]
            log_likelihood = yes * np.log(psi[0]) + (noise.shape[1] - yes) * np.log1p(-psi[0])
            posterior *= np.exp(log_likelihood - log_likelihood.max(axis=(1, 2), keepdims=True))
        for trial in count():
            posterior /= posterior.sum(axis=(1, 2), keepdims=True)
            if stop is not None and trial >= stop[1]:
                thresholds, of_each = search.grid.thresholds, posterior.sum(axis=2)
                ends = [[quantile(thresholds, one, p) for p in (0.025, 0.975)] for one in of_each]
                running = running & (np.diff(np.asarray(ends, float), axis=1)[:, 0] > stop[0])
            place = search.next_of(posterior) if trial or begin is None else np.full(tracks, begin)
            right = yield at[place], running
            posterior *= np.where(right[:, None, None], psi[place], 1.0 - psi[place])

    return observers.answers(draws, chosen())
