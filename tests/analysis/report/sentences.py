"""Every sentence of the first page, the limits and the methods as a template, with a check of what it claims.

A template is a regular expression and a function that recomputes the claim from report.json, tests.csv and the
answers. `check` refuses a sentence that has no template.
"""

import csv
import io
import json
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from scipy.stats import binom, binomtest
from scipy.stats import t as student

from study_app import __version__
from study_app.analysis.data.study_tables import Study
from study_app.analysis.report.sections import CLAIMS
from study_app.analysis.report.write_report import as_json_types, tests_csv
from study_app.analysis.results import Results
from study_app.analysis.statistics.mean_tests import Means, means_of, p_differs, resamples_for

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
class Told:
    """A study and what its report holds in numbers."""

    study: Study
    found: Results
    only: int | None = None
    """The hypothesis that the sentences are about; None: all of them."""

    @cached_property
    def results(self) -> dict[str, Any]:
        """The results in report.json."""
        return json.loads(json.dumps(as_json_types(self.found)))  # type: ignore[no-any-return]

    @cached_property
    def rows(self) -> list[dict[str, str]]:
        """The rows of tests.csv."""
        rows = csv.DictReader(io.StringIO(tests_csv(self.found).decode()))
        return [{name: "" if cell == "n/a" else cell for name, cell in row.items()} for row in rows]

    @property
    def block(self) -> dict[str, Any]:
        """The one block."""
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
        return [*self.asked("settings differ"), *self.asked("answers follow the delay")]

    @property
    def p_over_all(self) -> float:
        """The p of the test over all statements."""
        return float(self.asked("settings differ, all statements")[0]["p"])

    def asked(self, question: str) -> list[dict[str, str]]:
        """Return the rows of tests.csv that answer a question."""
        return [row for row in self.rows if row["question"] == question]

    def lowest(self) -> dict[str, float]:
        """Return of each statement with a trend the shortest delay whose steps are all significant, by item."""
        trends = {row["item"]: row for row in self.asked("answers follow the delay")}
        found = {}
        for row in self.asked("answers change with the delay, step-down test"):
            step = float(row["comparison"].removeprefix("up to ").removesuffix(" ms"))
            if float(row["p"] or 1) > self.alpha / int(trends[row["item"]]["members"]):
                found.setdefault(row["item"], math.nan)  # the first that fails ends them
            elif not math.isnan(found.get(row["item"], 0.0)) or row["item"] not in found:
                found[row["item"]] = step if not math.isnan(found.get(row["item"], step)) else math.nan
        return found


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


def position(one: Mapping[str, Any]) -> str:
    """Return where the interval of a comparison lies: "within" the bound, "beyond" it, or "across"."""
    ends, bound = one["found"]["interval"], one["found"]["bound"]
    effect = one["found"]["effect"]
    if ends is None and (effect is None or 0.5 ** one["found"]["n"] > one["found"]["alpha"]):
        return "across"
    low, high = (effect, effect) if ends is None else (ends["low"], ends["high"])
    if low > bound + 1e-9 or high < -bound - 1e-9:
        return "beyond"
    return "within" if -bound < low and high < bound else "across"


def beyond(told: Told) -> int:
    """Return how many comparisons lie beyond the bound."""
    return sum(position(one) == "beyond" for one in told.against)


def inconclusive(told: Told) -> int:
    """Return how many comparisons are neither equivalent nor beyond the bound."""
    return sum(one["found"]["verdict"] != "equivalent" and position(one) != "beyond" for one in told.against)


def fewest(alpha: float, share: float) -> int:
    """Return of how many people at least one is of a minority, with a probability of 1 − alpha."""
    return next(n for n in range(1, 10_000) if binom.pmf(0, n, share) <= alpha * (1 + 1e-9))


def names_in(text: str) -> set[str]:
    """Return the statements that a text names."""
    return {name.lower() for name in re.findall(r"“(\w+)”", text)}


def short_delay(told: Told) -> float:
    """Return the shortest delay."""
    return min(one["delay_ms"] or 0.0 for one in told.block["settings"])


# ----------------------------------------------------------------------------------------------- first page: delays


def trend_is_shown(match: re.Match[str], told: Told) -> bool:
    """Check the shortest delay with a trend, and the correlations."""
    shortest, at, rated = match.groups()
    lowest = {item: delay for item, delay in told.lowest().items() if not math.isnan(delay)}
    primary = {row["item"]: row["primary"] == "true" for row in told.asked("answers follow the delay")}
    of = [item for item in lowest if primary[item]] or list(lowest)
    if float(at) != min(lowest[item] for item in of) or float(shortest) != short_delay(told):
        return False
    falling = told.results["decided"]["falling"]
    told_of = re.findall(rf"(higher|lower) on “(\w+)” \(mean rank correlation {R}, {P}, n = (\d+)\)", rated)
    for side, item, number, p, n in told_of:
        (row,) = (
            row
            for row in told.asked("answers change with the delay, step-down test")
            if row["item"] == item.lower() and row["comparison"] == f"up to {at} ms"
        )
        effect = float(row["effect"]) * (-1 if item.lower() in falling else 1)
        if not is_number(number, effect) or (side == "higher") != (effect > 0):
            return False
        if not is_p(p, float(row["p"])) or n != row["n"]:
            return False
    return len(told_of) == rated.count("correlation") > 0


def trend_is_corrected(match: re.Match[str], told: Told) -> bool:
    """Check the criterion for the p values of trends, which are corrected over the statements."""
    members = {int(row["members"]) for row in told.asked("answers follow the delay") if row["item"] in told.lowest()}
    return members == {count(match[1]), int(match[4])} and all(
        math.isclose(float(text), alpha, rel_tol=6e-3)
        for text, alpha in ((match[3], told.alpha), (match[2], told.alpha / int(match[4])))
    )


def nothing_noticed(_match: re.Match[str], told: Told) -> bool:
    """Check that no delay has a trend."""
    return all(math.isnan(delay) for delay in told.lowest().values())


def nothing_equivalent(match: re.Match[str], told: Told) -> bool:
    """Check that not all statements are equivalent at the shortest of the delays that are compared."""
    first = min(one["delay_ms"] for one in told.against)
    at_first = [one for one in told.against if one["delay_ms"] == first]
    tested = told.against[0]["found"]
    bound, least = tested["bound"], fewest(tested["alpha"], min(1 / 5, tested["bound"] / 6))
    return (
        match["fewest"] == (str(least) if told.block["n"] < least else None)
        and float(match[1]) == bound
        and float(match[2]) == short_delay(told)
        and not all(one["found"]["verdict"] == "equivalent" for one in at_first)
    )


