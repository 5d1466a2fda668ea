"""The sections of the page: tables of every test, in the order of the study's blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial

from study_app.analysis.figures.report_figures import Picture
from study_app.analysis.findings.block_results import BlockFound, Results
from study_app.analysis.findings.item_test import Tested
from study_app.analysis.findings.pair_comparison import Pair
from study_app.analysis.findings.section_failures import Failure, Failures
from study_app.analysis.findings.words import (
    VERDICTS_MEAN,
    interval,
    lead,
    missing,
    name,
    number,
    p_equals,
    p_value,
    said_of_presentations,
    settings_noun,
    short,
    statistic,
    test_name,
)
from study_app.analysis.report import delay_sections
from study_app.analysis.report.html_page import bullets, heading, not_there, paragraph, picture, table
from study_app.analysis.statistics.ordinal import Ordinal
from study_app.analysis.statistics.paired import Paired

TESTS = ("Statement", "n", "Statistic", "p", "adjusted p", "smallest p", "Effect", "Interval", "Verdict")


def block(
    found: BlockFound, results: Results, drawn: Sequence[Picture], failures: Failures | None = None
) -> Iterator[str]:
    """Yield the section of one block; a part that fails is said in its place, and kept in ``failures``."""
    yield heading(2, lead(found))
    if not found.n:
        untested = any(one.block == found.id for one in results.failures)
        yield (
            bullets(missing(found))
            if untested
            else paragraph("Nobody's answers count yet: there is nothing to test or to draw.")
        )
        return
    held = Failures() if failures is None else failures
    for what, make in _parts(found, results, {one.name.split("-")[0]: one for one in drawn if one.block == found.id}):
        part = held.attempt(what, partial(_made, make), block=found.id)
        yield from (heading(3, what.capitalize()), not_there(part.why)) if isinstance(part, Failure) else part


def _made(make: Callable[[], Iterable[str]]) -> list[str]:
    return list(make())


def _parts(
    found: BlockFound, results: Results, pictures: Mapping[str, Picture]
) -> Iterator[tuple[str, Callable[[], Iterable[str]]]]:
    """Yield what the parts of a block's section are, and how each is made."""
    differ = f"Do the {settings_noun(found)}s differ, statement by statement?"
    yield "presentations", lambda: _presentations(found)
    yield "figure of answers", lambda: _picture(pictures, found.kind)
    yield "test over all statements", lambda: _overall(found)
    yield "tests of settings", lambda: _tests(differ, found, found.omnibus, found.names)
    yield "pairs", lambda: _pairs(found)
    yield "recognition", lambda: _recognition(found, pictures)
    yield "trends", lambda: _tests("Do answers follow the delay?", found, found.trends)
    yield "lowest delay", lambda: delay_sections.lowest(found)
    yield "comparisons with the shortest delay", lambda: delay_sections.against(found)
    yield "detection threshold", lambda: delay_sections.threshold(found)
    yield "figure of the threshold", lambda: _picture(pictures, "threshold")
    yield "what a delay can mean", lambda: delay_sections.meaning(found, results)
    yield "figure of movement", lambda: _picture(pictures, "movement")
    yield "sessions", lambda: _tests("Do sessions differ?", found, found.by_session, _sessions(found))
    yield "other assumptions", lambda: _again(found)
    yield "what is not here", lambda: _absent(found)


def _presentations(found: BlockFound) -> Iterator[str]:
    """Say what one answer stands for, where it is more than one presentation."""
    lines = said_of_presentations(found)
    if lines:
        yield paragraph(" ".join(lines))


def _absent(found: BlockFound) -> Iterator[str]:
    if found.absent:
        yield heading(3, "What is not here, and why")
        yield bullets(f"{line[:1].upper()}{line[1:]}" for line in missing(found))


def _picture(pictures: Mapping[str, Picture], kind: str) -> Iterator[str]:
    if kind in pictures:
        yield picture(pictures[kind].files["png"], pictures[kind].caption)


def _overall(found: BlockFound) -> Iterator[str]:
    overall = found.overall
    if overall is None:
        return
    if overall.p is None:
        yield paragraph(f"One test over all statements: none ({overall.note}).")
        return
    yield paragraph(
        f"One test over all statements: {statistic(overall)}, {p_equals(overall.p)} (smallest attainable "
        f"{p_value(overall.smallest_p)}; {overall.method}), {overall.effect_name} {number(overall.effect)}, "
        f"n = {overall.n}."
    )


