"""Differences between settings, statement by statement."""

from collections.abc import Iterator, Mapping
from typing import Final

from study_app.analysis.designs.block_tests import Asked, each_statement
from study_app.analysis.designs.verdicts import judged
from study_app.analysis.figures.picture import Picture
from study_app.analysis.report.item_tests import families, first_tested, table_of_tests, tests_in_words
from study_app.analysis.report.r_syntax import pair_calls, r_number, r_text
from study_app.analysis.report.test_rows import judged_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import Finding
from study_app.analysis.results.item_test import Tested
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.results.words import settings_noun, test_name
from study_app.analysis.statistics.friedman import Friedman, friedman
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.statistics.paired import paired
from study_app.analysis.tables.compared_blocks import KINDS
from study_app.analysis.tables.measures import Array
from study_app.analysis.tables.planned_analysis import Decided

OMNIBUS: Final = "test of settings"


def compared(answers: Asked) -> tuple[tuple[Tested, ...], tuple[NotTested, ...]]:
    """Test in every statement whether the settings are answered alike."""
    if answers.k < 2:
        return (), (NotTested("test of settings", "the block has one setting: there is nothing to compare it with"),)
    return judged(
        each_statement(answers, lambda values: _omnibus(values, answers)),
        answers.decided,
        f"{answers.block.id}: settings differ",
    ), ()


def _omnibus(values: Array, answers: Asked) -> Outcome:
    if answers.k == 2:
        return paired(values[:, 0], values[:, 1], alpha=answers.decided.alpha)
    return friedman(values, draws=answers.draws, seed=answers.seed)


def _section(found: BlockFound, _results: Results, _pictures: Mapping[str, Picture]) -> Iterator[str]:
    title = f"Do the {settings_noun(found)}s differ, statement by statement?"
    return table_of_tests(title, found, FINDING.of(found), found.names)


def _sentences(found: BlockFound, _decided: Decided) -> Iterator[str]:
    noun = settings_noun(found)
    nothing = f"in no single statement a difference between the {noun}s"
    return tests_in_words(found, FINDING.of(found), f"the {noun}s differ in", nothing)


def _methods(found: BlockFound, _results: Results) -> Iterator[str]:
    tests = FINDING.of(found)
    if tests:
        one = first_tested(tests)
        yield (
            f"Each statement was tested by {test_name(one.outcome)} ({one.outcome.method}), with "
            f"{one.outcome.effect_name} as the effect, {families(tests)}."
        )


def _calls(found: BlockFound, codes: str) -> Iterator[str]:
    tests, block = FINDING.of(found), r_text(found.id)
    if len(found.settings) == 2:
        first, second = (setting.code for setting in found.settings)
        yield from (call for one in tests for call in pair_calls(found, codes, first, second, one))
    for one in tests:
        if not isinstance(one.outcome, Friedman) or one.outcome.n < 2:
            continue  # R's friedman.test refuses a single participant
        if one.outcome.statistic is not None and one.outcome.p_chi2 is not None:
            numbers = f"{r_number(one.outcome.statistic)}, {r_number(one.outcome.p_chi2)}"
            yield f"friedman({r_text(one.item)}, wide({block}, {r_text(one.item)}, {codes}), {numbers})"


FINDING: Final[Finding[tuple[Tested, ...]]] = Finding(
    key="omnibus",
    place=2,
    what=OMNIBUS,
    empty=(),
    tests=lambda answers, _found: compared(answers),
    kinds=("liquids", "views"),
    sealed=KINDS,
    statements=True,
    row_place=2,
    rows=lambda found: (judged_row(found, "settings differ", one) for one in FINDING.of(found)),
    part="tests of settings",
    section=_section,
    sentences=_sentences,
    methods=_methods,
    calls=_calls,
)
