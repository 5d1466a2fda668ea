"""A finding made for a test: how often participants gave the highest answer to each statement of a block."""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binomtest

from study_app.analysis.designs.block_tests import Asked
from study_app.analysis.designs.verdicts import alone
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.figures.picture import Drawing, Picture
from study_app.analysis.report.first_page.answer import Answer
from study_app.analysis.report.html_page import drawn
from study_app.analysis.report.item_tests import table_of_tests
from study_app.analysis.report.r_syntax import r_text
from study_app.analysis.report.test_rows import judged_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import BlockFigure, Finding, Question
from study_app.analysis.results.item_test import Tested
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.results.words import lead, listed, short
from study_app.analysis.statistics.outcome import Outcome, clopper_pearson
from study_app.analysis.tables.planned_analysis import Decided

HIGHEST: Final = 7
TITLE: Final = "<Highest> answers"


def _tests(answers: Asked, found: BlockFound) -> tuple[tuple[Tested, ...], tuple[NotTested, ...]]:
    tests = []
    for item, values in answers.single.items():
        given = values[~np.isnan(values)]
        count, n = int((given == HIGHEST).sum()), len(given)
        outcome = Outcome(
            test="binomial",
            n=n,
            dropped=0,
            statistic_name="count",
            statistic=count,
            p=float(binomtest(count, n, 1 / HIGHEST).pvalue),
            smallest_p=None,
            method="exact",
            effect_name="share",
            effect=count / n,
            interval=clopper_pearson(count, n),
        )
        tests.append(alone(outcome, item, answers.decided, f"{found.id}: highest answers"))
    return tuple(tests), (NotTested("count of lowest answers", "nobody asked for it"),)


def _section(found: BlockFound, _results: Results, pictures: Mapping[str, Picture]) -> Iterator[str]:
    yield from table_of_tests(f"{TITLE}, counted", found, FINDING.of(found))
    yield from drawn(pictures, "highest")


def _figure(drawing: Drawing) -> Picture | None:
    def figure(**_own: object) -> Figure:
        drawn = Figure(figsize=(3, 2))
        drawn.add_subplot().bar(range(len(tests)), [one.outcome.effect for one in tests])
        return drawn

    tests = FINDING.of(drawing.found)
    return drawing.picture(TITLE, f"{TITLE}, as shares.", figure)


def _sentences(found: BlockFound, _decided: Decided) -> Iterator[str]:
    told = [f"“{short(found, one.item)}” {one.outcome.statistic:g} of {one.outcome.n}" for one in FINDING.of(found)]
    yield f"{lead(found)}: highest answers were given for {listed(told)}."


def _answer(found: BlockFound, _decided: Decided) -> Answer:
    most = max(FINDING.of(found), key=lambda one: one.outcome.effect or 0.0)
    return Answer(FINDING.key, found.id, found.title, f"Most highest answers: {short(found, most.item)}.", ())


def _picture(sheet: Sheet, found: BlockFound, answer: Answer) -> str | None:
    sheet.text(4, 20, answer.text, size=9)
    return f"The statement of {found.title} with most highest answers"


FINDING: Final[Finding[tuple[Tested, ...]]] = Finding(
    key="highest_answers",
    place=30,
    what="count of highest answers",
    empty=(),
    tests=_tests,
    rows=lambda found: (judged_row(found, "the highest answer is given", one) for one in FINDING.of(found)),
    part="highest answers",
    section=_section,
    figure=BlockFigure(name="highest", title=TITLE, draw=_figure),
    question=Question(words="Which statement got most highest answers?", answer=_answer, picture=_picture),
    sentences=_sentences,
    methods=lambda found, _results: [f"The highest answers of {found.title} were counted."],
    calls=lambda found, _codes: [f"# highest answers of {r_text(found.id)}"],
)
