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
    Told,
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


# ------------------------------------------------------------------------------------------------------------- liquids


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


def pairs_differ(match: re.Match[str], told: Told) -> bool:
    """Check that each named pair is significant in a statement, in the verdict of the first page."""
    names = {setting["code"]: name.lower() for setting, name in
             zip(told.block["settings"], told.block["names"], strict=True)}  # fmt: skip
    question = "conditions differ" if len(names) == 2 else "two conditions differ"
    found: dict[str, set[tuple[str, str]]] = {"shown": set(), "suggested": set()}
    verdicts = {row["verdict"] for row in (*told.asked("conditions differ"), *told.asked(question))}
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
    rows = told.asked("conditions differ")
    verdicts = {row["verdict"] for row in (*rows, *told.asked("two conditions differ"))}
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
    rows = {row["item"]: row for row in told.asked("conditions differ")}
    return all(float(rows[item]["p_adjusted"]) <= told.alpha for item in names_in(match[1]))


def no_statement_differs(_match: re.Match[str], told: Told) -> bool:
    """Check that nothing is significant in the verdict of the first page."""
    rows = [*told.asked("conditions differ"), *told.asked("two conditions differ")]
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


FIRST_PAGE: Final[Sequence[tuple[str, Check]]] = (
    # Delays
    (rf"Over delays of {R} to {R} ms, participants tended to rate longer delays (.*)\.", trend_is_shown),
    (rf"With {N} statements tested, p ≤ {R} \({R} / (\d+)\) is significant\.", trend_is_corrected),
    (r"Participants may also notice shorter delays\.", always),
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
    # Liquids
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
    # A block with a single setting
    (rf"(?P<agreed>\d+) of (?P<n>\d+) (?:participants agreed|answers expressed agreement) with “(?P<short>.*)” "
     rf"\((?P<share>{R}) %(?:, 95 % confidence interval \[(?P<low>\d+), (?P<high>\d+)\] %)?; median {R}\)\.", agreed),
)  # fmt: skip
