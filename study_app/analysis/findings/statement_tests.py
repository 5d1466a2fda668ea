"""Tests of statements: whether conditions differ, in which pairs, with the delay and between sessions."""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np

from study_app import number_text
from study_app.analysis.data.blocks import KINDS, TRENDS
from study_app.analysis.data.measures import LEVELS, by_participant, medians
from study_app.analysis.figures.people_figures import MOST_LETTERS, Column, Panel, mean_of, people_picture
from study_app.analysis.findings.finding import (
    FDR,
    HOLM,
    Absent,
    BlockAnswers,
    Finding,
    Row,
    corrected_tests,
    in_family,
    test_row,
    uncorrected_entries,
    verdict_row,
)
from study_app.analysis.html_page import ends_of, heading, paragraph, table_of
from study_app.analysis.page_layout import Drawing, Picture
from study_app.analysis.results import (
    BlockResult,
    Failure,
    NotTested,
    Tested,
    method_text,
    name,
    settings_noun,
    short_text,
    statistic,
    statistic_symbol,
    test_name,
)
from study_app.analysis.statistics.outcome import Interval, Outcome, false_discovery, holm, student_interval
from study_app.analysis.statistics.rank_tests import SignedRanks, friedman, global_permutation, signed_rank_test
from study_app.analysis.statistics.slope_tests import HOTELLING, PAIRED, T_TEST, SlopeTest, slope_test
from study_app.analysis.statistics.trend_tests import trend
from study_app.analysis.wording import (
    all_of,
    bound_text,
    counted,
    listed,
    ms,
    number,
    p_equals,
    p_value,
    percent,
    significant,
)

ONE_DELAY: Final = "the block has only one delay, so there is nothing to compare it with"


def table_of_tests(
    title: str,
    result: BlockResult,
    tests: Sequence[Tested],
    compared: Sequence[str] = (),
    *more: tuple[str, Callable[[Tested], str]] | None,
) -> Iterator[str]:
    """Yield a table of tests with ``more`` columns; ``compared`` are the names of the compared settings."""
    if not tests:
        return
    first, outcomes = tests[0], [test.outcome for test in tests]
    intervals = dict.fromkeys(outcome.interval.method for outcome in outcomes if outcome.interval is not None)
    reasons = dict.fromkeys(outcome.no_interval for outcome in outcomes if outcome.no_interval)
    methods = dict.fromkeys(outcome.method for outcome in outcomes if outcome.p is not None)
    family = dict.fromkeys(f"{_adjustment(test)} (family “{test.family}”)" for test in tests)
    two = isinstance(first.outcome, SignedRanks) and len(compared) == 2
    above = f", above 0 if {compared[0]} was rated higher than {compared[1]}" if two else ""
    exact = f" ({method_text(methods)})" if methods else ""
    l_words = " L is Page's statistic." if statistic_symbol(first.outcome) == "L" else ""
    effect = first.outcome.effect_name
    yield heading(3, title)
    yield table_of(
        tests,
        ("Statement", lambda test: short_text(result, test.item)),
        ("n", lambda test: f"{test.outcome.n}" + (f" (−{test.outcome.dropped})" if test.outcome.dropped else "")),
        (statistic_symbol(first.outcome), lambda test: number(test.outcome.statistic)),
        ("df", lambda test: _freedom(test.outcome)) if any(map(_freedom, outcomes)) else None,
        ("p", lambda test: p_value(test.outcome.p)),
        ("adjusted p", lambda test: p_value(test.p_adjusted)),
        ("smallest attainable p", lambda test: p_value(test.outcome.smallest_p))
        if _any_has(outcomes, "smallest_p")
        else None,
        (effect if len(effect) <= _MOST_NAME else "effect size", lambda test: number(test.outcome.effect))
        if _any_has(outcomes, "effect")
        else None,
        *(ends_of(lambda test: test.outcome.interval) if intervals else ()),
        *more,
        ("Verdict", _verdict_cell),
        last=1,
    )
    size = f" Effect size: {effect}{above}." if _any_has(outcomes, "effect") else ""
    ends = f" Confidence intervals (95 %): {'; '.join(intervals)}." if intervals else ""
    yield paragraph(f"Test: {test_name(first.outcome)}{exact}; {'; '.join(family)}.{l_words}{size}{ends}", "soft")
    if reasons and size and not intervals:
        yield paragraph(f"{'; '.join(map(number_text.capitalised, reasons))}.", "soft")


