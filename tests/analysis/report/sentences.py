"""Every sentence of the first page, the limits and the methods as a template, with a check of what it claims.

The modules `*_sentences` list the templates. A template is a regular expression and a function that recomputes the
claim from report.json, tests.csv and the answers. `check` refuses a sentence that has no template.
"""

import re
from collections.abc import Iterator, Sequence
from typing import Final

from tests.analysis.report.first_page_sentences import FIRST_PAGE
from tests.analysis.report.hypothesis_sentences import HYPOTHESES
from tests.analysis.report.limit_sentences import LIMITS
from tests.analysis.report.methods_sentences import METHODS
from tests.analysis.report.report_numbers import DECIDED, Check, ReportNumbers, position

TEMPLATES: Final[Sequence[tuple[str, Check]]] = (*FIRST_PAGE, *HYPOTHESES, *LIMITS, *METHODS)


def split(text: str) -> Iterator[str]:
    """Yield the sentences of a text."""
    yield from (part.strip() for part in re.split(r"(?<=[.!?])\s+(?=[A-Z“\d])", text) if part.strip())


def check(text: str, report: ReportNumbers) -> None:
    """Check every sentence of a text; a sentence without a template, or that is not true of the study, is a failure."""
    for sentence in split(text):
        matches = [(match, holds) for pattern, holds in TEMPLATES if (match := re.fullmatch(pattern, sentence))]
        assert matches, f"no template for: {sentence}"
        match, holds = matches[0]
        assert holds(match, report), f"not true of the study: {sentence}"


def check_verdicts(report: ReportNumbers) -> None:
    """Check that the verdict of each row agrees with its p, or its interval."""
    for contrast in report.against:
        verdict = contrast["found"]["verdict"]
        assert (position(contrast) == "beyond") == (verdict == "not equivalent"), contrast
        assert verdict != "equivalent" or contrast["found"]["p"] <= contrast["found"]["alpha"], contrast
    for row in report.rows:
        if row["p_adjusted"] and row["verdict"] in ("shown", "suggested", "not shown", "out of reach"):
            significant = float(row["p_adjusted"]) <= report.alpha
            assert significant == (row["verdict"] in DECIDED), row
            assert row["verdict"] != "shown" or row["primary"] == "true", row
