"""Simulated tracks: many at once choose the levels that each would choose alone."""

import math

import numpy as np
import pytest

from study_app.psychophysics.adaptive import (
    Observers,
    Search,
    Staircase,
    constant_tracks,
    search_tracks,
    staircase_tracks,
)
from study_app.psychophysics.grid import FREE_GUESSES, Grid, evenly, fit, geometric

LOW, HIGH = -1.7, -0.2
LEVELS = evenly(LOW, HIGH, 15)


def observers(count=6, guess=0.5):
    return Observers(family="weibull", thresholds=np.linspace(-1.2, -0.6, count), width=1.4, guess=guess, lapse=0.02)


def draws(trials, count=6, seed=1):
    return np.random.default_rng(seed).random((count, trials))


def search(learn="threshold", guesses=(0.5,), noise=False):
    grid = Grid(
        family="weibull",
        thresholds=evenly(LOW, HIGH, 21),
        widths=geometric(0.5, 4.0, 5),
        width_prior=(1.4, 1.5),
        lapses=(0.0, 0.02),
        lapse_prior=(0.5, 0.5),
        guesses=guesses,
    )
    return Search(grid, (-math.inf, *LEVELS) if noise else LEVELS, learn, noise)


@pytest.mark.parametrize("learn", ["threshold", "all"])
@pytest.mark.parametrize("noise", [0, 4, 3000])
def test_search_tracks_choose_the_levels_that_the_search_chooses_one_by_one(learn, noise):
    level_search = search(learn, FREE_GUESSES if noise else (0.5,), noise > 0)
    noise_draws = draws(noise, seed=2) if noise else None
    tracks = search_tracks(level_search, observers(guess=0.1), draws(25), noise=noise_draws)
    for track in range(6):
        counts = np.zeros((2, len(level_search.levels)))
        if noise_draws is not None:
            yes = int((noise_draws[track] < 0.1).sum())
            counts[:, 0] = yes, noise - yes
        for level, success in zip(tracks.levels[track], tracks.successes[track], strict=True):
            place = level_search.next(*counts)
            assert level_search.levels[place] == level
            counts[0 if success else 1, place] += 1


def test_search_tracks_end_when_the_interval_is_narrow_enough():
    level_search, most = search(), 0.9
    tracks = search_tracks(level_search, observers(), draws(80), stop=(most, 10))
    lengths = (~np.isnan(tracks.levels)).sum(axis=1)
    assert lengths.min() >= 10
    assert lengths.max() < 80
    for track, length in enumerate(lengths):
        for stop in (length - 1, length):  # the interval is wider one answer earlier
            if stop < 10:
                continue
            counts = np.zeros((2, len(LEVELS)))
            for level, success in list(zip(tracks.levels[track], tracks.successes[track], strict=True))[:stop]:
                counts[0 if success else 1, LEVELS.index(level)] += 1
            low, high = fit(level_search.levels, *counts, level_search.grid).interval
            assert (high - low <= most) == (stop == length)
    assert not tracks.successes[np.isnan(tracks.levels)].any()


@pytest.mark.parametrize("down_after", [1, 2, 3])
@pytest.mark.parametrize("stop", [None, (6, 20)])
def test_staircase_tracks_present_the_levels_of_the_rule(down_after, stop):
    staircase = Staircase(down_after=down_after, step_up=0.2, ratio=0.55, low=LOW, high=HIGH, begin=HIGH)
    tracks = staircase_tracks(staircase, observers(), draws(60), stop)
    for levels, successes in zip(tracks.levels, tracks.successes, strict=True):
        answers = []
        for level, success in zip(levels, successes, strict=True):
            ended = stop is not None and len(answers) >= stop[1] and len(staircase.reversals(answers)) >= stop[0]
            assert np.isnan(level) == ended
            if ended:
                break
            assert level == pytest.approx(staircase.next(answers))
            answers.append((staircase.next(answers), bool(success)))


def test_constant_tracks_are_answered_with_the_probability_of_the_level():
    tracks = constant_tracks(LEVELS, 4000, observers(2), draws(4000 * 15, 2))
    expected = observers(2).probability(np.array(LEVELS)[:, None]).T
    for answers, shares in zip(tracks.person_answers(np.array(LEVELS)), expected, strict=True):
        assert (np.bincount(answers.places) == 4000).all()
        assert np.abs(np.bincount(answers.places, answers.successes) / 4000 - shares).max() < 4 * math.sqrt(0.25 / 4000)
