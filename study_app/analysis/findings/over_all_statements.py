"""Differences between settings at all: one test over all statements of a block."""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from study_app.analysis.designs.block_tests import Asked
from study_app.analysis.figures.picture import Picture
from study_app.analysis.report.html_page import paragraph
from study_app.analysis.report.test_rows import rows_alone, test_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import Finding, Row
from study_app.analysis.results.words import all_of, lead, number, p_equals, p_value, settings_noun, statistic
from study_app.analysis.statistics.global_permutation import global_permutation
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.tables.planned_analysis import Decided

OVER_ALL: Final = "test over all statements"


def over_all(answers: Asked, draws: int | None = None) -> Outcome | None:
    """Test once over all statements whether the settings are answered alike; ``draws`` of them if not as usual."""
    if answers.k < 2 or (answers.verdicts_only and draws is None):
        return None
    answers.each("all statements")
    return global_permutation(
        np.array(list(answers.values.values())), draws=draws or answers.draws_over_all, seed=answers.seed
    )


def _rows(found: BlockFound) -> Iterator[Row]:
    overall = FINDING.of(found)
    if overall is not None:
        yield test_row(found, "settings differ, all statements", overall) | rows_alone(found, "all statements at once")


def _section(found: BlockFound, _results: Results, _pictures: Mapping[str, Picture]) -> Iterator[str]:
    overall = FINDING.of(found)
    if overall is None:
        return
    if overall.p is None:
        yield paragraph(f"One test over all statements: none ({overall.note}).")
        return
    yield paragraph(
        f"One test over all statements: {statistic(overall)}, {p_equals(overall.p)} (smallest attainable "
        f"{p_value(overall.smallest_p)}; {overall.method}), {overall.effect_name} {number(overall.effect)}, "
        f"n = {overall.n}."
    )


def _sentences(found: BlockFound, decided: Decided) -> Iterator[str]:
    overall = FINDING.of(found)
    if overall is not None and overall.p is not None:
        yield (
            f"{lead(found)}: one test over {all_of(len(found.items), 'statement')} "
            f"{'finds' if overall.p <= decided.alpha else 'does not find'} a difference between the "
            f"{settings_noun(found)}s ({p_equals(overall.p)}, n = {overall.n})."
        )


def _methods(found: BlockFound, _results: Results) -> Iterator[str]:
    if FINDING.of(found) is not None and not found.delays_ms:
        yield (
            f"The {settings_noun(found)}s were compared over {all_of(len(found.items), 'statement')} at once by "
            "permuting them within participants, the statistic being the sum of the statements' Friedman statistics."
        )


FINDING: Final[Finding[Outcome | None]] = Finding(
    key="overall",
    place=1,
    empty=None,
    what=OVER_ALL,
    tests=lambda answers, _found: (over_all(answers), ()),
    waits=("liquids", "views"),
    row_place=1,
    rows=_rows,
    part=OVER_ALL,
    section=_section,
    sentences=_sentences,
    methods=_methods,
)
