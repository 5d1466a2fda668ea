"""The figures of questions that no block of statements holds, each as PNG, SVG and PDF with its caption."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Final

from study_app import figure_style as style
from study_app.analysis.figures import answer_figures, questions
from study_app.analysis.figures.picture import Picture, attempted, files_of, sample_words
from study_app.analysis.figures.questions.group_rows import Look, QuestionFigure
from study_app.analysis.results.question_answers import QuestionFound
from study_app.analysis.results.section_failures import Failures
from study_app.analysis.results.words import counted
from study_app.analysis.tables.asked_questions import AskedQuestion
from study_app.analysis.tables.study_tables import Study
from study_app.discovery import modules_of

FIGURES: Final[dict[str, QuestionFigure]] = {
    module.FIGURE.id: module.FIGURE for module in modules_of(questions) if hasattr(module, "FIGURE")
}
"""Every figure by the id that a kind of question names it by, found by importing the modules of one folder."""


def question_pictures(
    study: Study,
    answered: Sequence[QuestionFound],
    forms: Sequence[str] = style.FORMATS,
    failures: Failures | None = None,
) -> Iterator[Picture]:
    """Draw the figure of every question that was answered and has one, in each of ``forms``.

    A figure that fails is left out, and kept in ``failures``; levels that participants set have a figure of their own.
    """
    both = zip(study.others.questions, answered, strict=True)
    set_by_hand = {block.id for block in study.levels if block.design.adjusts}
    shown = [
        (asked, found)
        for asked, found in both
        if found.figure is not None and found.n and found.where not in set_by_hand
    ]
    yield from attempted(
        (
            (found.where, f"question-{found.where}-{found.item}", partial(_picture, study, asked, found, forms))
            for asked, found in shown
        ),
        failures,
    )


def _picture(study: Study, asked: AskedQuestion, found: QuestionFound, forms: Sequence[str], name: str) -> Picture:
    figure = FIGURES[found.figure or ""]
    title = found.short if found.short == found.title else f"{found.title}: {found.short}"
    look = partial(Look, title, answer_figures.marks(study), (counted(study.n, "participant"),))
    files = files_of(lambda fonts: figure.draw(asked, found, look(fonts)), forms, f"{study.name}: {title}")
    caption = f"{found.title}: “{found.text}” {figure.caption} {sample_words(study, study.n)}"
    return Picture(found.where, name, caption, files)
