"""What the recomputations of a report share: its numbers, exported tables, who counts, signed ranks, corrections.

Nothing of the program is imported: an error that it makes in every place is not made here.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats
from statsmodels.stats.multitest import multipletests

Floats: TypeAlias = NDArray[np.float64]
Numbers: TypeAlias = dict[str, Any]
TOLERANCE = 1e-6
TIED = 1e-9
"""Sums of ranks that differ by less are equal."""
SESSION = ["participant", "session"]
TRIAL = [*SESSION, "trial"]
OF_TESTS = ("n", "dropped", "statistic", "p", "smallest_p", "effect", "p_adjusted", "members")
"""Columns of tests.csv that have the names of the numbers of report.json."""


@dataclass
class Compared:
    """The numbers of a report that were recomputed, by place, and those that differ: (place, report, recomputed).

    ``rows`` are the recomputed numbers of the rows of tests.csv by block, question, statement and comparison,
    ``values`` each person's numbers by block and measure, for the hypotheses.
    """

    folder: Path
    report: Numbers
    codebook: Numbers
    places: set[str] = field(default_factory=set)
    differences: list[tuple[str, Any, Any]] = field(default_factory=list)
    rows: dict[tuple[str, ...], Numbers] = field(default_factory=dict)
    values: dict[tuple[str, str], Any] = field(default_factory=dict)

    def check(self, place: str, recomputed: Mapping[str, Any], tolerance: float = TOLERANCE) -> None:
        """Compare the named numbers of a part of the report; None and NaN are the same."""
        for name, own in recomputed.items():
            path, told = f"{place}.{name}", self.report
            for key in path.split("."):
                told = told[int(key)] if isinstance(told, list) else told.get(key) if told else None  # type: ignore[assignment]
            self.places.add(path)
            self.equal(path, told, own, tolerance)

    def equal(self, path: str, told: Any, own: Any, tolerance: float = TOLERANCE) -> None:
        """Compare one number with the recomputed one."""
        values = [math.nan if value is None else float(value) for value in (told, own)]
        if not all(map(math.isnan, values)) and not math.isclose(*values, rel_tol=tolerance, abs_tol=1e-9):
            self.differences.append((path, told, own))

    def check_tests(self) -> None:
        """Compare the rows of tests.csv with what was recomputed."""
        for row in read_csv(self.folder / "tests.csv").to_dict("records"):
            parts = (row[name] for name in ("block", "question", "item", "comparison"))
            key = tuple("" if pd.isna(part) else str(part) for part in parts)
            own = self.rows.get(key, {"n": None})
            for name, value in own.items():
                if (column := name.removeprefix("interval.")) in (*OF_TESTS, "low", "high", "level"):
                    self.equal(f"tests.csv {key} {column}", row[column], value)

    @property
    def results(self) -> Numbers:
        """The results of the report."""
        return dict(self.report["results"])

    @property
    def share(self) -> float:
        """The share of the report's numbers that were recomputed."""
        return len(self.places.intersection(leaves(self.report))) / len(set(leaves(self.report)))

    def missing(self) -> Counter[str]:
        """Return how many numbers of each name were not recomputed."""
        return Counter(re.sub(r"\.\d+", "", place) for place in leaves(self.report) if place not in self.places)


def leaves(value: Any, place: str = "") -> Iterator[str]:
    """Yield the places of all numbers in a report."""
    if isinstance(value, dict | list):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(part, f"{place}.{key}" if place else str(key))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place


def read_csv(path: Path) -> pd.DataFrame:
    """Read a table of the program."""
    return pd.read_csv(path, na_values=["n/a"], keep_default_na=False, low_memory=False)


