"""Every figure of a study: of its answers as files, and of its findings for a report."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from study_app import figure_style as style
from study_app.analysis.data.blocks import KINDS, Block
from study_app.analysis.data.questions import questions_found
from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.figures import answer_figures
from study_app.analysis.figures.answer_figures import render
from study_app.analysis.figures.level_figures import level_pictures
from study_app.analysis.figures.page_layout import Drawing, Picture, attempted
from study_app.analysis.figures.question_figures import question_pictures
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.delays import LowestDelay
from study_app.analysis.levels.evaluate import levels_found
from study_app.analysis.results import Failures, Results
from study_app.errors import AnalysisError
from study_app.store.output_files import write_output


def pictures(
    study: Study, results: Results, forms: Sequence[str] = style.FORMATS, failures: Failures | None = None
) -> Iterator[Picture]:
    """Draw every figure that there are answers or recordings for, block by block, in each of ``forms``.

    A figure that fails is left out, and kept in ``failures``.
    """
    yield from attempted(
        (
            (
                block.id,
                f"{what}-{block.id}" if len(study.blocks_of(block.kind)) > 1 else what,
                partial(_named, draw, one),
            )
            for block, found in zip(study.blocks, results.blocks, strict=True)
            if found.n
            for one in [Drawing(study, block, found, results, block.kind, forms)]
            for what, draw in _of_block(one)
        ),
        failures,
    )


def block_name(study: Study, block: Block, what: str = "") -> str:
    """Return the name of a figure as a file, by default of the block's answers."""
    name = what or block.kind
    return f"{name}-{block.id}" if len(study.blocks_of(block.kind)) > 1 else name


def _named(draw: Callable[[Drawing], Picture | None], drawing: Drawing, name: str) -> Picture | None:
    return draw(replace(drawing, name=name))


def _of_block(drawing: Drawing) -> Iterator[tuple[str, Callable[[Drawing], Picture | None]]]:
    """Yield what a block's figures are called, and how each is drawn."""
    yield drawing.block.kind, _answers
    for finding in all_findings():
        if finding.figure_name:
            yield finding.figure_name, finding(drawing.found, drawing.results).figure


def _answers(drawing: Drawing) -> Picture:
    study, block, found = drawing.study, drawing.block, drawing.found
    lowest = {one.item: one.over_all_ms for one in LowestDelay.of(found) if one.over_all_ms is not None}
    caption = answer_figures.caption(study, block)
    if lowest:
        caption += (
            " Dashed: lowest delay at which stepping down still shows a trend, with the error rate held over all "
            "statements; an upper bound of the delay that is noticed."
        )
    files = {form: answer_figures.render(study, block, form, lowest) for form in drawing.forms}
    return Picture(block.id, drawing.name, caption, files)


def plot(folder: Path, to: Path, *, warn: Callable[[str], object] | None = None) -> tuple[Path, ...]:
    """Write every figure of a study as PNG, SVG and PDF, each with its caption as text, into the folder ``to``.

    The same results give the same bytes. Returns the files written. Files that are not as they were recorded are used
    as they are: ``warn`` receives each, and the captions say how many.

    Raises
    ------
    AnalysisError
        The results cannot be evaluated, or ``to`` cannot be written; nothing was.
    StoreError
        The key was opened, and is now missing or changed; or ``exclusions.csv`` cannot be read.
    """
    study = load_study(folder)
    if not study.blocks and not study.others.questions:
        raise AnalysisError(f"{folder}: the study {study.name!r} asks nothing, so there is nothing to draw")
    files: dict[str, bytes] = {}
    failures = Failures()
    questions = question_pictures(study, questions_found(study), failures=failures)
    for picture in (*_of_statements(study), *questions, *level_pictures(study, levels_found(study), failures=failures)):
        files |= {f"{picture.name}.{form}": content for form, content in picture.files.items()}
        files[f"{picture.name}.txt"] = f"{picture.caption}\n".encode()
    if failures.found:
        raise AnalysisError(f"a figure cannot be drawn: {failures.found[0]}")
    if not files:
        raise AnalysisError(f"{folder}: no completed session with answers yet: there is nothing to draw")
    written = write_output(study.folder, Path(to), files)
    study.tell_doubts(warn)
    return written


def _of_statements(study: Study) -> Iterator[Picture]:
    for kind in KINDS:
        for block in study.blocks_of(kind):
            files = {form: render(study, block, form) for form in style.FORMATS}
            yield Picture(block.id, block_name(study, block), answer_figures.caption(study, block), files)
