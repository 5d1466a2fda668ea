"""The figures of a report: of the answers of each block, and of its findings."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from study_app import figure_style as style
from study_app.analysis.figures import answer_figures, captions
from study_app.analysis.figures.picture import Drawing, Picture
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.delays import LowestDelay
from study_app.analysis.results.block_results import Results
from study_app.analysis.results.section_failures import Failure, Failures
from study_app.analysis.tables.study_tables import Study


def pictures(
    study: Study, results: Results, forms: Sequence[str] = style.FORMATS, failures: Failures | None = None
) -> Iterator[Picture]:
    """Draw every figure that there are answers or recordings for, block by block, in each of ``forms``.

    A figure that fails is left out, and kept in ``failures``.
    """
    held = Failures() if failures is None else failures
    for block, found in zip(study.blocks, results.blocks, strict=True):
        if not found.n:
            continue
        several = len(study.blocks_of(block.kind)) > 1
        drawing = Drawing(study, block, found, results, block.kind, forms)
        for what, draw in _of_block(drawing):
            name = f"{what}-{block.id}" if several else what
            drawn = held.attempt(f"figure {name}", partial(draw, replace(drawing, name=name)), block=block.id)
            if drawn is not None and not isinstance(drawn, Failure):
                yield drawn


def _of_block(drawing: Drawing) -> Iterator[tuple[str, Callable[[Drawing], Picture | None]]]:
    """Yield what a block's figures are called, and how each is drawn."""
    yield drawing.block.kind, _answers
    for finding in all_findings():
        if finding.figure_name:
            yield finding.figure_name, finding(drawing.found, drawing.results).figure


def _answers(drawing: Drawing) -> Picture:
    study, block, found = drawing.study, drawing.block, drawing.found
    lowest = {one.item: one.over_all_ms for one in LowestDelay.of(found) if one.over_all_ms is not None}
    caption = captions.caption(study, block)
    if lowest:
        caption += (
            " Dashed: lowest delay at which stepping down still shows a trend, with the error rate held over all "
            "statements; an upper bound of the delay that is noticed."
        )
    files = {form: answer_figures.render(study, block, form, lowest) for form in drawing.forms}
    return Picture(block.id, drawing.name, caption, files)