def read_table(folder: Path, name: str, study: Path) -> pd.DataFrame:
    """Read an exported table; what is excluded is read from the list in the study's own folder.

    ``here`` are the rows of complete sessions that are not excluded, ``kept`` those whose trial is not excluded either,
    ``counts`` of these answers to forms, and last attempts at main trials.
    """
    (path,) = folder.glob(f"*_description-{name}_data.csv")
    rows, listed = read_csv(path), study / "exclusions.csv"
    excluded = set(read_csv(listed)[TRIAL].fillna(0).itertuples(index=False, name=None)) if listed.exists() else set()
    of_session, of_trial = (
        np.array([key in excluded for key in rows[TRIAL].assign(**change).itertuples(index=False, name=None)])
        for change in ({"trial": 0}, {})
    )
    here = rows["session_status"].isin(["completed", "incomplete"]) & ~of_session
    last = (rows["attempt"] == rows.groupby(TRIAL)["attempt"].transform("max")) & (rows["phase"] == "main")
    return rows.assign(here=here, kept=here & ~of_trial, counts=here & ~of_trial & (rows["trial"].isna() | last))


def quartiles(values: pd.Series) -> Numbers:
    """Return quartiles and median; NaN without values."""
    return {"q1": values.quantile(0.25), "median": values.median(), "q3": values.quantile(0.75)}


def exact_share(count: int, n: int) -> Numbers:
    """Return the 95 % interval of Clopper and Pearson."""
    ends = stats.binomtest(count, n).proportion_ci(0.95, "exact")
    return {"low": ends.low, "high": ends.high}


def student(values: Iterable[float], level: float = 0.95) -> Numbers:
    """Return the ends of Student's interval of a mean; NaN without spread."""
    array = np.asarray(list(values), float)
    if len(array) < 2 or np.ptp(array) <= TIED:
        return {"low": math.nan, "high": math.nan}
    low, high = stats.t.interval(level, len(array) - 1, array.mean(), stats.sem(array))
    return {"low": low, "high": high}


def adjusted(ps: Sequence[float | None], method: str = "holm") -> list[float]:
    """Return adjusted p; a test without p is a member of the family."""
    known = np.array([math.nan if p is None else p for p in ps], float)
    found = multipletests(np.nan_to_num(known, nan=1.0), method=method)[1] if len(known) else known
    return list(np.where(np.isnan(known), math.nan, found))


def share_of_signs(sizes: Floats, total: float) -> float:
    """Return the share of all choices among ``sizes`` whose sum is at least ``total``."""
    sums = np.zeros(1)
    for size in sizes:
        sums = np.concatenate([sums, sums + size])
    return float((sums >= total - TIED).mean())


def signed_ranks(all_differences: pd.Series) -> Numbers:
    """Return Wilcoxon's signed ranks with the distribution of all signs, zeros left out."""
    differences = all_differences.dropna()
    nonzero = differences[differences != 0].to_numpy()
    ranks, n = stats.rankdata(np.abs(nonzero)), len(nonzero)
    statistic, total = ranks[nonzero > 0].sum(), ranks.sum()
    found = {"n": len(differences), "dropped": len(all_differences) - len(differences), "zeros": len(differences) - n}
    found |= {"superiority": np.sign(differences).mean(), "median_difference": differences.median()}
    if not n:
        return found | dict.fromkeys(("statistic", "effect", "p", "smallest_p"), math.nan)
    effect, tail = (2 * statistic - total) / total, max(statistic, total - statistic)
    found |= {"statistic": statistic, "effect": effect, "p": min(1.0, 2 * share_of_signs(ranks, tail))}
    found["smallest_p"] = min(1.0, 2 * share_of_signs(ranks, total))
    if n >= 6 and abs(effect) < 1:
        reach = stats.norm.ppf(0.975) * math.sqrt((2 * n**3 + 3 * n**2 + n) / 6) / (n * (n + 1) / 2)
        ends = {"low": math.tanh(math.atanh(effect) - reach), "high": math.tanh(math.atanh(effect) + reach)}
        found |= named("interval", ends | {"level": 0.95})
    return found


def named(prefix: str, numbers: Mapping[str, Any]) -> Numbers:
    """Return numbers with a prefix before their names."""
    return {f"{prefix}.{name}": value for name, value in numbers.items()}


def numbered(name: str, values: Iterable[Any]) -> Numbers:
    """Return values by a name and their places."""
    return {f"{name}.{place}": value for place, value in enumerate(values)}
