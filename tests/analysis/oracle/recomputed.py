"""What the recomputations of a report share: its numbers, exported tables, who counts, and intervals.

Nothing of the program is imported: an error that it makes in every place is not made here.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

Floats: TypeAlias = NDArray[np.float64]
Numbers: TypeAlias = dict[str, Any]
SESSION = ["participant", "session"]
TRIAL = [*SESSION, "trial"]
OF_TESTS = "n dropped statistic p smallest_p effect p_adjusted members low high level".split()  # noqa: SIM905


class Compared:
    """The numbers of a report that were recomputed, by place, and those that differ: (place, report, recomputed).

    ``rows`` are the recomputed numbers of the rows of tests.csv by block, question, statement and comparison,
    ``values`` each person's numbers by block and measure, for the hypotheses.
    """

    def __init__(self, folder: Path) -> None:
        report, self.codebook = (json.loads((folder / f"{name}.json").read_bytes()) for name in ("report", "codebook"))
        self.folder, self.results, self.numbers = folder, report["results"], dict(leaves(report))
        self.places, self.differences = set[str](), list[tuple[str, Any, Any]]()
        self.rows, self.values = dict[tuple[str, ...], Numbers](), dict[tuple[str, str], Any]()

    def check(self, place: str, recomputed: Mapping[str, Any], tolerance: float = 1e-6, absolute: float = 1e-9) -> None:
        """Compare the numbers without "_" before their names with a part of the report; None and NaN are the same."""
        for path, own in named(place, recomputed).items():
            if "._" not in path:
                self.places.add(path)
                self.equal(path, self.numbers.get(path), own, tolerance, absolute)

    def equal(self, path: str, reported: Any, own: Any, tolerance: float = 1e-6, absolute: float = 1e-9) -> None:
        values = [math.nan if value is None else float(value) for value in (reported, own)]
        if not all(map(math.isnan, values)) and not math.isclose(*values, rel_tol=tolerance, abs_tol=absolute):
            self.differences.append((path, reported, own))

    def tests(self) -> pd.DataFrame:
        return read_csv(self.folder / "tests.csv").astype(object).fillna("")

    def check_tests(self) -> None:
        for row in self.tests().to_dict("records"):
            key = tuple(str(row[name]) for name in ("block", "question", "item", "comparison"))
            for name, value in self.rows.get(key, {"n": None}).items():
                if (column := name.removeprefix("interval.")) in OF_TESTS:
                    self.equal(f"tests.csv {key} {column}", row[column] if row[column] != "" else None, value)


def leaves(value: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Yield the places of all numbers in a report, and the numbers."""
    if isinstance(value, dict | list):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(part, f"{place}.{key}" if place else str(key))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place, value


def read_csv(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, na_values=["n/a"], keep_default_na=False, low_memory=False)


def read_table(folder: Path, name: str, study: Path) -> pd.DataFrame:
    """Read an exported table; read exclusions from the list in the study folder.

    ``here`` are the rows of complete sessions that are not excluded, ``kept`` those whose trial is not excluded either,
    ``counts`` of these answers to forms, and last attempts at main trials.
    """
    (path,) = folder.glob(f"*_description-{name}_data.csv")
    rows, exclusion_list = read_csv(path), study / "exclusions.csv"
    excluded = read_csv(exclusion_list) if exclusion_list.exists() else pd.DataFrame(columns=TRIAL)
    parts = (SESSION, excluded[excluded["trial"].isna()]), (TRIAL, excluded.dropna(subset="trial"))
    of_session, of_trial = (rows.set_index(keys).index.isin(some.set_index(keys).index) for keys, some in parts)
    here = rows["session_status"].isin(["completed", "incomplete"]) & ~of_session
    rows = rows.assign(here=here, kept=here & ~of_trial, excluded_session=of_session)
    rows["last_attempt"] = rows.groupby(TRIAL)["attempt"].transform("max")
    last = (rows["attempt"] == rows["last_attempt"]) & (rows["phase"] == "main")
    return rows.assign(counts=rows["kept"] & (rows["trial"].isna() | last))


def quartiles(values: pd.Series) -> Numbers:
    return dict(zip(("q1", "median", "q3"), values.quantile([0.25, 0.5, 0.75]), strict=True))


def exact_share(count: int, n: int) -> Numbers:
    return stats.binomtest(count, n).proportion_ci(0.95, "exact")._asdict()


def student(values: Iterable[float], level: float = 0.95) -> Numbers:
    """Return the ends of Student's interval of a mean; NaN without spread."""
    array, ends = np.asarray([*values], float), (math.nan, math.nan)
    if len(array) > 1 and np.ptp(array) >= 1e-9:
        ends = stats.t.interval(level, len(array) - 1, array.mean(), stats.sem(array))
    return dict(zip(("low", "high"), ends, strict=True))


def named(prefix: str, numbers: Mapping[str, Any] | Iterable[tuple[int, Any]]) -> Numbers:
    return {f"{prefix}.{name}": value for name, value in dict(numbers).items()}
