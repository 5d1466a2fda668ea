"""Every psychophysical function of a table of usual and extreme arguments, compared with a reviewed file."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from study_app.psychophysics import adaptive, delivery, detection, families, grid, people
from tests.golden import compare
from tests.golden_values import one_line as told

SMALL = grid.Grid(
    family="weibull",
    thresholds=grid.evenly(-2, 0, 9),
    widths=grid.geometric(0.3, 2, 3),
    width_prior=(0.8, 1.5),
    lapses=(0.0, 0.05),
    lapse_prior=(0.7, 0.3),
    guesses=(0.5,),
)
FREE = replace(
    SMALL, family="logistic", width_prior=None, lapses=(0.0, 0.1), lapse_prior=(0.5, 0.5), guesses=(0.1, 0.2, 0.3)
)
LEVELS = (-1.8, -1.2, -0.8, -0.3)
RIGHT, WRONG = (0, 3, 6, 8), (2, 3, 1, 0)
MODELS = ("differencing", "independent")
FAMILIES = ("weibull", "normal", "logistic")


def lines() -> Iterator[str]:
    for task in detection.PROPORTIONS:
        shares = [detection.proportion_correct(task, one) for one in (0.0, 0.7, 1.5, 4.0)]
        yield f"{task}: {told(shares)} {told([detection.d_prime_at(task, one) for one in (0.1, 0.55, 0.76, 0.99)])}"
    for hits, signals, alarms, noises in ((8, 10, 2, 9), (0, 5, 5, 5), (5, 5, 0, 5), (3, 0, 2, 4), (3, 4, 2, 0)):
        counts = hits, signals, alarms, noises
        yield f"{counts}: {told(detection.yes_no(*counts))} {told(detection.two_intervals(*counts))}"
        yield f"  {told([detection.same_different(*counts, model) for model in MODELS])}"
        yield f"  {told([detection.abx(hits, signals, model) for model in MODELS])}"
        yield f"  {told([detection.from_correct(task, alarms, noises) for task in ('3ifc', 'oddity')])}"
    for noise, signal in (([1, 2, 2], [2, 4, 5]), ([3], [3]), ([], [1]), ([5, 6], [1, 2])):
        yield f"rating {noise} {signal}: {told(detection.rating(noise, signal))}"
    for family in FAMILIES:
        u = np.linspace(-2, 1, 5)
        yield f"{family}: {told(families.rise(family, u, -0.5, 0.8))}"
        yield f"  {told(families.success(family, u, 0, 1, 0.5, 0.1))}"
        yield f"  {told([families.position(family, share) for share in (0.05, 0.5, 0.95)])}"
        yield f"  {told([families.level_at(family, percent, -1, 0.5, 0.5, 0.02) for percent in (50, 75, 98, 99)])}"
    yield f"grid {SMALL.shape} {told(SMALL.prior)} {told(SMALL.success(LEVELS))}"
    for right, wrong in ((RIGHT, WRONG), ((0,) * 4, (0,) * 4), (WRONG, RIGHT)):
        found, free = (grid.fit(LEVELS, right, wrong, one) for one in (SMALL, FREE))
        ends = [found.threshold, *found.interval]
        yield f"{right}: {told(found.marginal)} {told(ends)} {told(free.weights[::3, 1, 1])}"
        for one in (found, free):
            yield f"  {told(tuple(one.others))} {one.variance:.7g} {told(one.success(LEVELS))} {told(one.band(LEVELS))}"
        for learn, noise in product(("threshold", "all"), (False, True)):
            search = adaptive.Search(SMALL, LEVELS, learn, noise)
            counts = [(*one, 0) if noise else one for one in (right, wrong)]
            try:
                posteriors = grid.fit(LEVELS, *counts, SMALL).weights[None]
                told_ = f"{search.next(*counts)} {told(search.expected_entropy(posteriors)[0])}"
            except ValueError as error:
                told_ = str(error)
            yield f"  {learn} {noise}: {told_}"
    observers = adaptive.Observers(
        family="weibull", thresholds=np.array([-1.5, -0.5]), width=0.8, guess=0.5, lapse=0.02
    )
    later = adaptive.Observers(
        family="normal",
        thresholds=np.array([-1.5, -0.5]),
        width=0.8,
        guess=0.5,
        lapse=0.02,
        presented=lambda u: u + 0.3,
    )
    draws = np.random.default_rng(4).random((2, 12))
    for down, ratio, begin in ((1, 1.0, -0.3), (2, 0.5488, -1.0), (3, 0.7393, 0.0)):
        rule = adaptive.Staircase(down_after=down, step_up=0.4, ratio=ratio, low=-2.0, high=0.0, begin=begin)
        found = [adaptive.staircase_tracks(rule, one, draws) for one in (observers, later)]
        counted = [one[1:3] for one in found[0].first(5).given(np.array(LEVELS))]
        yield f"{rule}: {rule.converges_to:.7g} {told([one[:2] for one in found])} {told(counted)}"
        for levels, right in zip(found[0].levels.tolist(), found[0].successes.tolist(), strict=True):
            given = list(zip(levels, right, strict=True))
            means = [rule.mean_of_reversals(given, most) for most in (1, 2, 4, 8)]
            yield f"  {rule.reversals_at(given)} {told(rule.reversals(given))} {told(means)} {rule.next(given):.7g}"
        yield f"  {told(adaptive.staircase_tracks(rule, observers, draws, (4, 6))[:2])} {rule.next([])}"
    yield told(adaptive.constant_tracks(LEVELS, 3, observers, draws)[:2])
    search = adaptive.Search(SMALL, LEVELS, "threshold")
    for more in ({}, {"begin": 2}, {"stop": (0.9, 5)}):
        yield f"search {more}: {told(adaptive.search_tracks(search, observers, draws, **more)[:2])}"
    prefers = replace(observers, criterion=2.5, repeats=0.4, towards=np.tile((1.0, -1.0), (2, 6)))
    yield f"prefers: {told(found := adaptive.search_tracks(search, prefers, draws))}"
    _, given = found.given(np.array(LEVELS))
    for one in (SMALL, replace(SMALL, log=False, session_sd=(0.0, 0.1))):
        fitted = given.fit(one, two_intervals=True)
        yield f"  {told(fitted.shifts)} {fitted.change:.7g} {fitted.named} {told(fitted.flat.marginal)}"
        yield f"  {told(fitted.expected(fitted.flat))} {told(fitted.after(5).marginal)}"
    yield from of_delivery()


def of_delivery() -> Iterator[str]:
    t = np.arange(0, 0.4, 0.001)
    place = 0.02 * np.stack([np.sin(9 * t), np.cos(7 * t), 0 * t], axis=1)
    moved = delivery.motion(t, place, 0.001)
    force = -3.0 * moved.velocity_mps - 0.2 * moved.acceleration_mps2
    yield f"motion {len(moved.times_s)} {moved.rms_speed_mps:.7g} {told(moved.velocity_mps[::97])}"
    yield f"  {told(moved.acceleration_mps2[::97])} {moved.after(0.1, 0.3).rms_speed_mps:.7g}"
    yield f"damping {told(delivery.damping(force, moved))} {told(delivery.damping(0 * force, moved))}"
    model = np.roll(force, 3, axis=0)
    yield f"share {told([delivery.share(0.8 * force, force), delivery.share(force, 0 * force)])}"
    lags = [delivery.lag(model, force, most) for most in (0, 2, 5)]
    yield f"lag {told(lags)} {told(delivery.lag(0 * force, force, 5))}"
    yield f"at {told(delivery.at(np.array([0.0, 0.0105, 0.39]), t, place))}"
    for errors in ([0.1, 0.3], [None, 0.2], [None, None], [0.1, 0.2, 0.5, None]):
        yield f"difference {errors} {told(delivery.difference(errors, [bool(one % 2) for one in range(len(errors))]))}"
    for spacing, half in product(("log", "linear"), (0.2, math.inf)):
        one = people.Expected(
            spacing=spacing,
            trials=40,
            standards=2,
            halves={"": half},
            spread=half / 2,
            threshold=0.3,
            shared=half**2 / 9,
        )
        groups = [one.of_group(people, trials) for people in (1, 2, 8) for trials in (None, 80.0)]
        yield f"{told(one)}: {one.measured} {told(groups)}"
        for within in (0.05, 0.3):
            yield f"  {within}: {one.participants_for(within)} {one.trials_for(within, 12)} {one.trials_for(within, 2)}"
    yield told([people.student_975(number) for number in (1, 2, 8, 300)])


def test_functions_of_usual_and_extreme_arguments(pytestconfig: pytest.Config) -> None:
    compare(Path(__file__).parent / "golden" / "cases.txt", lines(), pytestconfig)
    assert math.isnan(families.level_at("weibull", 99, -1, 0.5, 0.5, 0.02))