_MOST_NAME: Final = 16
"""The most letters of an effect size in a heading; longer names are below the table."""


def _adjustment(test: Tested) -> str:
    """Return a phrase on the adjustment of a p value: within its family, or by the test over all statements."""
    if test.members > 1:
        return f"p adjusted ({test.correction}) across {test.members} tests"
    if test.outcome.p is not None and test.p_adjusted is not None and test.p_adjusted > test.outcome.p:
        return "adjusted p: that of the test over all statements, which is larger than p"
    return "p not adjusted"


def _freedom(outcome: Outcome) -> str:
    """Return the degrees of freedom of t or F, "" if there are none."""
    match = re.match(r"[tF]\(([^)]*)\)", outcome.method)
    return match[1] if match else ""


def _any_has(outcomes: Sequence[Outcome], field: str) -> bool:
    return any(getattr(outcome, field) is not None for outcome in outcomes)


def _verdict_cell(test: Tested) -> str:
    return test.verdict + (f" ({test.outcome.note})" if test.verdict == "not tested" and test.outcome.note else "")


def families(tests: Sequence[Tested]) -> str:
    """Return a phrase on the families in which p values are adjusted: primary and exploratory statements."""
    groups = sorted({(not test.primary, test.members, test.correction) for test in tests})
    several = len(groups) > 1
    return "with p values adjusted " + listed(
        [
            f"by the {correction} method across {counted(members, f'{kind} statement')}"
            for exploratory, members, correction in groups
            for kind in [("exploratory" if exploratory else "primary") if several else ""]
        ]
    ).replace("  ", " ")


def test_differences(answers: BlockAnswers) -> tuple[tuple[Tested, ...], Absent]:
    """Test for each statement whether answers differ between settings."""
    if answers.k < 2:
        return (), (NotTested(SettingsDiffer.what, "the block has only one condition, so there is nothing to compare"),)
    outcomes = {item: _test_difference(answers, values) for item, values in answers.values.items()}
    return corrected_tests(outcomes, answers, f"{answers.block.id}: conditions differ"), ()


def _test_difference(answers: BlockAnswers, values: Any) -> Outcome:
    if values.shape[1] == 2:
        return signed_rank_test(values[:, 0], values[:, 1], alpha=answers.decided.alpha)
    return friedman(values, draws=answers.draws, seed=answers.seed)


def slope_tests(answers: BlockAnswers) -> dict[str, SlopeTest]:
    """Return the mean test of every statement: slopes against delay, or differences from the first setting."""
    over_delay = answers.block.kind == "delays"
    columns = np.array(answers.block.delays_ms)[:, None] / 100 if over_delay else None
    return {
        item: slope_test(values, columns, answers.decided.direction(item) if over_delay else None)
        for item, values in answers.values.items()
    }


class StatementTests(Finding[tuple[Tested, ...]]):
    """A finding with one test per statement; ``title`` may contain {noun}, the noun for settings."""

    empty = ()
    asks: ClassVar[str]
    title: ClassVar[str]

    def compared_names(self) -> Sequence[str]:
        """Return the names of the compared settings."""
        return ()

    def rows(self) -> Iterator[Row]:
        return (verdict_row(self.result, self.asks, test) for test in self.value)

    def section(self) -> Iterator[str]:
        return table_of_tests(self._with_noun(self.title), self.result, self.value, self.compared_names())

    def _with_noun(self, words: str) -> str:
        return words.format(noun=settings_noun(self.result))


