"""The tables, sentences and rows of findings for results made up by hand, so that each cell has its own value."""

from collections.abc import Iterable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.analysis import results as analysis_results
from study_app.analysis.data.blocks import Item
from study_app.analysis.findings import cumulative_models, statement_tests
from study_app.analysis.findings import delays as delay_findings
from study_app.analysis.findings import finding as findings
from study_app.analysis.findings import recognition as recognition_findings
from study_app.analysis.findings.finding import block_answers, codes_of, summarize_block, verdict, verdict_row
from study_app.analysis.page_layout import Drawing
from study_app.analysis.results import BlockResult, Failures
from study_app.analysis.statistics.outcome import Interval
from study_app.analysis.statistics.rank_tests import SignedRanks
from study_app.analysis.statistics.slope_tests import HOTELLING, SlopeTest
from tests.analysis.made_up import DECIDED, delays, everybody, liquids, study
from tests.golden_values import page_lines

ITEMS = tuple(Item(id=item, text=f"It is {item}.", short=item.capitalize()) for item in ("warm", "thick", "calm"))
ENDS = Interval(low=-0.12, high=0.86, level=0.95, method="by tanh")
RESULTS: Any = SimpleNamespace(decided=DECIDED)


def block(kind: Any = "liquids", **changes: Any) -> BlockResult:
    """Return the result of a block of three settings."""
    settings = delays((10, 40, 90)) if kind == "delays" else liquids(3)
    block_result = BlockResult(
        id="b", title="Block", kind=kind, revealed=True, n=12, settings=settings, names=("Thin", "Wax", "Tar"),
        items=ITEMS, labels=(), measures=(),
    )  # fmt: skip
    return replace(block_result, **changes)


def ranks(**changes: Any) -> SignedRanks:
    fields = {
        "test": "Wilcoxon signed ranks", "n": 11, "dropped": 1, "statistic_name": "V", "statistic": 23.5, "p": 0.0312,
        "smallest_p": 0.002, "method": "exact", "effect_name": "rank-biserial", "effect": 0.41, "interval": ENDS,
        "zeros": 2, "superiority": 0.3, "median_difference": 1.0,
    }  # fmt: skip
    return SignedRanks(**{**fields, **changes})


def with_verdict(item: str, outcome: Any, *, result: Any = "shown", primary: bool = True, members: int = 2) -> Any:
    return analysis_results.Tested(
        item=item, outcome=outcome, family="b: family", members=members, correction="Holm", p_adjusted=0.0624,
        primary=primary, verdict=result,
    )  # fmt: skip


def lines_of(parts: Iterable[Any]) -> list[str]:
    """Return the headings, paragraphs and rows of parts of the page."""
    return list(page_lines("".join(map(str, parts))))


def test_a_table_of_tests_has_the_numbers_of_each_statement() -> None:
    untested = ranks(
        statistic=None, p=None, smallest_p=None, effect=None, interval=None, no_interval="all equal", note="alike",
        dropped=0, method="none",
    )  # fmt: skip
    tests = with_verdict("thick", ranks()), with_verdict("warm", untested, result="not tested")
    names = "session 1", "session 2"
    lines = lines_of(statement_tests.table_of_tests("Title", block(), tests, names, ("more", lambda test: test.item)))
    assert lines == [
        "Title",
        "Statement | n | V | p | adjusted p | smallest attainable p | rank-biserial | 95 % CI lower | 95 % CI upper | "
        "more | Verdict",
        "Thick | 11 (−1) | 23.5 | .031 | .062 | .002 | 0.41 | −0.12 | 0.86 | thick | shown",
        "Warm | 11 | – | – | .062 | – | – | – | – | warm | not tested (alike)",
        "Test: Wilcoxon's signed-rank test (exact); p adjusted (Holm) across 2 tests (family “b: family”). Effect "
        "size: rank-biserial, above 0 if session 1 was rated higher than session 2. Confidence intervals (95 %): "
        "by tanh.",
    ]
    slope = SlopeTest(
        test="t test of slopes", n=9, dropped=0, statistic_name="t", statistic=2.5, p=0.04, effect_name="slope",
        effect=0.7, no_interval="too few", method="t(8), two-sided",
    )  # fmt: skip
    gated = replace(with_verdict("calm", slope, members=1), p_adjusted=0.05)
    _, head, row, *notes = lines_of(statement_tests.table_of_tests("Title", block(), [gated]))
    assert (head, row) == (
        "Statement | n | t | df | p | adjusted p | slope | Verdict",
        "Calm | 9 | 2.50 | 8 | .040 | .050 | 0.70 | shown",
    )
    assert notes == [
        "Test: Student's t test on the participants' slopes (t(8), two-sided); adjusted p: that of the test over all "
        "statements, which is larger than p (family “b: family”). Effect size: slope.",
        "Too few.",
    ]
    assert lines_of(statement_tests.table_of_tests("Title", block(), [])) == []


