"""A study and its report in numbers, and how sentences write numbers."""

import csv
import io
import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from scipy.stats import binom

from study_app.analysis.data.study_tables import Study
from study_app.analysis.report.write_report import as_json_types, tests_csv
from study_app.analysis.results import Results

WORDS: Final = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"]
N: Final = r"(\d+|[A-Za-z]+)"
"""A count, in digits or as a word."""
R: Final = r"(−?\d+(?:\.\d+)?)"
"""A number with a real minus sign."""
P: Final = r"p ([<>=] \.\d{3})"
ENDS: Final = rf"\[{R}, {R}\]"
ITEM: Final = r"“\w+”"
LEAD: Final = r"Block(?: \(\w+\))?: "
DECIDED: Final = ("shown", "suggested")


@dataclass(frozen=True)
class ReportNumbers:
    """A study and the numbers in its report."""

    study: Study
    evaluated: Results
    only: int | None = None
    """The hypothesis that the sentences are about; None: all of them."""

    @cached_property
    def results(self) -> dict[str, Any]:
        """The results in report.json."""
        return json.loads(json.dumps(as_json_types(self.evaluated)))  # type: ignore[no-any-return]

    @cached_property
    def rows(self) -> list[dict[str, str]]:
        """The rows of tests.csv."""
        rows = csv.DictReader(io.StringIO(tests_csv(self.evaluated).decode()))
        return [{name: "" if cell == "n/a" else cell for name, cell in row.items()} for row in rows]

    @property
    def block(self) -> dict[str, Any]:
        """Return the only block."""
        return self.results["blocks"][0]  # type: ignore[no-any-return]

    @property
    def alpha(self) -> float:
        """The alpha that decides."""
        return float(self.results["decided"]["alpha"])

    @property
    def against(self) -> list[dict[str, Any]]:
        """The comparisons with the shortest delay."""
        return self.block["against"]  # type: ignore[no-any-return]

    @property
    def contrasts(self) -> list[dict[str, Any]]:
        """The hypotheses."""
        contrasts: list[dict[str, Any]] = self.results.get("contrasts", [])
        return contrasts if self.only is None else [contrasts[self.only]]

    @property
    def of_statements(self) -> list[dict[str, str]]:
        """The tests of single statements that the test over all statements gates."""
        return [*self.test_rows("conditions differ"), *self.test_rows("answers follow the delay")]

    @property
    def p_over_all(self) -> float:
        """The p of the test over all statements."""
        return float(self.test_rows("conditions differ, all statements")[0]["p"])

    def test_rows(self, question: str) -> list[dict[str, str]]:
        """Return the rows of tests.csv that answer a question."""
        return [row for row in self.rows if row["question"] == question]

    def lowest(self) -> dict[str, float]:
        """Return of each statement with a trend the shortest delay whose steps are all significant, by item."""
        trends = {row["item"]: row for row in self.test_rows("answers follow the delay")}
        delays = {}
        for row in self.test_rows("answers change with the delay, step-down test"):
            step = float(row["comparison"].removeprefix("up to ").removesuffix(" ms"))
            if float(row["p"] or 1) > self.alpha / int(trends[row["item"]]["members"]):
                delays.setdefault(row["item"], math.nan)  # the first that fails ends them
            elif not math.isnan(delays.get(row["item"], 0.0)) or row["item"] not in delays:
                delays[row["item"]] = step if not math.isnan(delays.get(row["item"], step)) else math.nan
        return delays


Check = Callable[[re.Match[str], ReportNumbers], bool]


def count(text: str) -> int:
    """Return a count that is written in digits or as a word."""
    return int(text) if text.isdigit() else WORDS.index(text.lower())


def is_number(text: str, value: float) -> bool:
    """Return whether a number is a value as rounded to the digits that are shown, three significant ones at most."""
    decimals = len(text.partition(".")[2])
    digits = text.strip("−").replace(".", "").lstrip("0")
    rounded = abs(float(text.replace("−", "-")) - value) <= 0.5 * 10**-decimals * (1 + 1e-9)
    return rounded and (len(digits) <= 3 or not decimals)


def is_p(text: str, p: float) -> bool:
    """Return whether "= .023", "< .001" or "> .999" is p."""
    sign, _, number = text.partition(" ")
    return {"<": p < 0.001, ">": p > 0.999, "=": abs(p - float(number)) <= 0.0005 + 1e-9}[sign]


def position(contrast: Mapping[str, Any]) -> str:
    """Return where the interval of a comparison lies: "within" the bound, "beyond" it, or "across"."""
    ends, bound = contrast["found"]["interval"], contrast["found"]["bound"]
    effect = contrast["found"]["effect"]
    if ends is None and (effect is None or 0.5 ** contrast["found"]["n"] > contrast["found"]["alpha"]):
        return "across"
    low, high = (effect, effect) if ends is None else (ends["low"], ends["high"])
    if low > bound + 1e-9 or high < -bound - 1e-9:
        return "beyond"
    return "within" if -bound < low and high < bound else "across"


def beyond(report: ReportNumbers) -> int:
    """Return how many comparisons lie beyond the bound."""
    return sum(position(contrast) == "beyond" for contrast in report.against)


def inconclusive(report: ReportNumbers) -> int:
    """Return how many comparisons are neither equivalent nor beyond the bound."""
    return sum(
        contrast["found"]["verdict"] != "equivalent" and position(contrast) != "beyond" for contrast in report.against
    )


def fewest(alpha: float, share: float) -> int:
    """Return the smallest sample that includes at least one of a minority with probability 1 − alpha."""
    return next(n for n in range(1, 10_000) if binom.pmf(0, n, share) <= alpha * (1 + 1e-9))


def names_in(text: str) -> set[str]:
    """Return the statements that a text names."""
    return {name.lower() for name in re.findall(r"“(\w+)”", text)}


def listed_in(text: str) -> set[str]:
    """Return the parts of "a, b and c"."""
    return set(re.split(r", | and ", text))


def short_delay(report: ReportNumbers) -> float:
    """Return the shortest delay."""
    return min(setting["delay_ms"] or 0.0 for setting in report.block["settings"])


def short_of(report: ReportNumbers, item: str) -> str:
    """Return the short text of a statement."""
    return next(item_facts["short"] for item_facts in report.block["items"] if item_facts["id"] == item)


def people(report: ReportNumbers) -> int:
    """Return how many participants have answers that count."""
    return len(report.study.people)


def always(_match: re.Match[str], _report: ReportNumbers) -> bool:
    """A sentence without a number from the study."""
    return True


def when(holds: Callable[[ReportNumbers], bool]) -> Check:
    """Return the check that something holds of the study."""
    return lambda _match, report: holds(report)
