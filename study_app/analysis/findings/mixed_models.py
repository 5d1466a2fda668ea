"""The mixed model: the same questions of answers as numbers, with effects of each participant's own."""

from collections.abc import Iterator, Sequence

from study_app.analysis.findings.finding import Absent, BlockAnswers, judged
from study_app.analysis.findings.statement_tests import ONE_DELAY, StatementTests, mixed_models
from study_app.analysis.report.html_page import paragraph
from study_app.analysis.results import BlockResult, NotTested, Tested, interval, listed, number, short
from study_app.analysis.statistics.mixed_model import Mixed


class MixedModel(StatementTests):
    """The linear mixed model of every statement."""

    key = "mixed"
    place = 13
    row_place = 5
    what = "mixed model"
    part = "mixed model"
    asks = "settings differ, mixed model"
    title = "Mixed model"

    @classmethod
    def test(cls, answers: BlockAnswers, found: BlockResult) -> tuple[tuple[Tested, ...], Absent]:
        if answers.k < 2:
            return (), (NotTested(cls.what, ONE_DELAY if answers.block.kind == "delays" else "there is one setting"),)
        return judged(mixed_models(answers), answers, f"{answers.block.id}: mixed model"), ()

    def section(self) -> Iterator[str]:
        yield from super().section()
        per = "per 100 ms of delay" if self.found.delays_ms else "against the first"
        effects = [
            f"{short(self.found, one.item)}: "
            + listed([f"{number(slope)} {interval(ends)}" for slope, ends in zip(it.slopes, it.intervals, strict=True)])
            for one in self.value
            if isinstance(it := one.outcome, Mixed) and it.slopes
        ]
        if effects:
            yield paragraph(f"Slopes in points {per}, with 95 % intervals: {'; '.join(effects)}.", "soft")

    @classmethod
    def common_methods(cls, blocks: Sequence[BlockResult]) -> Iterator[str]:
        if any(cls.of(found) for found in blocks):
            yield (
                "Besides, answers as numbers were fitted by linear mixed models with a random intercept and random "
                "slopes of each participant (t of the mean slope, Hotelling's T²), corrected alike."
            )
        yield (
            "Missing answers were never replaced; tests over several settings use participants who answered under all "
            "of them, comparisons of two those who answered under both."
        )
