"""Whether the answers in a journal's confirmations are those that were chosen before."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from study_app.store.journals.journal import Line
from study_app.store.progress import Given, Progress

_ROUNDED_S = 1.1e-6


def wrong_responses(lines: Sequence[Line]) -> Iterator[str]:
    """Yield a sentence on each answer in ``responses`` that is not the one given by the choices before it."""
    now = Progress()
    for line in lines:
        if line["event"] in ("responses", "form_answered"):
            chosen = dict(now.answers)
            where = f"form {line['form']}" if "form" in line else f"trial {line['trial']}"
            line_name = f"line {line['n']} ({line['event']})"
            hides = any("kind" in row for row in line["items"])  # format 2: a question may have been shown for a while
            for row in line["items"]:
                given = chosen.pop(row["item"], Given())
                if not _is_of(row, given):
                    yield (
                        f"{line_name} has for {row['item']!r} in {where} another answer "
                        f"than was chosen before: it was changed"
                    )
            yield from (
                f"{line_name} lacks {item!r}, answered in {where}: it was changed"
                for item, given in chosen.items()
                if given.first_s is not None or not hides
            )
        now.take(line)


def _is_of(row: Mapping[str, Any], given: Given) -> bool:
    """Return whether an answer in ``responses`` is what was ``given``; moments of a line are rounded to 1 µs."""
    moments = ((row[name], getattr(given, name)) for name in ("onset_s", "first_s", "last_s"))
    return (row["value"], row["changes"]) == (given.value, given.changes) and all(
        listed == ours or (None not in (listed, ours) and abs(listed - ours) <= _ROUNDED_S) for listed, ours in moments
    )