def test_families_are_named_with_their_statements_and_corrections() -> None:
    primary, exploratory = with_verdict("warm", None, members=3), with_verdict("thick", None, primary=False, members=2)
    exploratory = replace(exploratory, correction="Benjamini-Hochberg")
    assert statement_tests.families([primary]) == "with p values adjusted by the Holm method across three statements"
    assert statement_tests.families([exploratory, primary]) == (
        "with p values adjusted by the Holm method across three primary statements and by the Benjamini-Hochberg "
        "method across two exploratory statements"
    )


def test_the_rows_of_tests_have_the_values_of_their_test_and_family() -> None:
    row = verdict_row(
        block(), "conditions differ", with_verdict("thick", ranks(note="few"), result="suggested", primary=False)
    )
    assert {name: value for name, value in row.items() if value is not None} == {
        "block": "b", "question": "conditions differ", "item": "thick", "test": "Wilcoxon signed ranks", "n": 11,
        "dropped": 1, "statistic_name": "V", "statistic": 23.5, "p": 0.0312, "p_adjusted": 0.0624, "smallest_p": 0.002,
        "family": "b: family", "members": 2, "correction": "Holm", "primary": False, "verdict": "suggested",
        "effect_name": "rank-biserial", "effect": 0.41, "low": -0.12, "high": 0.86, "level": 0.95,
        "interval": "by tanh", "method": "exact", "note": "few", "codes": "L1 L2 L3",
    }  # fmt: skip
    without = findings.test_row(block(), "conditions differ", ranks(interval=None, no_interval="all equal"))
    assert [without[name] for name in ("low", "high", "level", "interval", "note", "family", "verdict")] == [
        None, None, None, "all equal", None, None, None,
    ]  # fmt: skip
    late = delays((40, 10, 40))
    assert codes_of(block("delays", settings=late)) == "D2 D1+D3"
    assert codes_of(block("delays", settings=late), 40.0) == "D1+D3"


@pytest.mark.parametrize(
    ("p", "least", "primary", "expected"),
    [
        (0.05, 0.9, True, "shown"),
        (0.05, None, False, "suggested"),
        (0.051, 0.05, True, "not shown"),
        (0.051, None, True, "not shown"),
        (0.051, 0.051, False, "out of reach"),
        (None, 0.9, True, "not tested"),
    ],
)
def test_a_verdict_follows_from_p_and_the_smallest_p(
    p: float | None, least: float | None, primary: bool, expected: str
) -> None:
    assert verdict(p, least, 0.05, primary=primary) == expected


def test_the_test_over_all_statements_has_its_sentence_and_row() -> None:
    overall = ranks(statistic_name="chi2", test="permutation", method="4000 draws", effect_name="W")
    result = block(findings={"overall": overall})
    finding = statement_tests.OverAll(result, RESULTS)
    assert lines_of(finding.section()) == [
        "Test over all statements: χ² 23.5, p = .031 (4000 draws; smallest attainable p = .002), W 0.41, n = 11."
    ]
    (row,) = finding.rows()
    assert [row[name] for name in ("question", "family", "members", "correction", "item")] == [
        "conditions differ, all statements", "b: all statements at once", 1, "none", None,
    ]  # fmt: skip
    untested = block(findings={"overall": ranks(p=None, note="all equal")})
    assert lines_of(statement_tests.OverAll(untested, RESULTS).section()) == [
        "The test over all statements was not possible (all equal)."
    ]


