"""The comparison of settings two by two, in the statements that differ at all."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

from study_app.analysis.designs.block_tests import Asked
from study_app.analysis.designs.verdicts import HOLM, in_family
from study_app.analysis.figures.picture import Picture
from study_app.analysis.findings.settings_differ import FINDING as OMNIBUS
from study_app.analysis.report.html_page import heading, paragraph, table
from study_app.analysis.report.r_syntax import pair_calls
from study_app.analysis.report.test_rows import judged_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import Finding, Row
from study_app.analysis.results.item_test import Tested
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.results.words import interval, name, number, p_value, short
from study_app.analysis.statistics.multiple_comparisons import holm
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.statistics.paired import Paired, paired
from study_app.number_text import counted

PAIRS: Final = "comparison of two settings"


@dataclass(frozen=True, slots=True)
class Pair:
    """Two settings (codes) compared in one statement; the family is all pairs that are compared in the block."""

    first: str
    second: str
    tested: Tested


def pairs_of(answers: Asked, omnibus: tuple[Tested, ...]) -> tuple[tuple[Pair, ...], tuple[NotTested, ...]]:
    """Return the comparisons of settings two by two, in the statements that differ at all, and why there are none."""
    count = math.comb(answers.k, 2)
    if answers.k < 3:
        return (), ()
    corrected = smallest_of_pairs(answers.k, answers.n)
    if corrected > answers.decided.alpha:
        why = (
            f"{counted(answers.n, 'participant')} cannot show it: the smallest p that {counted(answers.n, 'pair')} can "
            f"give is {smallest_of_pairs(2, answers.n):.4g}, after Holm's correction over {count} pairs "
            f"{corrected:.4g}, which is above {answers.decided.alpha:g}"
        )
        return (), (NotTested(PAIRS, why),)
    differing = [one.item for one in omnibus if one.verdict in ("shown", "suggested")]
    if not differing:
        return (), (NotTested(PAIRS, "no statement shows a difference between the settings"),)
    return _over_all_pairs(answers, differing), ()


def smallest_of_pairs(settings: int, participants: int) -> float:
    """Return the smallest p that a comparison of two of the settings can have, corrected over all pairs by Holm."""
    return min(1.0, math.comb(settings, 2) * 2.0 ** (1 - participants))


def _over_all_pairs(answers: Asked, items: list[str]) -> tuple[Pair, ...]:
    """Compare the settings two by two in the statements ``items``, all pairs of all of them in one Holm family.

    Where one liquid differs from all others, every statement is opened, and each holds pairs that do not differ.
    """
    codes = answers.block.codes
    compared = {
        f"{item} {first} {second}": (item, first, second)
        for item in items
        for first, second in combinations(range(answers.k), 2)
    }
    outcomes: dict[str, Outcome] = {
        name: paired(answers.values[item][:, first], answers.values[item][:, second], alpha=answers.decided.alpha)
        for name, (item, first, second) in compared.items()
    }
    family = f"{answers.block.id}: all pairs of settings"
    primary = [answers.decided.is_primary(item) for item, _, _ in compared.values()]
    judged = in_family(outcomes, answers.decided.alpha, family, holm, HOLM, primary=primary)
    return tuple(
        Pair(codes[first], codes[second], replace(one, item=item))
        for (item, first, second), one in zip(compared.values(), judged, strict=True)
    )


def _rows(found: BlockFound) -> Iterator[Row]:
    for pair in FINDING.of(found):
        compared = f"{name(found, pair.first)} − {name(found, pair.second)}"
        yield judged_row(found, "two settings differ", pair.tested) | {"comparison": compared}


def _section(found: BlockFound, _results: Results, _pictures: Mapping[str, Picture]) -> Iterator[str]:
    if not FINDING.of(found):
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
            for one in FINDING.of(found)
        ],
        words=2,
        last=1,
    )
    yield paragraph(
        "Wilcoxon's signed ranks, exact, only in statements that differ as a whole; above 0 the first of a pair was "
        f"rated higher. p adjusted by Holm over all {FINDING.of(found)[0].tested.members} pairs of this table. "
        f"{FINDING.of(found)[0].tested.outcome.method}. "
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


def _methods(found: BlockFound, _results: Results) -> Iterator[str]:
    if FINDING.of(found):
        yield (
            "Where these showed a difference, pairs were compared by Wilcoxon's signed ranks (exact; equal pairs left "
            "out) with the matched rank-biserial correlation, Holm-adjusted over all pairs of all these statements."
        )


def _calls(found: BlockFound, codes: str) -> Iterator[str]:
    for pair in FINDING.of(found):
        yield from pair_calls(found, codes, pair.first, pair.second, pair.tested)


FINDING: Final[Finding[tuple[Pair, ...]]] = Finding(
    key="pairs",
    place=3,
    what=PAIRS,
    empty=(),
    tests=lambda answers, found: pairs_of(answers, OMNIBUS.of(found)),
    kinds=("liquids", "views"),
    waits=("liquids", "views"),
    row_place=7,
    rows=_rows,
    part="pairs",
    section=_section,
    methods=_methods,
    calls=_calls,
)