def all_equivalent(match: re.Match[str], told: Told) -> bool:
    """Check that all statements are equivalent up to a delay, and not up to the next."""
    up_to, _, bound, control, percent = match.groups()
    within = [one for one in told.against if one["delay_ms"] <= float(up_to)]
    after = [one for one in told.against if one["delay_ms"] > float(up_to)]
    following = [one for one in after if one["delay_ms"] == min((it["delay_ms"] for it in after), default=0)]
    most = max(one["found"]["beyond"]["interval"]["high"] for one in within)
    return (
        all(one["found"]["verdict"] == "equivalent" and position(one) != "beyond" for one in within)
        and (not following or not all(one["found"]["verdict"] == "equivalent" for one in following))
        and float(bound) == within[0]["found"]["bound"]
        and float(control) == short_delay(told)
        and abs(float(percent) - 100 * most) <= 0.5
    )


def threshold_is_told(match: re.Match[str], told: Told) -> bool:
    """Check the detection threshold, its interval and how many answers agree there."""
    found, (at, ends, n, percent, item) = told.block["threshold"], match.groups()
    known = found["interval"]
    interval = [] if known is None else re.findall(R, ends.partition("[")[2])
    return (
        is_number(at, found["effect"])
        and int(n) == found["n"]
        and is_number(percent, 100 * (found["guess"] + (1 - found["guess"] - found["lapse"]) / 2))
        and names_in(item) == {told.results["decided"]["noticed"]}
        and (known is None or all(map(is_number, interval, (known["low"], known["high"]))))
    )


def largest_difference(match: re.Match[str], told: Told) -> bool:
    """Check that no mean difference from the shortest delay is larger, and its interval."""
    mean, item, at, percent, low, high, n = match.groups()
    known = [one for one in told.against if one["found"]["interval"] is not None]
    (one,) = (it for it in known if {it["item"]} == names_in(item) and it["delay_ms"] == float(at))
    ends = one["found"]["interval"]
    return (
        abs(one["found"]["effect"]) >= max(abs(it["found"]["effect"]) for it in known)
        and is_number(mean, one["found"]["effect"])
        and (is_number(low, ends["low"]) and is_number(high, ends["high"]))
        and (is_number(percent, 100 * ends["level"]) or 100 * ends["level"] > float(percent))
        and int(n) == one["found"]["n"]
    )


# ---------------------------------------------------------------------------------------------- first page: liquids


def recognised(told: Told) -> set[str]:
    """Return the names of the liquids that are recognised."""
    named = told.block["named"]
    if named is None or named["verdict"] not in DECIDED:
        return set()
    rates = [rate for rate in named["found"]["rates"] if rate["p_adjusted"] is not None]
    return {told.block["names"][rate["setting"]].lower() for rate in rates if rate["p_adjusted"] <= told.alpha}


def names_are_counted(match: re.Match[str], told: Told) -> bool:
    """Check how many names are right, and how many would be by chance."""
    overall, hits, n, more, expected, p = match.groups()
    is_shown = told.block["named"]["verdict"] in DECIDED
    rates, found = told.block["named"]["found"]["rates"], told.block["named"]["found"]
    return (
        (overall, more) == (("Overall, p", ", more than the ") if is_shown else ("P", " ("))
        and int(hits) == sum(rate["hits"] for rate in rates)
        and int(n) == sum(rate["n"] for rate in rates)
        and is_number(expected, found["expected"])
        and is_p(p, found["p"])
    )


def listed_in(text: str) -> set[str]:
    """Return the parts of "a, b and c"."""
    return set(re.split(r", | and ", text))


def pairs_differ(match: re.Match[str], told: Told) -> bool:
    """Check that each named pair is significant in a statement, in the verdict of the first page."""
    names = {setting["code"]: name.lower() for setting, name in
             zip(told.block["settings"], told.block["names"], strict=True)}  # fmt: skip
    question = "settings differ" if len(names) == 2 else "two settings differ"
    found: dict[str, set[tuple[str, str]]] = {"shown": set(), "suggested": set()}
    verdicts = {row["verdict"] for row in (*told.asked("settings differ"), *told.asked(question))}
    for row in told.asked(question):
        if row["verdict"] in found and float(row["p_adjusted"]) <= told.alpha:
            pair = " and ".join(names[code] for code in row["codes"].split())
            found[row["verdict"]].add((pair, row["item"]))
    stated = "shown" if "shown" in verdicts or _recognition_shown(told) else "suggested"
    told_pairs = re.findall(r"between ([^(]+) \(([^)]*)\)", match[1])
    return {(pair, item) for pair, items in told_pairs for item in names_in(items)} == found[stated]


def largest_of_settings(match: re.Match[str], told: Told) -> bool:
    """Check that no mean difference from the first setting is larger in a statement with a difference."""
    first, mean, item, other, low, high, n = match.groups()
    block = told.block
    names = {it["code"]: text.lower() for it, text in zip(block["settings"], block["names"], strict=True)}
    rows = told.asked("settings differ")
    verdicts = {row["verdict"] for row in (*rows, *told.asked("two settings differ"))}
    stated = "shown" if "shown" in verdicts or _recognition_shown(told) else "suggested"
    differing = {row["item"] for row in rows if row["verdict"] == stated}
    known = [effect for effect in block["effects"] if effect["item"] in differing]
    (named,) = (it for it in known if {it["item"]} == names_in(item) and names[it["code"]] == other)
    return (
        first == block["names"][0].lower()
        and all(abs(effect["mean"]) <= abs(named["mean"]) for effect in known)
        and is_number(mean, named["mean"])
        and (is_number(low, named["low"]) and is_number(high, named["high"]))
        and int(n) == named["n"]
    )


def _recognition_shown(told: Told) -> bool:
    return bool(recognised(told)) and told.block["named"]["verdict"] == "shown"


def statements_differ(match: re.Match[str], told: Told) -> bool:
    """Check that the named statements show a difference."""
    rows = {row["item"]: row for row in told.asked("settings differ")}
    return all(float(rows[item]["p_adjusted"]) <= told.alpha for item in names_in(match[1]))


def no_statement_differs(_match: re.Match[str], told: Told) -> bool:
    """Check that nothing is significant in the verdict of the first page."""
    rows = [*told.asked("settings differ"), *told.asked("two settings differ")]
    shown = [row for row in rows if row["verdict"] in DECIDED]
    return not shown or (_recognition_shown(told) and all(row["verdict"] == "suggested" for row in shown))


def agreed(match: re.Match[str], told: Told) -> bool:
    """Check how many answers to a statement are above the neutral level, with the exact interval of their share."""
    (item,) = (one["id"] for one in told.block["items"] if one["short"] == match["short"])
    values = told.study.responses.loc[told.study.responses["item"] == item, "response"].dropna().astype(int)
    above, n = int((values > 4).sum()), len(values)
    exact = binomtest(above, n).proportion_ci()
    ends = (exact.low, exact.high)
    shown = [match[end] for end in ("low", "high")]
    return (
        (int(match["agreed"]), int(match["n"])) == (above, n)
        and abs(float(match["share"]) - 100 * above / n) <= 0.5
        and (shown[0] is None or all(abs(int(text) - 100 * end) < 0.501 for text, end in zip(shown, ends, strict=True)))
    )


