"""The parts of a block's section that are about delays: lowest delay, comparisons, threshold, meaning."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from study_app.analysis.findings.block_results import BlockFound, Results
from study_app.analysis.findings.contrast_with_control import ContrastWithControl
from study_app.analysis.findings.words import beyond, counted, enough, interval, ms, number, p_value, percent, short
from study_app.analysis.report.delay_meaning import VERDICTS, by_delay, tempting_ms
from study_app.analysis.report.delay_meaning import meaning as paragraphs_on_delay
from study_app.analysis.report.html_page import box, heading, paragraph, table
from study_app.analysis.statistics.equivalence.power import MOST, STUDIES
from study_app.analysis.statistics.equivalence.tost import Equivalence

AGAINST = (
    *("Statement", "Delay", "n", "difference", "interval", "people beyond the bound", "p equivalent"),
    "p without normality",
    *("p different, adjusted", "n for 80 %", "Verdict"),
)


def lowest(found: BlockFound) -> Iterator[str]:
    """Yield the lowest delay that shows, by statement."""
    if not found.lowest:
        return
    yield heading(3, "The lowest delay that shows")
    yield table(
        ("Statement", "lowest", "uncorrected", "steps down: longest delay, p"),
        [
            [
                short(found, one.item),
                _at_most(one.over_all_ms),
                _at_most(one.steps.lowest_ms),
                "; ".join(f"{ms(step.longest_ms)} {p_value(step.page.p)}" for step in one.steps.steps),
            ]
            for one in found.lowest
        ],
        words=4,
    )
    members = found.lowest[0].members
    yield paragraph(
        "Only where a trend is there at all, the longest delay is dropped as long as a trend is left. The order is "
        f"fixed. The lowest delay is the one whose steps all have p of at most alpha / {members}, so that the error "
        "rate holds over all statements; uncorrected it holds within one statement alone. The result is an upper "
        "bound and biased upward: few participants find only long delays.",
        "soft",
    )


def _at_most(delay_ms: float | None) -> str:
    return "–" if delay_ms is None else f"≤ {ms(delay_ms)}"


def against(found: BlockFound) -> Iterator[str]:
    """Yield the comparisons of each delay with the shortest."""
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
                beyond(one.found),
                p_value(one.found.p),
                p_value(_without_normality(one.found)),
                _p_different(one),
                _needed(one),
                one.verdict + (" *" if one.found.checks_agree is False else ""),
            ]
            for one in found.against
        ],
        words=2,
        last=1,
    )
    yield paragraph(" ".join(_about_against(found.against)), "soft")


def _without_normality(tested: Equivalence) -> float | None:
    """Return the largest p of the tests for equivalence that do not ask for normality."""
    return max((p for p in (tested.p_permutation, tested.p_ranks, tested.p_bootstrap) if p is not None), default=None)


def _p_different(one: ContrastWithControl) -> str:
    """Return the adjusted p of a difference, unless no answers of so many participants could have shown one."""
    out = min(1.0, 2 * 0.5**one.found.n) * one.members > one.found.alpha
    return "out of reach" if out and one.p_adjusted is not None else p_value(one.p_adjusted)


def _needed(one: ContrastWithControl) -> str:
    """Return how many participants equivalence would take, and where nobody knows a dash."""
    if one.found.n_needed is not None:
        return str(one.found.n_needed)
    return f"> {MOST}" if one.found.sd is not None else "–"


def _about_against(against: Sequence[ContrastWithControl]) -> Iterator[str]:
    """Yield how the comparisons with the shortest delay were made, and what they could not show."""
    first = against[0].found
    yield (
        f"Two one-sided t tests with a bound of ±{first.bound:g}, intervals of {percent(1 - 2 * first.alpha)}. "
        "Equivalent: the t tests, changes of signs, signed ranks and the bootstrap-t (for answers that lean to one "
        "side) all show that the mean lies within the bound; each comparison stands for itself, so that a single one "
        "among many is weak. "
        f"It needs {enough(first.alpha)}. It is about the mean: the table also states how many people differ by more "
        "than the bound, with a 95 % Clopper-Pearson interval of their share. Different: the larger p of a two-sided "
        f"t test and of exact signed ranks, Holm-adjusted over the {len(against)} comparisons of this table, is at "
        f"most {first.alpha:g}. Where "
        "all differences are equal, signs and ranks decide. Inconclusive: neither. Out of reach: no answers of so "
        "many participants could have given either. n for 80 %: participants with whom all these tests would show "
        f"equivalence in 80 % of simulated studies ({STUDIES} for each number, differences about 0 with this spread, "
        "rounded as these are); a spread estimated from few is itself uncertain."
    )
    least = first.smallest_check_p
    if least is not None:
        yield f"By signs and ranks the smallest p for equivalence is {p_value(least)}."
    differing = 0.5 ** (first.n - 1) if first.n else 1.0
    if differing * len(against) > first.alpha:
        yield (
            f"For a difference the signed ranks of {counted(first.n, 'pair')} give {p_value(differing)} at least, so "
            "that after the correction no comparison here can be called different, however clear it is; a trend over "
            "all delays can be shown."
        )
    disagree = sum(one.found.checks_agree is False for one in against)
    if disagree:
        yield f"*: p with and without normality decide differently ({disagree}); equivalent is only what all show."


def threshold(found: BlockFound) -> Iterator[str]:
    """Yield the detection threshold, or why there is none."""
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


def meaning(found: BlockFound, results: Results) -> Iterator[str]:
    """Yield what the delay of which one would most like to speak can and cannot mean."""
    delay_ms = tempting_ms(found)
    if delay_ms is None:
        return
    yield heading(3, f"What “{ms(delay_ms)}” can and cannot mean")
    yield box([paragraph(line) for line in paragraphs_on_delay(found, results)], "care")
    if found.against:
        head = ("Delay", *(f"{verdict} in" for verdict in VERDICTS), "what can be said")
        yield table(head, by_delay(found), words=len(head))