def test_pairs_have_the_names_and_numbers_of_their_settings() -> None:
    pairs = (
        statement_tests.Pair("L1", "L3", with_verdict("thick", ranks())),
        statement_tests.Pair("L2", "L3", with_verdict("warm", ranks(n=10, zeros=4, interval=None), result="not shown")),
    )
    finding = statement_tests.Pairs(block(findings={"pairs": pairs}), RESULTS)
    title, head, *rows, note = lines_of(finding.section())
    assert (title, head) == (
        "Which liquids differ?",
        "Statement | Pair | n | V | p | adjusted p | smallest attainable p | rank-biserial | 95 % CI lower | 95 % CI "
        "upper | Verdict",
    )
    assert rows == [
        "Thick | Thin − Tar | 11 (9 differ) | 23.5 | .031 | .062 | .002 | 0.41 | −0.12 | 0.86 | shown",
        "Warm | Wax − Tar | 10 (6 differ) | 23.5 | .031 | .062 | .002 | 0.41 | – | – | not shown",
    ]
    assert "between the liquids (exact); p values are Holm-adjusted across the 2 pairs in this table." in note
    assert [[row[name] for name in ("question", "item", "comparison", "codes")] for row in finding.rows()] == [
        ["two conditions differ", "thick", "Thin − Tar", "L1 L3"],
        ["two conditions differ", "warm", "Wax − Tar", "L2 L3"],
    ]  # fmt: skip


def test_methods_count_the_statements_to_which_a_model_could_not_be_fitted() -> None:
    def tested(item: str, p: float | None) -> Any:
        return with_verdict(item, SimpleNamespace(p=p, note="the answers hardly vary"))

    fitted = [tested("warm", 0.03)]
    failed = [tested("thick", None), tested("calm", None)]
    for tests, note in (
        ((*fitted, *failed), "1 primary statement (it could not be fitted to the other two statements), including"),
        ((*fitted, *failed[:1]), "1 primary statement (it could not be fitted to the other statement), including"),
        (fitted, "1 primary statement, including"),
    ):
        (sentence,) = cumulative_models._CumulativeModels(
            block(findings={"cumulative": tuple(tests)}), RESULTS
        ).methods()
        assert note in sentence


def test_mean_tests_have_the_spread_of_slopes_or_the_differences_from_the_first_setting() -> None:
    intervals = (
        Interval(low=0.1, high=0.9, level=0.95, method="t"),
        Interval(low=-2.0, high=-1.0, level=0.95, method="t"),
    )
    fields = {"n": 16, "dropped": 0, "statistic_name": "F", "statistic": 4.5, "p": 0.03, "effect_name": "slope"}
    of_liquids = SlopeTest(
        test=HOTELLING,
        slopes=(0.5, -1.5),
        intervals=intervals,
        sds=(0.8, 1.6),
        intercept_sd=1.25,
        method="F(2, 14)",
        **fields,
    )
    finding = statement_tests.MeanTests(block(findings={"mixed": (with_verdict("calm", of_liquids),)}), RESULTS)
    lines = lines_of(finding.section())
    assert lines[:3] == [
        "Do mean answers differ? (exploratory)", "Statement | n | F | df | p | adjusted p | intercept SD | Verdict",
        "Calm | 16 | 4.50 | 2, 14 | .030 | .062 | 1.25 | shown",
    ]  # fmt: skip
    assert lines[-3:] == [
        "Statement | Comparison | n | mean difference | SD | SE | 95 % CI lower | 95 % CI upper",
        "Calm | Wax − Thin | 16 | 0.50 | 0.80 | 0.20 | 0.10 | 0.90",
        "Calm | Tar − Thin | 16 | −1.50 | 1.60 | 0.40 | −2.00 | −1.00",
    ]
    assert "answers for Thin. Mean differences from Thin, in points:" in lines[-4]
    over_delay = replace(of_liquids, effect=0.5, slopes=(0.5,), sds=(0.8,), interval=intervals[0], method="t(15)")
    late = statement_tests.MeanTests(block("delays", findings={"mixed": (with_verdict("calm", over_delay),)}), RESULTS)
    _, head, row, *notes = lines_of(late.section())
    assert head.endswith("| slope | 95 % CI lower | 95 % CI upper | slope SD | intercept SD | Verdict")
    assert row.endswith("| 0.50 | 0.10 | 0.90 | 0.80 | 1.25 | shown")
    assert notes[-1].startswith("Slopes are in points per 100 ms of delay.")