class SettingsDiffer(StatementTests):
    """Differences between settings for each statement."""

    key = "omnibus"
    place = 2
    row_place = 2
    what = "test of differences between conditions"
    kinds = ("liquids", "views")
    sealed = KINDS
    statements = True
    asks = "conditions differ"
    title = "Do the {noun}s differ, statement by statement?"

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[tuple[Tested, ...], Absent]:
        return test_differences(answers)

    def compared_names(self) -> Sequence[str]:
        return self.result.names

    def methods(self) -> Iterator[str]:
        if (test := _first_tested(self.value)) is not None:
            yield (
                f"Each statement was tested with {test_name(test.outcome)} ({test.outcome.method}), "
                f"{families(self.value)}; the effect size is {test.outcome.effect_name}."
            )


def _first_tested(tests: Sequence[Tested]) -> Tested | None:
    """Return the first test with a p value."""
    return next((test for test in tests if test.outcome.p is not None), None)


class DelayTrend(StatementTests):
    """The trend test over the delay for each statement, in the stated direction or two-sided."""

    key = "trends"
    place = 5
    row_place = 3
    what = "trend test"
    kinds = ("delays",)
    waits = ("delays",)
    statements = True
    asks = "answers follow the delay"
    title = "Do answers change with the delay?"

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[tuple[Tested, ...], Absent]:
        if answers.k < 2:
            return (), (NotTested(cls.what, ONE_DELAY),)
        outcomes: Mapping[str, Outcome]
        if answers.decided.trends == "slopes":
            outcomes = slope_tests(answers)
        else:
            outcomes = {
                item: trend(values, answers.decided.direction(item), seed=answers.intervals)
                for item, values in answers.values.items()
            }
        return corrected_tests(outcomes, answers, f"{answers.block.id}: trend over delay"), ()

    def methods(self) -> Iterator[str]:
        if trends := self.value:
            decided, first = self.results.decided, _first_tested(trends)
            sides = [decided.direction(test.item) is not None for test in trends]
            stated = "before the first session" if decided.binding else "by the protocol"
            one_sided = f"one-sided in the direction stated {stated}" if all(sides) else "two-sided"
            if any(sides) and not all(sides):
                one_sided = f"one-sided if a direction was stated {stated}, otherwise two-sided"
            if decided.trends == "ranks" and first is not None:
                one_sided = f"{first.outcome.method.split(',')[0]}; {one_sided}"
            yield f"Trends across delays were tested with {TRENDS[decided.trends]} ({one_sided}), {families(trends)}."
            yield (
                "If a statement showed a trend, the longest delay was dropped and the rank correlations were tested "
                f"again, until no trend remained. At every step, a trend required p ≤ alpha{_divided_text(trends)}. "
                "The shortest delay with a trend is an upper bound for the shortest noticeable delay."
            )


def _divided_text(trends: Sequence[Tested]) -> str:
    """Return a phrase on the correction of alpha for the number of statements, with a leading space, or ""."""
    families = {test.primary: test.members for test in trends}
    if len(families) > 1:
        return " divided by the number of primary or of exploratory statements, respectively"
    return " divided by the number of statements" if len(trends) > 1 else ""


class _SessionsDiffer(StatementTests):
    """The comparison of sessions for each statement, by participants who attended all of them."""

    key = "by_session"
    place = 12
    row_place = 4
    what = "comparison of sessions"
    sealed = KINDS
    compares_settings = False
    asks = "sessions differ"
    title = "Do sessions differ?"

    def compared_names(self) -> Sequence[str]:
        return [f"session {number}" for number in self.result.sessions]

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[tuple[Tested, ...], Absent]:
        """Compare participants' medians per session over the settings that were answered in all sessions."""
        numbers = result.sessions
        if len(numbers) < 2:
            return (), ()
        outcomes = {}
        for item in answers.block.items:
            single, sessions = answers.single[item.id], answers.sessions[item.id]
            by_session = np.stack([medians(np.where(sessions == number, single, np.nan)) for number in numbers], axis=2)
            in_all_sessions = np.asarray(~np.isnan(by_session).any(axis=2))
            outcomes[item.id] = _test_difference(
                answers, medians(np.where(in_all_sessions[..., None], by_session, np.nan).transpose(0, 2, 1))
            )
        ungated = replace(answers, gate=0.0)  # sessions may differ even if settings do not
        tested = in_family(outcomes, ungated, f"{answers.block.id}: sessions", false_discovery, FDR, primary=False)
        if all(test.outcome.n == 0 for test in tested):
            return (), (NotTested(cls.what, "no participant rated the same condition in all sessions"),)
        return tested, ()