# ------------------------------------------------------------------------------------------------------- hypotheses


def short_of(told: Told, item: str) -> str:
    """Return the short text of a statement."""
    return next(one["short"] for one in told.block["items"] if one["id"] == item)


def p_before_the_adjustment(match: re.Match[str], told: Told) -> bool:
    """Check the largest p of the tests of a hypothesis, which the adjustment alone makes too large."""
    (one,) = told.contrasts
    ps = [one[name] for name in ("p", "p_bootstrap", "p_skewed") if one[name] is not None]
    return (
        int(match[1]) == len(told.results["contrasts"])
        and is_p(match[2], max(ps))
        and max(ps) <= 0.05 < one["p_adjusted"]
        and one["verdict"] not in DECIDED
    )


def contrast_is_tested(match: re.Match[str], told: Told) -> bool:
    """Check every number of a hypothesis, and its verdict."""
    (one,) = told.contrasts
    shown, lower, means, effect, size = (match[name] for name in ("shown", "lower", "means", "effect", "size"))
    sides = [np.array([*side["values"].values()]) for side in one["sides"]]
    differences, within = contrast_values(told, one), one["contrast"]["groups"] is None
    mean = float(differences.mean()) if within else float(sides[0].mean() - sides[1].mean())
    standard = mean / differences.std(ddof=1) if within else hedges_g(*sides)
    return (
        f"“{short_of(told, one['contrast']['measure'])}”" in match[0]
        and all(name in match[0] for name in one["compared"])
        and (not within or np.allclose(np.sort(sides[0] - sides[1]), np.sort(differences)))
        and all(mean_holds(text, side) for text, side in zip(means.split(" and "), sides, strict=True))
        and (match["adjusted"] is not None) == (len(told.results["contrasts"]) > 1)
        and (match["unadjusted"] is None) == (match["adjusted"] is None)
        and [match[side] is None for side in ("two", "one")] == [one["contrast"]["expected"] is None] * 2
        and is_number(effect, one["effect"])
        and is_number(effect, mean)
        and is_number(match["low"], one["interval"]["low"])
        and is_number(match["high"], one["interval"]["high"])
        and match["name"] == ("d_z" if within else "g")
        and is_number(size, standard)
        and is_number(size, one["standardised"]["value"])
        and is_p(match["p"], one["p_adjusted"])
        and int(match["n"]) == one["n"]
        and (shown is not None) == (one["verdict"] in DECIDED) == (one["p_adjusted"] <= told.alpha)
        and (shown is None or (shown == "higher") == (mean > 0))
        and (shown is not None or lower == one["contrast"]["expected"])
    )


def mean_holds(text: str, values: np.ndarray) -> bool:
    """Return whether a text is the mean of values, and Student's interval if it gives one."""
    mean, *ends = re.findall(R, text)
    half = student.ppf(0.975, len(values) - 1) * values.std(ddof=1) / math.sqrt(len(values))
    expected = (values.mean() - half, values.mean() + half)
    return is_number(mean, values.mean()) and all(map(is_number, ends, expected[: len(ends)]))


def hedges_g(first: np.ndarray, second: np.ndarray) -> float:
    """Return the standardised difference of two groups, corrected for its bias by the usual approximation."""
    freedom = len(first) + len(second) - 2
    squares = sum(((one - one.mean()) ** 2).sum() for one in (first, second))
    exact = math.gamma(freedom / 2) / math.sqrt(freedom / 2) / math.gamma((freedom - 1) / 2)
    return float((first.mean() - second.mean()) / math.sqrt(squares / freedom) * exact)


def higher_for_so_many(match: re.Match[str], told: Told) -> bool:
    """Check for how many participants the first is higher."""
    (one,) = told.contrasts
    differences = contrast_values(told, one)
    return match[1] == one["compared"][0] and (int(match[2]), int(match[3]), int(match[4] or 0)) == (
        int((differences > 0).sum()),
        len(differences),
        int((differences == 0).sum()),
    )


def bayes_factor(match: re.Match[str], told: Told) -> bool:
    """Check the Bayes factor of a hypothesis that was not shown, and which side it favours."""
    (one,) = told.contrasts
    factor = one["bayes_factor"]
    return (
        one["verdict"] not in DECIDED
        and math.isclose(float(match[1]), max(factor, 1 / factor), rel_tol=6e-3)
        and (match[2] == "with") == (factor > 1) == (" as without one" in match[0])
        and (match[3] is not None) == (1 / 3 < factor < 3)
    )


def contrast_values(told: Told, one: Mapping[str, Any]) -> np.ndarray:
    """Return the differences of each participant's median answers under two conditions; of all, between groups."""
    rows = told.study.responses[told.study.responses["item"] == one["contrast"]["measure"]].dropna(subset=["response"])
    delays = {it["code"]: it["delay_ms"] for it in told.block["settings"]}
    if told.block["kind"] == "delays":
        rows = rows.assign(code=[f"{delays[code]:g}" for code in rows["code"]])
    medians = rows.astype({"response": float}).groupby(["participant", "code"])["response"].median().unstack()
    if one["contrast"]["conditions"] is None:
        return medians.mean(axis=1).dropna().to_numpy()  # type: ignore[no-any-return]
    codes = {it["condition"]: it["code"] for it in told.block["settings"]}
    first, second = (codes[condition] for condition in one["contrast"]["conditions"])
    if told.block["kind"] == "delays":
        first, second = f"{delays[first]:g}", f"{delays[second]:g}"
    return (medians[first] - medians[second]).dropna().to_numpy()  # type: ignore[no-any-return]


def bound_of_a_contrast(where: str) -> Callable[[re.Match[str], Told], bool]:
    """Return the check that a hypothesis with a bound lies there: its interval, or the difference of all."""

    def check_bound(match: re.Match[str], told: Told) -> bool:
        found = set()
        if match[0].startswith("The mean difference lies within"):
            assert any(one["equivalent"] and is_p(match[1], one["p_equivalent"]) for one in told.contrasts)
        for one in told.contrasts:
            if (bound := one["contrast"]["bound"]) is not None and one["effect"] is not None:
                ends = one["interval"] or {"low": one["effect"], "high": one["effect"]}
                few = one["interval"] is None and 0.5 ** one["n"] > 0.05
                outside = not few and (ends["low"] > bound or ends["high"] < -bound)
                found.add("beyond" if outside else "within" if one["equivalent"] else "neither")
                assert not (outside and one["equivalent"])
                assert not one["equivalent"] or one["p_equivalent"] <= told.alpha
            elif bound is not None:
                found.add("neither")
        return where in found

    return check_bound


def contrast_is_untested(_match: re.Match[str], told: Told) -> bool:
    """Check that a hypothesis has no p."""
    return any(one["p"] is None and one["verdict"] in ("not tested", "equivalent") for one in told.contrasts)


# ------------------------------------------------------------------------------------------------------------ looks