def against(item: str, delay_ms: float, verdict_: str, **changes: Any) -> Any:
    beyond = SimpleNamespace(count=3, n=11, interval=SimpleNamespace(low=0.06, high=0.61))
    fields = {
        **{name: getattr(ranks(), name) for name in ("test", "n", "dropped", "statistic_name", "statistic", "p")},
        **{name: getattr(ranks(), name) for name in ("smallest_p", "method", "effect_name", "effect", "interval")},
        "no_interval": "", "note": "", "bound": 0.5, "alpha": 0.025, "verdict": verdict_, "p_bootstrap": 0.047,
        "checks_agree": True, "beyond": beyond,
    }  # fmt: skip
    tested_delay: Any = SimpleNamespace(**{**fields, **changes})
    return delay_findings.ContrastWithControl(item, delay_ms, 10.0, tested_delay)


AGAINST = (
    against("warm", 40.0, "equivalent"), against("warm", 90.0, "inconclusive", checks_agree=False, effect=-0.9),
    against("thick", 40.0, "not equivalent", effect=1.75), against("thick", 90.0, "out of reach", beyond=None),
)  # fmt: skip


def test_comparisons_with_the_shortest_delay_have_their_own_numbers() -> None:
    finding = delay_findings.ContrastsWithControl(block("delays", findings={"against": AGAINST}), RESULTS)
    lines = lines_of(finding.section())
    assert lines[:6] == [
        "Comparison of each delay with 10 ms",
        "Statement | Comparison | n | mean difference | 95 % CI lower | 95 % CI upper | participants outside the "
        "bounds | p (t tests) | p (bootstrap) | Verdict",
        "Warm | 40 ms − 10 ms | 11 | 0.41 | −0.12 | 0.86 | 3 of 11 [6, 61] % | .031 | .047 | equivalent",
        "Warm | 90 ms − 10 ms | 11 | −0.90 | −0.12 | 0.86 | 3 of 11 [6, 61] % | .031 | .047 | inconclusive *",
        "Thick | 40 ms − 10 ms | 11 | 1.75 | −0.12 | 0.86 | 3 of 11 [6, 61] % | .031 | .047 | not equivalent",
        "Thick | 90 ms − 10 ms | 11 | 0.41 | −0.12 | 0.86 | – | .031 | .047 | out of reach",
    ]
    assert "equivalence bounds of ±0.5 points, and a 95 % confidence interval." in lines[6]
    assert "* The t tests and the bootstrap disagree in 1 of 4 comparisons." in lines[6]
    assert [line.rpartition(" | ")[0] for line in lines if line.startswith(("40 ms |", "90 ms |"))] == [
        "40 ms | Warm | Thick | – | –", "90 ms | – | – | Warm | Thick",
    ]  # fmt: skip
    rows = list(finding.rows())
    assert [[row[name] for name in ("item", "comparison", "verdict", "codes", "family")] for row in rows[:2]] == [
        ["warm", "40 ms − 10 ms", "equivalent", "D2 D1", "b: warm at 40 ms"],
        ["warm", "90 ms − 10 ms", "inconclusive", "D3 D1", "b: warm at 90 ms"],
    ]
    assert delay_findings.equivalent_up_to(AGAINST) == {"warm": 40.0, "thick": None}
    again = against("warm", 40.0, "inconclusive"), against("warm", 90.0, "equivalent")
    assert delay_findings.equivalent_up_to(again) == {"warm": None}, "the first that fails ends the sequence"
    entries = finding.entries(finding.result)
    assert (entries["against"], entries["equivalent_up_to"]) == (AGAINST, {"warm": 40.0, "thick": None})
    first, second = finding.limits()
    assert first.endswith("This study has twelve participants, so it can show only that a mean answer differs by more.")
    assert second.startswith("Block (delays): in 2 of 4 comparisons with 10 ms (one for each statement and delay)")


