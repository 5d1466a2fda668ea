"""The comparison of sessions in every statement, by the participants who came to all of them."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from study_app.analysis.designs.block_tests import Asked
from study_app.analysis.designs.verdicts import FDR, in_family
from study_app.analysis.report.item_tests import table_of_tests
from study_app.analysis.report.r_syntax import r_number, r_text, r_vector
from study_app.analysis.report.test_rows import judged_row
from study_app.analysis.results.block_results import BlockFound
from study_app.analysis.results.finding import Finding
from study_app.analysis.results.item_test import Tested
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.statistics.friedman import Friedman, friedman
from study_app.analysis.statistics.multiple_comparisons import false_discovery
from study_app.analysis.statistics.paired import paired
from study_app.analysis.tables.compared_blocks import KINDS
from study_app.analysis.tables.measures import medians

COMPARISON: Final = "comparison of sessions"


def compared_sessions(answers: Asked, numbers: Sequence[int]) -> tuple[tuple[Tested, ...], tuple[NotTested, ...]]:
    """Test in every statement whether sessions are answered alike, by the participants who came to all of them.

    A participant's answers in a session are their median over the settings that he or she answered in all sessions.
    """
    if len(numbers) < 2:
        return (), ()
    outcomes = {}
    for item in answers.block.items:
        answers.each(f"{item.short}, sessions")
        each = np.stack(
            [
                medians(np.where(answers.sessions[item.id] == number, answers.single[item.id], np.nan))[:, :, None]
                for number in numbers
            ],
            axis=2,
        )[..., 0]
        common = np.asarray(~np.isnan(each).any(axis=2))
        levels = medians(np.where(common[..., None], each, np.nan).transpose(0, 2, 1))
        outcomes[item.id] = (
            paired(levels[:, 0], levels[:, 1], alpha=answers.decided.alpha)
            if len(numbers) == 2
            else friedman(levels, draws=answers.draws, seed=answers.seed)
        )
    ps = in_family(
        outcomes, answers.decided.alpha, f"{answers.block.id}: sessions", false_discovery, FDR, primary=False
    )
    if all(one.outcome.n == 0 for one in ps):
        return (), (NotTested(COMPARISON, f"no one answered the same setting in all of sessions {numbers}"),)
    return ps, ()


def _calls(found: BlockFound, codes: str) -> Iterator[str]:
    numbers = r_vector(map(str, found.sessions))
    for one in FINDING.of(found):
        outcome = one.outcome
        table = f"by_session({r_text(found.id)}, {r_text(one.item)}, {numbers}, {codes})"
        what = r_text(f"{one.item}, sessions")
        if isinstance(outcome, Friedman) and outcome.n > 1 and outcome.statistic is not None:
            yield f"friedman({what}, {table}, {r_number(outcome.statistic)}, {r_number(outcome.p_chi2 or 0.0)})"
        elif not isinstance(outcome, Friedman) and outcome.statistic is not None and outcome.p is not None:
            yield f"pair({what}, {table}, 1, 2, {r_number(outcome.statistic)}, {r_number(outcome.p)})"


FINDING: Final[Finding[tuple[Tested, ...]]] = Finding(
    key="by_session",
    place=12,
    what=COMPARISON,
    empty=(),
    tests=lambda answers, found: compared_sessions(answers, found.sessions),
    sealed=KINDS,
    about="sessions",
    row_place=4,
    rows=lambda found: (judged_row(found, "sessions differ", one) for one in FINDING.of(found)),
    part="sessions",
    section=lambda found, _results, _pictures: table_of_tests(
        "Do sessions differ?", found, FINDING.of(found), [f"session {number}" for number in found.sessions]
    ),
    calls=_calls,
)
