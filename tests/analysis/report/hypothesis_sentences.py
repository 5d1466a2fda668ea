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
    Told,
    is_number,
    is_p,
    people,
    short_of,
    when,
)


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
    if one["contrast"]["conditions"] is None and told.block["kind"] == "delays":  # replicates are pooled
        delays = {setting["code"]: setting["delay_ms"] for setting in told.block["settings"]}
        rows = rows.assign(code=[f"{delays[code]:g}" for code in rows["code"]])
    medians = rows.astype({"response": float}).groupby(["participant", "code"])["response"].median().unstack()
    if one["contrast"]["conditions"] is None:
        return medians.mean(axis=1).dropna().to_numpy()  # type: ignore[no-any-return]
    codes = {it["condition"]: it["code"] for it in told.block["settings"]}
    first, second = (codes[condition] for condition in one["contrast"]["conditions"])
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


# --------------------------------------------------------------------------------------------------------------- looks


def look(number: Callable[[Told], bool]) -> Callable[[re.Match[str], Told], bool]:
    """Return the check that the planned looks are named and the study is at one of this kind."""

    def check_look(match: re.Match[str], told: Told) -> bool:
        looks = told.results["decided"]["looks"]
        return [int(one) for one in re.findall(r"\d+", match["looks"])] == looks and number(told)

    return check_look


def alpha_here(match: re.Match[str], told: Told) -> bool:
    """Check the alpha of this look."""
    return math.isclose(float(match[1]), told.alpha, rel_tol=6e-3)


def alphas_of_looks(match: re.Match[str], told: Told) -> bool:
    """Check the alphas of all looks, of which the last is the largest below the alpha of all."""
    alphas = [float(one) for one in re.findall(r"0\.\d+", match[1])]
    total = told.results["decided"]["planned_alpha"] or told.alpha
    return len(alphas) == len(told.results["decided"]["looks"]) and alphas == sorted(alphas) and alphas[-1] <= total


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
    (r"The sample is too small to show equivalence: at least \d+ participants( in each group)? are needed\.",
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
)  # fmt: skip