def test_the_answer_on_unchanged_delays_follows_from_all_statements() -> None:
    def answer(*comparisons: Any, n: int = 200) -> tuple[str, str]:
        given_answer = delay_findings._EquivalentDelays(
            block("delays", n=n, findings={"against": comparisons}), RESULTS
        ).answer()
        return given_answer.verdict, given_answer.text

    share = SimpleNamespace(count=1, n=9, interval=SimpleNamespace(low=0.0, high=0.33))
    both = against("warm", 40.0, "equivalent"), against("thick", 40.0, "equivalent", beyond=share)
    assert answer(*both, against("warm", 90.0, "equivalent"), against("thick", 90.0, "inconclusive")) == (
        "equivalent",
        "Up to 40 ms, mean answers to both statements stay within ±0.5 points of those at 10 ms, but the data do not "
        "rule out the possibility that up to 61 % of people show a larger difference.",
    )
    assert answer(*AGAINST) == (
        "inconclusive",
        "We could not show for any delay that the mean answers to all statements stay within ±0.5 points of those at "
        "10 ms. The largest mean difference is 1.75 points (“Thick” at 40 ms, 95 % confidence interval [−0.12, 0.86], "
        "n = 11). In 1 of 4 comparisons (at 40 ms), the whole confidence interval lies outside the equivalence bounds "
        "(not equivalent; not corrected for the number of comparisons).",
    )
    few = answer(against("warm", 40.0, "inconclusive"), n=12)[1]
    assert " (at least 43 participants are needed). The largest" in few, "0.975 = 1 − (11 / 12) ** 43"
    assert few.endswith("Failing to show equivalence is not evidence that answers change.")


def lowest(item: str, *steps: tuple[float, float | None], members: int = 2) -> Any:
    trends = [
        SimpleNamespace(longest_ms=ms, trend=SimpleNamespace(**vars_of(ranks(p=p, effect=0.3 + ms / 1000))))
        for ms, p in steps
    ]
    reached = [ms for ms, p in steps if p is not None and p <= 0.05]
    fields: Any = SimpleNamespace(steps=tuple(trends), lowest_ms=min(reached, default=None), alpha=0.05, note="")
    return delay_findings.LowestTrend(item, fields, members)


def vars_of(outcome: Any) -> dict[str, Any]:
    names = (
        "test",
        "n",
        "dropped",
        "statistic_name",
        "statistic",
        "p",
        "smallest_p",
        "method",
        "effect_name",
        "effect",
    )
    return {name: getattr(outcome, name) for name in (*names, "interval", "no_interval", "note")}


LOWEST = lowest("warm", (90.0, 0.001), (40.0, 0.03)), lowest("calm", (90.0, 0.04), (40.0, None))


def test_the_shortest_delay_with_a_trend_is_corrected_over_the_statements() -> None:
    assert [row.over_all_ms for row in LOWEST] == [90.0, None]
    trends = with_verdict("warm", ranks()), with_verdict("calm", ranks())
    finding = delay_findings.LowestDelay(block("delays", findings={"lowest": LOWEST, "trends": trends}), RESULTS)
    lines = lines_of(finding.section())
    assert lines[1:4] == [
        "Statement | shortest | uncorrected | longest delay and p at each step",
        "Warm | ≤ 90 ms | ≤ 40 ms | 90 ms .001; 40 ms .030",
        "Calm | – | ≤ 90 ms | 90 ms .040; 40 ms –",
    ]
    assert "requires p ≤ alpha / 2 at every step, which controls the error rate across both statements;" in lines[4]
    rows = [[row[name] for name in ("item", "comparison", "p", "members", "family")] for row in finding.rows()]
    assert rows == [
        ["warm", "up to 90 ms", 0.001, 2, "b: stepping down within warm"],
        ["warm", "up to 40 ms", 0.03, 2, "b: stepping down within warm"],
        ["calm", "up to 90 ms", 0.04, 2, "b: stepping down within calm"],
        ["calm", "up to 40 ms", None, 2, "b: stepping down within calm"],
    ]
    alone, warm = replace(LOWEST[0], members=1), with_verdict("warm", ranks(), members=1)
    finding = delay_findings.LowestDelay(block("delays", findings={"lowest": (alone,), "trends": (warm,)}), RESULTS)
    assert "no trend remains. Every step requires p ≤ alpha. The shortest delay" in lines_of(finding.section())[3]
    others = [with_verdict(item, ranks(), primary=False, members=3) for item in ("calm", "thick", "wet")]
    both = block("delays", findings={"lowest": (alone, LOWEST[1]), "trends": (warm, *others)})
    assert (
        "“Shortest” requires p ≤ alpha for primary and p ≤ alpha / 3 for exploratory statements at every step, which "
        "controls the error rate across the primary and across the exploratory statements;"
    ) in lines_of(delay_findings.LowestDelay(both, RESULTS).section())[-1]