def _sessions(found: BlockFound) -> list[str]:
    return [f"session {number}" for number in found.sessions]


def _tests(title: str, found: BlockFound, tests: Sequence[Tested], compared: Sequence[str] = ()) -> Iterator[str]:
    """Yield a table of tests; ``compared`` are the names of what each of them compares."""
    if not tests:
        return
    yield heading(3, title)
    yield table(TESTS, [_row(found, one) for one in tests], last=1)
    first = tests[0]
    families = dict.fromkeys(
        f"{one.members} in the family “{one.family}”, p adjusted by {one.correction}" for one in tests
    )
    intervals = dict.fromkeys(one.outcome.interval.method for one in tests if one.outcome.interval is not None)
    yield paragraph(
        f"{test_name(first.outcome)}; effect: {first.outcome.effect_name}{_above(first, compared)}. Found by: "
        f"{'; '.join(dict.fromkeys(one.outcome.method for one in tests if one.outcome.p is not None)) or 'none'}. "
        f"{'; '.join(families)}. " + (f"Intervals: 95 %, {'; '.join(intervals)}." if intervals else ""),
        "soft",
    )
    reasons = dict.fromkeys(one.outcome.no_interval for one in tests if one.outcome.no_interval)
    if reasons and not intervals:
        yield paragraph(f"Intervals: {'; '.join(reasons)}.", "soft")


def _above(one: Tested, compared: Sequence[str]) -> str:
    """Say which of two an effect above 0 stands for."""
    if not isinstance(one.outcome, Paired) or len(compared) != 2:
        return ""
    return f", above 0 where {compared[0]} was rated higher than {compared[1]}"


def _row(found: BlockFound, one: Tested) -> list[str]:
    outcome = one.outcome
    dropped = f" (−{outcome.dropped})" if outcome.dropped else ""
    return [
        short(found, one.item),
        f"{outcome.n}{dropped}",
        statistic(outcome),
        p_value(outcome.p),
        p_value(one.p_adjusted),
        p_value(outcome.smallest_p),
        number(outcome.effect),
        interval(outcome.interval),
        one.verdict + (f" ({outcome.note})" if one.verdict == "not tested" and outcome.note else ""),
    ]


def _pairs(found: BlockFound) -> Iterator[str]:
    if not found.pairs:
        return
    yield heading(3, "Which of them differ?")
    yield table(
        ("Statement", "Pair", "n", "V", "p", "adjusted p", "smallest p", "rank-biserial", "Interval", "Verdict"),
        [
            [
                short(found, one.tested.item),
                f"{name(found, one.first)} – {name(found, one.second)}",
                _pairs_used(one),
                number(one.tested.outcome.statistic, 1),
                p_value(one.tested.outcome.p),
                p_value(one.tested.p_adjusted),
                p_value(one.tested.outcome.smallest_p),
                number(one.tested.outcome.effect),
                _pair_interval(one),
                one.tested.verdict,
            ]
            for one in found.pairs
        ],
        words=2,
        last=1,
    )
    yield paragraph(
        "Wilcoxon's signed ranks, exact, only in statements that differ as a whole; above 0 the first of a pair was "
        f"rated higher. p adjusted by Holm over all {found.pairs[0].tested.members} pairs of this table. "
        f"{found.pairs[0].tested.outcome.method}. "
        "Intervals: 95 %, Fisher z, which cover about 90 % up to two dozen pairs; none where all pairs that differ "
        "went one way, since −1 and 1 are the ends of the scale, nor below six pairs that differ.",
        "soft",
    )


def _pair_interval(pair: Pair) -> str:
    """Return the interval of a pair's effect, or in its place how many went one way, where all did."""
    outcome = pair.tested.outcome
    if outcome.effect is not None and abs(outcome.effect) == 1.0 and isinstance(outcome, Paired):
        return f"– (all {outcome.n - outcome.zeros} one way)"
    return interval(outcome.interval)


def _pairs_used(pair: Pair) -> str:
    """Return how many pairs there are and how many of them differ, which alone are tested."""
    outcome = pair.tested.outcome
    equal = outcome.zeros if isinstance(outcome, Paired) else 0
    return f"{outcome.n} ({outcome.n - equal} differ)"


