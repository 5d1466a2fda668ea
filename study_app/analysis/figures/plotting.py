"""Every figure of a study's answers as files: of statements, of other questions, and of levels."""

from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path

from study_app import figure_style as style
from study_app.analysis.designs.level_summaries import levels_found
from study_app.analysis.designs.question_measures import questions_found
from study_app.analysis.figures import captions
from study_app.analysis.figures.answer_figures import render
from study_app.analysis.figures.levels.level_pictures import level_pictures
from study_app.analysis.figures.picture import Picture
from study_app.analysis.figures.question_figures import question_pictures
from study_app.analysis.results.section_failures import Failures
from study_app.analysis.tables.compared_blocks import KINDS
from study_app.analysis.tables.study_tables import Study, load_study
from study_app.errors import AnalysisError
from study_app.store.output_files import write_output


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
    for picture in chain(_of_statements(study), _of_others(study)):
        files |= {f"{picture.name}.{form}": content for form, content in picture.files.items()}
        files[f"{picture.name}.txt"] = f"{picture.caption}\n".encode()
    if not files:
        raise AnalysisError(f"{folder}: no completed session with answers yet: there is nothing to draw")
    written = write_output(study.folder, Path(to), files)
    study.tell_doubts(warn)
    return written


def _of_statements(study: Study) -> Iterator[Picture]:
    for kind in KINDS:
        blocks = study.blocks_of(kind)
        for block in blocks:
            name = kind if len(blocks) == 1 else f"{kind}-{block.id}"
            files = {form: render(study, block, form) for form in style.FORMATS}
            yield Picture(block.id, name, captions.caption(study, block), files)


def _of_others(study: Study) -> Iterator[Picture]:
    failures = Failures()
    yield from question_pictures(study, questions_found(study), failures=failures)
    yield from level_pictures(study, levels_found(study), failures=failures)
    if failures.found:
        raise AnalysisError(f"a figure cannot be drawn: {failures.found[0]}")
