"""The first page: three answers each with a picture, the limits below them, and how often it is wrong."""

import base64
from collections.abc import Sequence
from typing import Any, Final

from markupsafe import Markup

from study_app.analysis.report.findings_summary import none_found, of_levels
from study_app.analysis.report.first_page import pictures
from study_app.analysis.report.first_page.answer import Answer
from study_app.analysis.report.first_page.claims import answers, questions
from study_app.analysis.report.html_page import render
from study_app.analysis.report.measured import empty_studies
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.section_failures import Failure, Failures

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


def _shown(answer: Answer, found: BlockFound, results: Results, failures: Failures) -> dict[str, Any]:
    finding = next(one for one in questions(found.kind) if one.key == answer.question)(found, results)
    drawn = failures.attempt(
        f"picture “{answer.question}”",
        lambda: pictures.draw(lambda sheet: finding.picture(sheet, answer)) if found.revealed else None,
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