def _recognition(found: BlockFound, pictures: Mapping[str, Picture]) -> Iterator[str]:
    named = found.named
    if named is None:
        return
    yield heading(3, "Were the liquids recognised?")
    yield from _picture(pictures, "recognition")
    rates = {rate.setting: rate for rate in named.found.rates}
    yield table(
        ("Liquid", "right", "of", "share", "95 % interval"),
        [
            [
                told,
                str(rates[place].hits),
                str(rates[place].n),
                number(rates[place].rate),
                interval(rates[place].interval),
            ]
            for place, told in enumerate(found.names)
            if place in rates
        ],
    )
    outcome = named.found
    why = "" if outcome.interval else f" ({outcome.no_interval})"
    note = f" {outcome.note[:1].upper()}{outcome.note[1:]}." if outcome.note else ""
    if outcome.p is None:
        yield paragraph(f"Not tested: {outcome.note}.")
        return
    yield paragraph(
        f"Hits {number(outcome.statistic, 0)}, {number(outcome.expected, 1)} expected by chance, "
        f"{p_equals(outcome.p)} (smallest attainable {p_value(outcome.smallest_p)}), {named.verdict}. Kappa of decided "
        f"answers {number(outcome.effect)}, 95 % interval {interval(outcome.interval)}{why}. Chance: "
        f"{outcome.method}.{note} One test, corrected for no other."
    )
    yield paragraph("Intervals of the shares: Clopper-Pearson, which takes participants one by one.", "soft")


def _again(found: BlockFound) -> Iterator[str]:
    again = (*found.mixed, *found.incomplete)
    if not again:
        return
    yield heading(3, "The same asked with other assumptions")
    yield table(
        ("Statement", "Test", "n", "statistic", "p", "effect", "interval", "note"),
        [
            [
                short(found, one.item),
                one.outcome.test,
                str(one.outcome.n),
                statistic(one.outcome),
                p_value(one.outcome.p),
                *_effects(found, one),
                one.outcome.note,
            ]
            for one in again
        ],
        words=2,
        last=1,
    )
    effects = ""
    if found.mixed:
        per = "per 100 ms of delay" if found.delays_ms else f"against {found.names[0]}"
        effects = (
            f"Effects of the mixed model: log odds of a higher answer {per}, 95 % Wald intervals; p by likelihood "
            "ratio. "
        )
    yield paragraph(f"{effects}These p are not corrected and decide nothing.", "soft")


def _effects(found: BlockFound, one: Tested) -> tuple[str, str]:
    outcome = one.outcome
    if isinstance(outcome, Ordinal) and len(outcome.coefficients) > 1:
        return (
            "; ".join(
                f"{told} {number(coefficient.estimate)}"
                for told, coefficient in zip(found.names[1:], outcome.coefficients, strict=True)
            ),
            "; ".join(interval(coefficient.interval) for coefficient in outcome.coefficients),
        )
    return number(outcome.effect), interval(outcome.interval)


def verdicts_mean(results: Results) -> Iterator[str]:
    """Yield what the words of verdicts mean, once for all tables."""
    yield heading(2, "What the words of verdicts mean")
    yield paragraph(VERDICTS_MEAN.format(alpha=f"{results.decided.alpha:g}"))


def answers(results: Results) -> Iterator[str]:
    """Yield the counts of all answers, block by block."""
    yield heading(2, "Answers, counted")
    for found in results.blocks:
        if found.measures:
            yield heading(3, lead(found))
            yield _measures(found)


def _measures(found: BlockFound) -> str:
    levels = [str(level) for level in range(1, 8)]
    return table(
        ("Statement", settings_noun(found).capitalize(), *levels, "n", "missing", "median", "quartiles", "agree %"),
        [
            [
                short(found, str(row["item"])),
                name(found, str(row["code"])),
                *(str(row[f"count_{level}"]) for level in levels),
                str(row["n"]),
                str(row["missing"] + row["cannot_judge"]),
                number(row["median"], 1),
                f"{number(row['q1'], 1)} – {number(row['q3'], 1)}" if row["q1"] is not None else "–",
                number(row["agree_percent"], 0),
            ]
            for row in sorted(found.measures, key=lambda row: [item.id for item in found.items].index(str(row["item"])))
        ],
        words=2,
    )
