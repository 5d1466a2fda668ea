"""What is judged of validated thresholds: each value with its limit."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from study_app.analysis.planning.power_curves import interval
from study_app.evidence.thresholds.methods_alone import PEOPLE, StudyFound, slopes
from study_app.evidence.thresholds.planted import Planted
from study_app.store.tables.csv_files import csv_text_of

ERROR_MOST: Final = 0.05
NEAR: Final = 0.15
NEAR_SHARE: Final = 0.95
OWN_COVERAGE: Final = (0.93, 0.99)
EXPONENT_MOST: Final = 0.15


@dataclass(frozen=True, slots=True)
class Verdict:
    """One judged value: what it is of, the value and its limit in words, and whether it keeps to the limit."""

    study: str
    what: str
    value: str
    limit: str
    holds: bool


def verdicts(one: Planted, studies: Sequence[StudyFound]) -> Iterator[Verdict]:
    """Yield what studies of equal observers show of methods and analysis."""
    errors = np.array([math.log(found.mean / one.threshold) for found in studies])
    mean = math.exp(float(errors.mean())) - 1
    yield Verdict(
        one.name, "mean error of the threshold", f"{100 * mean:+.1f} %", "within ±5 %", abs(mean) <= ERROR_MOST
    )
    near, n = int((np.abs(np.expm1(errors)) <= NEAR).sum()), len(studies)
    yield Verdict(
        one.name,
        f"studies of {PEOPLE} within ±15 %",
        f"{100 * near / n:.1f} %",
        "at least 95 % (Wilson interval)",
        interval(near / n, n)[1] >= NEAR_SHARE,
    )
    of_group = [low <= one.threshold <= high for found in studies for _, low, high in found.group]
    yield group_coverage(one.name, sum(of_group) / len(of_group), n)
    of_people = [low <= one.threshold <= high for found in studies for own in found.own for _, low, high in own]
    share = sum(of_people) / len(of_people)
    low, high = OWN_COVERAGE
    yield Verdict(
        one.name,
        "coverage of participants' 95 % intervals",
        f"{100 * share:.1f} %",
        f"{100 * low:.0f} to {100 * high:.0f} %",
        low <= share <= high,
    )
    if one.exponent is not None:
        exponent = float(np.mean([slope for found in studies for slope in slopes(one, found)]))
        yield Verdict(
            one.name,
            "exponent of JND over standard",
            f"{exponent:.3f}",
            f"{one.exponent:g} ± {EXPONENT_MOST:g}",
            abs(exponent - one.exponent) <= EXPONENT_MOST,
        )


def group_coverage(study: str, share: float, studies: int) -> Verdict:
    """Return whether the share of the group's intervals that hold the truth is 95 %, but for chance."""
    slack = 3 * math.sqrt(0.95 * 0.05 / studies)
    limit = f"95 ± {100 * slack:.1f} %"
    what = "coverage of the group's 95 % intervals"
    return Verdict(study, what, f"{100 * share:.1f} %", limit, abs(share - 0.95) <= slack)


def spread(studies: Sequence[StudyFound], people: int) -> float:
    """Return the standard deviation of ln threshold over studies of so many participants."""
    return float(np.std([math.log(found.mean_of(people)) for found in studies], ddof=1))


def markdown(judged: Sequence[Verdict]) -> str:
    """Return a row for each value, with its limit."""
    rows = (
        f"| {one.study} | {one.what} | {one.value} | {one.limit} | {'yes' if one.holds else 'no'} |" for one in judged
    )
    return "\n".join(("| study | what | value | limit | holds |", "|---" * 5 + "|", *rows)) + "\n"


def table(judged: Sequence[Verdict]) -> bytes:
    """Return the values as CSV, a row each."""
    rows = [[one.study, one.what, one.value, one.limit, str(one.holds).lower()] for one in judged]
    return csv_text_of([["study", "what", "value", "limit", "holds"], *rows]).encode()
