"""The sections of forms, and of questions of other kinds after trials: a table of each, its figure, texts, scores."""

from collections.abc import Iterator, Mapping, Sequence

from study_app.analysis.designs.question_measures import MEASURES
from study_app.analysis.figures.picture import Picture
from study_app.analysis.report.answers import level_section
from study_app.analysis.report.html_page import bullets, heading, paragraph, picture, table
from study_app.analysis.results.block_results import Results
from study_app.analysis.results.question_answers import QuestionFound, ScoreFound
from study_app.analysis.results.words import number
from study_app.analysis.tables.study_tables import Study


def places(results: Results) -> dict[str, str]:
    """Return where questions were asked: id → title of the section, in the order of the session."""
    levels = {one.block for one in results.levels}

    def kind(one: QuestionFound) -> str:
        return "form" if one.is_form else "levels" if one.where in levels else "other questions"

    return {one.where: f"{one.title}: {kind(one)}" for one in results.questions}


def section(where: str, study: Study, results: Results, drawn: Sequence[Picture]) -> Iterator[str]:
    """Yield the section of a form, or of a block's other questions."""
    yield heading(2, places(results)[where])
    pictures = {one.name: one for one in drawn}
    asked = {(one.where.id, one.id): one for one in study.others.questions}
    yield from _scores([one for one in results.scores if one.where == where])
    steps = {one.block for one in results.levels if one.summary == "settings"}  # each from another start
    for found in results.questions:
        if found.where == where:
            yield heading(3, "Answers" if where in {one.block for one in results.levels} else found.short)
            yield paragraph(found.text)
            if where in steps:
                continue
            if not found.n:
                yield paragraph("No answers count yet.")
                continue
            measure = MEASURES[found.measure]
            if measure.cells is None:
                yield from _texts(found)
                continue
            question = asked[found.where, found.item]
            rows = [(group.name, measure.cells(question, group.numbers)) for group in found.groups]
            yield _table(rows)
            name = f"question-{found.where}-{found.item}"
            if name in pictures:
                yield picture(pictures[name].files["png"], pictures[name].caption)
    for levels in results.levels:
        if levels.block == where:
            yield from level_section.section(levels, drawn, study.estimator)


def _table(rows: Sequence[tuple[str, Mapping[str, str]]]) -> str:
    head = ("Answers", *rows[0][1])
    return table(head, [[name, *cells.values()] for name, cells in rows])


def _texts(found: QuestionFound) -> Iterator[str]:
    """List the texts, by participant."""
    for group in found.groups:
        if len(found.groups) > 1:
            yield paragraph(f"{group.name}:")
        yield bullets(group.numbers["texts"])


def _scores(scores: Sequence[ScoreFound]) -> Iterator[str]:
    if not scores:
        return
    yield heading(3, "Scores")
    yield table(
        ("Score", "Setting", "n", "mean", "SD", "range"),
        [
            [
                one.name,
                group.name,
                str(group.numbers["n"]),
                number(group.numbers["mean"], 1),
                number(group.numbers["sd"], 1),
                "–"
                if group.numbers["smallest"] is None
                else f"{number(group.numbers['smallest'], 1)} – {number(group.numbers['largest'], 1)}",
            ]
            for one in scores
            for group in one.groups
        ],
        words=2,
    )
    yield from (paragraph(source, "soft") for source in dict.fromkeys(one.source for one in scores) if source)
