"""Error rates of verdicts on hypotheses, recognition, equivalence and trends, from directly drawn numbers.

Each trial draws one study whose truth is known, and calls the same statistic as the report. The selection of
participants, the wording and the layout of the report are covered by tests.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Final, TypeAlias

import numpy as np
from scipy.optimize import brentq

from study_app.analysis.contrasts import ContrastSamples, ParticipantValue
from study_app.analysis.findings import RecognitionResult, recognised
from study_app.analysis.results import Verdict
from study_app.analysis.statistics import (
    STEPS,
    Array,
    holm,
    means_of,
    p_differs,
    p_equivalent,
    recognition,
    tost,
    trend,
)
from study_app.protocol.trials import ForcedChoice, Stimulus, UpDown
from study_app.protocol.warnings import ThresholdPlan
from study_app.psychophysics.people import BETWEEN_PEOPLE

_ALPHA: Final = 0.05

Trial: TypeAlias = Callable[[np.random.Generator], bool]
Drawn: TypeAlias = Callable[[np.random.Generator, int], Array]
"""A function that draws one number for each of ``n`` participants."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnStudies:
    """Simulated studies of one kind; ``trial`` simulates one and returns whether the report makes the ``claim``."""

    name: str
    participants: int
    claim: str
    trial: Trial


_SHOWN: Final = "shown"
_EQUIVALENT: Final = "called equivalent"


def false_claims() -> Iterator[DrawnStudies]:
    """Yield studies in which the claim is false."""
    yield from _thresholds()
    yield from _recognition()
    yield from _equivalence()
    yield from _contrasts()
    yield from _trends()


def true_claims() -> Iterator[DrawnStudies]:
    """Yield studies in which the claim is true."""
    yield DrawnStudies(
        name="thresholds in two blocks, ratio 1.5 : 1, 3-down-1-up, 60 trials",
        participants=12,
        claim=_SHOWN,
        trial=_threshold_trial(12, 1.5),
    )


def _is_difference_shown(*samples: Array, alternative: str = "two-sided") -> bool:
    """Return whether the test of a contrast shows a difference from 0, or between two groups."""
    means, *others = (means_of(sample[None], group=group) for group, sample in enumerate(samples))
    for other in others:
        means = means - other
    return bool(means.error[0] > 0 and max(float(p[0]) for p in p_differs(means, alternative)) <= _ALPHA)


_LEVELS: Final = (0.02, 0.6)
DESIGN: Final = ForcedChoice()
METHOD: Final = UpDown(rule="3down1up", trials=30, tracks=2)


def _thresholds() -> Iterator[DrawnStudies]:
    yield DrawnStudies(
        name="thresholds in two blocks, equal, 3-down-1-up, 60 trials",
        participants=12,
        claim=_SHOWN,
        trial=_threshold_trial(12, 1.0),
    )


def _threshold_trial(n: int, ratio: float) -> Trial:
    """Return a trial that compares thresholds in two blocks; the first block's are ``ratio`` times higher."""
    plan = ThresholdPlan(Stimulus(vary="damping_nspm", levels=_LEVELS), DESIGN, METHOD, catch=0, standards=1)

    def trial(rng: np.random.Generator) -> bool:
        middle = sum(plan.stimulus.domain) / 2
        spread = math.log10(BETWEEN_PEOPLE) / math.sqrt(2)  # the difference has the standard deviation of `power`
        thresholds = middle + spread * rng.normal(size=n)
        fits = [
            fit
            for shift in (math.log10(ratio), 0.0)
            for fit in plan.fits(plan.answers(thresholds + spread * rng.normal(size=n) + shift, rng))
        ]
        estimates = plan.grouped(fits, 2 * n)  # both blocks have a common width
        values, variances = (
            estimates.medians[:n] - estimates.medians[n:],
            estimates.variances[:n] + estimates.variances[n:],
        )
        sample = tuple(ParticipantValue(value=values[k], variance=variances[k]) for k in np.argsort(values))
        means = ContrastSamples(samples=(sample,), left_out={}).means(_ALPHA)
        return means is not None and max(float(p[0]) for p in p_differs(means, "two-sided")) <= _ALPHA

    return trial


LIQUIDS: Final = ("water", "honey", "oil")


def _recognition() -> Iterator[DrawnStudies]:
    for n in (12, 24, 60):
        for proportion in (0.5, 0.8):
            name = f"honey recognised; water and oil named “water” in {100 * proportion:.0f} %, otherwise “oil”"
            yield DrawnStudies(
                name=name,
                participants=n,
                claim="water or oil recognised",
                trial=_recognition_trial(n, proportion, known=(1,)),
            )
        yield DrawnStudies(
            name="all three liquids named at random",
            participants=n,
            claim="a liquid recognised",
            trial=_recognition_trial(n, 0.5, known=()),
        )


def _recognition_trial(n: int, share: float, known: tuple[int, ...]) -> Trial:
    """Return a trial in which liquids are named at random, except those that are ``known``."""

    def trial(rng: np.random.Generator) -> bool:
        names = np.where(rng.random((n, 3)) < share, 0, 2) if known else rng.integers(0, 3, (n, 3))
        names[:, list(known)] = known
        result = recognition(names, [0, 1, 2], 3, seed=None)
        verdict: Verdict = "shown" if result.p is not None and result.p <= _ALPHA else "not shown"
        named = RecognitionResult(LIQUIDS, LIQUIDS, LIQUIDS, result, verdict)
        return bool({*recognised(named, _ALPHA)} - {*known})

    return trial


