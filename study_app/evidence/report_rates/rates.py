"""Rates of simulated studies: counting, comparison with limits, and tables (Markdown, CSV)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

from scipy.stats import binomtest

from study_app.analysis.planning.power_curves import interval
from study_app.store.tables.csv_files import csv_text_of

Limit: TypeAlias = Literal["none", "at most 5 %", "at least 93 %", "at least 77 %", "at most 83 %", "counted"]

Verdict: TypeAlias = Literal["yes", "no", "too few studies", "counted"]

SURE: Final = 0.999
"""Confidence of the interval that must lie beyond a limit to say that a rate does not keep to it."""

ALLOWED: Final[dict[Limit, tuple[float, float, float, float]]] = {
    "at most 5 %": (0.0, 0.05, 0.0, 0.075),
    "at least 93 %": (0.93, 1.0, 0.905, 1.0),
    "at least 77 %": (0.77, 1.0, 0.0, 1.0),
    "at most 83 %": (0.0, 0.83, 0.0, 1.0),
}
"""Of each limit the range that the interval of a rate must touch, and the range that it must not leave."""


@dataclass(frozen=True, slots=True)
class Rate:
    """Number of ``hits`` among the simulated studies ``of`` one cell."""

    cell: str
    participants: int
    what: str
    limit: Limit
    hits: int
    studies: int

    def __add__(self, other: Rate) -> Rate:
        """Return the rate of both counts together, of the same thing in the same cell."""
        return replace(self, hits=self.hits + other.hits, studies=self.studies + other.studies)

    def __str__(self) -> str:
        """Return the rate in one line."""
        low, high = (100 * end for end in self.interval)
        return (
            f"{self.cell}, n = {self.participants}: {self.what}: {self.hits} of {self.studies}, "
            f"{100 * self.share:.1f} % ({low:.1f} to {high:.1f}), {self.limit}: {self.holds}"
        )

    @property
    def share(self) -> float:
        """The share of studies."""
        return self.hits / self.studies if self.studies else 0.0

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the share."""
        return interval(self.share, self.studies) if self.studies else (0.0, 1.0)

    @property
    def holds(self) -> Verdict:
        """Whether the rate keeps to its limit.

        "yes" by the 95 % interval, "no" where even the 99.9 % interval lies beyond the limit: of a hundred rates that
        are exactly at their limit some 95 % intervals miss it by chance. Between the two there are too few studies.
        """
        if self.limit == "counted":
            return "counted"
        if self.limit == "none":
            return "no" if self.hits else "yes"
        if not self.studies:
            return "too few studies"
        lowest, highest, least, most = ALLOWED[self.limit]
        low, high = binomtest(self.hits, self.studies).proportion_ci(SURE, method="wilson")
        if high < lowest or low > highest:
            return "no"
        low, high = self.interval
        reaches = low <= highest and high >= lowest
        return "yes" if reaches and low >= least and high <= most else "too few studies"


def markdown(rates: Sequence[Rate]) -> str:
    """Return the rates, each with its Wilson interval and whether its limit holds."""
    lines = ["| studies | n | what happened | share | 95 % interval | of | limit | holds |", "|---" * 8 + "|"]
    for rate in sorted(rates, key=lambda one: (one.cell, one.what, one.participants)):
        low, high = (f"{100 * end:.1f}" for end in rate.interval)
        lines.append(
            f"| {rate.cell} | {rate.participants} | {rate.what} | {100 * rate.share:.1f} % | {low} to {high} % | "
            f"{rate.studies} | {rate.limit} | {rate.holds} |"
        )
    return "\n".join(lines) + "\n"


def table(rates: Sequence[Rate]) -> bytes:
    """Return the rates as CSV, a row each."""
    rows: list[list[object]] = [
        ["studies", "participants", "what", "limit", "hits", "of", "share", "low", "high", "holds"]
    ]
    for one in rates:
        share = (f"{number:.6f}" for number in (one.share, *one.interval))
        rows.append([one.cell, one.participants, one.what, one.limit, one.hits, one.studies, *share, one.holds])
    return csv_text_of(rows).encode()
