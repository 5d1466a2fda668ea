"""The first page: three answers with a picture beside each, the limits below them, and how often it is wrong."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from functools import cache
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from study_app.analysis.findings.block_results import BlockFound, Results
from study_app.analysis.findings.section_failures import Failure, Failures
from study_app.analysis.report.first_page import pictures
from study_app.analysis.report.first_page.answer import ASKED, Answer
from study_app.analysis.report.first_page.claims import answers
from study_app.analysis.report.measured import empty_studies

SHOWN: Final = 6
"""So many limits are listed; the others are folded."""


def first_page(results: Results, limits: Sequence[str], failures: Failures) -> str:
    """Return the first page as HTML; a picture that fails is left out, and kept in ``failures``."""
    found = {one.id: one for one in results.blocks}
    told = answers(results)
    return _template().render(
        answers=[_shown(one, found[one.block], failures) for one in told],
        several=len({one.block for one in told}) > 1,
        limits=list(limits),
        shown=SHOWN,
        empty=empty_studies(max((one.n for one in results.blocks), default=0)) if told else "",
    )


def _shown(answer: Answer, found: BlockFound, failures: Failures) -> dict[str, Any]:
    drawn = failures.attempt(f"picture “{answer.question}”", lambda: pictures.draw(answer, found), block=answer.block)
    png, alt = (b"", "") if isinstance(drawn, Failure) or drawn is None or not found.revealed else drawn
    return {
        "question": ASKED[answer.question],
        "title": answer.title,
        "told": _kept_together(answer.told),
        "exploratory": answer.exploratory,
        "sizes": [_kept_together(line) for line in answer.sizes],
        "picture": base64.b64encode(png).decode("ascii"),
        "alt": alt,
    }


def _kept_together(words: str) -> str:
    """Return a text in which no line ends between a number and its unit."""
    return words.replace(" ms", "\u00a0ms").replace(" %", "\u00a0%").replace(" points", "\u00a0points")


@cache
def _template() -> Template:
    """Return the template of the first page; everything in it is escaped, and nothing may be missing."""
    loader = PackageLoader("study_app.analysis.report.first_page", "templates")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.get_template("first_page.html")
