"""The figures of questions that no block of statements holds, each as PNG, SVG and PDF with its caption."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Final

from study_app import figure_style as style
from study_app.analysis.figures import answer_figures, questions
from study_app.analysis.figures.picture import Picture
from study_app.analysis.figures.questions.group_rows import Look, QuestionFigure
from study_app.analysis.results.question_answers import QuestionFound
from study_app.analysis.results.section_failures import Failure, Failures
from study_app.analysis.results.words import counted
from study_app.analysis.tables.asked_questions import AskedQuestion
from study_app.analysis.tables.study import Study
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

    A figure that fails is left out, and kept in ``failures``.
    """
    held = Failures() if failures is None else failures
    for asked, found in zip(study.others.questions, answered, strict=True):
        if found.figure is None or not found.n:
            continue
        name = f"question-{found.where}-{found.item}"
        drawn = held.attempt(f"figure {name}", partial(_picture, study, asked, found, name, forms), block=found.where)
        if not isinstance(drawn, Failure):
            yield drawn


def _picture(study: Study, asked: AskedQuestion, found: QuestionFound, name: str, forms: Sequence[str]) -> Picture:
    figure = FIGURES[found.figure or ""]
    title = found.short if found.short == found.title else f"{found.title}: {found.short}"
    look = partial(Look, title, answer_figures.marks(study), (counted(study.n, "participant"),))
    files = {
        form: style.file_bytes(
            figure.draw(asked, found, look(style.fonts_for(form))).figure, form, f"{study.name}: {title}"
        )
        for form in forms
    }
    simulated = "SIMULATED participants, no people; " if study.simulated else ""
    caption = f"{found.title}: “{found.text}” {figure.caption} {simulated}{counted(study.n, 'participant')}."
    return Picture(found.where, name, caption, files)
