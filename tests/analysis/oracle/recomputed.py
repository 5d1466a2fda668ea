"""What the recomputations of a report share: its numbers, exported tables, who counts, and intervals.

Nothing of the program is imported: an error that it makes in every place is not made here.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

Floats: TypeAlias = NDArray[np.float64]
Numbers: TypeAlias = dict[str, Any]
TOLERANCE = 1e-6
SESSION = ["participant", "session"]
TRIAL = [*SESSION, "trial"]
OF_TESTS = "n dropped statistic p smallest_p effect p_adjusted members low high level".split()  # noqa: SIM905
"""Columns of tests.csv that have the names of the numbers of report.json."""


class Compared:
    """The numbers of a report that were recomputed, by place, and those that differ: (place, report, recomputed).

    ``rows`` are the recomputed numbers of the rows of tests.csv by block, question, statement and comparison,
    ``values`` each person's numbers by block and measure, for the hypotheses.
    """

    def __init__(self, folder: Path) -> None:
        report, self.codebook = (
            json.loads((folder / f"{name}.json").read_text("utf-8")) for name in ("report", "codebook")
        )
        self.folder, self.report, self.results, self.numbers = folder, report, report["results"], dict(leaves(report))
        self.places: set[str] = set()
        self.differences: list[tuple[str, Any, Any]] = []
        self.rows: dict[tuple[str, ...], Numbers] = {}
        self.values: dict[tuple[str, str], Any] = {}

    def check(self, place: str, recomputed: Mapping[str, Any], tolerance: float = TOLERANCE) -> None:
        """Compare the named numbers of a part of the report, those without "_" before their names."""
        for path, own in named(place, recomputed).items():
            if "._" not in path:
                self.places.add(path)
                self.equal(path, self.numbers.get(path), own, tolerance)

    def equal(self, path: str, told: Any, own: Any, tolerance: float = TOLERANCE) -> None:
        """Compare one number with the recomputed one; None and NaN are the same."""
        values = [math.nan if value is None else float(value) for value in (told, own)]
        if not all(map(math.isnan, values)) and not math.isclose(*values, rel_tol=tolerance, abs_tol=1e-9):
            self.differences.append((path, told, own))

    def check_tests(self) -> None:
        """Compare the rows of tests.csv with what was recomputed."""
        for row in read_csv(self.folder / "tests.csv").astype(object).fillna("").to_dict("records"):
            key = tuple(str(row[name]) for name in ("block", "question", "item", "comparison"))
            for name, value in self.rows.get(key, {"n": None}).items():
                if (column := name.removeprefix("interval.")) in OF_TESTS:
                    self.equal(f"tests.csv {key} {column}", row[column] if row[column] != "" else None, value)

    @property
    def share(self) -> float:
        """The share of the report's numbers that were recomputed."""
        return len(self.places & self.numbers.keys()) / len(self.numbers)

    def missing(self) -> Counter[str]:
        """Return how many numbers of each name were not recomputed."""
        return Counter(re.sub(r"\.\d+", "", place) for place in self.numbers.keys() - self.places)


def leaves(value: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Yield the places of all numbers in a report, and the numbers."""
    if isinstance(value, dict | list):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(part, f"{place}.{key}" if place else str(key))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place, value


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
    rows = rows.assign(excluded_session=of_session)
    return rows.assign(here=here, kept=here & ~of_trial, counts=here & ~of_trial & (rows["trial"].isna() | last))


def quartiles(values: pd.Series) -> Numbers:
    """Return quartiles and median; NaN without values."""
    return dict(zip(("q1", "median", "q3"), values.quantile([0.25, 0.5, 0.75]), strict=True))


def exact_share(count: int, n: int) -> Numbers:
    """Return the 95 % interval of Clopper and Pearson."""
    ends = stats.binomtest(count, n).proportion_ci(0.95, "exact")
    return {"low": ends.low, "high": ends.high}


def student(values: Iterable[float], level: float = 0.95) -> Numbers:
    """Return the ends of Student's interval of a mean; NaN without spread."""
    array = np.asarray(list(values), float)
    if len(array) < 2 or np.ptp(array) < 1e-9:
        return {"low": math.nan, "high": math.nan}
    return dict(
        zip(("low", "high"), stats.t.interval(level, len(array) - 1, array.mean(), stats.sem(array)), strict=True)
    )


def named(prefix: str, numbers: Mapping[str, Any]) -> Numbers:
    """Return numbers with a prefix before their names."""
    return {f"{prefix}.{name}": value for name, value in numbers.items()}


def numbered(name: str, values: Iterable[Any]) -> Numbers:
    """Return values by a name and their places."""
    return {f"{name}.{place}": value for place, value in enumerate(values)}
