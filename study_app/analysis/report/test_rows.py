"""Tests as rows of tests.csv, and values and calls in the syntax of R."""

from collections.abc import Iterable
from typing import Any, Final

from study_app.analysis.findings.block_tests import ALONE
from study_app.analysis.results import BlockFound, Tested
from study_app.analysis.statistics.outcome import Outcome
from study_app.store.tables.csv_files import Column, optional

TESTS: Final = (
    Column("block", "text", "Id of the block."),
    Column("question", "text", "What is asked."),
    optional("item", "text", "Id of the statement; n/a where the test is over several."),
    optional("comparison", "text", "Which settings, where not all."),
    Column("test", "text", "The test."),
    Column("n", "integer", "Participants used.", minimum=0),
    Column("dropped", "integer", "Participants not used, for missing answers.", minimum=0),
    Column("statistic_name", "text", "What the statistic is."),
    optional("statistic", "number", "The statistic."),
    optional("p", "number", "p, not corrected.", minimum=0, maximum=1),
    optional("p_adjusted", "number", "p, corrected within the family.", minimum=0, maximum=1),
    optional("smallest_p", "number", "The smallest p that could have come out.", minimum=0, maximum=1),
    optional("family", "text", "What is corrected together."),
    optional("members", "integer", "Tests in the family.", minimum=1),
    optional("correction", "text", "How p is corrected."),
    optional("primary", "flag", "true where it was decided on before the study."),
    optional("verdict", "text", "What may be said."),
    Column("effect_name", "text", "What the effect is."),
    optional("effect", "number", "The effect."),
    optional("low", "number", "Lower end of the effect's interval."),
    optional("high", "number", "Upper end of the effect's interval."),
    optional("level", "number", "Confidence of the interval."),
    optional("interval", "text", "How the interval was made, or why there is none."),
    Column("method", "text", "How p was found."),
    optional("note", "text", "What must be said with it."),
)


def test_row(found: BlockFound, question: str, outcome: Outcome) -> dict[str, Any]:
    """Return the row of a test that answers a question about a block; its family and verdict are empty."""
    interval = outcome.interval
    blank = {column.name: None for column in TESTS}
    return blank | {
        "block": found.id,
        "question": question,
        **{
            field: getattr(outcome, field)
            for field in (
                *("test", "n", "dropped", "statistic_name", "statistic", "p", "smallest_p", "method"),
                *("effect_name", "effect"),
            )
        },
        "low": None if interval is None else interval.low,
        "high": None if interval is None else interval.high,
        "level": None if interval is None else interval.level,
        "interval": outcome.no_interval or None if interval is None else interval.method,
        "note": outcome.note or None,
    }


def judged_row(found: BlockFound, question: str, one: Tested) -> dict[str, Any]:
    """Return the row of a test of one statement, with its family and verdict."""
    return test_row(found, question, one.outcome) | {
        "item": one.item,
        "family": one.family,
        "members": one.members,
        "correction": one.correction,
        "p_adjusted": one.p_adjusted,
        "primary": one.primary,
        "verdict": one.verdict,
    }


def rows_alone(found: BlockFound, what: str) -> dict[str, Any]:
    """Return the family of a test that is corrected for no other."""
    return {"family": f"{found.id}: {what}", "members": 1, "correction": ALONE}


def r_number(value: float) -> str:
    """Return a number as R reads it."""
    return repr(float(value))


def r_text(words: str) -> str:
    """Return a text as R reads it."""
    escaped = words.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def r_vector(words: Iterable[str]) -> str:
    """Return a vector of texts as R reads it."""
    return f"c({', '.join(map(r_text, words))})"
