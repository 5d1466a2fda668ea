"""All figures of a study: those of its answers as files, and those of its findings for a report."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain
from pathlib import Path

from study_app import figure_style as style
from study_app.analysis.data.blocks import KINDS, Block
from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.figures import answer_figures
from study_app.analysis.figures.level_figures import level_figure_tasks
from study_app.analysis.figures.question_figures import question_figure_tasks
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.delays import LowestDelay
from study_app.analysis.levels.evaluate import level_results
from study_app.analysis.page_layout import Drawing, FigureTask, draw_figures
from study_app.analysis.questions import question_results
from study_app.analysis.results import Failures, Results
from study_app.errors import AnalysisError
from study_app.store.files import write_output


def block_figure_tasks(study: Study, results: Results, forms: Sequence[str] = style.FORMATS) -> Iterator[FigureTask]:
    """Yield the figures of answers and findings, block by block, to draw in each of ``forms``."""
    for block, result in zip(study.blocks, results.blocks, strict=True):
        if not result.n:
            continue
        lowest = {
            lowest.item: lowest.over_all_ms for lowest in LowestDelay.value_in(result) if lowest.over_all_ms is not None
        }
        name = block_name(study, block)
        yield block.id, name, partial(answer_figures.answers_picture, study, block, name, forms, lowest)
        for finding in all_findings():
            if finding.figure_name:
                several = len(finding.kinds) > 1 and len(study.blocks) > 1
                name = f"{finding.figure_name}-{block.id}" if several else block_name(study, block, finding.figure_name)
                drawing = Drawing(study, block, result, results, name, forms)
                yield block.id, name, partial(finding(result, results).figure, drawing)


def block_name(study: Study, block: Block, what: str = "") -> str:
    """Return the file name of a block's figure: ``what``, by default the kind of block, with the ID if it is needed."""
    name = what or block.kind
    return f"{name}-{block.id}" if len(study.blocks_of(block.kind)) > 1 else name


def plot(folder: Path, to: Path, *, warn: Callable[[str], object] | None = None) -> tuple[Path, ...]:
    """Write every figure of a study as PNG, SVG and PDF, each with its caption as text, into the folder ``to``.

    The same results give the same bytes. Returns the written files. Files that differ from their recorded state are
    used: ``warn`` is called for each, and the captions state their number.

    Raises
    ------
    AnalysisError
        The results cannot be evaluated, or ``to`` cannot be written; nothing was written.
    StoreError
        The key was opened, and is now missing or changed; or ``exclusions.csv`` cannot be read.
    """
    study = load_study(folder)
    if not study.blocks and not study.others.questions:
        raise AnalysisError(
            f"{folder}: the study {study.name!r} does not ask any questions, so there is nothing to draw"
        )
    files: dict[str, bytes] = {}
    failures = Failures()
    tasks = chain(
        question_figure_tasks(study, question_results(study)), level_figure_tasks(study, level_results(study))
    )
    statements = (
        answer_figures.answers_picture(study, block, block_name(study, block))
        for kind in KINDS
        for block in study.blocks_of(kind)
    )
    for picture in (*statements, *draw_figures(tasks, failures)):
        files |= {f"{picture.name}.{form}": content for form, content in picture.files.items()}
        files[f"{picture.name}.txt"] = f"{picture.caption}\n".encode()
    if failures.found:
        raise AnalysisError(f"one of the figures cannot be drawn: {failures.found[0]}")
    if not files:
        raise AnalysisError(f"{folder}: there is nothing to draw, because no completed session has answers yet")
    written = write_output(study.folder, Path(to), files, warn)
    study.tell_doubts(warn)
    return written
