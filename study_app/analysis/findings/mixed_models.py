"""The mixed model: the same questions of every single answer, with participants as a random factor."""

from collections.abc import Iterator, Sequence

import numpy as np

from study_app.analysis.findings.finding import MANY, Absent, BlockAnswers, Finding, Row, alone, judged_row
from study_app.analysis.report.html_page import heading, paragraph, table_of
from study_app.analysis.results import BlockResult, NotTested, Tested, interval, number, p_value, short, statistic
from study_app.analysis.statistics.mixed_model import Ordinal, ordinal
from study_app.analysis.statistics.outcome import FEW
from study_app.number_text import counted


def _no_model(answers: BlockAnswers) -> str:
    if answers.k < 2:
        return "there is one setting"
    if answers.sites and not answers.block.revealed:
        return "each site has settings of its own until the keys of all sites are open"
    if answers.n < FEW:
        return f"with {counted(answers.n, 'participant')}, below {FEW}, its estimates and errors would not hold"
    if answers.n > MANY:
        return f"it is left out above {MANY} participants, where it takes minutes"
    return ""


def _effects(found: BlockResult, one: Tested) -> tuple[str, str]:
    outcome = one.outcome
    if isinstance(outcome, Ordinal) and len(outcome.coefficients) > 1:
        return (
            "; ".join(
                f"{answer} {number(coefficient.estimate)}"
                for answer, coefficient in zip(found.names[1:], outcome.coefficients, strict=True)
            ),
            "; ".join(interval(coefficient.interval) for coefficient in outcome.coefficients),
        )
    return number(outcome.effect), interval(outcome.interval)


class MixedModel(Finding[tuple[Tested, ...]]):
    """The cumulative logit mixed model of every statement; its p are not corrected."""

    key = "mixed"
    place = 13
    row_place = 5
    what = "mixed model"
    part = "mixed model"
    empty = ()

    @classmethod
    def test(cls, answers: BlockAnswers, found: BlockResult) -> tuple[tuple[Tested, ...], Absent]:
        if answers.verdicts_only:
            return (), ()
        over_delay = answers.block.kind == "delays"
        if reason := _no_model(answers):
            return (), (NotTested(f"mixed model of {'the delay' if over_delay else 'the settings'}", reason),)
        columns = np.array(answers.block.delays_ms)[:, None] / 100 if over_delay else None
        family, sites = f"{answers.block.id}: mixed model", answers.sites or None
        models = {
            item: ordinal(single, columns, sessions=answers.sessions[item], sites=sites)
            for item, single in answers.single.items()
        }
        return tuple(alone(model, item, answers, family) for item, model in models.items()), ()

    def rows(self) -> Iterator[Row]:
        return (judged_row(self.found, "settings differ, mixed model", one) for one in self.value)

    def section(self) -> Iterator[str]:
        if not self.value:
            return
        yield heading(3, "Mixed model")
        yield table_of(
            self.value,
            ("Statement", lambda one: short(self.found, one.item)),
            ("Test", lambda one: one.outcome.test),
            ("n", lambda one: str(one.outcome.n)),
            ("statistic", lambda one: statistic(one.outcome)),
            ("p", lambda one: p_value(one.outcome.p)),
            ("effect", lambda one: _effects(self.found, one)[0]),
            ("interval", lambda one: _effects(self.found, one)[1]),
            ("note", lambda one: one.outcome.note),
            words=2,
            last=1,
        )
        per = "per 100 ms of delay" if self.found.delays_ms else f"against {self.found.names[0]}"
        yield paragraph(
            f"Effects: log odds of a higher answer {per}, 95 % Wald intervals; p by likelihood ratio, not corrected: "
            "they decide nothing.",
            "soft",
        )

    @classmethod
    def common_methods(cls, blocks: Sequence[BlockResult]) -> Iterator[str]:
        if any(cls.of(found) for found in blocks):
            yield (
                "As a check, answers were fitted by cumulative logit models with a random intercept for each "
                "participant (adaptive quadrature, likelihood ratio)."
            )
        yield (
            "Missing answers were never replaced; tests over several settings use participants who answered under all "
            "of them, comparisons of two those who answered under both."
        )
