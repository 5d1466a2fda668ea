"""The sections of the page: tables of every test, in the order of the study's blocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from study_app.analysis.report.meaning import by_delay, meaning, tempting_ms
from study_app.analysis.report.page import box, bullets, heading, paragraph, picture, table
from study_app.analysis.report.pictures import Picture
from study_app.analysis.report.words import (
    VERDICTS_MEAN,
    counted,
    interval,
    lead,
    missing,
    ms,
    name,
    number,
    p_equals,
    p_value,
    settings_noun,
    short,
    statistic,
    test_name,
)
from study_app.analysis.results import Against, BlockFound, Pair, Results, Tested
from study_app.analysis.statistics.ordinal import Ordinal
from study_app.analysis.statistics.paired import Paired

AGAINST = (
    *("Statement", "Delay", "n", "difference", "interval", "p equivalent", "p without normality"),
    *("p different, adjusted", "n for 80 %", "Verdict"),
)
TESTS = ("Statement", "n", "Statistic", "p", "adjusted p", "smallest p", "Effect", "Interval", "Verdict")


def block(found: BlockFound, results: Results, drawn: Sequence[Picture]) -> Iterator[str]:
    """Yield the section of one block."""
    yield heading(2, lead(found))
    if not found.n:
        yield paragraph("Nobody's answers count yet: there is nothing to test or to draw.")
        return
    pictures = {one.name.split("-")[0]: one for one in drawn if one.block == found.id}
    yield from _picture(pictures, found.kind)
    yield from _overall(found)
    yield from _tests(f"Do the {settings_noun(found)}s differ, statement by statement?", found, found.omnibus, results)
    yield from _pairs(found)
    yield from _recognition(found, pictures)
    yield from _tests("Do answers follow the delay?", found, found.trends, results)
    yield from _lowest(found)
    yield from _against(found)
    yield from _threshold(found)
    yield from _meaning(found, results)
    yield from _picture(pictures, "movement")
    yield from _again(found)
    if found.absent:
        yield heading(3, "What is not here, and why")
        yield bullets(f"{line[:1].upper()}{line[1:]}" for line in missing(found))
    yield heading(3, "Answers")
    yield _measures(found)


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


def _tests(title: str, found: BlockFound, tests: Sequence[Tested], results: Results) -> Iterator[str]:
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
        f"{test_name(first.outcome)}; effect: {first.outcome.effect_name}. Found by: "
        f"{'; '.join(dict.fromkeys(one.outcome.method for one in tests if one.outcome.p is not None)) or 'none'}. "
        f"{'; '.join(families)}. "
        + (f"Intervals: 95 %, {'; '.join(intervals)}. " if intervals else "")
        + VERDICTS_MEAN.format(alpha=f"{results.decided.alpha:g}"),
        "soft",
    )
    reasons = dict.fromkeys(one.outcome.no_interval for one in tests if one.outcome.no_interval)
    if reasons and not intervals:
        yield paragraph(f"Intervals: {'; '.join(reasons)}.", "soft")


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
        f"rated higher. p adjusted by Holm within each statement. {found.pairs[0].tested.outcome.method}. "
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


def _lowest(found: BlockFound) -> Iterator[str]:
    if not found.lowest:
        return
    yield heading(3, "The lowest delay that shows")
    yield table(
        ("Statement", "lowest", "over all statements", "steps down: longest delay, p"),
        [
            [
                short(found, one.item),
                _at_most(one.steps.lowest_ms),
                _at_most(one.over_all_ms),
                "; ".join(f"{ms(step.longest_ms)} {p_value(step.page.p)}" for step in one.steps.steps),
            ]
            for one in found.lowest
        ],
        words=4,
    )
    members = found.lowest[0].members
    yield paragraph(
        "Only where a trend is there at all, the longest delay is dropped as long as a trend is left. The order is "
        "fixed, so that the error rate holds within each statement without correction; over all statements it holds "
        f"where every step has p of at most alpha / {members}. The result is an upper bound and biased upward: few "
        "participants find only long delays.",
        "soft",
    )


def _at_most(delay_ms: float | None) -> str:
    return "–" if delay_ms is None else f"≤ {ms(delay_ms)}"


def _against(found: BlockFound) -> Iterator[str]:
    if not found.against:
        return
    control = ms(found.against[0].control_ms)
    yield heading(3, f"Each delay against {control}")
    yield table(
        AGAINST,
        [
            [
                short(found, one.item),
                ms(one.delay_ms),
                str(one.found.n),
                number(one.found.effect),
                interval(one.found.interval),
                p_value(one.found.p),
                p_value(one.found.p_permutation),
                p_value(one.p_adjusted),
                "–" if one.found.n_needed is None else str(one.found.n_needed),
                one.verdict + _doubt(one),
            ]
            for one in found.against
        ],
        words=2,
        last=1,
    )
    yield paragraph(" ".join(_about_against(found.against)), "soft")


def _doubt(one: Against) -> str:
    if one.found.checks_agree is False:
        return " *"
    return " †" if one.found.verdict == "different" and one.verdict == "inconclusive" else ""


def _about_against(against: Sequence[Against]) -> Iterator[str]:
    """Yield how the comparisons with the shortest delay were made, and what they could not show."""
    first = against[0].found
    yield (
        f"Two one-sided t tests with a bound of ±{first.bound:g}, intervals of {100 - 200 * first.alpha:.0f} %. "
        "Equivalent: the interval lies within the bound; each comparison stands for itself, so that a single one among "
        "many is weak. Different: the larger p of a two-sided t test and of exact signed ranks, Holm-adjusted over the "
        f"{len(against)} comparisons of this table, is at most {first.alpha:g}. Inconclusive: neither. n for 80 %: "
        "participants who would show equivalence with 80 % power at this spread, if there were no difference; a spread "
        "estimated from few is itself uncertain."
    )
    least = first.smallest_check_p
    if least is not None:
        yield f"Without normality the smallest p for equivalence is {p_value(least)}."
    differing = 0.5 ** (first.n - 1) if first.n else 1.0
    if differing * len(against) > first.alpha:
        yield (
            f"For a difference the signed ranks of {counted(first.n, 'pair')} give {p_value(differing)} at least, so "
            "that after the correction no comparison here can be called different, however clear it is; a trend over "
            "all delays can be shown."
        )
    disagree = sum(one.found.checks_agree is False for one in against)
    if disagree:
        yield f"*: p with and without normality decide differently ({disagree}); equivalent is only what both show."
    alone = sum(_doubt(one) == " †" for one in against)
    if alone:
        yield f"†: a t test alone, not corrected, would call it different ({alone})."


def _threshold(found: BlockFound) -> Iterator[str]:
    threshold = found.threshold
    if threshold is None:
        return
    yield heading(3, "From when on is a delay noticed?")
    counts = ", ".join(
        f"{ms(level)} {yes} of {asked}"
        for level, yes, asked in zip(threshold.levels, threshold.yes, threshold.asked, strict=True)
    )
    if threshold.effect is None:
        yield paragraph(f"No threshold: {threshold.note}. Noticed: {counts}.")
        return
    yield paragraph(
        f"Detection threshold {number(threshold.effect, 0)} ms, 95 % interval {interval(threshold.interval, 0)} ms"
        f"{f' ({threshold.no_interval})' if threshold.no_interval else ''}; guesses {number(threshold.guess)}, lapses "
        f"{number(threshold.lapse)}; {threshold.method}; n = {threshold.n}. Noticed: {counts}. "
        f"{threshold.note[:1].upper()}{threshold.note[1:]}. Agreement is no yes or no: "
        "who agrees somewhat with “different” may mean little."
    )


def _meaning(found: BlockFound, results: Results) -> Iterator[str]:
    delay_ms = tempting_ms(found)
    if delay_ms is None:
        return
    yield heading(3, f"What “{ms(delay_ms)}” can and cannot mean")
    yield box([paragraph(line) for line in meaning(found, results)], "care")
    if found.against:
        head = ("Delay", "equivalent in", "different in", "inconclusive in", "what can be said")
        yield table(head, by_delay(found), words=len(head))


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
