"""Cumulative mixed models of the primary statements, which require neither equal steps nor complete answers."""

from collections.abc import Iterator
from functools import partial
from typing import cast

import numpy as np

from study_app import number_text
from study_app.analysis.findings.finding import FDR, Absent, BlockAnswers, in_family
from study_app.analysis.findings.statement_tests import StatementTests
from study_app.analysis.html_page import heading, paragraph, table_of
from study_app.analysis.results import BlockResult, NotTested, Tested, method_text, short_text
from study_app.analysis.statistics.cumulative_models import CumulativeModel, cumulative_model
from study_app.analysis.statistics.outcome import false_discovery
from study_app.analysis.wording import counted, interval, number, p_value


class _CumulativeModels(StatementTests):
    """An exploratory cumulative mixed model of each primary statement.

    For delays, it is fitted to all individual answers, and the effect of the delay varies between participants. For
    liquids and views, it is fitted to the participants' medians, because with repeated answers its test rejects too
    often.
    """

    key = "cumulative"
    place = 14
    row_place = 6
    what = "cumulative mixed model"
    asks = "answers differ, cumulative mixed model"
    title = "Cumulative mixed model of the answers (exploratory)"

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[tuple[Tested, ...], Absent]:
        if answers.k < 2 or answers.verdicts_only:
            return (), ()
        over_delay = answers.block.kind == "delays"
        columns = np.array(answers.block.delays_ms)[:, None] / 100 if over_delay else None
        outcomes = {
            item: cumulative_model(answers.single[item], columns, answers.decided.direction(item))
            if over_delay
            else cumulative_model(medians[..., None])
            for item, medians in answers.values.items()
            if answers.decided.is_primary(item)
        }
        family = f"{answers.block.id}: cumulative mixed models"
        tested = in_family(outcomes, answers, family, false_discovery, FDR, primary=False)
        if tested and all(test.outcome.p is None for test in tested):
            return (), (NotTested(cls.what, "; ".join(dict.fromkeys(test.outcome.note for test in tested))),)
        return tested, ()

    def section(self) -> Iterator[str]:
        fitted = [test for test in self.value if test.outcome.p is not None]
        if not fitted:
            return
        delays = bool(self.result.delays_ms)
        effects = ["per 100 ms"] if delays else [f"{name} − {self.result.names[0]}" for name in self.result.names[1:]]
        yield heading(3, self.title)
        yield table_of(
            fitted,
            ("Statement", lambda test: short_text(self.result, test.item)),
            ("n", lambda test: f"{test.outcome.n}"),
            ("incomplete", lambda test: f"{self._model(test).incomplete}"),
            ("answers", lambda test: f"{self._model(test).answers}"),
            *[(effect, partial(self._effect_cell, place)) for place, effect in enumerate(effects)],
            (
                "SDs (intercept, delay)" if delays else "SD",
                lambda test: ", ".join(number(sd) for sd in self._model(test).sds),
            ),
            ("LR", lambda test: number(test.outcome.statistic)),
            ("p", lambda test: p_value(test.outcome.p)),
            ("adjusted p", lambda test: p_value(test.p_adjusted)),
            ("Verdict", lambda test: test.verdict),
            last=1,
        )
        methods = method_text(test.outcome.method for test in fitted)
        unit, sign = ("per 100 ms of delay", "answers rise") if delays else ("", "the first of the two is rated higher")
        yield paragraph(
            f"A cumulative logit mixed model was fitted to {self._answers_noun()} to each primary statement, including "
            f"the answers of participants with missing answers. Effects are log odds ratios {unit}".rstrip()
            + f" and are positive if {sign}; their 95 % intervals are Wald intervals. The SDs describe the "
            f"participants' intercepts{' and delay effects' if delays else ''}. "
            f"LR is the likelihood-ratio statistic; p values are based on {methods}. Adjusted p values are corrected "
            f"({fitted[0].correction}) across {number_text.counted(fitted[0].members, 'test')}.",
            "soft",
        )
        for test in self.value:
            if test.outcome.p is None:
                failure = f"{short_text(self.result, test.item)}: the model could not be fitted"
                yield paragraph(f"{failure} because {test.outcome.note}.", "soft")

    def _answers_noun(self) -> str:
        return "all individual answers" if self.result.delays_ms else "the participants' median answers"

    @staticmethod
    def _model(test: Tested) -> CumulativeModel:
        return cast("CumulativeModel", test.outcome)

    def _effect_cell(self, place: int, test: Tested) -> str:
        model = self._model(test)
        return f"{number(model.log_odds_ratios[place])} {interval(model.intervals[place])}"

    def methods(self) -> Iterator[str]:
        fitted = sum(test.outcome.p is not None for test in self.value)
        failed = len(self.value) - fitted
        failures = "the other statement" if failed == 1 else f"the other {counted(failed, 'statement')}"
        failure_note = f" (it could not be fitted to {failures})" if failed else ""
        if fitted:
            slopes = " and delay effects" if self.result.delays_ms else ""
            yield (
                f"In an exploratory analysis, a cumulative logit mixed model with random intercepts{slopes} was fitted "
                f"to {self._answers_noun()} to {counted(fitted, 'primary statement')}{failure_note}, including the "
                "answers of participants who did not answer in all conditions; effects were tested with "
                "likelihood-ratio tests, and the false discovery rate was controlled (Benjamini–Hochberg)."
            )
