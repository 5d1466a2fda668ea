"""Sentences of the first page, with a check of each: delays, liquids, and a block with a single setting."""

import math
import re
from collections.abc import Sequence
from typing import Final

from scipy.stats import binomtest

from tests.analysis.report.report_numbers import (
    DECIDED,
    ENDS,
    ITEM,
    Check,
    N,
    P,
    R,
    ReportNumbers,
    always,
    beyond,
    count,
    fewest,
    is_number,
    is_p,
    listed_in,
    names_in,
    position,
    short_delay,
    when,
)

# -------------------------------------------------------------------------------------------------------------- delays


def trend_is_shown(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the shortest delay with a trend, and the correlations."""
    shortest, at, rated = match.groups()
    lowest = {item: delay for item, delay in report.lowest().items() if not math.isnan(delay)}
    primary = {row["item"]: row["primary"] == "true" for row in report.test_rows("answers follow the delay")}
    of = [item for item in lowest if primary[item]] or list(lowest)
    if float(at) != min(lowest[item] for item in of) or float(shortest) != short_delay(report):
        return False
    falling = report.results["decided"]["falling"]
    correlations = re.findall(rf"(higher|lower) on “(\w+)” \(mean rank correlation {R}, {P}, n = (\d+)\)", rated)
    for side, item, number, p, n in correlations:
        (row,) = (
            row
            for row in report.test_rows("answers change with the delay, step-down test")
            if row["item"] == item.lower() and row["comparison"] == f"up to {at} ms"
        )
        effect = float(row["effect"]) * (-1 if item.lower() in falling else 1)
        if not is_number(number, effect) or (side == "higher") != (effect > 0):
            return False
        if not is_p(p, float(row["p"])) or n != row["n"]:
            return False
    return len(correlations) == rated.count("correlation") > 0


def trend_is_corrected(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the criterion for the p values of trends, which are corrected over the statements."""
    members = {
        int(row["members"]) for row in report.test_rows("answers follow the delay") if row["item"] in report.lowest()
    }
    return members == {count(match[1]), int(match[4])} and all(
        math.isclose(float(text), alpha, rel_tol=6e-3)
        for text, alpha in ((match[3], report.alpha), (match[2], report.alpha / int(match[4])))
    )


def nothing_noticed(_match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that no delay has a trend."""
    return all(math.isnan(delay) for delay in report.lowest().values())


def nothing_equivalent(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that not all statements are equivalent at the shortest of the delays that are compared."""
    first = min(contrast["delay_ms"] for contrast in report.against)
    at_first = [contrast for contrast in report.against if contrast["delay_ms"] == first]
    tested = report.against[0]["found"]
    bound, least = tested["bound"], fewest(tested["alpha"], min(1 / 5, tested["bound"] / 6))
    return (
        match["fewest"] == (str(least) if report.block["n"] < least else None)
        and float(match[1]) == bound
        and float(match[2]) == short_delay(report)
        and not all(contrast["found"]["verdict"] == "equivalent" for contrast in at_first)
    )


def all_equivalent(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that all statements are equivalent up to a delay, and not up to the next."""
    up_to, _, bound, control, percent = match.groups()
    within = [contrast for contrast in report.against if contrast["delay_ms"] <= float(up_to)]
    after = [contrast for contrast in report.against if contrast["delay_ms"] > float(up_to)]
    following = [
        contrast for contrast in after if contrast["delay_ms"] == min((later["delay_ms"] for later in after), default=0)
    ]
    most = max(contrast["found"]["beyond"]["interval"]["high"] for contrast in within)
    return (
        all(contrast["found"]["verdict"] == "equivalent" and position(contrast) != "beyond" for contrast in within)
        and (not following or not all(contrast["found"]["verdict"] == "equivalent" for contrast in following))
        and float(bound) == within[0]["found"]["bound"]
        and float(control) == short_delay(report)
        and abs(float(percent) - 100 * most) <= 0.5
    )


def threshold_is_stated(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the detection threshold, its interval and how many answers agree there."""
    threshold, (at, ends, n, percent, item) = report.block["threshold"], match.groups()
    known = threshold["interval"]
    interval = [] if known is None else re.findall(R, ends.partition("[")[2])
    return (
        is_number(at, threshold["effect"])
        and int(n) == threshold["n"]
        and is_number(percent, 100 * (threshold["guess"] + (1 - threshold["guess"] - threshold["lapse"]) / 2))
        and names_in(item) == {report.results["decided"]["noticed"]}
        and (known is None or all(map(is_number, interval, (known["low"], known["high"]))))
    )


def largest_difference(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that no mean difference from the shortest delay is larger, and its interval."""
    mean, item, at, percent, low, high, n = match.groups()
    known = [contrast for contrast in report.against if contrast["found"]["interval"] is not None]
    (largest,) = (
        contrast for contrast in known if {contrast["item"]} == names_in(item) and contrast["delay_ms"] == float(at)
    )
    ends = largest["found"]["interval"]
    return (
        abs(largest["found"]["effect"]) >= max(abs(contrast["found"]["effect"]) for contrast in known)
        and is_number(mean, largest["found"]["effect"])
        and (is_number(low, ends["low"]) and is_number(high, ends["high"]))
        and (is_number(percent, 100 * ends["level"]) or 100 * ends["level"] > float(percent))
        and int(n) == largest["found"]["n"]
    )


# ------------------------------------------------------------------------------------------------------------- liquids


def recognised(report: ReportNumbers) -> set[str]:
    """Return the names of the liquids that are recognised."""
    recognition = report.block["named"]
    if recognition is None or recognition["verdict"] not in DECIDED:
        return set()
    rates = [rate for rate in recognition["found"]["rates"] if rate["p_adjusted"] is not None]
    return {report.block["names"][rate["setting"]].lower() for rate in rates if rate["p_adjusted"] <= report.alpha}


def names_are_counted(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check how many names are right, and how many would be by chance."""
    overall, hits, n, more, expected, p = match.groups()
    is_shown = report.block["named"]["verdict"] in DECIDED
    rates, naming = report.block["named"]["found"]["rates"], report.block["named"]["found"]
    return (
        (overall, more) == (("Overall, p", ", more than the ") if is_shown else ("P", " ("))
        and int(hits) == sum(rate["hits"] for rate in rates)
        and int(n) == sum(rate["n"] for rate in rates)
        and is_number(expected, naming["expected"])
        and is_p(p, naming["p"])
    )


def pairs_differ(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that each named pair is significant in a statement, in the verdict of the first page."""
    names = {setting["code"]: name.lower() for setting, name in
             zip(report.block["settings"], report.block["names"], strict=True)}  # fmt: skip
    question = "conditions differ" if len(names) == 2 else "two conditions differ"
    pairs_by_verdict: dict[str, set[tuple[str, str]]] = {"shown": set(), "suggested": set()}
    verdicts = {row["verdict"] for row in (*report.test_rows("conditions differ"), *report.test_rows(question))}
    for row in report.test_rows(question):
        if row["verdict"] in pairs_by_verdict and float(row["p_adjusted"]) <= report.alpha:
            pair = " and ".join(names[code] for code in row["codes"].split())
            pairs_by_verdict[row["verdict"]].add((pair, row["item"]))
    stated = "shown" if "shown" in verdicts or _recognition_shown(report) else "suggested"
    stated_pairs = re.findall(r"between ([^(]+) \(([^)]*)\)", match[1])
    return {(pair, item) for pair, items in stated_pairs for item in names_in(items)} == pairs_by_verdict[stated]


def largest_of_settings(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that no mean difference from the first setting is larger in a statement with a difference."""
    first, mean, item, other, low, high, n = match.groups()
    block = report.block
    names = {it["code"]: text.lower() for it, text in zip(block["settings"], block["names"], strict=True)}
    rows = report.test_rows("conditions differ")
    verdicts = {row["verdict"] for row in (*rows, *report.test_rows("two conditions differ"))}
    stated = "shown" if "shown" in verdicts or _recognition_shown(report) else "suggested"
    differing = {row["item"] for row in rows if row["verdict"] == stated}
    known = [effect for effect in block["effects"] if effect["item"] in differing]
    (effect_row,) = (
        effect for effect in known if {effect["item"]} == names_in(item) and names[effect["code"]] == other
    )
    return (
        first == block["names"][0].lower()
        and all(abs(effect["mean"]) <= abs(effect_row["mean"]) for effect in known)
        and is_number(mean, effect_row["mean"])
        and (is_number(low, effect_row["low"]) and is_number(high, effect_row["high"]))
        and int(n) == effect_row["n"]
    )


def _recognition_shown(report: ReportNumbers) -> bool:
    return bool(recognised(report)) and report.block["named"]["verdict"] == "shown"


def statements_differ(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that the named statements show a difference."""
    rows = {row["item"]: row for row in report.test_rows("conditions differ")}
    return all(float(rows[item]["p_adjusted"]) <= report.alpha for item in names_in(match[1]))


def no_statement_differs(_match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that nothing is significant in the verdict of the first page."""
    rows = [*report.test_rows("conditions differ"), *report.test_rows("two conditions differ")]
    shown_rows = [row for row in rows if row["verdict"] in DECIDED]
    return not shown_rows or (_recognition_shown(report) and all(row["verdict"] == "suggested" for row in shown_rows))


def agreed(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check how many answers to a statement are above the neutral level, with the exact interval of their share."""
    (item,) = (item["id"] for item in report.block["items"] if item["short"] == match["short"])
    values = report.study.responses.loc[report.study.responses["item"] == item, "response"].dropna().astype(int)
    above, n = int((values > 4).sum()), len(values)
    exact = binomtest(above, n).proportion_ci()
    ends = (exact.low, exact.high)
    ends_text = [match[end] for end in ("low", "high")]
    return (
        (int(match["agreed"]), int(match["n"])) == (above, n)
        and abs(float(match["share"]) - 100 * above / n) <= 0.5
        and (
            ends_text[0] is None
            or all(abs(int(text) - 100 * end) < 0.501 for text, end in zip(ends_text, ends, strict=True))
        )
    )


FIRST_PAGE: Final[Sequence[tuple[str, Check]]] = (
    # Delays
    (rf"Over delays of {R} to {R} ms, participants tended to rate longer delays (.*)\.", trend_is_shown),
    (rf"With {N} statements tested, p ≤ {R} \({R} / (\d+)\) is significant\.", trend_is_corrected),
    (r"Participants may also notice shorter delays\.", always),
    (r"The test compares ranks, not mean ratings\.", always),
    (r"Agreement increases with the delay, but we could not show that participants noticed any particular delay\.",
     when(lambda report: report.block["threshold"]["effect"] is not None)),
    (r"We could not show that participants noticed any delay\.", nothing_noticed),
    (r"This is not evidence that there is no difference\.", always),
    (r"This was not tested, because [a-z].*\.", when(lambda report: not report.against)),
    (rf"We could not show for any delay that the mean answers to all statements stay within ±{R} points? of those at "
     rf"{R} ms(?: \(at least (?P<fewest>\d+) participants are needed\))?\.", nothing_equivalent),
    (r"Failing to show equivalence is not evidence that answers change\.", when(lambda report: beyond(report) == 0)),
    (r"In (\d+) of (\d+) comparisons? \(at (.*) ms\), the whole confidence interval lies outside the equivalence "
     r"bounds \(not equivalent; not corrected for the number of comparisons\)\.",
     lambda match, report: (int(match[1]), int(match[2])) == (beyond(report), len(report.against))
     and {*map(float, listed_in(match[3]))}
     == {contrast["delay_ms"] for contrast in report.against if position(contrast) == "beyond"}),
    (rf"Up to {R} ms, mean answers to (all \w+ statements|both statements|the one statement) stay within ±{R} points? "
     rf"of those at {R} ms, but the data do not rule out the possibility that up to {R} % of people show a larger "
     r"difference\.", all_equivalent),
    (rf"The detection threshold is {R} ms \((.*), n = (\d+)\); at this delay, (?:> )?{R} % of answers express "
     rf"agreement with ({ITEM})\.", threshold_is_stated),
    (rf"The largest mean difference is {R} points \(({ITEM}) at {R} ms, (?:> )?{R} % confidence interval {ENDS}, "
     r"n = (\d+)\)\.", largest_difference),
    # Liquids
    (rf"(P|Overall, p)articipants named (\d+) of (\d+) liquids correctly(, more than the | \(){R}"
     rf" expected by chance(?: \(|, )given how often each name was used; {P}\)\.", names_are_counted),
    (r"We could not show for any single liquid that it was recognised above chance\.",
     when(lambda report: not recognised(report) and report.block["named"]["verdict"] in DECIDED)),
    (r"Recognised above chance: (.*)\.", lambda match, report: listed_in(match[1]) == recognised(report)),
    (r"We could not show that participants recognised any liquid above "
     r"chance\.", when(lambda report: report.block["named"]["verdict"] not in DECIDED)),
    (r"Ratings differed (between .*)\.", pairs_differ),
    (rf"The largest mean difference from (.*) is {R} points \(({ITEM}) for (.*), 95 % confidence interval {ENDS}, "
     r"n = (\d+)\)\.", largest_of_settings),
    (r"The liquids were rated differently on (.*), but the tests do not show which ones differ\.", statements_differ),
    (r"No statement showed a difference between any two liquids\.", no_statement_differs),
    # A block with a single setting
    (rf"(?P<agreed>\d+) of (?P<n>\d+) (?:participants agreed|answers expressed agreement) with “(?P<short>.*)” "
     rf"\((?P<share>{R}) %(?:, 95 % confidence interval \[(?P<low>\d+), (?P<high>\d+)\] %)?; median {R}\)\.", agreed),
)  # fmt: skip