def test_the_answer_on_noticed_delays_prefers_primary_statements_and_turns_falling_ones() -> None:
    decided = replace(DECIDED, primary=("warm",), rising=("warm",), falling=("calm",), noticed=None)

    def answer(*lowest_trends: Any, primary: tuple[str, ...] = ("warm",)) -> tuple[str, str]:
        results: Any = SimpleNamespace(decided=replace(decided, primary=primary))
        given_answer = delay_findings._FirstNoticedDelay(
            block("delays", findings={"lowest": lowest_trends}), results
        ).answer()
        return given_answer.verdict, given_answer.text

    rest = (
        " With two statements tested, p ≤ 0.025 (0.05 / 2) is significant. Participants may also notice shorter "
        "delays. The test compares ranks, not mean ratings."
    )
    early = lowest("calm", (90.0, 0.001), (40.0, 0.002))
    assert answer(LOWEST[0], early) == (
        "shown",
        "Over delays of 10 to 90 ms, participants tended to rate longer delays higher on “Warm” (mean rank correlation "
        f"0.39, p = .001, n = 11).{rest}",
    )
    assert answer(LOWEST[0], early, primary=("calm", "warm")) == (
        "shown",
        "Over delays of 10 to 40 ms, participants tended to rate longer delays lower on “Calm” (mean rank correlation "
        f"−0.34, p = .002, n = 11).{rest}",
    )
    assert answer(early)[0] == "suggested"
    assert answer(LOWEST[1]) == (
        "not shown",
        "We could not show that participants noticed any delay. This is not evidence that there is no difference.",
    )


def threshold(**changes: Any) -> Any:
    fields = {
        "effect": 57.3, "n": 9, "guess": 0.1, "lapse": 0.04, "half_way": 0.53, "width": 20.0,
        "levels": (10.0, 40.0, 90.0),
        "yes": (1, 4, 8), "asked": (9, 8, 9), "note": "few answers", "method": "posterior median",
        "no_interval": "open",
        "interval": Interval(low=41.4, high=88.6, level=0.95, method="b"),
    }  # fmt: skip
    return SimpleNamespace(**{**fields, **changes})


def test_the_detection_threshold_has_its_interval_shares_and_the_counts_at_each_delay() -> None:
    def lines(value: Any) -> list[str]:
        finding = delay_findings.DetectionThreshold(block("delays", findings={"threshold": value}), RESULTS)
        return lines_of(finding.section())

    counts = "Answers that express agreement (5 to 7): 1 of 9 at 10 ms, 4 of 8 at 40 ms, 8 of 9 at 90 ms."
    assert lines(threshold())[1].startswith(
        "Detection threshold: 57 ms, 95 % interval [41, 89] ms, n = 9. The threshold is the delay at which the fitted "
        "function lies halfway between the guess rate (10 %) and one minus the lapse rate (4 %). At this delay, 53 % "
        f"of answers express agreement. {counts} Few answers. Fit: posterior median."
    )
    assert lines(threshold(interval=None))[1].startswith("Detection threshold: 57 ms, open, n = 9. The")
    assert lines(threshold(effect=None)) == [
        "At what delay do participants notice a difference?",
        f"No threshold could be estimated: few answers. {counts}",
    ]


