"""Every statistic of a table of small and unusual samples: its numbers are possible, its words reviewed."""

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np
import pytest

from study_app.analysis.planning import simulated_studies
from study_app.analysis.statistics import (
    equivalence,
    mean_tests,
    outcome,
    rank_tests,
    recognition_tests,
    thresholds,
    trend_tests,
)
from study_app.errors import AnalysisError
from study_app.protocol.participants import fewest_participants
from tests.analysis.outputs import GOLDEN
from tests.golden import compare, each_once

NAN = np.nan
LEVELS = (0.0, 50.0, 100.0, 200.0)


def answers(people: int, columns: int, seed: int, slope: float = 0.0, missing: float = 0.0) -> Any:
    """Return answers from 1 to 7 that rise with the column."""
    rng = np.random.default_rng(seed)
    ratings = np.clip(
        np.round(rng.normal(4 + slope * (np.arange(columns) - columns / 2), 1.2, (people, columns))), 1, 7
    )
    return np.where(rng.random(ratings.shape) < missing, NAN, ratings)


SAMPLES = {
    "none": np.zeros((0, 3)), "one": answers(1, 3, 0), "two": answers(2, 3, 1), "ties": np.full((5, 3), 4.0),
    "few": answers(4, 3, 2, 1.5), "rise": answers(8, 4, 3, 1.2), "fall": answers(8, 4, 4, -1.2),
    "missing": answers(9, 4, 5, 0.8, 0.15), "all missing": np.full((3, 3), NAN), "many": answers(40, 3, 6, 0.3),
    "pair": answers(7, 2, 7, 2.0), "one setting": answers(6, 1, 8), "seven": answers(5, 7, 9, 0.6),
    "ends": np.tile([1.0, 7.0, 7.0], (6, 1)), "half": answers(12, 4, 10, 0.5, 0.5),
}  # fmt: skip
"""(participants, settings) arrays."""
DIFFERENCES = {
    "none": [], "one": [1.0], "two": [0.0, 1.0], "equal": [0.0] * 8, "ones": [1.0] * 8,
    "small": [0, 0, 1, 0, -1, 0, 0, 1], "large": [2, 3, 2, 4, 3, 2], "wide": [-3, 3, -2, 2, 0, 1],
    "many": np.random.default_rng(3).integers(-1, 2, 30), "missing": [0, NAN, 1, 0, -1, NAN, 0],
    "outlier": [0, 0, 0, 0, 0, 0, 6], "halves": [0.5, 0, -0.5, 0, 0.5, 0, 0, 0, 1, -1, 0.5, 0],
}  # fmt: skip
PS = ((), (0.04,), (0.01, 0.04, None), (0.5, 0.02, 0.02, 1.0), (None, None), (0.03, 0.01, 0.2, 0.04, 0.001))


def over(function: Callable[..., Any], cases: dict[str, Any], *more: Any, **named: Any) -> Iterator[tuple[str, Any]]:
    for name, case in cases.items():
        yield f"{function.__name__}({name}{''.join(f', {argument}' for argument in (*more, *named.items()))})", case


def results(function: Callable[..., Any], cases: dict[str, Any], *more: Any, **named: Any) -> Iterator[str]:
    """Yield the texts of each result, or the error, of a function for each case; check its numbers."""
    for name, case in over(function, cases, *more, **named):
        arguments = case if isinstance(case, tuple) else (case,)
        try:
            result = function(*arguments, *more, **named)
            check(name, result)
        except (AnalysisError, ValueError) as error:
            yield f"{function.__name__}: {type(error).__name__}: {error}"
            continue
        for key in ("method", "note", "no_interval"):
            if words := getattr(result, key, ""):
                yield f"{function.__name__}: {key}: {words}"


def check(name: str, found: Any) -> None:
    """Check that p is a probability, that an interval contains its effect and that a missing test has a note."""
    p, effect = getattr(found, "p", None), getattr(found, "effect", None)
    low, high = getattr(found, "low", None), getattr(found, "high", None)
    if p is not None and np.ndim(p) == 0 and not np.isnan(p):
        assert 0 <= p <= 1, name
        smallest = getattr(found, "smallest_p", None)
        assert smallest is None or smallest <= p * (1 + 1e-9), name
    elif hasattr(found, "note") and hasattr(found, "p"):
        assert found.note, f"{name} has neither p nor a note"
    if None not in (low, high, effect) and not np.isnan([low, high, effect]).any():
        assert low <= effect <= high, name


def named_(number: int, count: int) -> dict[str, Any]:
    rng = np.random.default_rng(number)
    return {
        f"{people} people": np.where(rng.random((people, count, 4)) < 0.1, NAN, rng.integers(1, 8, (people, count, 4)))
        for people in (0, 1, 2, 5, 12)
    }


