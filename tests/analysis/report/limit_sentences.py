"""Sentences on the limits of a study, with a check of each."""

import re
from collections.abc import Sequence
from typing import Final

from study_app.analysis.report.sections import CLAIMS
from tests.analysis.report.report_numbers import (
    LEAD,
    Check,
    N,
    R,
    ReportNumbers,
    always,
    count,
    fewest,
    inconclusive,
    is_number,
    names_in,
    people,
    when,
)


def claims(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the rate of empty studies that claim something."""
    studies, n, percent, reports = (match[place] for place in (1, 2, 3, 4))
    return CLAIMS[int(n)] == (int(reports), int(studies)) and is_number(percent, 100 * int(reports) / int(studies))


def too_few_for_equivalence(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the least number of participants."""
    first = report.against[0]["found"]
    return is_number(match[1], first["bound"]) and int(match[2]) == fewest(
        first["alpha"], min(1 / 5, first["bound"] / 6)
    )


def missed_minority(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the chance of missing a minority, and its size."""
    chance, share, points = match.groups()
    first = report.against[0]["found"]
    minority = min(1 / 5, first["bound"] / 6)
    return (
        (is_number(chance, 100 * first["alpha"]) or (chance == "0.1" and first["alpha"] < 0.001))
        and is_number(share, 100 * minority)
        and is_number(points, first["bound"] / minority)
    )


def nobody_is_left(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that so many comparisons are inconclusive."""
    bound = report.against[0]["found"]["bound"]
    counts = (int(match[1]), int(match[2])) == (inconclusive(report), len(report.against))
    return counts and is_number(match[3], bound)


def out_of_reach(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that the named statements are those that no answers could have shown."""
    rows = [row for row in report.of_statements if row["verdict"] == "out of reach"]
    return names_in(match[1]) == {row["item"] for row in rows} and all(
        float(row["p_adjusted"]) > report.alpha for row in rows
    )


def not_testable(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that the named statements have no p."""
    return names_in(match[1]) <= {row["item"] for row in report.of_statements if not row["p"]}


def same_position(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that a setting has been in this position in all orders."""
    orders = report.results["orders"]["b"]
    delays = [setting["delay_ms"] for setting in report.block["settings"]]
    names = [
        f"{setting['delay_ms']:g} ms" + (f" ({setting['condition']})" if delays.count(setting["delay_ms"]) > 1 else "")
        for setting in report.block["settings"]
    ]
    names = names if report.block["kind"] == "delays" else report.block["names"]
    codes = {setting["code"] for name, setting in zip(names, report.block["settings"], strict=True) if name == match[1]}
    counts = dict(zip(orders["codes"], orders["positions"][int(match[2]) - 1], strict=True))
    return any(counts[code] == orders["orders"] for code in codes)


def not_computed(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that the block states this reason."""
    return match[2] in {absence["why"] for absence in report.block["absent"]}


LIMITS: Final[Sequence[tuple[str, Check]]] = (
    (rf"In (\d+) simulated studies with (\d+) participants, three liquids, seven delays and no true effect, {R} % of "
     rf"the reports claimed a difference or a noticed delay \((\d+) reports, 95 % confidence interval {R} to {R} %; "
     r"liquid-study validate-report\)\.", claims),
    (r"No answers are included yet\.", when(lambda report: report.block["n"] == 0)),
    (rf"{LEAD}no answers are included yet\.", when(lambda report: report.block["n"] == 0)),
    (r"Block presents only one (?:liquid|delay|condition), so its ratings are not compared\.",
     when(lambda report: len(report.block["settings"]) == 1)),
    (r"The participants were SIMULATED, so this report is not evidence about people\.",
     when(lambda report: report.study.simulated)),
    (r"No analysis was planned in the study file, so all results are exploratory\.",
     when(lambda report: not report.results["decided"]["made"])),
    (r"The decisions about the analysis changed between sessions, so all results are exploratory; the decisions from "
     r"the first session (are used|were used \(alpha = .*\))\.",
     when(lambda report: report.results["decided"]["changed"])),
    (r"There is only one participant, so the results do not generalise to other people\.",
     when(lambda report: people(report) == 1)),
    (r"Intervals for mean rank correlations and exploratory tests of means need at least 10 participants; this study "
     r"has (\d+)\.", lambda match, report: int(match[1]) == people(report) < 10),
    (r"Interactions between groups and blocks or conditions are not tested\.",
     when(lambda report: {contrast["contrast"]["groups"] is None for contrast in report.contrasts} == {True, False})),
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
     lambda match, report: count(match[1]) == report.block["n"]),
    (rf"{LEAD}in (\d+) of (\d+) comparisons? with .* ms \(one for each statement and delay\), the data show "
     rf"neither that the mean answer stays within ±{R} points? nor that it differs by more\.", nobody_is_left),
)  # fmt: skip