@pytest.mark.slow
def test_the_figure_of_the_threshold_has_the_share_of_each_participant() -> None:
    """Code D3 is 90 ms; the first of two participants agrees at 40 ms in one of two answers, and at 90 ms."""
    agreed = {("P000", "D2", 0): 5, ("P000", "D3", 0): 7, ("P000", "D3", 1): 6, ("P001", "D1", 0): 5}
    counts: dict[tuple[str, str, str], int] = {}

    def given(person: int, _session: int, code: str, item: str) -> int:
        key = (f"P{person:03d}", code, item)
        counts[key] = counts.get(key, -1) + 1
        return agreed.get((key[0], code, counts[key]), 4) if item == "different" else 7

    settings = delays((10, 40, 90))
    case_study = study(
        settings, list(everybody(settings, 2, given, repetitions=2)), replace(DECIDED, noticed="different")
    )
    case_study = replace(
        case_study, responses=case_study.responses.assign(response=case_study.responses["response"].astype("Int64"))
    )
    result = block("delays", findings={"threshold": threshold(), "lowest": (*LOWEST, lowest("thick", (40.0, 0.01)))})
    results: Any = SimpleNamespace(decided=case_study.decided)
    drawing = Drawing(case_study, case_study.blocks[0], result, results, "threshold-b", ())
    finding = delay_findings.DetectionThreshold(result, results)
    assert finding._shares(drawing) == {"P000": {10: 0.0, 40: 0.5, 90: 1.0}, "P001": {10: 0.5, 40: 0.0, 90: 0.0}}
    picture = finding.figure(drawing)
    assert picture is not None
    assert picture.numbers.splitlines()[:2] == ["participant\t10 ms\t40 ms\t90 ms", "P000\t0.0\t0.5\t1.0"]
    assert "diamond: the detection threshold, 57 ms (95 % interval [41, 89] ms)." in picture.caption
    assert picture.caption.endswith(" Dashed line: the shortest delay at which any statement shows a trend, 40 ms.")


RATES = tuple(
    SimpleNamespace(setting=setting, hits=hits, n=11, rate=hits / 11, interval=ENDS, rival=rival, p=p, p_adjusted=2 * p)
    for setting, hits, rival, p in ((1, 7, 0, 0.02), (0, 9, 1, 0.004), (2, 3, None, 0.3))
)


def named(**changes: Any) -> Any:
    outcome = {
        "p": 0.0031, "note": "", "statistic": 19.0, "expected": 11.25, "method": "exact", "smallest_p": 0.0002,
        "effect": 0.46, "interval": Interval(low=0.2, high=0.7, level=0.95, method="bootstrap"), "decided": 30,
        "undecided": 2, "unanswered": 1, "rates": RATES, "no_interval": "",
        "table": ((9, 1, 0, 4, 0), (2, 7, 1, 5, 0), (3, 3, 3, 6, 1)),
    }  # fmt: skip
    rates_result: Any = SimpleNamespace(**{**outcome, **changes.pop("found", {})})
    fields = {"labels": ("warm", "thick", "calm"), "right": ("warm", "thick", None), "settings": ("L1", "L2", "L3")}
    return SimpleNamespace(**{**fields, "found": rates_result, "verdict": "shown", **changes})


def test_recognition_is_not_missing_from_studies_that_do_not_ask_for_it() -> None:
    settings = tuple(replace(setting, label=None) for setting in liquids(3))
    for labelled, absent in ((liquids(3), 1), (settings, 0)):
        made = study(labelled, list(everybody(labelled, 6, lambda person, _session, code, _item: 2 + person % 3)))
        without_names = replace(made, decided=replace(made.decided, names=()))
        answers = block_answers(without_names, made.blocks[0], 1, Failures())
        found, reasons = recognition_findings.LiquidRecognition.test(answers, summarize_block(None, answers))
        assert (found, len(reasons)) == (None, absent)


def test_recognised_liquids_have_their_counts_rivals_and_kappa() -> None:
    finding = recognition_findings.LiquidRecognition(block(findings={"named": named()}), RESULTS)
    lines = lines_of(finding.section())
    assert lines[:5] == [
        "Were the liquids recognised?",
        "Liquid | correct | n | undecided | proportion | 95 % CI lower | 95 % CI upper | closest other liquid | p | "
        "adjusted p",
        "Thin | 9 | 11 | 4 | 0.82 | −0.12 | 0.86 | Wax | .004 | .008",
        "Wax | 7 | 11 | 5 | 0.64 | −0.12 | 0.86 | Thin | .020 | .040",
        "Tar | 3 | 11 | 6 | 0.27 | −0.12 | 0.86 | – | .300 | .600",
    ]
    assert lines[5] == (
        "Correct names: 19; 11.2 expected by chance; p = .003 (exact; smallest attainable p < .001): shown. Cohen's "
        "kappa for the 30 decided answers is 0.46 (95 % confidence interval [0.20, 0.70]). 2 undecided answers count "
        "as incorrect and are not included in kappa. This is a single test, so its p value is not corrected."
    )
    untested = recognition_findings.LiquidRecognition(
        block(findings={"named": named(found={"p": None, "note": "too few"})}), RESULTS
    )
    assert lines_of(untested.section())[-1] == "Not tested: too few."


