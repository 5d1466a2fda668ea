"""Page's test of a trend over the delay, in every statement whose direction was stated."""

from collections.abc import Iterator
from typing import Final

from study_app.analysis.designs.block_tests import Asked
from study_app.analysis.designs.verdicts import judged
from study_app.analysis.report.item_tests import families, first_tested, table_of_tests, tests_in_words
from study_app.analysis.report.r_syntax import r_number, r_text
from study_app.analysis.report.test_rows import judged_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import Finding
from study_app.analysis.results.item_test import Tested
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.statistics.trend import page

TREND: Final = "test of a trend (Page)"
ONE_DELAY: Final = "the block has one delay: there is nothing to compare it with"


def _tested(answers: Asked, _found: BlockFound) -> tuple[tuple[Tested, ...], tuple[NotTested, ...]]:
    if answers.k < 2:
        return (), (NotTested(TREND, ONE_DELAY),)
    outcomes = {}
    for item in answers.block.items:
        direction = answers.decided.direction(item.id)
        if direction is not None:
            answers.each(item.short)
            outcomes[item.id] = page(answers.values[item.id], direction, seed=answers.intervals)
    undirected = [item.short for item in answers.block.items if item.id not in outcomes]
    why = f"the protocol does not say whether answers should rise or fall with delay ({', '.join(undirected)})"
    found = judged(outcomes, answers.decided, f"{answers.block.id}: trend over delay")
    return found, (NotTested(TREND, why),) if undirected else ()


def _methods(found: BlockFound, results: Results) -> Iterator[str]:
    trends = FINDING.of(found)
    if trends:
        tested = first_tested(trends).outcome.method.split(",")[0]
        yield (
            f"Trends over the delay were tested by Page's L ({tested}), one-sided in the "
            f"direction stated {'beforehand' if results.decided.binding else 'by the protocol'}, "
            f"{families(trends)}; where a trend showed, the longest delay was dropped and the test repeated "
            "until it no longer did, which gives an upper bound of the lowest delay that is noticed (every step at "
            "alpha over the number of statements, so that the error rate holds over all of them)."
        )


def _calls(found: BlockFound, codes: str) -> Iterator[str]:
    for one in FINDING.of(found):
        if one.outcome.statistic is not None and one.outcome.p is not None:
            falling = "TRUE" if "decreasing" in one.outcome.method else "FALSE"
            numbers = f"{falling}, {r_number(one.outcome.statistic)}, {r_number(one.outcome.p)}"
            yield f"page({r_text(one.item)}, wide({r_text(found.id)}, {r_text(one.item)}, {codes}), {numbers})"


FINDING: Final[Finding[tuple[Tested, ...]]] = Finding(
    key="trends",
    place=5,
    what=TREND,
    empty=(),
    tests=_tested,
    kinds=("delays",),
    waits=("delays",),
    statements=True,
    row_place=3,
    rows=lambda found: (judged_row(found, "answers follow the delay", one) for one in FINDING.of(found)),
    part="trends",
    section=lambda found, _results, _pictures: table_of_tests("Do answers follow the delay?", found, FINDING.of(found)),
    sentences=lambda found, _decided: tests_in_words(
        found,
        FINDING.of(found),
        "answers follow the delay, in the direction stated before the study, in",
        "in no statement a trend over the delay",
    ),
    methods=_methods,
    calls=_calls,
)
