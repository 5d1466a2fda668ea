"""A finding made for a test: how often participants gave the highest answer to each statement of a block."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from scipy.stats import binomtest

from study_app.analysis.findings.finding import ALONE, Absent, Answer, BlockAnswers, Finding, in_family, verdict_row
from study_app.analysis.findings.statement_tests import table_of_tests
from study_app.analysis.page_layout import Drawing, Look, Picture, Sheet
from study_app.analysis.results import BlockResult, NotTested, Tested, short_text
from study_app.analysis.statistics.outcome import Outcome, clopper_pearson

HIGHEST: Final = 7


class HighestAnswers(Finding[tuple[Tested, ...]]):
    """How often participants gave the highest answer to each statement of a block."""

    key = "highest_answers"
    place = 30
    what = "count of highest answers"
    part = "highest answers"
    empty = ()
    figure_name = "highest"
    figure_title = "<Highest> answers"
    question = "Which statement got most highest answers?"

    @classmethod
    def test(cls, answers: BlockAnswers, found: BlockResult) -> tuple[tuple[Tested, ...], Absent]:
        outcomes = {}
        for item, values in answers.single.items():
            known = values[~np.isnan(values)]
            count, n = int((known == HIGHEST).sum()), len(known)
            outcomes[item] = Outcome(
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
        tests = in_family(outcomes, answers, f"{found.id}: highest answers", tuple, ALONE, primary=False)
        return tests, (NotTested("count of lowest answers", "nobody asked for it"),)

    def rows(self) -> Iterator[dict[str, object]]:
        return (verdict_row(self.result, "the highest answer is given", tested_item) for tested_item in self.value)

    def section(self) -> Iterator[str]:
        yield from table_of_tests(f"{self.figure_title}, counted", self.result, self.value)
        yield from self.figure_html()

    def figure(self, drawing: Drawing) -> Picture | None:
        def figure(look: Look) -> Sheet:
            sheet = look.sheet(150)
            sheet.axes(40, 40, 200, 80).bar(
                range(len(self.value)), [tested_item.outcome.effect or 0.0 for tested_item in self.value]
            )
            return sheet

        return drawing.picture(self.figure_title, f"{self.figure_title}, as shares.", figure)

    def methods(self) -> Iterator[str]:
        yield f"The highest answers of {self.result.title} were counted."

    def answer(self) -> Answer:
        most = max(self.value, key=lambda tested_item: tested_item.outcome.effect or 0.0)
        text = f"Most highest answers: {short_text(self.result, most.item)}."
        return self.make_answer("shown", text)
