"""The first page: three answers each with a picture, the limits below them, and how often it is wrong.

Measured by ``liquid-study validate-report --studies 1000``: studies of rek2024 in which nothing differs, of each size
1000 by the answer model and 1000 by the ordinal probit model.
"""

import base64
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

from markupsafe import Markup

from study_app.analysis.data.blocks import Kind
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.finding import NO_EVIDENCE, Answer, Finding, answer_picture
from study_app.analysis.findings.statement_tests import OverAll
from study_app.analysis.planning.power_curves import interval
from study_app.analysis.report.html_page import render
from study_app.analysis.report.sentences import none_found, of_levels
from study_app.analysis.results import BlockFound, Failure, Failures, Results
from study_app.analysis.statistics.outcome import holm

STUDIES: Final = 2000
CLAIMS: Final[dict[int, int]] = {5: 11, 12: 33, 24: 36}
"""Participants → in how many of so many empty studies the page claims something."""

SHOWN: Final = 6
"""So many limits are listed; the others are folded."""


def first_page(results: Results, limits: Sequence[str], failures: Failures) -> Markup:
    """Return the first page as HTML; a picture that fails is left out, and kept in ``failures``."""
    found = {one.id: one for one in results.blocks}
    found_answers = answers(results)
    return render(
        "first_page.html",
        answers=[_shown(one, found[one.block], results, failures) for one in found_answers],
        several=len({one.block for one in found_answers}) > 1,
        without_findings=of_levels(results) or (none_found(results),),
        limits=list(limits),
        shown=SHOWN,
        empty=empty_studies(max((one.n for one in results.blocks), default=0)) if found_answers else "",
    )


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


def _shown(answer: Answer, found: BlockFound, results: Results, failures: Failures) -> dict[str, Any]:
    finding = next(one for one in questions(found.kind) if one.key == answer.question)(found, results)
    drawn = failures.attempt(
        f"picture “{answer.question}”",
        lambda: answer_picture(lambda sheet: finding.picture(sheet, answer)) if found.revealed else None,
        block=answer.block,
    )
    png, alt = (b"", "") if isinstance(drawn, Failure) or drawn is None else drawn
    return {
        "question": finding.question.format(kind=found.kind),
        "title": answer.title,
        "text": _kept_together(answer.text),
        "exploratory": answer.exploratory,
        "sizes": [_kept_together(line) for line in answer.sizes],
        "picture": base64.b64encode(png).decode("ascii"),
        "alt": alt,
    }


def _kept_together(words: str) -> str:
    """Return a text in which no line ends between a number and its unit."""
    return words.replace(" ms", "\u00a0ms").replace(" %", "\u00a0%").replace(" points", "\u00a0points")


def empty_studies(participants: int) -> str:
    """Return in how many of a hundred empty studies the page would say something; ``participants`` take part."""
    n = min(CLAIMS, key=lambda size: abs(size - participants))
    share, low, high = (100 * one for one in (CLAIMS[n] / STUDIES, *interval(CLAIMS[n] / STUDIES, STUDIES)))
    return (
        "In how many of a hundred empty studies would this page say something? Of simulated studies of three liquids "
        f"and seven delays in which nothing differs, with {n} participants, it claims a difference or a noticed delay "
        f"in {share:.1f} of a hundred ({CLAIMS[n]} of {STUDIES} studies, 95 % interval {low:.1f} to {high:.1f}; "
        "liquid-study validate-report)."
    )
