"""The answers of the first page, block by block, and which of them may claim something."""

from __future__ import annotations

from dataclasses import replace

from study_app.analysis.findings.block_results import BlockFound, Results
from study_app.analysis.report.first_page.answer import NO_EVIDENCE, Answer, Question
from study_app.analysis.report.first_page.answers_of_delays import noticed_from, unchanged
from study_app.analysis.report.first_page.answers_of_liquids import distinguished
from study_app.analysis.statistics.multiple_comparisons import holm
from study_app.analysis.tables.planned_analysis import Decided


def answers(results: Results) -> tuple[Answer, ...]:
    """Return the answers that a study gives, block by block.

    They claim something about a block only where the one test over all its statements finds a difference, corrected
    by Holm over the blocks: in a study where nothing differs they then claim anything at most so often as alpha says.
    """
    overall = holm([None if found.overall is None else found.overall.p for found in results.blocks])
    return tuple(
        _unless_claimed_alone(one, p, results.decided.alpha)
        for found, p in zip(results.blocks, overall, strict=True)
        for one in _of_block(found, results.decided)
    )


def _unless_claimed_alone(answer: Answer, p_over_all: float | None, alpha: float) -> Answer:
    """Return an answer without its claim where the test over all statements does not find a difference."""
    if not answer.claims or (p_over_all is not None and p_over_all <= alpha):
        return answer
    told = (
        "Nothing is claimed here: single tests in the sections below find something, but the test over all statements "
        f"does not find a difference. {NO_EVIDENCE}"
    )
    return replace(answer, told=told, sizes=(), claims=False, exploratory=False, at_ms=None)


def _of_block(found: BlockFound, decided: Decided) -> tuple[Answer, ...]:
    """Return the answers that a block gives: none before anybody's answers count."""
    if not found.n:
        return ()
    questions: tuple[Question, ...] = (
        ("noticed from", "unchanged up to") if found.kind == "delays" else ("distinguished",)
    )
    if not found.revealed:
        waits = "This waits for the key to be opened: until then settings are codes."
        return tuple(Answer(question, found.id, found.title, waits, ()) for question in questions)
    if found.kind == "delays":
        return noticed_from(found, decided), unchanged(found)
    return (distinguished(found, decided),)
