"""Sentences of the methods, with a check of each: questionnaires, planned exclusions, conditions and tests."""

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from study_app import __version__
from study_app.analysis.statistics.mean_tests import Means, means_of, p_differs, resamples_for
from tests.analysis.report.report_numbers import (
    DECIDED,
    Check,
    N,
    R,
    ReportNumbers,
    always,
    count,
    fewest,
    is_number,
    listed_in,
    names_in,
    people,
    short_delay,
    short_of,
    when,
)


def form_times(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the number of questions of a form and that exactly its times are named."""
    form, protocol = match["form"].lower(), report.study.protocol
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
    item_count = len(protocol["questionnaires"][form]["items"])
    return count(match["n"]) == item_count and set(re.split(" and |, ", match["times"])) == times


def rules_met(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the planned rules and the number of sessions that meet one of them."""
    rules = {rule["rule"]: rule["limit"] for rule in report.study.protocol["analysis"]["exclusions"]}
    identical = re.search(rf"more than {R} % of the answers to statements are identical", match["rules"])
    fast = re.search(rf"the median response time is below {R} s", match["rules"])
    quoted = {"constant_answers": identical, "fast_answers": fast}
    met = 0
    answers = report.study.responses.dropna(subset=["response"])
    for _, rows in answers.groupby(["participant", "session"]):
        most = max(Counter(map(str, rows["response"])).values())
        met += len(rows) > 1 and 100 * most > rules.get("constant_answers", 100) * len(rows)
    return (
        count(match["met"]) == met
        and {rule: float(limit[1]) for rule, limit in quoted.items() if limit is not None} == rules
    )


def settings_presented(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the number of settings and statements, and the names of the settings."""
    number, noun, names, statements = match["n"], match["noun"], match["names"], match["statements"]
    settings = report.block["settings"]
    if noun == "visual delay":
        delays = sorted({setting["delay_ms"] for setting in settings})
        return (
            count(number) == len(delays)
            and [float(number_text) for number_text in re.findall(r"[\d.]+", names)] == delays
        )
    return (
        count(number) == len(settings)
        and listed_in(names) == {name.lower() for name in report.block["names"]}
        and count(statements) == len(report.block["items"])
    )


def presentations(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check how often a participant rated a setting."""
    fewest_, most = report.block["presentations"]
    if most == 2:
        return match[1] == ("twice" if fewest_ == most else "once or twice")
    return match[1] == (f"{most} times" if fewest_ == most else f"{fewest_} to {most} times")


def sessions_attended(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the number of sessions of each participant."""
    rows = report.study.participants[report.study.participants["counted"]]
    counts = [len(of_person) for _, of_person in rows.groupby("participant")]
    if min(counts) == max(counts):
        return count(match[1]) == max(counts)
    return match[1] == f"{min(counts)} to {max(counts)}"


def groups(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the sizes of the groups and their ratio."""
    members = report.study.trials.drop_duplicates("participant")["group"].value_counts()
    named = {name: int(n) for name, n in re.findall(r"(\w+) \(n = (\d+)\)", match[0])}
    shares = ":".join(str(group["share"]) for group in report.study.protocol["groups"].values())
    return all(members.get(name, 0) == n for name, n in named.items()) and match["ratio"] == shares


def hypothesis(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that a hypothesis is stated with its test and sides."""
    place = int(match[1] or 1) - 1
    contrast = report.contrasts[place]["contrast"]
    return (
        ("two-sample" in match[4]) == (contrast["groups"] is not None)
        and (match[3] == "two-sided") == (contrast["expected"] is None)
        and f"“{short_of(report, contrast['measure'])}”" in match[2]
    )


def low_power(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that the three tests of a hypothesis find the stated mean difference with 80 % power.

    If no difference is stated, the t tests alone show that the largest one is found too rarely.
    """
    contrast = report.contrasts[int(match[1] or 1) - 1]
    sizes, sds = zip(*((len(side["values"]), side["sd"]) for side in contrast["sides"]), strict=True)
    sides, sd, alpha = (
        "greater" if contrast["contrast"]["expected"] else "two-sided",
        contrast["sd"],
        report.alpha / contrast["members"],
    )
    numbers = np.split(np.random.default_rng(7).normal(size=(3000, sum(sizes))), [sizes[0]], axis=1)
    resamples = resamples_for(alpha) if match[3] else 1
    means = [means_of(of, group=group, resamples=resamples) for group, of in enumerate(numbers)]
    means = means[0] - means[1] if contrast["contrast"]["groups"] else means[0]
    if contrast["contrast"]["groups"]:
        sd = math.sqrt(sum((n - 1) * own**2 for n, own in zip(sizes, sds, strict=True)) / (sum(sizes) - 2))
    largest = 12.0 if contrast["contrast"]["groups"] and contrast["contrast"]["conditions"] else 6.0
    away = 0.05 if match[3] and float(match[3]) >= 10 else 0.005
    ends = [(float(match[3]) - away) / sd, (float(match[3]) + away) / sd] if match[3] else [largest / sd, math.inf]
    ends[0] = 3.0 if match[4] == "a difference of 3 SD" else ends[0]
    powers = [1.0 if math.isinf(end) else _power(_raised(means, end), sides, alpha, match[3]) for end in ends]
    is_listed = contrast["verdict"] not in DECIDED and count(match[2]) == contrast["n"]
    return is_listed and powers[0] <= 0.83 and powers[1] >= 0.77


def _power(means: Means, sides: str, alpha: float, with_bootstrap: str | None) -> float:
    ps = p_differs(means, sides)
    return float(np.mean(np.max(ps if with_bootstrap else (ps.t, ps.skewed), axis=0) <= alpha))


def _raised(means: Means, end: float) -> Means:
    return replace(means, mean=means.mean + end, lowest=means.lowest + end, highest=means.highest + end)


def tested_means(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check in which tests means are."""
    expected = {
        "the hypotheses": bool(report.contrasts),
        "the equivalence tests": bool(report.against),
        "the exploratory tests of means": any(test["outcome"]["p"] is not None for test in report.block["mixed"]),
    }
    return listed_in(match[1]) == {what for what, applies in expected.items() if applies}


def cumulative_models(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check how many cumulative models were fitted, and whether they have random slopes."""
    fitted = [model for model in report.block["cumulative"] if model["outcome"]["p"] is not None]
    failed = len(report.block["cumulative"]) - len(fitted)
    told = 1 if match["one"] else count(match["failed"]) if match["failed"] else 0
    return told == failed and len(fitted) == count(match[2]) and bool(match[1]) == (report.block["kind"] == "delays")


def no_tested_means(_match: re.Match[str], report: ReportNumbers) -> bool:
    """Check that no test is of means."""
    tested = any(test["outcome"]["p"] is not None for test in report.block["mixed"])
    return not (report.contrasts or report.against or tested)


def family(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check how many statements are corrected together."""
    return corrected(match[1], report)


def corrected(text: str, report: ReportNumbers) -> bool:
    """Return whether a text names each correction and its number of statements."""
    question = "answers follow the delay" if report.block["kind"] == "delays" else "conditions differ"
    rows = report.test_rows(question)
    corrections = {(row["correction"], int(row["members"])) for row in rows}
    return {
        (how, count(n)) for how, n in re.findall(rf"by the (Holm|Benjamini-Hochberg) method across {N}", text)
    } == corrections


def trends_tested(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check sides and correction of the tests of trends."""
    decided = report.results["decided"]
    stated = {row["item"] in (*decided["rising"], *decided["falling"]) for row in report.of_statements}
    sides = {
        frozenset({True}): "one-sided in",
        frozenset({False}): "two-sided",
        frozenset({True, False}): "one-sided if",
    }
    return match[1].startswith(sides[frozenset(stated)]) and corrected(match[2], report)


def equivalence_tests(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check the control, the bound and the level of the intervals."""
    control, bound, above, percent = match.groups()
    first = report.against[0]["found"]
    level = 100 * (1 - 2 * first["alpha"])
    return (
        float(control) == short_delay(report)
        and float(bound) == first["bound"]
        and (level > float(percent) if above else is_number(percent, level))
    )


def left_out(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check how many participants miss an answer."""
    left_out_people = {person for members in report.block["incomplete"].values() for person in members}
    return int(match[1]) == len(left_out_people)


def decided_beforehand(match: re.Match[str], report: ReportNumbers) -> bool:
    """Check alpha and the primary statements."""
    decided = report.results["decided"]
    primary = decided["primary"]
    return (
        decided["made"]
        and not decided["changed"]
        and float(match[1]) == (decided["planned_alpha"] or decided["alpha"])
        and (match[2] == "all statements" if not primary else names_in(match[2]) == set(primary))
    )


METHODS: Final[Sequence[tuple[str, Check]]] = (
    # Questionnaires and planned exclusions
    (rf"Participants completed the questionnaire “(?P<form>\w+)” \((?P<n>{N}) questions?\) (?P<times>.*)\.",
     form_times),
    (rf"According to the protocol, a session is considered for exclusion if (?P<rules>.*); (?P<met>{N}) sessions? met "
     r"(?:this rule|one of these rules)\.", rules_met),
    # Methods
    (rf"{N} participants?(?: \(SIMULATED, not people\))? took part in “Made up” \(protocol made_up, version 1\)(, "
     r"each in all conditions|, but some did not complete all conditions)?\.",
     lambda match, report: count(match[1]) == people(report)),
    (rf"(?:{N} participants? (?:did not complete (?:the session|their sessions)|(?:was|were) excluded)(?: and )?)+, so "
     rf"(?P<n>nobody|{N} participants?) (?:was|were) analysed(?:, each in all conditions|, but some did not complete "
     r"all conditions)?\.", lambda match, report: match["n"] == "nobody" or count(match["n"]) == people(report)),
    (r"Participants were randomised in permuted blocks to the groups .*, with an allocation ratio of (?P<ratio>\S+)\.",
     groups),
    (r"In “Block”, (?P<n>\w+) (?P<noun>visual delay|liquid|view)s? \((?P<names>.*?)(?: ms)?\)(?: in \w+)? "
     rf"(?:was|were) presented(?: in a random order for each participant)?; participants rated (?P<statements>{N}) "
     r"statements? after each presentation\.", settings_presented),
    (r"Several conditions have a delay of .*; they are treated as repeated presentations of one delay\.",
     when(lambda report: bool(report.block["replicated_ms"]))),
    (r"Each participant rated each \w+ (once or twice|twice|\d+(?: to \d+)? times)\.", presentations),
    (rf"Each participant attended ({N}|\d+ to \d+) sessions?\.", sessions_attended),
    (r"The tests use the median of these answers(; the detection threshold is estimated from all individual "
     r"answers)?\.",
     lambda match, report: report.block["presentations"][1] > 1
     and bool(match[1]) == (report.block["threshold"] is not None)),
    (r"The answers from sessions (.*) are compared with each other, and are pooled in all other tests\.",
     lambda match, report: listed_in(match[1]) == {str(session) for session in report.block["sessions"]}),
    (r"Conditions were identified only by codes until the key was opened\.",
     when(lambda report: report.study.revealed)),
    (r"The achieved delays in “Block” were not measured\.",
     when(lambda report: all(delivery["measured"] == 0 for delivery in report.results["delivered"]))),
    (r"(?:Hypothesis (\d+)|The hypothesis) \((.*)\) was tested with a (one-sided|two-sided) (.*)\.", hypothesis),
    (r"Comparisons between groups used the degrees of freedom of the smaller group \(Hsu 1938\)\.",
     when(lambda report: any(contrast["contrast"]["groups"] for contrast in report.contrasts))),
    (r"Each participant contributed one value to each comparison( \([a-z ,“”\w]+\))?\.",
     when(lambda report: bool(report.contrasts))),
    (r"In addition to the t test, we used a bootstrap that includes one hypothetical participant as extreme as the "
     r"most extreme participant in the sample \(Gaffke 2005\), and a t test corrected for skewness "
     r"\(Hall 1992\)\.", when(lambda report: bool(report.contrasts))),
    (r"The reported p value is the largest of the three(?:, Holm-adjusted across (\d+) hypotheses)?\.",
     lambda match, report: int(match[1] or 1) == len(report.contrasts)),
    (r"Equivalence was tested with two one-sided t tests and the same bootstrap(?:, Holm-adjusted across (\d+) "
     r"bounds)?; both had to show equivalence\.",
     lambda match, report: int(match[1] or 1)
     == sum(contrast["contrast"]["bound"] is not None for contrast in report.contrasts)),
    (r"In addition, the sample had to be large enough that it would probably include a member of any minority that "
     r"could shift the mean by as much as the bound\.",
     when(lambda report: any(contrast["contrast"]["bound"] is not None for contrast in report.contrasts))),
    (rf"Hypothesis(?: (\d+))?: with {N} participants(?: and the observed standard deviation, the true mean "
     rf"difference must be at least {R} to be detected with 80 % power; the confidence interval shows "
     r"which differences are compatible with the data|, even (a difference of 3 SD|the largest difference on the "
     r"scale) cannot be detected with 80 % power)\.", low_power),
    (r"No hypothesis tests an interaction between groups and blocks or conditions\.",
     when(lambda report: {contrast["contrast"]["groups"] is None for contrast in report.contrasts} == {True, False})),
    (r"Some participants were excluded from a test because a value was missing \(.*\)\.",
     when(lambda report: any(contrast["left_out"] for contrast in report.contrasts))),
    (r"Statements were rated on seven-point scales\.", always),
    (r"Answers were treated as ordinal and summarised by medians and quartiles \(linear interpolation, Hyndman & "
     r"Fan type 7\)\.", always),
    (r"Mean differences from the first condition are shown with 95 % confidence intervals \(Student's t\)\.",
     when(lambda report: bool(report.block["effects"]))),
    (r"Means were used for (.*)\.", tested_means),
    (r"Means were not tested\.", no_tested_means),
    (r"First, the (?:liquids|delays) were compared across both statements with a within-participant permutation test; "
     r"the statistic was the sum of the statements' Friedman statistics\.",
     when(lambda report: report.block["overall"] is not None)),
    (r"Each statement was tested with (?:Friedman's test|Wilcoxon's signed-rank test) \(.*\), with p values adjusted "
     r"(by .*); the effect size is .*\.", family),
    (r"If a statement showed a difference, pairs were compared with Wilcoxon's signed-rank test \(exact; pairs of "
     r"equal answers were dropped\), with p values Holm-adjusted across all pairs for all such statements; the effect "
     r"size is the matched-pairs rank-biserial correlation\.", when(lambda report: bool(report.block["pairs"]))),
    (r"Participants were considered to have named the liquid whose statement they rated highest; ties for the highest "
     r"rating were treated as undecided and scored as "
     r"incorrect\.", when(lambda report: report.block["named"] is not None)),
    (r"The number of correct names was tested by permuting the liquids within participants \(exact, one-sided\)\.",
     when(lambda report: report.block["named"] is not None)),
    (r"In addition, a liquid was classified as recognised only if its name was used more often for it than for each "
     r"of the others \(McNemar's exact test within participants, one-sided, with p values Holm-adjusted across the "
     r"liquids\)\.", when(lambda report: report.block["named"] is not None)),
    (r"Trends across delays were tested with a sign-flip permutation test on the participants' rank correlations "
     r"between answers and delays \((?:.*; )?(one-sided in the direction stated (?:before the first session|by the "
     r"protocol)|two-sided|one-sided if a direction was stated (?:before the first session|by the protocol), "
     r"otherwise two-sided)\), with p values adjusted (by .*)\.", trends_tested),
    (r"If a statement showed a trend, the longest delay was dropped and the rank correlations were tested again, "
     r"until no trend remained\.", when(lambda report: bool(report.block["trends"]))),
    (r"At every step, a trend required p ≤ alpha( divided by the number of (?:statements|primary or of exploratory "
     r"statements, respectively))?\.", lambda match, report: match[1] == {
         (1, 1): None, (1, 2): " divided by the number of statements",
     }.get((len({trend["primary"] for trend in report.block["trends"]}), min(len(report.block["trends"]), 2)),
           " divided by the number of primary or of exploratory statements, respectively")),
    (r"The shortest delay with a trend is an upper bound for the shortest noticeable delay\.",
     when(lambda report: bool(report.block["trends"]))),
    (rf"Each delay was compared with {R} ms using two one-sided t tests on paired differences, with equivalence "
     rf"bounds of ±{R} points?(?: \(stated before the first session\))? and (> )?{R} % confidence intervals\.",
     equivalence_tests),
    (r"A delay was classified as equivalent only if a bootstrap that includes one hypothetical participant as "
     r"extreme as the most extreme participant in the sample \(Gaffke 2005\) also showed equivalence, and "
     r"only with at least (\d+) participants\.",
     lambda match, report: int(match[1])
     == fewest(report.against[0]["found"]["alpha"], min(1 / 5, report.against[0]["found"]["bound"] / 6))),
    (r"It was classified as not equivalent if the whole confidence interval lay outside the bounds\.",
     when(lambda report: bool(report.against))),
    (r"The detection threshold is the delay at which a logistic function, fitted to agreement \(5 to 7\) in "
     r"individual answers pooled across participants, lies halfway between the guess rate and one minus the lapse "
     r"rate \(posterior median\)\.", when(lambda report: report.block["threshold"] is not None)),
    (r"Its 95 % interval is widened to allow for differences between participants\.", always),
    (r"The threshold is reported only if the statement shows a trend and the threshold lies within the range of "
     r"presented delays\.", when(lambda report: report.block["threshold"] is not None)),
    (r"A statement's adjusted p value is never smaller than the p value of the test over all statements in its block"
     r"\.",
     when(lambda report: all(float(row["p_adjusted"] or 1) >= report.p_over_all - 1e-9
                             for row in report.of_statements))),
    (r"Alpha \(([\d.]+)(?: across all looks, [\d.]+ at this look)?\) and the primary statements \((.*)\) were "
     r"specified before the first session\.", decided_beforehand),
    (r"The analysis was not specified beforehand, so all results are exploratory \(alpha = ([\d.]+)\)\.",
     lambda match, report: not report.results["decided"]["made"] and float(match[1]) == report.alpha),
    (r"In an exploratory analysis, the answers were treated as numbers: (?:differences between the conditions were "
     r"tested with Hotelling's T²|the participants' slopes were tested with Student's t test), for the participants "
     r"who answered in all conditions; the false discovery rate was controlled \(Benjamini–Hochberg\)\.",
     when(lambda report: any(test["outcome"]["p"] is not None for test in report.block["mixed"]))),
    (rf"In an exploratory analysis, a cumulative logit mixed model with random intercepts( and delay effects)? was "
     rf"fitted to (?:all individual|the participants' median) answers to {N} primary statements?(?: \(it could not be "
     rf"fitted to the other (?:(?P<failed>{N}) statements|(?P<one>statement))\))?, including the "
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