def test_the_answer_on_liquids_names_recognised_and_differing_ones() -> None:
    pairs = (
        statement_tests.Pair("L1", "L3", with_verdict("thick", ranks())),
        statement_tests.Pair("L1", "L3", with_verdict("warm", ranks())),
        statement_tests.Pair("L2", "L3", with_verdict("warm", ranks(), result="not shown")),
    )  # fmt: skip
    effects = tuple(
        statement_tests.Effect(item=item, code=code, n=n, mean=mean, low=mean - 1, high=mean + 1)
        for item, code, n, mean in (("warm", "L2", 10, 1.25), ("thick", "L3", 9, -2.5), ("calm", "L2", 8, 5.0))
    )
    fields = {
        "named": named(), "pairs": pairs, "effects": effects,
        "omnibus": (
            *(with_verdict(item, ranks()) for item in ("thick", "warm")),
            with_verdict("calm", ranks(), result="suggested", primary=False),
        ),
    }  # fmt: skip

    def answer(**changes: Any) -> tuple[str, str]:
        given_answer = recognition_findings._Distinguished(block(findings={**fields, **changes}), RESULTS).answer()
        assert given_answer.claims is (given_answer.verdict != "not shown")
        return given_answer.verdict, given_answer.text

    largest = (
        " The largest mean difference from thin is −2.50 points (“Thick” for tar, 95 % confidence interval [−3.50, "
        "−1.50], n = 9)."
    )
    assert answer() == (
        "shown",
        "Overall, participants named 19 of 33 liquids correctly, more than the 11.2 expected by chance (given how "
        "often each name was used; p = .003). Recognised above chance: wax and thin. Ratings differed between thin and "
        f"tar (“Thick” and “Warm”).{largest}",
    )
    few = answer(named=None, pairs=())
    assert few[1] == (
        "The liquids were rated differently on “Thick” and “Warm”, but the tests do not show which ones differ."
        + largest
    )
    nothing = answer(named=named(verdict="not shown"), pairs=(), omnibus=())
    assert nothing[0] == "not shown"
    hits = "Participants named 19 of 33 liquids correctly (11.2 expected by chance, given how often each name was used;"
    assert nothing[1].startswith(f"{hits} p = .003). ")
    assert " No statement showed a difference between any two liquids. This is not evidence that" in nothing[1]
    unnamed = answer(named=named(verdict="not shown"))
    assert unnamed[1].startswith(f"Ratings differed between thin and tar (“Thick” and “Warm”).{largest} {hits}")


@pytest.mark.slow
def test_the_figure_of_recognition_has_the_names_and_counts() -> None:
    case_study = study(liquids(3), list(everybody(liquids(3), 11, lambda *_: 4)))
    result = block(findings={"named": named()})
    finding = recognition_findings.LiquidRecognition(result, RESULTS)
    picture = finding.figure(Drawing(case_study, case_study.blocks[0], result, RESULTS, "recognition-b", ()))
    assert picture is not None
    assert picture.numbers.splitlines() == [
        "liquid\tWarm\tThick\tCalm\tundecided\tunanswered", "Thin\t9\t1\t0\t4\t0", "Wax\t2\t7\t1\t5\t0",
        "Tar\t3\t3\t3\t6\t1",
    ]  # fmt: skip
    assert (
        " Correct: 19; 11.2 expected by chance (liquids permuted within each participant; exact, one-sided, p = .003)"
        in (picture.caption)
    )


def test_the_summary_of_a_block_counts_presentations_sessions_and_missing_answers() -> None:
    settings = delays((50, 10, 50))
    rows = [
        ("P1", 1, "D1", (4, None)), ("P1", 1, "D2", (3, 2)), ("P1", 1, "D3", (4, 5)), ("P2", 2, "D1", (4, 4)),
        ("P2", 2, "D2", (None, 4)),
    ]  # fmt: skip
    case_study = study(settings, rows)
    answers = block_answers(case_study, case_study.blocks[0], 1, Failures())
    result = summarize_block(case_study, answers)
    assert (result.n, result.presentations, result.sessions, result.replicated_ms) == (2, (1, 2), (1, 2), (50.0,))
    assert result.incomplete == {"different": ("P2",)}
    assert answers.values["harder"].tolist() == [[2.0, 5.0], [4.0, 4.0]]