def look(number: Callable[[Told], bool]) -> Callable[[re.Match[str], Told], bool]:
    """Return the check that the planned looks are named and the study is at one of this kind."""

    def check_look(match: re.Match[str], told: Told) -> bool:
        looks = told.results["decided"]["looks"]
        return [int(one) for one in re.findall(r"\d+", match["looks"])] == looks and number(told)

    return check_look


def people(told: Told) -> int:
    """Return how many participants have answers that count."""
    return len(told.study.people)


def alpha_here(match: re.Match[str], told: Told) -> bool:
    """Check the alpha of this look."""
    return math.isclose(float(match[1]), told.alpha, rel_tol=6e-3)


def alphas_of_looks(match: re.Match[str], told: Told) -> bool:
    """Check the alphas of all looks, of which the last is the largest below the alpha of all."""
    alphas = [float(one) for one in re.findall(r"0\.\d+", match[1])]
    total = told.results["decided"]["planned_alpha"] or told.alpha
    return len(alphas) == len(told.results["decided"]["looks"]) and alphas == sorted(alphas) and alphas[-1] <= total


# ----------------------------------------------------------------------------------------------------------- limits


def claims(match: re.Match[str], told: Told) -> bool:
    """Check the rate of empty studies that claim something."""
    studies, n, percent, reports = (match[place] for place in (1, 2, 3, 4))
    return CLAIMS[int(n)] == (int(reports), int(studies)) and is_number(percent, 100 * int(reports) / int(studies))


def too_few_for_equivalence(match: re.Match[str], told: Told) -> bool:
    """Check the least number of participants."""
    first = told.against[0]["found"]
    return is_number(match[1], first["bound"]) and int(match[2]) == fewest(
        first["alpha"], min(1 / 5, first["bound"] / 6)
    )


def missed_minority(match: re.Match[str], told: Told) -> bool:
    """Check the chance of missing a minority, and its size."""
    chance, share, points = match.groups()
    first = told.against[0]["found"]
    minority = min(1 / 5, first["bound"] / 6)
    return (
        (is_number(chance, 100 * first["alpha"]) or (chance == "0.1" and first["alpha"] < 0.001))
        and is_number(share, 100 * minority)
        and is_number(points, first["bound"] / minority)
    )


def nobody_is_left(match: re.Match[str], told: Told) -> bool:
    """Check that so many comparisons are inconclusive."""
    bound = told.against[0]["found"]["bound"]
    counts = (int(match[1]), int(match[2])) == (inconclusive(told), len(told.against))
    return counts and is_number(match[3], bound)


def out_of_reach(match: re.Match[str], told: Told) -> bool:
    """Check that the named statements are those that no answers could have shown."""
    rows = [row for row in told.of_statements if row["verdict"] == "out of reach"]
    return names_in(match[1]) == {row["item"] for row in rows} and all(
        float(row["p_adjusted"]) > told.alpha for row in rows
    )


def not_testable(match: re.Match[str], told: Told) -> bool:
    """Check that the named statements have no p."""
    return names_in(match[1]) <= {row["item"] for row in told.of_statements if not row["p"]}


def same_position(match: re.Match[str], told: Told) -> bool:
    """Check that a setting has been in this position in all orders."""
    orders = told.results["orders"]["b"]
    names = [f"{one['delay_ms']:g} ms" for one in told.block["settings"]]
    names = names if told.block["kind"] == "delays" else told.block["names"]
    codes = {one["code"] for name, one in zip(names, told.block["settings"], strict=True) if name == match[1]}
    counts = dict(zip(orders["codes"], orders["positions"][int(match[2]) - 1], strict=True))
    return any(counts[code] == orders["orders"] for code in codes)


def not_computed(match: re.Match[str], told: Told) -> bool:
    """Check that the reason is one of those that the block gives."""
    return match[2] in {one["why"] for one in told.block["absent"]}


# ---------------------------------------------------------------------------------------------------------- methods


def settings_presented(match: re.Match[str], told: Told) -> bool:
    """Check how many settings there are, which, and how many statements."""
    number, noun, names, statements = match["n"], match["noun"], match["names"], match["statements"]
    settings = told.block["settings"]
    if noun == "visual delay":
        delays = sorted({one["delay_ms"] for one in settings})
        return count(number) == len(delays) and [float(one) for one in re.findall(r"[\d.]+", names)] == delays
    return (
        count(number) == len(settings)
        and listed_in(names) == {name.lower() for name in told.block["names"]}
        and count(statements) == len(told.block["items"])
    )


def presentations(match: re.Match[str], told: Told) -> bool:
    """Check how often a participant rated a setting."""
    fewest_, most = told.block["presentations"]
    return match[1] == (f"{most}" if fewest_ == most else f"{fewest_} to {most}")


def groups(match: re.Match[str], told: Told) -> bool:
    """Check the sizes of the groups and their ratio."""
    members = told.study.trials.drop_duplicates("participant")["group"].value_counts()
    named = {name: int(n) for name, n in re.findall(r"(\w+) \(n = (\d+)\)", match[0])}
    shares = ":".join(str(one["share"]) for one in told.study.protocol["groups"].values())
    return all(members.get(name, 0) == n for name, n in named.items()) and match["ratio"] == shares


def hypothesis(match: re.Match[str], told: Told) -> bool:
    """Check that a hypothesis is stated with its test and sides."""
    place = int(match[1] or 1) - 1
    contrast = told.contrasts[place]["contrast"]
    return (
        ("two-sample" in match[4]) == (contrast["groups"] is not None)
        and (match[3] == "two-sided") == (contrast["expected"] is None)
        and f"“{short_of(told, contrast['measure'])}”" in match[2]
    )


def low_power(match: re.Match[str], told: Told) -> bool:
    """Check that the three tests of a hypothesis find the stated mean difference with 80 % power."""
    one = told.contrasts[int(match[1] or 1) - 1]
    sizes, sds = zip(*((len(side["values"]), side["sd"]) for side in one["sides"]), strict=True)
    sides, sd, alpha = "greater" if one["contrast"]["expected"] else "two-sided", one["sd"], told.alpha / one["members"]
    numbers = np.split(np.random.default_rng(7).normal(size=(3000, sum(sizes))), [sizes[0]], axis=1)
    means = [means_of(of, group=group, resamples=resamples_for(alpha)) for group, of in enumerate(numbers)]
    means = means[0] - means[1] if one["contrast"]["groups"] else means[0]
    if one["contrast"]["groups"]:
        sd = math.sqrt(sum((n - 1) * own**2 for n, own in zip(sizes, sds, strict=True)) / (sum(sizes) - 2))
    largest = 12.0 if one["contrast"]["groups"] and one["contrast"]["conditions"] else 6.0
    away = 0.05 if match[3] and float(match[3]) >= 10 else 0.005
    ends = [(float(match[3]) - away) / sd, (float(match[3]) + away) / sd] if match[3] else [largest / sd, math.inf]
    ends[0] = 3.0 if match[4] == "a difference of 3 SD" else ends[0]
    powers = [
        1.0 if math.isinf(end) else np.mean(np.max(p_differs(_raised(means, end), sides), axis=0) <= alpha)
        for end in ends
    ]
    said = one["verdict"] not in DECIDED and count(match[2]) == one["n"]
    return said and powers[0] <= 0.83 and powers[1] >= 0.77


