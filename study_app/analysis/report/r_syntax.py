"""Values and calls in the syntax of R."""

from collections.abc import Iterable, Iterator

from study_app.analysis.results.block_results import BlockFound
from study_app.analysis.results.item_test import Tested


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


def pair_calls(found: BlockFound, codes: str, first: str, second: str, one: Tested) -> Iterator[str]:
    """Yield the call that compares two settings in one statement; none where it has no p."""
    if one.outcome.statistic is not None and one.outcome.p is not None:
        what = r_text(f"{one.item}, {first} and {second}")
        numbers = f"{r_text(first)}, {r_text(second)}, {r_number(one.outcome.statistic)}, {r_number(one.outcome.p)}"
        yield f"pair({what}, wide({r_text(found.id)}, {r_text(one.item)}, {codes}), {numbers})"