def of_settings() -> Iterator[str]:
    yield from results(rank_tests.friedman, SAMPLES)
    yield from results(rank_tests.friedman, {"long": answers(60, 5, 1, 0.2)}, draws=500, seed=2)
    yield from results(trend_tests.trend, SAMPLES)
    yield from results(trend_tests.trend, SAMPLES, "decreasing")
    yield from results(trend_tests.trend, {"long": answers(210, 3, 2, 0.1)}, seed=None)
    wide = {name: (sample, LEVELS[: sample.shape[1]]) for name, sample in SAMPLES.items() if sample.shape[1] <= 4}
    yield from results(trend_tests.step_down, wide)
    yield from results(trend_tests.step_down, wide, "decreasing", alpha=0.2)
    stacked = {name: np.stack([sample, sample[::-1], 8 - sample]) for name, sample in SAMPLES.items() if name != "half"}
    yield from results(rank_tests.global_permutation, stacked, draws=300)


def of_pairs() -> Iterator[str]:
    pairs = {name: (sample[:, 0], sample[:, -1]) for name, sample in SAMPLES.items()}
    yield from results(rank_tests.signed_rank_test, pairs)
    yield from results(rank_tests.signed_rank_test, {"few": pairs["few"]}, alpha=0.2)
    yield from results(rank_tests.signed_rank_test, {"lengths": ([1.0], [1.0, 2.0])})
    yield from results(outcome.holm, {str(ps): (ps,) for ps in PS})
    yield from results(outcome.false_discovery, {str(ps): (ps,) for ps in (*PS, (1.2,))})
    tables = {"2": [[5, 1], [2, 7]], "0": [[0, 0], [0, 0]], "3": [[3, 0, 1], [0, 4, 0], [2, 0, 5]]}
    yield from results(recognition_tests.kappa, tables)
    yield from results(recognition_tests.named_labels, named_(1, 3))
    names = {name: (recognition_tests.named_labels(choices), (0, 1, None)) for name, choices in named_(2, 3).items()}
    yield from results(recognition_tests.recognition, names, labels=4)
    yield from results(
        outcome.student_interval, {name: np.asarray(differences, float) for name, differences in DIFFERENCES.items()}
    )
    yield from results(thresholds.group_mean, {
        "one": ([1.0], [0.1]), "two": ([1.0, 2.0], [0.1, 0.2]), "alike": ([1.0, 1.01, 0.99], [0.5, 0.4, 0.6]),
        "apart": ([1.0, 4.0, 9.0, 2.0], [0.01, 0.02, 0.01, 0.03]), "none": ([], []),
    })  # fmt: skip
    yield from results(outcome.draws_for, {f"{a} {m}": (a, 1000, m) for a, m in product((0.05, 0.001, 1e-6), (1, 40))})
    yield from results(outcome.clopper_pearson, {f"{c} of {n}": (c, n) for c, n in ((0, 5), (5, 5), (3, 10), (0, 1))})
    complete = {name: sample for name, sample in SAMPLES.items() if not np.isnan(sample).any()}
    yield from results(rank_tests.doubled_ranks, complete)


def of_equivalence() -> Iterator[str]:
    cases = {name: np.asarray(differences, float) for name, differences in DIFFERENCES.items()}
    for bound, alpha in ((1.0, 0.05), (0.5, 0.05), (3.0, 0.2)):
        yield from results(equivalence.tost, cases, bound, alpha=alpha)
    cases_of_bounds = product((0.2, 0.05, 0.01), (0.5, 1.0, 3.0))
    limits = {f"{alpha} {bound}": (alpha, bound, equivalence.STEPS) for alpha, bound in cases_of_bounds}
    yield from results(fewest_participants, limits)
    yield from results(mean_tests.resamples_for, {str(alpha): alpha for alpha in (0.2, 0.05, 0.01, 0.001, 1e-5)})
    rows = {name: sample[None] for name, sample in cases.items() if len(sample) > 2 and not np.isnan(sample).any()}
    yield from results(simulated_studies.difference_ranks, rows)
    yield from results(equivalence.shows_equivalence, rows, 1.0, 0.05)


def of_thresholds() -> Iterator[str]:
    rising = {
        name: (sample, LEVELS[: sample.shape[1]]) for name, sample in SAMPLES.items()
        if name in ("none", "one", "ties", "few", "rise", "fall", "missing", "all missing", "ends", "one setting")
    }  # fmt: skip
    yield from results(thresholds.detection_threshold, rising)
    expected = np.array([0.55, 0.7, 0.9])
    for right in ([1, 4, 9], [5, 7, 10], [0, 0, 10]):
        yield from results(thresholds.deviances, {str(right): (right, [10] * 3, expected)})
        yield from results(thresholds.p_of_fit, {str(right): (right, [10] * 3, expected)})
    flags = ([True] * 4, [True, False, False, False], [False, True, True, True], [True])
    shares = ([0.9, 0.6, 0.7, 0.8], [0.7] * 4)
    drifting = {f"{flag} {own}": (flag, own[: len(flag)]) for flag, own in product(flags, shares)}
    yield from results(thresholds.drift, drifting)


TABLES = (of_settings, of_pairs, of_equivalence, of_thresholds)


def test_statistics_of_small_and_unusual_samples(pytestconfig: pytest.Config) -> None:
    words = (line for table in TABLES for line in table())
    compare(GOLDEN / "statistics.txt", each_once(words), pytestconfig)