def _raised(means: Means, end: float) -> Means:
    return replace(means, mean=means.mean + end, lowest=means.lowest + end, highest=means.highest + end)


def tested_means(match: re.Match[str], told: Told) -> bool:
    """Check in which tests means are."""
    expected = {
        "the hypotheses": bool(told.contrasts),
        "the equivalence tests": bool(told.against),
        "the exploratory tests of means": any(one["outcome"]["p"] is not None for one in told.block["mixed"]),
    }
    return listed_in(match[1]) == {what for what, applies in expected.items() if applies}


def cumulative_models(match: re.Match[str], told: Told) -> bool:
    """Check how many cumulative models were fitted, and whether they have random slopes."""
    fitted = [one for one in told.block["cumulative"] if one["outcome"]["p"] is not None]
    return len(fitted) == count(match[2]) and bool(match[1]) == (told.block["kind"] == "delays")


def no_tested_means(_match: re.Match[str], told: Told) -> bool:
    """Check that no test is of means."""
    tested = any(one["outcome"]["p"] is not None for one in told.block["mixed"])
    return not (told.contrasts or told.against or tested)


def family(match: re.Match[str], told: Told) -> bool:
    """Check how many statements are corrected together."""
    return corrected(match[1], told)


def corrected(text: str, told: Told) -> bool:
    """Return whether a text names each correction and its number of statements."""
    question = "answers follow the delay" if told.block["kind"] == "delays" else "settings differ"
    rows = told.asked(question)
    found = {(row["correction"], int(row["members"])) for row in rows}
    return {
        (how, count(n)) for how, n in re.findall(rf"by the (Holm|Benjamini-Hochberg) method across {N}", text)
    } == found


def trends_tested(match: re.Match[str], told: Told) -> bool:
    """Check sides and correction of the tests of trends."""
    decided = told.results["decided"]
    stated = {row["item"] in (*decided["rising"], *decided["falling"]) for row in told.of_statements}
    sides = {
        frozenset({True}): "one-sided in",
        frozenset({False}): "two-sided",
        frozenset({True, False}): "one-sided if",
    }
    return match[1].startswith(sides[frozenset(stated)]) and corrected(match[2], told)


def equivalence_tests(match: re.Match[str], told: Told) -> bool:
    """Check the control, the bound and the level of the intervals."""
    control, bound, above, percent = match.groups()
    first = told.against[0]["found"]
    level = 100 * (1 - 2 * first["alpha"])
    return (
        float(control) == short_delay(told)
        and float(bound) == first["bound"]
        and (level > float(percent) if above else is_number(percent, level))
    )


def left_out(match: re.Match[str], told: Told) -> bool:
    """Check how many participants miss an answer."""
    gone = {person for members in told.block["incomplete"].values() for person in members}
    return int(match[1]) == len(gone)


def decided_beforehand(match: re.Match[str], told: Told) -> bool:
    """Check alpha and the primary statements."""
    decided = told.results["decided"]
    primary = decided["primary"]
    return (
        decided["made"]
        and not decided["changed"]
        and float(match[1]) == (decided["planned_alpha"] or decided["alpha"])
        and (match[2] == "all statements" if not primary else names_in(match[2]) == set(primary))
    )


Check = Callable[[re.Match[str], Told], bool]


def form_times(match: re.Match[str], told: Told) -> bool:
    """Check the number of questions and the times of a form: each use is named, and no other time."""
    form, protocol = match["form"].lower(), told.study.protocol
    steps = next(iter(protocol["groups"].values()))["sequence"] if "groups" in protocol else protocol["sequence"]
    sides = [
        [step for step in part if step in protocol["blocks"]]
        for place, step in enumerate(steps)
        if step == form
        for part in (steps[:place], steps[place:])
    ]
    uses = list(zip(sides[::2], sides[1::2], strict=True))
    main = {name for name, block in protocol["blocks"].items() if name in steps and block["phase"] == "main"}
    exchanged = main if protocol["study"]["block_order"] != "fixed" else set()
    between = {"b": "after “Block”", "other": "after “Other”"}
    times = {
        "before the first block"
        if not before
        else "after the last block"
        if not after
        else "between the blocks"
        if before[-1] in exchanged
        else between[before[-1]]
        for before, after in uses
    }
    if len(uses) > 1 and all(before for before, _ in uses) and {before[-1] for before, _ in uses} == main:
        times = {"after each main block"}
    asked = len(protocol["questionnaires"][form]["items"])
    return count(match["n"]) == asked and set(re.split(" and |, ", match["times"])) == times


def rules_met(match: re.Match[str], told: Told) -> bool:
    """Check the planned rules, and count the sessions that meet one of them in the tables of answers."""
    rules = {rule["rule"]: rule["limit"] for rule in told.study.protocol["analysis"]["exclusions"]}
    identical = re.search(rf"more than {R} % of the answers to statements are identical", match["rules"])
    fast = re.search(rf"the median response time is below {R} s", match["rules"])
    quoted = {"constant_answers": identical, "fast_answers": fast}
    met = 0
    answers = told.study.responses.dropna(subset=["response"])
    for _, rows in answers.groupby(["participant", "session"]):
        most = max(Counter(map(str, rows["response"])).values())
        met += len(rows) > 1 and 100 * most > rules.get("constant_answers", 100) * len(rows)
    return (
        count(match["met"]) == met
        and {rule: float(limit[1]) for rule, limit in quoted.items() if limit is not None} == rules
    )


def always(_match: re.Match[str], _told: Told) -> bool:
    """A sentence that states no number of the study."""
    return True


def when(holds: Callable[[Told], bool]) -> Check:
    """Return the check that something holds of the study."""
    return lambda _match, told: holds(told)


