"""The detection threshold of a delay: a psychometric function fitted to the answers to one statement."""

from collections.abc import Iterator, Mapping
from typing import Final

from study_app.analysis.designs.block_tests import Asked
from study_app.analysis.figures import psychometric_curve
from study_app.analysis.figures.picture import Drawing, Picture
from study_app.analysis.findings.lowest_delay import FINDING as LOWEST
from study_app.analysis.report.html_page import drawn, heading, paragraph
from study_app.analysis.report.test_rows import test_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import BlockFigure, Finding, Row
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.results.words import interval, lead, ms, number
from study_app.analysis.statistics.psychometrics.threshold import Threshold, noticed
from study_app.analysis.tables.planned_analysis import Decided

DETECTION: Final = "detection threshold"
TITLE: Final = "When a delay is noticed"


def _tested(answers: Asked, _found: BlockFound) -> tuple[Threshold | None, tuple[NotTested, ...]]:
    item = answers.decided.noticed
    if item is None or item not in answers.values:
        return None, (NotTested(DETECTION, "the protocol names no statement that asks for it"),)
    answers.each("detection threshold")
    single, delays_ms = answers.single[item], answers.block.delays_ms
    return noticed(single, delays_ms, alpha=answers.decided.alpha, seed=answers.seed), ()


def _rows(found: BlockFound) -> Iterator[Row]:
    threshold = FINDING.of(found)
    if threshold is not None:
        yield test_row(found, "a delay is noticed", threshold)


def _section(found: BlockFound, _results: Results, pictures: Mapping[str, Picture]) -> Iterator[str]:
    """Yield the detection threshold, or why there is none."""
    threshold = FINDING.of(found)
    if threshold is None:
        return
    yield heading(3, "From when on is a delay noticed?")
    counts = ", ".join(
        f"{ms(level)} {yes} of {asked}"
        for level, yes, asked in zip(threshold.levels, threshold.yes, threshold.asked, strict=True)
    )
    if threshold.effect is None:
        yield paragraph(f"No threshold: {threshold.note}. Noticed: {counts}.")
        yield from drawn(pictures, "threshold")
        return
    yield paragraph(
        f"Detection threshold {number(threshold.effect, 0)} ms, 95 % interval {interval(threshold.interval, 0)} ms"
        f"{f' ({threshold.no_interval})' if threshold.no_interval else ''}; guesses {number(threshold.guess)}, lapses "
        f"{number(threshold.lapse)}; {threshold.method}; n = {threshold.n}. Noticed: {counts}. "
        f"{threshold.note[:1].upper()}{threshold.note[1:]}. Agreement is no yes or no: "
        "who agrees somewhat with “different” may mean little."
    )
    yield from drawn(pictures, "threshold")


def _figure(drawing: Drawing) -> Picture | None:
    threshold = FINDING.of(drawing.found)
    if threshold is None or not any(threshold.asked):
        return None
    lowest = min((one.over_all_ms for one in LOWEST.of(drawing.found) if one.over_all_ms is not None), default=None)
    curve = f"No curve: {threshold.note}."
    if threshold.effect is not None:
        curve = (
            f"Curve: {threshold.method}; diamond: the detection threshold, {threshold.effect:.0f} ms, on its 95 % "
            f"interval {interval(threshold.interval, 0)} ms."
        )
    dashed = "" if lowest is None else f" Dashed: the lowest delay up to which a statement follows it, {lowest:g} ms."
    caption = (
        f"Share of answers that noticed the delay, over the delay asked for ({drawing.simulated}n = {threshold.n}). "
        f"{curve}{dashed}"
    )
    return drawing.picture(
        TITLE, caption, lambda **own: psychometric_curve.draw(threshold, lowest, counts=("",), **own).figure
    )


def _sentences(found: BlockFound, _decided: Decided) -> Iterator[str]:
    threshold = FINDING.of(found)
    if threshold is not None and threshold.effect is not None:
        yield (
            f"{lead(found)}: the detection threshold is {threshold.effect:.0f} ms (95 % interval "
            f"{interval(threshold.interval, 0)} ms, n = {threshold.n}), if agreeing counts as noticing; "
            f"{'; '.join(words for words in (threshold.no_interval, threshold.note) if words)}."
        )


def _methods(found: BlockFound, _results: Results) -> Iterator[str]:
    if FINDING.of(found) is not None:
        yield (
            "The detection threshold is the 50 % point between guesses and lapses of a logistic function fitted by "
            "maximum likelihood to agreement (5 to 7) in single answers, all participants pooled, with a profile "
            "interval that is scaled by how far participants differ. It is stated only where a permutation test "
            "against a flat line shows a rise, and where it lies among the delays that were presented."
        )


FINDING: Final[Finding[Threshold | None]] = Finding(
    key="threshold",
    place=8,
    empty=None,
    what=DETECTION,
    tests=_tested,
    kinds=("delays",),
    waits=("delays",),
    row_place=11,
    rows=_rows,
    part=DETECTION,
    section=_section,
    figure=BlockFigure(name="threshold", title=TITLE, draw=_figure),
    sentences=_sentences,
    methods=_methods,
)
