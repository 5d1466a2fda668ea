"""The lowest delay at which a trend shows, stepping down from the longest."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from study_app.analysis.designs.block_tests import Asked
from study_app.analysis.figures.picture import Picture
from study_app.analysis.findings.delay_trend import FINDING as TREND
from study_app.analysis.report.first_page.answer import FOUND
from study_app.analysis.report.html_page import heading, paragraph, table
from study_app.analysis.report.test_rows import rows_alone, test_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import Finding, Row
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.results.words import all_of, counted, lead, listed, ms, p_value, short
from study_app.analysis.statistics.trend import StepDown, step_down
from study_app.analysis.tables.planned_analysis import Decided

LOWEST_DELAY: Final = "lowest delay that shows"


@dataclass(frozen=True, slots=True)
class Lowest:
    """The lowest delay at which a trend shows in one statement, stepping down.

    The error rate of ``steps`` holds within the statement; that of ``over_all_ms``, the lowest delay whose steps all
    have p ≤ alpha / ``members``, over all statements of the family.
    """

    item: str
    steps: StepDown
    members: int = 1

    @property
    def over_all_ms(self) -> float | None:
        """The lowest delay that shows with the error rate held over all statements; None without any."""
        lowest = None
        for step in self.steps.steps:
            if step.page.p is None or step.page.p > self.steps.alpha / self.members:
                break
            lowest = step.longest_ms
        return lowest


def _tested(answers: Asked, found: BlockFound) -> tuple[tuple[Lowest, ...], tuple[NotTested, ...]]:
    """Step down in the statements whose trend is there at all."""
    trends, lowest = TREND.of(found), []
    showing = [one for one in trends if one.verdict in FOUND]
    for one in showing:
        direction = answers.decided.direction(one.item) or "increasing"
        steps = step_down(answers.values[one.item], answers.block.delays_ms, direction, alpha=answers.decided.alpha)
        lowest.append(Lowest(one.item, steps, one.members))
    if trends and not showing:
        why = "no statement shows a trend over all delays; that is not evidence that none is noticed"
        return (), (NotTested(LOWEST_DELAY, why),)
    return tuple(lowest), ()


def _rows(found: BlockFound) -> Iterator[Row]:
    for lowest in FINDING.of(found):
        for step in lowest.steps.steps:
            row = test_row(found, "answers follow the delay, stepping down", step.page)
            row |= rows_alone(found, f"stepping down within {lowest.item}") | {"members": len(lowest.steps.steps)}
            row |= {"correction": "none: fixed order, ends at the first that fails"}
            yield row | {"item": lowest.item, "comparison": f"up to {step.longest_ms:g} ms"}


def _section(found: BlockFound, _results: Results, _pictures: Mapping[str, Picture]) -> Iterator[str]:
    """Yield the lowest delay that shows, by statement."""
    if not FINDING.of(found):
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
            for one in FINDING.of(found)
        ],
        words=4,
    )
    members = FINDING.of(found)[0].members
    yield paragraph(
        "Only where a trend is there at all, the longest delay is dropped as long as a trend is left. The order is "
        f"fixed. The lowest delay is the one whose steps all have p of at most alpha / {members}, so that the error "
        "rate holds over all statements; uncorrected it holds within one statement alone. The result is an upper "
        "bound and biased upward: few participants find only long delays.",
        "soft",
    )


def _at_most(delay_ms: float | None) -> str:
    return "–" if delay_ms is None else f"≤ {ms(delay_ms)}"


def _sentences(found: BlockFound, _decided: Decided) -> Iterator[str]:
    lowest = [
        f"“{short(found, one.item)}” {ms(one.over_all_ms)}" for one in FINDING.of(found) if one.over_all_ms is not None
    ]
    if lowest:
        yield (
            f"{lead(found)}: the lowest delay at which the answers of {_used(found)} show a trend, "
            f"corrected for {all_of(FINDING.of(found)[0].members, 'statement')}: {listed(lowest)}. "
            "Each is an upper bound: shorter delays may be noticed too."
        )


def _used(found: BlockFound) -> str:
    """Return of how many participants, all whose answers are complete, the lowest delays are."""
    used = {one.steps.steps[0].page.n for one in FINDING.of(found)}
    return counted(max(used), "participant") if len(used) == 1 else f"{min(used)} to {max(used)} participants"


FINDING: Final[Finding[tuple[Lowest, ...]]] = Finding(
    key="lowest",
    place=6,
    what=LOWEST_DELAY,
    empty=(),
    tests=_tested,
    kinds=("delays",),
    waits=("delays",),
    row_place=9,
    rows=_rows,
    part="lowest delay",
    section=_section,
    sentences=_sentences,
)
