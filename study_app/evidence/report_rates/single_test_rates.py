"""Rates of single tests: equivalence where a few notice strongly, coverage of thresholds, planned sizes."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Final, TypeAlias

import numpy as np
from scipy.special import expit

from study_app.analysis.data.measures import Array
from study_app.analysis.statistics.equivalence import participants_needed, tost
from study_app.analysis.statistics.thresholds import noticed
from study_app.evidence.report_rates.rates import Limit, Rate

Case: TypeAlias = tuple[str, int]
"""What is simulated, and how many participants take part."""

Trial: TypeAlias = Callable[[np.random.Generator], bool | None]
"""Simulates one study and says whether it counts as a hit; None: it prints nothing that could be one."""

COVERS: Final = "interval covers the threshold, where one is printed"
PRINTED: Final = "threshold printed, with its interval"

BOUND: Final = 1.0
LEVELS_MS: Final = np.array([0, 50, 75, 100, 125, 150, 200])
TRUE_MS: Final = 120.0
WIDTH_MS: Final = 60.0
LAPSE: Final = 0.02

TWELVE_EQUAL: Final = (12, (0.0,))
"""In 6.9 % of these studies no one of the one in five takes part, and all twelve differences are 0: equivalent."""


@cache
def cases() -> Mapping[Case, tuple[Limit, str, Trial]]:
    """Return all cases: the limit of their rate, what is counted, and how one study is simulated."""
    found: dict[Case, tuple[Limit, str, Trial]] = {}
    for n in (5, 12, 24):
        for words, most in (("-1, 0, 1", (-1.0, 0.0, 1.0)), ("0", (0.0,))):
            found[f"one in five differs by 5 points, the others by {words}", n] = (
                "counted" if (n, most) == TWELVE_EQUAL else "at most 5 %",
                "called equivalent",
                _leaning(n, most),
            )
    for n, spread_ms, never, words in (
        (5, 0.0, 0.0, "one threshold for all"),
        (12, 0.0, 0.0, "one threshold for all"),
        (12, 35.0, 0.0, "thresholds of people, SD 35 ms"),
        (12, 60.0, 0.0, "thresholds of people, SD 60 ms"),
        (12, 15.0, 1 / 6, "one in six never agrees"),
    ):
        found[words, n] = ("at least 93 %", COVERS, _covered(n, spread_ms, never))
    for sd in (0.7, 1.0, 1.5):
        n = participants_needed(np.rint(sd * np.random.default_rng(1).normal(size=2000)), BOUND, 0.05) or 0
        words = f"whole-number differences about 0, SD {sd:g}, printed n {n}"
        found[words, n] = ("at least 77 %", "called equivalent", _equal(n, sd))
        found[words, n - 1] = ("at most 83 %", "called equivalent", _equal(n - 1, sd))
    return found


def count(case: Case, seed: int, batch: int, studies: int) -> tuple[Rate, ...]:
    """Return the rates of so many studies of a case, those of batch number ``batch``."""
    limit, what, trial = cases()[case]
    number = list(cases()).index(case)
    rng = np.random.default_rng([seed, number, batch])
    hits = [hit for _ in range(studies) if (hit := trial(rng)) is not None]
    rate = Rate(*case, what, limit, sum(hits), len(hits))
    return (Rate(*case, PRINTED, "at least 93 %", len(hits), studies), rate) if what == COVERS else (rate,)


def _leaning(n: int, most: tuple[float, ...]) -> Trial:
    def trial(rng: np.random.Generator) -> bool:
        return tost(np.where(rng.random(n) < 0.2, 5.0, rng.choice(most, n)), BOUND).verdict == "equivalent"

    return trial


def _covered(n: int, spread_ms: float, never: float) -> Trial:
    def trial(rng: np.random.Generator) -> bool | None:
        found = noticed(_people(rng, n, spread_ms, never), LEVELS_MS.tolist()).interval
        return None if found is None else found.low <= TRUE_MS <= found.high

    return trial


def _people(rng: np.random.Generator, n: int, spread_ms: float, never: float) -> Array:
    """Return answers (n, levels), 6 for noticed and 2 for not, of people whose thresholds lie about the true one."""
    at = TRUE_MS + spread_ms * rng.normal(size=(n, 1))
    chance = LAPSE + (1 - 2 * LAPSE) * expit(2 * np.log(19) * (LEVELS_MS - at) / WIDTH_MS)
    chance[rng.random(n) < never] = LAPSE
    return np.where(rng.random(chance.shape) < chance, 6.0, 2.0)


def _equal(n: int, sd: float) -> Trial:
    def trial(rng: np.random.Generator) -> bool:
        return tost(np.rint(sd * rng.normal(size=n)), BOUND).verdict == "equivalent"

    return trial
