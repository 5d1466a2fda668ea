"""The answers of the first page, block by block, and which of them may claim something."""

from dataclasses import replace
from typing import Any

from study_app.analysis.findings import all_findings
from study_app.analysis.findings.finding import Finding
from study_app.analysis.findings.statement_tests import OverAll
from study_app.analysis.report.first_page.answer import NO_EVIDENCE, Answer
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.statistics.multiple_comparisons import holm
from study_app.analysis.tables.compared_blocks import Kind


def answers(results: Results) -> tuple[Answer, ...]:
    """Return the answers that a study gives, block by block.

    They claim something about a block only where the one test over all its statements finds a difference, corrected
    by Holm over the blocks: in a study where nothing differs they then claim anything at most so often as alpha says.
    """
    overall = holm([None if (one := OverAll.of(found)) is None else one.p for found in results.blocks])
    return tuple(
        _unless_claimed_alone(one, p, results.decided.alpha)
        for found, p in zip(results.blocks, overall, strict=True)
        for one in _of_block(found, results)
    )


def _unless_claimed_alone(answer: Answer, p_over_all: float | None, alpha: float) -> Answer:
    """Return an answer without its claim where the test over all statements does not find a difference."""
    if not answer.claims or (p_over_all is not None and p_over_all <= alpha):
        return answer
    text = (
        "Nothing is claimed here: single tests in the sections below find something, but the test over all statements "
        f"does not find a difference. {NO_EVIDENCE}"
    )
    return replace(answer, text=text, sizes=(), claims=False, exploratory=False, at_ms=None)


def _of_block(found: BlockFound, results: Results) -> tuple[Answer, ...]:
    """Return the answers that a block gives: none before anybody's answers count."""
    if not found.n:
        return ()
    if not found.revealed:
        waits = "This waits for the key to be opened: until then settings are codes."
        return tuple(Answer(one.key, found.id, found.title, waits, ()) for one in questions(found.kind))
    return tuple(one(found, results).answer() for one in questions(found.kind))


def questions(kind: Kind) -> tuple[type[Finding[Any]], ...]:
    """Return the findings that answer a question of the first page about blocks of this kind."""
    return tuple(one for one in all_findings() if one.question and kind in one.kinds)