LOOKS: Final = r"(?P<looks>\d+(?:, \d+)* and \d+) participants"
TEMPLATES: Final[Sequence[tuple[str, Check]]] = (
    # First page: delays
    (rf"Over delays of {R} to {R} ms, participants tended to rate longer delays (.*)\.", trend_is_shown),
    (rf"With {N} statements tested, p ≤ {R} \({R} / (\d+)\) is significant\.", trend_is_corrected),
    (r"They may also notice shorter delays\.", always),
    (r"The test compares ranks, not mean ratings\.", always),
    (r"Agreement increases with the delay, but we could not show that participants noticed any particular delay\.",
     when(lambda told: told.block["threshold"]["effect"] is not None)),
    (r"We could not show that participants noticed any delay\.", nothing_noticed),
    (r"This is not evidence that there is no difference\.", always),
    (r"This was not tested, because [a-z].*\.", when(lambda told: not told.against)),
    (rf"We could not show for any delay that the mean answers to all statements stay within ±{R} points? of those at "
     rf"{R} ms(?: \(at least (?P<fewest>\d+) participants are needed\))?\.", nothing_equivalent),
    (r"Failing to show equivalence is not evidence that answers change\.", when(lambda told: beyond(told) == 0)),
    (r"In (\d+) of (\d+) comparisons? \(at (.*) ms\), the whole confidence interval lies outside the equivalence "
     r"bounds \(not equivalent; not corrected for the number of comparisons\)\.",
     lambda match, told: (int(match[1]), int(match[2])) == (beyond(told), len(told.against))
     and {*map(float, listed_in(match[3]))} == {one["delay_ms"] for one in told.against if position(one) == "beyond"}),
    (rf"Up to {R} ms, mean answers to (all \w+ statements|both statements|the one statement) stay within ±{R} points? "
     rf"of those at {R} ms, but the data do not rule out the possibility that up to {R} % of people show a larger "
     r"difference\.", all_equivalent),
    (rf"The detection threshold is {R} ms \((.*), n = (\d+)\); at this delay, (?:> )?{R} % of answers express "
     rf"agreement with ({ITEM})\.", threshold_is_told),
    (rf"The largest mean difference is {R} points \(({ITEM}) at {R} ms, (?:> )?{R} % confidence interval {ENDS}, "
     r"n = (\d+)\)\.", largest_difference),
    # First page: liquids
    (rf"(P|Overall, p)articipants named (\d+) of (\d+) liquids correctly(, more than the | \(){R}"
     rf" expected by chance(?: \(|, )given how often each name was used; {P}\)\.", names_are_counted),
    (r"We could not show for any single liquid that it was recognised above chance\.",
     when(lambda told: not recognised(told) and told.block["named"]["verdict"] in DECIDED)),
    (r"Recognised above chance: (.*)\.", lambda match, told: listed_in(match[1]) == recognised(told)),
    (r"We could not show that participants recognised any liquid above "
     r"chance\.", when(lambda told: told.block["named"]["verdict"] not in DECIDED)),
    (r"Ratings differed (between .*)\.", pairs_differ),
    (rf"The largest mean difference from (.*) is {R} points \(({ITEM}) for (.*), 95 % confidence interval {ENDS}, "
     r"n = (\d+)\)\.", largest_of_settings),
    (r"The liquids were rated differently on (.*), but the tests do not show which ones differ\.", statements_differ),
    (r"No statement showed a difference between any two liquids\.", no_statement_differs),
    # First page: a block with a single setting
    (rf"(?P<agreed>\d+) of (?P<n>\d+) (?:participants agreed|answers expressed agreement) with “(?P<short>.*)” "
     rf"\((?P<share>{R}) %(?:, 95 % confidence interval \[(?P<low>\d+), (?P<high>\d+)\] %)?; median {R}\)\.", agreed),
    # Hypotheses
    (rf"Agreement with {ITEM} (?:was (?P<shown>higher|lower) in .* than in .*|did not differ significantly between .*"
     r" and .*|was not significantly (?P<lower>higher|lower) in .* than in .*)"
     rf" \(means (?P<means>{R}(?: {ENDS})? and {R}(?: {ENDS})?); mean difference (?P<effect>{R})"
     rf", (?P<unadjusted>unadjusted )?(?P<two>two-sided )?95 % confidence interval \[(?P<low>{R}), (?P<high>{R})\], "
     rf"(?P<name>d_z|g) (?P<size>{R}) {ENDS}, "
     r"(?P<adjusted>adjusted )?(?P<one>one-sided )?p (?P<p>[<>=] \.\d{3}), n = (?P<n>\d+)\)\.", contrast_is_tested),
    (rf"Before the adjustment for (\d+) hypotheses, {P}\.", p_before_the_adjustment),
    (r"It was higher in (\S+) for (\d+) of (\d+) participants(?: and equal for (\d+))?\.", higher_for_so_many),
    (r"The data are ([\d.]+) times as likely (with|without) a difference as (?:with one|without one) \(JZS Bayes "
     r"factor, Cauchy prior with scale 0\.707\)(, which is weak evidence)?\.", bayes_factor),
    (r"Standardised effects give all participants equal weight: d_z is .*\.", when(lambda told: bool(told.contrasts))),
    (r"Their 95 % confidence intervals are calculated from the noncentral t distribution\.",
     when(lambda told: bool(told.contrasts))),
    (r"Bayes factors are two-sided JZS Bayes factors \(Rouder et al\., 2009\) that compare the hypothesis of a "
     r"difference with the null hypothesis, using a Cauchy prior with scale 0\.707\.",
     when(lambda told: bool(told.contrasts))),
    (r"Between groups, Cliff's delta is the probability that an answer in the first group is larger than one in the "
     r"second, minus the probability that it is smaller\.", when(lambda told: bool(told.contrasts))),
    (r"Within participants, it is the proportion of .*\.", when(lambda told: bool(told.contrasts))),
    (rf"The mean difference lies within the equivalence bounds \(equivalent, {P}\)\.", bound_of_a_contrast("within")),
    (r"However, the data do not rule out the possibility that up to (\d+) % of (people show a difference larger than "
     r"the bound|a group belong to a minority that the sample does not include)\.",
     bound_of_a_contrast("within")),
    (r"(The whole confidence interval lies|All differences lie) outside the equivalence bounds \(not equivalent\)\.",
     bound_of_a_contrast("beyond")),
    (r"The tests do not show that the mean difference lies within the equivalence bounds\.",
     bound_of_a_contrast("neither")),
    (r"Not tested: (fewer than two participants have both values|the values do not vary between participants, so a "
     r"t test is not possible)\.", contrast_is_untested),
    (r"Excluded: .*\.", when(lambda told: any(one["left_out"] for one in told.contrasts))),
    # Looks
    (rf"Looks are planned at {LOOKS}\.", look(lambda told: people(told) < told.results["decided"]["looks"][0])),
    (r"None has been reached yet, so all results are exploratory\.",
     when(lambda told: people(told) < told.results["decided"]["looks"][0])),
    (rf"This is look (?P<look>\d+) of \d+, planned at {LOOKS}\.",
     look(lambda told: people(told) in told.results["decided"]["looks"])),
    (rf"This look at \d+ participants was unplanned; looks are planned at {LOOKS}\.",
     look(lambda told: people(told) not in told.results["decided"]["looks"])),
    (rf"Adjusted p values of up to {R} are (significant \(.* alpha spending\)|treated as significant, as at the last "
     r"planned look)\.", alpha_here),
    (r"If there were no effect and the data were tested in this way after every participant, the false-positive rate "
     rf"would be {R} % instead of {R} %\.", lambda match, told: float(match[1]) >= float(match[2])),
    (r"At the planned looks, adjusted p values of up to (.*) are significant \((O'Brien–Fleming|Pocock) alpha spending "
     r"with alpha = [\d.]+, Lan & DeMets 1983\)\.", alphas_of_looks),
    # Questionnaires and planned exclusions
    (rf"Participants completed the questionnaire “(?P<form>\w+)” \((?P<n>{N}) questions?\) (?P<times>.*)\.",
     form_times),
    (rf"According to the protocol, a session is considered for exclusion if (?P<rules>.*); (?P<met>{N}) sessions? met "
     r"(?:this rule|one of these rules)\.", rules_met),
    # Limits
    (rf"In (\d+) simulated studies with (\d+) participants, three liquids, seven delays and no true effect, {R} % of "
     rf"the reports claimed a difference or a noticed delay \((\d+) reports, 95 % confidence interval {R} to {R} %; "
     r"liquid-study validate-report\)\.", claims),
    (r"No answers are included yet\.", when(lambda told: told.block["n"] == 0)),
    (rf"{LEAD}no answers are included yet\.", when(lambda told: told.block["n"] == 0)),
    (r"Block presents only one (?:liquid|delay|condition), so its ratings are not compared\.",
     when(lambda told: len(told.block["settings"]) == 1)),
    (r"The participants were SIMULATED, so this report is not evidence about people\.",
     when(lambda told: told.study.simulated)),
    (r"No analysis was planned in the study file, so all results are exploratory\.",
     when(lambda told: not told.results["decided"]["made"])),
    (r"The decisions about the analysis changed between sessions, so all results are exploratory; the decisions from "
     r"the first session (are used|were used \(alpha = .*\))\.", when(lambda told: told.results["decided"]["changed"])),
    (r"There is only one participant, so the results do not generalise to other people\.",
     when(lambda told: people(told) == 1)),
    (r"Intervals for mean rank correlations and exploratory tests of means need at least 10 participants; this study "
     r"has (\d+)\.", lambda match, told: int(match[1]) == people(told) < 10),
    (r"Interactions between groups and blocks or conditions are not tested\.",
     when(lambda told: {one["contrast"]["groups"] is None for one in told.contrasts} == {True, False})),
    (r"Effects that this report does not show may still exist\.", always),
    (rf"{LEAD}(the .*?) (?:was|were) not computed because (.*)\.", not_computed),
    (rf"{LEAD}the tests for (.*) could not have been significant with so few participants, because no rearrangement of "
     r"the answers within participants gives a small enough adjusted p value\.", out_of_reach),
    (rf"{LEAD}(.*) could not be tested \((.*)\)\.", not_testable),
    (rf"{LEAD}(.*) was in position (\d+) for all participants, so its effect cannot be distinguished from the effect "
     rf"of "
     r"that position\.", same_position),
    (rf"{LEAD}to show that a mean answer stays within ±{R} points? of that at .* ms, a study needs at least (\d+) "
     r"participants\.", too_few_for_equivalence),
    (rf"A smaller sample has more than a (?:< )?{R} % chance of including nobody from a minority of {R} % of the "
     rf"population; if the answers of such a minority differ by {R} points, they shift the mean by as much as the "
     r"bound\.", missed_minority),
    (rf"This study has {N} participants?(, so it can show only that a mean answer differs by more)?\.",
     lambda match, told: count(match[1]) == told.block["n"]),
    (rf"{LEAD}in (\d+) of (\d+) comparisons? with .* ms \(one for each statement and delay\), the data show "
     rf"neither that the mean answer stays within ±{R} points? nor that it differs by more\.", nobody_is_left),
    # Methods
    (rf"{N} participants?(?: \(SIMULATED, not people\))? took part in “Made up” \(protocol made_up, version 1\)(, "
     r"each in all conditions|, but some did not complete all conditions)?\.",
     lambda match, told: count(match[1]) == people(told)),
    (r"Participants were randomised in permuted blocks to the groups .*, with an allocation ratio of (?P<ratio>\S+)\.",
     groups),
    (r"In “Block”, (?P<n>\w+) (?P<noun>visual delay|liquid|view)s? \((?P<names>.*?)(?: ms)?\)(?: in \w+)? "
     rf"(?:was|were) presented(?: in a random order for each participant)?; participants rated (?P<statements>{N}) "
     r"statements? after each presentation\.", settings_presented),
    (r"Several conditions have a delay of .*; they are treated as repeated presentations of one delay\.",
     when(lambda told: bool(told.block["replicated_ms"]))),
    (r"Each participant rated each \w+ (\d+(?: to \d+)?) times\.", presentations),
    (r"The tests use the median of these answers(; the detection threshold is estimated from all individual "
     r"answers)?\.",
     when(lambda told: told.block["presentations"][1] > 1)),
    (r"The answers from sessions (.*) are compared with each other, and are pooled in all other tests\.",
     lambda match, told: listed_in(match[1]) == {str(one) for one in told.block["sessions"]}),
    (r"Conditions were identified only by codes until the key was opened\.", when(lambda told: told.study.revealed)),
    (r"The achieved delays in “Block” were not measured\.",
     when(lambda told: all(one["measured"] == 0 for one in told.results["delivered"]))),
    (r"(?:Hypothesis (\d+)|The hypothesis) \((.*)\) was tested with a (one-sided|two-sided) (.*)\.", hypothesis),
    (r"Comparisons between groups used the degrees of freedom of the smaller group \(Hsu 1938\)\.",
     when(lambda told: any(one["contrast"]["groups"] for one in told.contrasts))),
    (r"Each participant contributed one value to each comparison\.", when(lambda told: bool(told.contrasts))),
    (r"In addition to the t test, we used a bootstrap that adds a participant as extreme as the most extreme one "
     r"\(Gaffke 2005\) and a t test corrected for skewness \(Hall 1992\)\.", when(lambda told: bool(told.contrasts))),
    (r"The reported p value is the largest of the three(?:, Holm-adjusted across (\d+) hypotheses)?\.",
     lambda match, told: int(match[1] or 1) == len(told.contrasts)),
    (r"Equivalence was tested with two one-sided t tests and the same bootstrap(?:, Holm-adjusted across (\d+) "
     r"bounds)?; both had to show equivalence\.",
     lambda match, told: int(match[1] or 1)
     == sum(one["contrast"]["bound"] is not None for one in told.contrasts)),
    (r"In addition, the sample had to be large enough that it would probably include a member of any minority that "
     r"could shift the mean by as much as the bound\.",
     when(lambda told: any(one["contrast"]["bound"] is not None for one in told.contrasts))),
    (rf"Hypothesis(?: (\d+))?: (?:with )?{N} participants (?:and the observed variation between them, a mean "
     rf"difference must be at least {R} to be detected with 80 % power; the confidence interval shows "
     r"which differences remain possible|are too few to find even (a difference of 3 SD|the largest difference on the "
     r"scale) with 80 % power)\.", low_power),
    (r"No hypothesis tests an interaction between groups and blocks or conditions\.",
     when(lambda told: {one["contrast"]["groups"] is None for one in told.contrasts} == {True, False})),
    (r"Some participants were excluded from a test because a value was missing \(.*\)\.",
     when(lambda told: any(one["left_out"] for one in told.contrasts))),
    (r"Statements were rated on seven-point scales\.", always),
    (r"Answers were treated as ordinal and are summarised by medians and quartiles \(linear interpolation, Hyndman & "
     r"Fan type 7\)\.", always),
    (r"Mean differences from the first condition are shown with 95 % confidence intervals \(Student's t\)\.",
     when(lambda told: bool(told.block["effects"]))),
    (r"Means were used for (.*)\.", tested_means),
    (r"Means were not tested\.", no_tested_means),
    (r"First, the (?:liquids|delays) were compared across both statements with a within-participant permutation test; "
     r"the statistic was the sum of the statements' Friedman statistics\.",
     when(lambda told: told.block["overall"] is not None)),
    (r"Each statement was tested with (?:Friedman's test|Wilcoxon's signed-rank test) \(.*\), with p values adjusted "
     r"(by .*); the effect size is .*\.", family),
    (r"If a statement showed a difference, pairs were compared with Wilcoxon's signed-rank test \(exact; pairs of "
     r"equal answers were dropped\), with p values Holm-adjusted across all pairs for all such statements; the effect "
     r"size is the matched-pairs rank-biserial correlation\.", when(lambda told: bool(told.block["pairs"]))),
    (r"Participants were considered to have named the liquid whose statement they rated highest; ties for the highest "
     r"rating were treated as undecided and scored as "
     r"incorrect\.", when(lambda told: told.block["named"] is not None)),
    (r"The number of correct names was tested by permuting the liquids within participants \(exact, one-sided\)\.",
     when(lambda told: told.block["named"] is not None)),
    (r"In addition, a liquid was classified as recognised only if its name was used more often for it than for each "
     r"of the others \(McNemar's exact test within participants, one-sided, with p values Holm-adjusted across the "
     r"liquids\)\.", when(lambda told: told.block["named"] is not None)),
    (r"Trends across delays were tested with a sign-flip permutation test on the participants' rank correlations "
     r"between answers and delays \(.*; (one-sided in the direction stated (?:before the first session|by the "
     r"protocol)|two-sided|one-sided if a direction was stated (?:before the first session|by the protocol), "
     r"otherwise two-sided)\), with p values adjusted (by .*)\.", trends_tested),
    (r"If a statement showed a trend, the longest delay was dropped and the rank correlations were tested again, "
     r"until no trend remained\.", when(lambda told: bool(told.block["trends"]))),
    (r"At every step, a trend required p ≤ alpha divided by the number of statements\.",
     when(lambda told: bool(told.block["trends"]))),
    (r"The shortest delay with a trend is an upper bound for the shortest noticeable delay\.",
     when(lambda told: bool(told.block["trends"]))),
    (rf"Each delay was compared with {R} ms using two one-sided t tests on paired differences, with equivalence "
     rf"bounds of ±{R} points?(?: \(stated before the first session\))? and (> )?{R} % confidence intervals\.",
     equivalence_tests),
    (r"A delay was classified as equivalent only if a bootstrap that adds a participant as extreme as the most "
     r"extreme one \(Gaffke 2005\) also showed equivalence, and only with at least (\d+) participants\.",
     lambda match, told: int(match[1])
     == fewest(told.against[0]["found"]["alpha"], min(1 / 5, told.against[0]["found"]["bound"] / 6))),
    (r"It was classified as not equivalent if the whole confidence interval lay outside the bounds\.",
     when(lambda told: bool(told.against))),
    (r"The detection threshold is the delay at which a logistic function, fitted to agreement \(5 to 7\) in "
     r"individual answers pooled across participants, lies halfway between the guess rate and one minus the lapse "
     r"rate \(posterior median\)\.", when(lambda told: told.block["threshold"] is not None)),
    (r"Its 95 % interval is widened to allow for differences between participants\.", always),
    (r"The threshold is reported only if the statement shows a trend and the threshold lies within the range of "
     r"presented delays\.", when(lambda told: told.block["threshold"] is not None)),
    (r"A statement's adjusted p value is never smaller than the p value of the test over all statements in its block"
     r"\.",
     when(lambda told: all(float(row["p_adjusted"] or 1) >= told.p_over_all - 1e-9 for row in told.of_statements))),
    (r"Alpha \(([\d.]+)(?: across all looks, [\d.]+ at this look)?\) and the primary statements \((.*)\) were "
     r"specified before the first session\.", decided_beforehand),
    (r"The analysis was not specified beforehand, so all results are exploratory \(alpha = ([\d.]+)\)\.",
     lambda match, told: not told.results["decided"]["made"] and float(match[1]) == told.alpha),
    (r"In an exploratory analysis, the answers were treated as numbers: (?:differences between the conditions were "
     r"tested with Hotelling's T²|the participants' slopes were tested with Student's t test), for the participants "
     r"who answered in all conditions; the false discovery rate was controlled \(Benjamini–Hochberg\)\.",
     when(lambda told: any(one["outcome"]["p"] is not None for one in told.block["mixed"]))),
    (rf"In an exploratory analysis, a cumulative logit mixed model with random intercepts( and delay effects)? was "
     rf"fitted to (?:all individual|the participants' median) answers to {N} primary statements?, including the "
     r"answers of participants who did not answer in all conditions; "
     r"effects were tested with likelihood-ratio tests, and "
     r"the false discovery rate was controlled \(Benjamini–Hochberg\)\.",
     cumulative_models),
    (r"Missing answers were not imputed; (\d+) participants? with a missing answer to a statement (?:was|were) "
     r"excluded from that statement's tests over all conditions, and from comparisons of two conditions that involve "
     r"the missing answer\.",
     left_out),
    (rf"The sessions were run and analysed with liquid-study {re.escape(__version__)}\.", always),
)  # fmt: skip


