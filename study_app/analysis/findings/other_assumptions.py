"""The same questions under other assumptions: the mixed model, and a test with incomplete participants."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from study_app.analysis.data.measures import Array
from study_app.analysis.findings.finding import MANY, Absent, BlockAnswers, Finding, Row, alone, judged_row
from study_app.analysis.report.html_page import heading, paragraph, table_of
from study_app.analysis.results import BlockFound, NotTested, Tested, interval, number, p_value, short, statistic
from study_app.analysis.statistics.mixed_model import Ordinal, ordinal
from study_app.analysis.statistics.outcome import FEW
from study_app.analysis.statistics.rank_tests import skillings_mack
from study_app.number_text import counted


@dataclass(frozen=True, slots=True)
class OtherAssumptions:
    """The tests by the ``mixed`` model, and with the ``incomplete`` participants too, of each statement."""

    mixed: tuple[Tested, ...] = ()
    incomplete: tuple[Tested, ...] = ()


def asked_again(
    answers: BlockAnswers, columns: Array | None, what: str
) -> tuple[OtherAssumptions, tuple[NotTested, ...]]:
    """Return the same questions under other assumptions: the mixed model, and with missing answers; and what is not.

    ``columns`` (settings, columns) are what the mixed model tests, ``what`` names it.
    """
    if answers.verdicts_only:
        return OtherAssumptions(), ()
    absent = []
    mixed: tuple[Tested, ...] = ()
    reason = _no_model(answers)
    if reason:
        absent.append(NotTested(f"mixed model of {what}", reason))
    else:
        models = {}
        for item in answers.block.items:
            models[item.id] = ordinal(
                answers.single[item.id], columns, sessions=answers.sessions[item.id], sites=answers.sites or None
            )
        mixed = tuple(
            alone(model, item, answers.decided, f"{answers.block.id}: mixed model") for item, model in models.items()
        )
    gaps = {item: values for item, values in answers.values.items() if np.isnan(values).any()}
    incomplete: tuple[Tested, ...] = ()
    if gaps and answers.k >= 3:
        incomplete = tuple(
            alone(
                skillings_mack(values, draws=answers.draws, seed=answers.seed),
                item,
                answers.decided,
                f"{answers.block.id}: with missing answers",
            )
            for item, values in gaps.items()
        )
    elif gaps:
        absent.append(NotTested("test with incomplete participants", "it needs three settings"))
    return OtherAssumptions(mixed, incomplete), tuple(absent)


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


def _effects(found: BlockFound, one: Tested) -> tuple[str, str]:
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


class SameWithOtherAssumptions(Finding[OtherAssumptions]):
    """The same questions under other assumptions: the mixed model, and a test with incomplete participants."""

    key = "again"
    place = 13
    row_place = 5
    what = "the same asked with other assumptions"
    part = "other assumptions"
    empty = OtherAssumptions()

    @classmethod
    def entries(cls, found: BlockFound) -> Mapping[str, Any]:
        return {"mixed": cls.of(found).mixed, "incomplete": cls.of(found).incomplete}

    @classmethod
    def test(cls, answers: BlockAnswers, found: BlockFound) -> tuple[OtherAssumptions, Absent]:
        if answers.block.kind == "delays":
            return asked_again(answers, np.array(answers.block.delays_ms)[:, None] / 100, "the delay")
        return asked_again(answers, None, "the settings")

    def rows(self) -> Iterator[Row]:
        asked = self.value
        for one in asked.mixed:
            yield judged_row(self.found, "settings differ, mixed model", one)
        for one in asked.incomplete:
            yield judged_row(self.found, "settings differ, incomplete participants too", one)

    def section(self) -> Iterator[str]:
        asked = self.value
        again = (*asked.mixed, *asked.incomplete)
        if not again:
            return
        yield heading(3, "The same asked with other assumptions")
        yield table_of(
            again,
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
        effects = ""
        if asked.mixed:
            per = "per 100 ms of delay" if self.found.delays_ms else f"against {self.found.names[0]}"
            effects = (
                f"Effects of the mixed model: log odds of a higher answer {per}, 95 % Wald intervals; p by likelihood "
                "ratio. "
            )
        yield paragraph(f"{effects}These p are not corrected and decide nothing.", "soft")

    @classmethod
    def common_methods(cls, blocks: Sequence[BlockFound]) -> Iterator[str]:
        asked = [cls.of(found) for found in blocks]
        if any(one.mixed for one in asked):
            yield (
                "As a check, answers were fitted by cumulative logit models with a random intercept for each "
                "participant (adaptive quadrature, likelihood ratio)."
            )
        again = (
            " and Skillings and Mack's test uses those who missed some" if any(one.incomplete for one in asked) else ""
        )
        yield (
            "Missing answers were never replaced; tests over several settings use participants who answered under all "
            f"of them, comparisons of two those who answered under both{again}."
        )
