"""Sentences on hypotheses and planned looks, with a check of each."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from scipy.stats import t as student

from tests.analysis.report.report_numbers import (
    DECIDED,
    ENDS,
    ITEM,
    Check,
    P,
    R,
    ReportNumbers,
    is_number,
    is_p,
    people,
    short_of,
    when,
)


def p_before_the_adjustment(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the largest p of a hypothesis that is significant before but not after the adjustment."""
    (contrast,) = report.contrasts
    ps = [contrast[name] for name in ("p", "p_bootstrap", "p_skewed") if contrast[name] is not None]
    return (
        int(match[1]) == len(report.results["contrasts"])
        and is_p(match[2], max(ps))
        and max(ps) <= 0.05 < contrast["p_adjusted"]
        and contrast["verdict"] not in DECIDED
    )


def contrast_is_tested(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check every number of a hypothesis, and its verdict."""
    (contrast,) = report.contrasts
    shown_side, lower, means, effect, size = (match[name] for name in ("shown", "lower", "means", "effect", "size"))
    sides = [np.array([*side["values"].values()]) for side in contrast["sides"]]
    differences, within = contrast_values(report, contrast), contrast["contrast"]["groups"] is None
    mean = float(differences.mean()) if within else float(sides[0].mean() - sides[1].mean())
    standard = mean / differences.std(ddof=1) if within else hedges_g(*sides)
    return (
        f"“{short_of(report, contrast['contrast']['measure'])}”" in match[0]
        and all(name in match[0] for name in contrast["compared"])
        and (not within or np.allclose(np.sort(sides[0] - sides[1]), np.sort(differences)))
        and all(mean_holds(text, side) for text, side in zip(means.split(" and "), sides, strict=True))
        and (match["adjusted"] is not None) == (len(report.results["contrasts"]) > 1)
        and (match["unadjusted"] is None) == (match["adjusted"] is None)
        and [match[side] is None for side in ("two", "one")] == [contrast["contrast"]["expected"] is None] * 2
        and is_number(effect, contrast["effect"])
        and is_number(effect, mean)
        and is_number(match["low"], contrast["interval"]["low"])
        and is_number(match["high"], contrast["interval"]["high"])
        and match["name"] == ("d_z" if within else "g")
        and is_number(size, standard)
        and is_number(size, contrast["standardised"]["value"])
        and is_p(match["p"], contrast["p_adjusted"])
        and int(match["n"]) == contrast["n"]
        and (shown_side is not None) == (contrast["verdict"] in DECIDED) == (contrast["p_adjusted"] <= report.alpha)
        and (shown_side is None or (shown_side == "higher") == (mean > 0))
        and (shown_side is not None or lower == contrast["contrast"]["expected"])
    )


def mean_holds(text: str, values: np.ndarray) -> bool:
    """Return whether a text states the mean of values, with Student's interval if the text has an interval."""
    mean, *ends = re.findall(R, text)
    half = student.ppf(0.975, len(values) - 1) * values.std(ddof=1) / math.sqrt(len(values))
    expected = (values.mean() - half, values.mean() + half)
    return is_number(mean, values.mean()) and all(map(is_number, ends, expected[: len(ends)]))


def hedges_g(first: np.ndarray, second: np.ndarray) -> float:
    """Return the standardised difference of two groups, corrected for its bias by the usual approximation."""
    freedom = len(first) + len(second) - 2
    squares = sum(((sample - sample.mean()) ** 2).sum() for sample in (first, second))
    exact = math.gamma(freedom / 2) / math.sqrt(freedom / 2) / math.gamma((freedom - 1) / 2)
    return float((first.mean() - second.mean()) / math.sqrt(squares / freedom) * exact)


def higher_for_so_many(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check for how many participants the first is higher."""
    (contrast,) = report.contrasts
    differences = contrast_values(report, contrast)
    return match[1].strip("“”") == contrast["compared"][0] and (int(match[2]), int(match[3]), int(match[4] or 0)) == (
        int((differences > 0).sum()),
        len(differences),
        int((differences == 0).sum()),
    )


def bayes_factor(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the Bayes factor of a hypothesis that was not shown and the side that it favours."""
    (contrast,) = report.contrasts
    factor = contrast["bayes_factor"]
    return (
        contrast["verdict"] not in DECIDED
        and math.isclose(float(match[1]), max(factor, 1 / factor), rel_tol=6e-3)
        and (match[2] == "with") == (factor > 1) == (" as without one" in match[0])
        and (match[3] is not None) == (1 / 3 < factor < 3)
    )


def contrast_values(report: ReportNumbers, contrast: Mapping[str, Any]) -> np.ndarray:
    """Return the differences of each participant's median answers under two conditions; of all, between groups."""
    rows = report.study.responses[report.study.responses["item"] == contrast["contrast"]["measure"]].dropna(
        subset=["response"]
    )
    if contrast["contrast"]["conditions"] is None and report.block["kind"] == "delays":  # replicates are pooled
        delays = {setting["code"]: setting["delay_ms"] for setting in report.block["settings"]}
        rows = rows.assign(code=[f"{delays[code]:g}" for code in rows["code"]])
    medians = rows.astype({"response": float}).groupby(["participant", "code"])["response"].median().unstack()
    if contrast["contrast"]["conditions"] is None:
        return medians.mean(axis=1).dropna().to_numpy()  # type: ignore[no-any-return]
    codes = {setting["condition"]: setting["code"] for setting in report.block["settings"]}
    first, second = (codes[condition] for condition in contrast["contrast"]["conditions"])
    return (medians[first] - medians[second]).dropna().to_numpy()  # type: ignore[no-any-return]


def bound_of_a_contrast(where: str) -> Callable[[re.Match[str], ReportNumbers], bool]:
    """Return a check of where a hypothesis with a bound lies: within it, beyond it, or neither."""

    def check_bound(match: re.Match[str], report: ReportNumbers) -> bool:
        positions = set()
        if match[0].startswith("The mean difference lies within"):
            assert any(
                contrast["equivalent"] and is_p(match[1], contrast["p_equivalent"]) for contrast in report.contrasts
            )
        for contrast in report.contrasts:
            if (bound := contrast["contrast"]["bound"]) is not None and contrast["effect"] is not None:
                ends = contrast["interval"] or {"low": contrast["effect"], "high": contrast["effect"]}
                few = contrast["interval"] is None and 0.5 ** contrast["n"] > 0.05
                outside = not few and (ends["low"] > bound or ends["high"] < -bound)
                positions.add("beyond" if outside else "within" if contrast["equivalent"] else "neither")
                assert not (outside and contrast["equivalent"])
                assert not contrast["equivalent"] or contrast["p_equivalent"] <= report.alpha
            elif bound is not None:
                positions.add("neither")
        return where in positions

    return check_bound


def contrast_is_untested(_match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that at least one hypothesis has no p value."""
    return any(
        contrast["p"] is None and contrast["verdict"] in ("not tested", "equivalent") for contrast in report.contrasts
    )


# --------------------------------------------------------------------------------------------------------------- looks


def look(has_look_number: Callable[[ReportNumbers], bool]) -> Callable[[re.Match[str], ReportNumbers], bool]:
    """Return a check that the sentence lists the planned looks and that the current look has the expected number."""

    def check_look(match: re.Match[str], report: ReportNumbers) -> bool:
        looks = report.results["decided"]["looks"]
        return [int(number_text) for number_text in re.findall(r"\d+", match["looks"])] == looks and has_look_number(
            report
        )

    return check_look


def alpha_here(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the alpha of this look."""
    return math.isclose(float(match[1]), report.alpha, rel_tol=6e-3)


def alphas_of_looks(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the alphas of all looks, of which the last is the largest below the alpha of all."""
    alphas = [float(number_text) for number_text in re.findall(r"0\.\d+", match[1])]
    total = report.results["decided"]["planned_alpha"] or report.alpha
    return len(alphas) == len(report.results["decided"]["looks"]) and alphas == sorted(alphas) and alphas[-1] <= total


LOOKS: Final = r"(?P<looks>\d+(?:, \d+)* and \d+) participants"
HYPOTHESES: Final[Sequence[tuple[str, Check]]] = (
    # Hypotheses
    (rf"Agreement with {ITEM} (?:was (?P<shown>higher|lower) in .* than in .*|did not differ significantly between .*"
     r" and .*|was not significantly (?P<lower>higher|lower) in .* than in .*)"
     rf" \(means (?P<means>{R}(?: {ENDS})? and {R}(?: {ENDS})?); mean difference (?P<effect>{R})"
     rf", (?P<unadjusted>unadjusted )?(?P<two>two-sided )?95 % confidence interval \[(?P<low>{R}), (?P<high>{R})\], "
     rf"(?P<name>d_z|g) (?P<size>{R}) {ENDS}, "
     r"(?P<adjusted>adjusted )?(?P<one>one-sided )?p (?P<p>[<>=] \.\d{3}), n = (?P<n>\d+)\)\.", contrast_is_tested),
    (rf"Before the adjustment for (\d+) hypotheses, {P}\.", p_before_the_adjustment),
    (r"It was higher in (“[^”]+”|\S+) for (\d+) of (\d+) participants(?: and equal for (\d+))?\.", higher_for_so_many),
    (r"The data are ([\d.]+) times as likely (with|without) a difference as (?:with one|without one) \(JZS Bayes "
     r"factor, Cauchy prior with scale 0\.707\)(, which is weak evidence)?\.", bayes_factor),
    (r"Standardised effects give all participants equal weight: d_z is .*\.",
     when(lambda report: bool(report.contrasts))),
    (r"Their 95 % confidence intervals are calculated from the noncentral t distribution\.",
     when(lambda report: bool(report.contrasts))),
    (r"Bayes factors are two-sided JZS Bayes factors \(Rouder et al\., 2009\) that compare the hypothesis of a "
     r"difference with the null hypothesis, using a Cauchy prior with scale 0\.707\.",
     when(lambda report: bool(report.contrasts))),
    (r"Between groups, Cliff's delta is the probability that an answer in the first group is larger than one in the "
     r"second, minus the probability that it is smaller\.", when(lambda report: bool(report.contrasts))),
    (r"Within participants, it is the proportion of .*\.", when(lambda report: bool(report.contrasts))),
    (rf"The mean difference lies within the equivalence bounds \(equivalent, {P}\)\.", bound_of_a_contrast("within")),
    (r"However, the data do not rule out the possibility that up to (\d+) % of (people show a difference larger than "
     r"the bound|a group belong to a minority that the sample does not include)\.",
     bound_of_a_contrast("within")),
    (r"(The whole confidence interval lies|All differences lie) outside the equivalence bounds \(not equivalent\)\.",
     bound_of_a_contrast("beyond")),
    (r"The tests do not show that the mean difference lies within the equivalence bounds\.",
     bound_of_a_contrast("neither")),
    (r"The sample is too small to show equivalence: at least \d+ participants( in each group)? are needed\.",
     bound_of_a_contrast("neither")),
    (r"Not tested: (fewer than two participants have both values|the values do not vary between participants, so a "
     r"t test is not possible)\.", contrast_is_untested),
    (r"Excluded: .*\.", when(lambda report: any(contrast["left_out"] for contrast in report.contrasts))),
    # Looks
    (rf"Looks are planned at {LOOKS}\.", look(lambda report: people(report) < report.results["decided"]["looks"][0])),
    (r"None has been reached yet, so all results are exploratory\.",
     when(lambda report: people(report) < report.results["decided"]["looks"][0])),
    (rf"This is look (?P<look>\d+) of \d+, planned at {LOOKS}\.",
     look(lambda report: people(report) in report.results["decided"]["looks"])),
    (rf"This look at \d+ participants was unplanned; looks are planned at {LOOKS}\.",
     look(lambda report: people(report) not in report.results["decided"]["looks"])),
    (rf"Adjusted p values of up to {R} are (significant \(.* alpha spending\)|treated as significant, as at the last "
     r"planned look)\.", alpha_here),
    (r"If there were no effect and the data were tested in this way after every participant, the false-positive rate "
     rf"would be {R} % instead of {R} %\.", lambda match, report: float(match[1]) >= float(match[2])),
    (r"At the planned looks, adjusted p values of up to (.*) are significant \((O'Brien–Fleming|Pocock) alpha spending "
     r"with alpha = [\d.]+, Lan & DeMets 1983\)\.", alphas_of_looks),
)  # fmt: skip