def add_gates(blocks: Sequence[BlockAnswers], draws: int | None = None) -> tuple[BlockAnswers, ...]:
    """Return the answers of a study's blocks with the global test over all statements and the resulting gate.

    ``draws`` overrides the usual number of random permutations. If the test fails or has no p value, the gate is 1, so
    that nothing is significant.
    """

    def test(answers: BlockAnswers) -> Outcome | None:
        if answers.k < 2:
            return None
        values = np.array(list(answers.values.values()))
        return global_permutation(values, draws=draws or answers.draws_over_all, seed=answers.seed)

    tests = [block.failures.attempt(OverAll.what, partial(test, block), block=block.block.id) for block in blocks]
    adjusted = holm([test.p if isinstance(test, Outcome) else None for test in tests])
    return tuple(
        replace(answers, over_all=test, gate=1.0 if p is None else p)
        for answers, test, p in zip(blocks, tests, adjusted, strict=True)
    )


class OverAll(Finding[Outcome | None]):
    """The global test over all statements of a block for any difference between settings."""

    key = "overall"
    place = 1
    row_place = 1
    what = "test over all statements"
    waits = ("liquids", "views")

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[Outcome | None, Absent]:
        if isinstance(answers.over_all, Failure):
            return None, (NotTested(cls.what, answers.over_all.why),)
        return answers.over_all, ()

    def rows(self) -> Iterator[Row]:
        if (overall := self.value) is not None:
            row = test_row(self.result, "conditions differ, all statements", overall)
            yield row | uncorrected_entries(self.result, "all statements at once")

    def section(self) -> Iterator[str]:
        if (overall := self.value) is None:
            return
        if overall.p is None:
            yield paragraph(f"The test over all statements was not possible ({overall.note}).")
            return
        yield paragraph(
            f"Test over all statements: {statistic(overall)}, {p_equals(overall.p)} ({overall.method}; smallest "
            f"attainable {p_equals(overall.smallest_p or 0.0)}), {overall.effect_name} {number(overall.effect)}, "
            f"n = {overall.n}."
        )

    def methods(self) -> Iterator[str]:
        if self.value is not None:
            several = len(self.result.items) > 1
            across = f" across {all_of(len(self.result.items), 'statement')}" if several else ""
            statistic_text = "the sum of the statements' Friedman statistics" if several else "Friedman's statistic"
            yield (
                f"First, the {settings_noun(self.result)}s were compared{across} with a within-participant "
                f"permutation test; the statistic was {statistic_text}."
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """The mean difference of a setting (code) from the first one in one statement, for ``n`` participants.

    ``low`` and ``high`` are the ends of Student's 95 % interval, None if there is none.
    """

    item: str
    code: str
    n: int
    mean: float | None
    low: float | None
    high: float | None


def _scale_text(labels: Sequence[str]) -> str:
    """Return the title of a scale, with the names of its ends if there is space."""
    words = f"Points from {LEVELS[0]} ({labels[0]}) to {LEVELS[-1]} ({labels[-1]})"
    return words if len(words) <= MOST_LETTERS else "Points on the scale"


class Effects(Finding[tuple[Effect, ...]]):
    """The figure of effects: the difference of each setting from the first for each statement, with intervals."""

    key = "effects"
    place = 0.5
    what = "figure of effects"
    empty = ()
    figure_name = "effects"
    figure_title = "Every participant's answers"

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[tuple[Effect, ...], Absent]:
        if answers.verdicts_only or answers.k < 2:
            return (), ()
        codes = {column: code for code, column in reversed(answers.block.columns.items())}
        effects = []
        for item, values in answers.values.items():
            for column in range(1, answers.k):
                differences = values[:, column] - values[:, 0]
                differences = differences[~np.isnan(differences)]
                low, high = student_interval(differences)
                mean = float(differences.mean()) if len(differences) else None
                effects.append(Effect(item=item, code=codes[column], n=len(differences), mean=mean, low=low, high=high))
        return tuple(effects), ()

    def section(self) -> Iterator[str]:
        yield from self.figure_html()

    def figure(self, drawing: Drawing) -> Picture | None:
        """Draw every participant's answers to each statement; for delays, the differences from the shortest."""
        result, study = self.result, drawing.study
        if not self.value:
            return None
        over_delay = bool(result.delays_ms)
        decided = drawing.results.decided
        bound = decided.equivalence_bound if over_delay else None
        level = 0.95 if bound is None else 1 - 2 * decided.alpha
        answers = study.answers(drawing.block)
        people = sorted(answers["participant"].unique())
        codes = {column: code for code, column in reversed(drawing.block.columns.items())}
        panels = []
        for item in result.items:
            values = by_participant(answers, people, drawing.block.columns, item.id)
            shown_values = values[:, 1:] - values[:, :1] if over_delay else values
            columns = []
            for place in range(shown_values.shape[1]):
                numbers = dict(zip(people, shown_values[:, place].tolist(), strict=True))
                numbers = {person: value for person, value in numbers.items() if not math.isnan(value)}
                column_name = f"{result.delays_ms[place + 1]:g}" if over_delay else name(result, codes[place])
                columns.append(Column(name=column_name, values=numbers, mean=mean_of(numbers.values(), level)))
            panels.append(
                Panel(
                    title=item.short,
                    columns=tuple(columns),
                    places=result.delays_ms[1:],
                    line=0.0 if over_delay else None,
                    bound=None if bound is None else (-bound, bound),
                    level=level,
                    ends=None if over_delay else (LEVELS[0], LEVELS[-1]),
                )
            )
        first = ms(result.delays_ms[0]) if over_delay else result.names[0]
        subject = f"Difference between each participant's answers and those at {first}" if over_delay else (
            f"Each participant's answers about each {settings_noun(result)}"
        )  # fmt: skip
        caption = (
            f"{subject} ({drawing.simulated}n = {result.n}). Diamonds: means with {percent(level)} confidence "
            "intervals (Student's t), not corrected for the number of intervals. Conclusions are based on the tests."
            + (f" Band: equivalence bounds of {bound_text(bound)}." if bound else "")
        )
        return people_picture(
            study,
            drawing.block.id,
            drawing.name,
            f"Differences from {first}" if over_delay else self.figure_title,
            caption,
            panels,
            drawing.forms,
            above=f"Difference from {first}, in points" if over_delay else _scale_text(drawing.block.labels),
            below="Added delay in ms" if over_delay else "",
            shared=True,
        )


@dataclass(frozen=True, slots=True)
class Pair:
    """Two settings (codes) compared for one statement; the family is all compared pairs of the block."""

    first: str
    second: str
    tested: Tested


def _smallest_of_pairs(settings: int, participants: int) -> float:
    """Return the smallest p that a pairwise comparison can have after Holm's correction over all pairs."""
    return min(1.0, math.comb(settings, 2) * 2.0 ** (1 - participants))


def pairs_of(answers: BlockAnswers, omnibus: tuple[Tested, ...]) -> tuple[tuple[Pair, ...], Absent]:
    """Compare settings pairwise for statements with a significant difference, as one Holm family.

    One family is needed because even if only one liquid differs, so that all statements are included, each statement
    has pairs that do not differ.
    """
    n, k, alpha, codes = answers.n, answers.k, answers.decided.alpha, answers.block.codes
    if k < 3:
        return (), ()
    if (corrected := _smallest_of_pairs(k, n)) > alpha:
        why = (
            f"{number_text.counted(n, 'participant')} cannot show a difference between two conditions: the smallest "
            f"attainable p is {p_value(_smallest_of_pairs(2, n))}, and {p_value(corrected)} after Holm's correction "
            f"for {math.comb(k, 2)} pairs, which is above {significant(alpha)}"
        )
        return (), (NotTested(Pairs.what, why),)
    differing_items = [test.item for test in omnibus if test.verdict in ("shown", "suggested")]
    if not differing_items:
        return (), (NotTested(Pairs.what, "no statement shows a difference between the conditions"),)
    comparisons = [(item, *two) for item in differing_items for two in combinations(range(k), 2)]
    outcomes = {
        f"{item} {first} {second}": signed_rank_test(
            answers.values[item][:, first], answers.values[item][:, second], alpha=alpha
        )
        for item, first, second in comparisons
    }
    primary = [answers.decided.is_primary(item) for item, *_ in comparisons]
    tested = in_family(outcomes, answers, f"{answers.block.id}: all pairs of conditions", holm, HOLM, primary=primary)
    return tuple(
        Pair(codes[first], codes[second], replace(test, item=item))
        for (item, first, second), test in zip(comparisons, tested, strict=True)
    ), ()


class Pairs(Finding[tuple[Pair, ...]]):
    """Pairwise comparisons of settings for statements with a significant difference."""

    key = "pairs"
    place = 3
    row_place = 7
    what = "pairwise comparison of conditions"
    kinds = ("liquids", "views")
    waits = ("liquids", "views")
    empty = ()

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[tuple[Pair, ...], Absent]:
        return pairs_of(answers, SettingsDiffer.value_in(result))

    def rows(self) -> Iterator[Row]:
        for pair in self.value:
            compared = f"{name(self.result, pair.first)} − {name(self.result, pair.second)}"
            row = verdict_row(self.result, "two conditions differ", pair.tested)
            yield row | {"comparison": compared, "codes": f"{pair.first} {pair.second}"}

    def section(self) -> Iterator[str]:
        if not (pairs := self.value):
            return
        yield heading(3, f"Which {settings_noun(self.result)}s differ?")
        yield table_of(
            pairs,
            ("Statement", lambda pair: short_text(self.result, pair.tested.item)),
            ("Pair", lambda pair: f"{name(self.result, pair.first)} − {name(self.result, pair.second)}"),
            ("n", lambda pair: f"{pair.tested.outcome.n} ({_differing_participants(pair)} differ)"),
            ("V", lambda pair: number(pair.tested.outcome.statistic, 1)),
            ("p", lambda pair: p_value(pair.tested.outcome.p)),
            ("adjusted p", lambda pair: p_value(pair.tested.p_adjusted)),
            ("smallest attainable p", lambda pair: p_value(pair.tested.outcome.smallest_p)),
            ("rank-biserial", lambda pair: number(pair.tested.outcome.effect)),
            *ends_of(lambda pair: pair.tested.outcome.interval),
            ("Verdict", lambda pair: pair.tested.verdict),
            words=2,
            last=1,
        )
        yield paragraph(
            "Test: Wilcoxon's signed-rank test (V: sum of the ranks of the positive differences), only for statements "
            "that show a difference between the "
            f"{settings_noun(self.result)}s ({pairs[0].tested.outcome.method}); p values are Holm-adjusted across the "
            f"{pairs[0].tested.members} pairs in this table. A rank-biserial correlation above 0 means that the first "
            f"{settings_noun(self.result)} in the pair was rated higher. Nominal 95 % confidence intervals use "
            "Fisher's z; with up to 24 participants, their coverage is about 90 %. There is no interval if all "
            "differences have the same sign (the correlation is then −1 or 1), or if fewer than six participants "
            "answered differently about the two.",
            "soft",
        )

    def methods(self) -> Iterator[str]:
        if self.value:
            yield (
                "If a statement showed a difference, pairs were compared with Wilcoxon's signed-rank test (exact; "
                "pairs of equal answers were dropped), with p values Holm-adjusted across all pairs for all such "
                "statements; the effect size is the matched-pairs rank-biserial correlation."
            )


def _differing_participants(pair: Pair) -> int:
    """Return the number of participants with different answers about the two settings; only these are tested."""
    outcome = pair.tested.outcome
    return outcome.n - (outcome.zeros if isinstance(outcome, SignedRanks) else 0)


class _Difference(NamedTuple):
    """The mean difference of the ``other`` setting from the first one in one statement."""

    item: str
    other: str
    n: int
    mean: float
    sd: float
    interval: Interval


def _sd_cell(test: Tested, field: str) -> str:
    """Return the standard deviation between participants of their slopes or intercepts."""
    sds = getattr(test.outcome, field)
    return number((sds[0] if sds else None) if isinstance(sds, tuple) else sds)


class MeanTests(StatementTests):
    """The mean test of every statement: exploratory, unless it is the planned trend test."""

    key = "mixed"
    place = 13
    row_place = 5
    what = "test of means"
    asks = "means differ"
    title = "Do mean answers differ? (exploratory)"

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[tuple[Tested, ...], Absent]:
        if answers.k < 2:
            return (), (
                NotTested(cls.what, ONE_DELAY if answers.block.kind == "delays" else "there is only one condition"),
            )
        if answers.block.kind == "delays" and answers.decided.trends == "slopes":
            return (), ()  # the trend test is the same test
        family = f"{answers.block.id}: means"
        return in_family(slope_tests(answers), answers, family, false_discovery, FDR, primary=False), ()

    def section(self) -> Iterator[str]:
        if not any(isinstance(test.outcome, SlopeTest) and test.outcome.slopes for test in self.value):
            yield from super().section()
            return
        over_delay, first, others = bool(self.result.delays_ms), self.result.names[0], self.result.names[1:]
        slopes = ("slope SD", lambda test: _sd_cell(test, "sds")) if over_delay else None
        intercepts = ("intercept SD", lambda test: _sd_cell(test, "intercept_sd"))
        yield from table_of_tests(self._with_noun(self.title), self.result, self.value, (), slopes, intercepts)
        if over_delay:
            yield paragraph(
                "Slopes are in points per 100 ms of delay. SDs are the standard deviations between participants of "
                "their slopes, and of their answers without delay (intercepts).",
                "soft",
            )
            return
        rows = [
            _Difference(test.item, other, outcome.n, mean, sd, ends)
            for test in self.value
            if isinstance(outcome := test.outcome, SlopeTest) and outcome.slopes
            for other, mean, sd, ends in zip(others, outcome.slopes, outcome.sds, outcome.intervals, strict=True)
        ]
        yield paragraph(
            f"The intercept SD is the standard deviation between participants of their answers for {first}. Mean "
            f"differences from {first}, in points:",
            "soft",
        )
        yield table_of(
            rows,
            ("Statement", lambda row: short_text(self.result, row.item)),
            ("Comparison", lambda row: f"{row.other} − {first}"),
            ("n", lambda row: str(row.n)),
            ("mean difference", lambda row: number(row.mean)),
            ("SD", lambda row: number(row.sd)),
            ("SE", lambda row: number(row.sd / math.sqrt(row.n))),
            *ends_of(lambda row: row.interval),
            words=2,
        )

    @classmethod
    def tested(cls, result: BlockResult) -> bool:
        """Return whether any statement of a block was tested."""
        return any(test.outcome.p is not None for test in cls.value_in(result))

    @classmethod
    def common_methods(cls, blocks: Sequence[BlockResult]) -> Iterator[str]:
        tests = {test.outcome.test for block in blocks for test in cls.value_in(block) if test.outcome.p is not None}
        if tests:
            descriptions = {
                HOTELLING: "differences between the conditions were tested with Hotelling's T²",
                PAIRED: "the difference between the two conditions was tested with Student's t test",
                T_TEST: "the participants' slopes were tested with Student's t test",
            }
            words = listed([descriptions[test] for test in descriptions if test in tests])
            yield (
                f"In an exploratory analysis, the answers were treated as numbers: {words}, for the participants "
                "who answered in all conditions; the false discovery rate was controlled (Benjamini–Hochberg)."
            )