def _equivalence() -> Iterator[DrawnStudies]:
    for bound in (0.5, 1.0):
        proportion = bound / STEPS
        for description, other_differences in (("0", (0.0,)), ("−1, 0 or 1", (-1.0, 0.0, 0.0, 1.0))):
            name = (
                f"one participant in {1 / proportion:.0f} differs by 6 points, the others by {description}, "
                f"bound {bound:g}"
            )
            for n in (14, 20, 30, 40):
                yield DrawnStudies(
                    name=name,
                    participants=n,
                    claim=_EQUIVALENT,
                    trial=_outlier_trial(n, proportion, other_differences, bound),
                )
    for members in (1, 4, 6):
        description = "one hypothesis" if members == 1 else f"{members} hypotheses"
        yield DrawnStudies(
            name=f"{description} with the true difference at the bound, normal",
            participants=20,
            claim=f"any {_EQUIVALENT}",
            trial=_at_bound_trial(20, members),
        )


def _outlier_trial(n: int, share: float, others: tuple[float, ...], bound: float) -> Trial:
    """Return a trial in which a ``share`` of participants differs by `STEPS`, the others by values from ``others``."""

    def trial(rng: np.random.Generator) -> bool:
        differences = np.where(rng.random(n) < share, STEPS, rng.choice(others, n))
        return tost(differences, bound).verdict == "equivalent"

    return trial


def _at_bound_trial(n: int, members: int) -> Trial:
    """Return a trial with ``members`` hypotheses whose true difference is at the equivalence bound."""

    def trial(rng: np.random.Generator) -> bool:
        means = means_of(rng.normal(1.0, 1.0, (members, n)))
        ps = holm(p_equivalent(means, 1.0, n, STEPS).tolist())
        return min(p for p in ps if p is not None) <= _ALPHA

    return trial


def _contrasts() -> Iterator[DrawnStudies]:
    for n in (8, 12, 30):
        for ratio in (1, 3, 6):
            name = f"two groups, sizes 1 : 2, SDs {ratio} : 1"
            yield DrawnStudies(
                name=name, participants=n, claim=_SHOWN, trial=_groups_trial(round(n / 3), n - round(n / 3), ratio)
            )
    for n in (8, 12, 20, 30):
        yield DrawnStudies(
            name="paired, one participant in six 5 points higher, the others 1 lower",
            participants=n,
            claim=_SHOWN,
            trial=_pairs_trial(n, _one_in_six),
        )
        yield DrawnStudies(
            name="paired, exponential",
            participants=n,
            claim=_SHOWN,
            trial=_pairs_trial(n, lambda rng, count: rng.exponential(size=count) - 1),
        )


def _groups_trial(n: int, other: int, ratio: float) -> Trial:
    return lambda rng: _is_difference_shown(ratio * rng.normal(size=n), rng.normal(size=other))


def _pairs_trial(n: int, drawn: Drawn) -> Trial:
    return lambda rng: _is_difference_shown(drawn(rng, n))


def _one_in_six(rng: np.random.Generator, n: int) -> Array:
    return np.where(rng.random(n) < 1 / 6, 5.0, -1.0)


DELAYS: Final = np.linspace(-1.0, 1.0, 7)
_SLOPE: Final = 1.2
_NOISE: Final = 0.7
_LARGE_SAMPLE: Final = 20_000


def _trends() -> Iterator[DrawnStudies]:
    """Yield skewed individual trends with mean 0, so that ranks fall, and with rank correlation 0."""
    for n in (12, 30):
        yield DrawnStudies(
            name="individual trends, skewed with mean 0, so that ranks decrease",
            participants=n,
            claim="an increase shown",
            trial=_trend_trial(n, 0.0, "rise"),
        )
        name = "individual trends, skewed, mean rank correlation 0"
        yield DrawnStudies(
            name=name, participants=n, claim="a trend shown", trial=_trend_trial(n, _shift_without_trend(), "either")
        )


def _trend_trial(n: int, shift: float, claim: str) -> Trial:
    def trial(rng: np.random.Generator) -> bool:
        result = trend(_draw_answers(rng, n, shift), None, seed=None)
        claimed = result.p is not None and result.p <= _ALPHA
        return claimed and (claim == "either" or (result.effect or 0.0) > 0)

    return trial


def _draw_answers(rng: np.random.Generator, n: int, shift: float) -> Array:
    """Return answers (participants, delays) of participants with exponentially distributed slopes of mean ``shift``."""
    slopes = _SLOPE * (rng.exponential(size=(n, 1)) - 1 + shift)
    return np.clip(np.round(4 + slopes * DELAYS + _NOISE * rng.normal(size=(n, len(DELAYS)))), 1, 7)


@cache
def _shift_without_trend() -> float:
    """Return the mean of skewed slopes at which the mean rank correlation is 0, from a large sample."""

    def correlation(shift: float) -> float:
        return trend(_draw_answers(np.random.default_rng(0), _LARGE_SAMPLE, shift), None, seed=None).effect or 0.0

    return float(brentq(correlation, 0.0, 1.0, xtol=1e-3))