def split(text: str) -> Iterator[str]:
    """Yield the sentences of a text."""
    yield from (part.strip() for part in re.split(r"(?<=[.!?])\s+(?=[A-Z“\d])", text) if part.strip())


def check(text: str, told: Told) -> None:
    """Check every sentence of a text; a sentence without a template, or that is not true of the study, is a failure."""
    for sentence in split(text):
        found = [(match, holds) for pattern, holds in TEMPLATES if (match := re.fullmatch(pattern, sentence))]
        assert found, f"no template for: {sentence}"
        match, holds = found[0]
        assert holds(match, told), f"not true of the study: {sentence}"


def check_verdicts(told: Told) -> None:
    """Check that the verdict of each row agrees with its p, or its interval."""
    for one in told.against:
        verdict = one["found"]["verdict"]
        assert (position(one) == "beyond") == (verdict == "not equivalent"), one
        assert verdict != "equivalent" or one["found"]["p"] <= one["found"]["alpha"], one
    for row in told.rows:
        if row["p_adjusted"] and row["verdict"] in ("shown", "suggested", "not shown", "out of reach"):
            significant = float(row["p_adjusted"]) <= told.alpha
            assert significant == (row["verdict"] in DECIDED), row
            assert row["verdict"] != "shown" or row["primary"] == "true", row
