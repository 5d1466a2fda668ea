"""Events of a journal for tests, with empty fields by default."""

from collections.abc import Iterable, Mapping
from typing import Any

from study_app.store.journals.journal_events import EVENTS, Event, read_event

ANSWER = ("item", "number", "value", "onset_s", "first_s", "last_s", "changes")


def event_of(name: str, **fields: Any) -> Event:
    """Return an event with these fields, and empty ones where its class requires more."""
    kind = EVENTS.get(name)
    empty = {} if kind is None else dict.fromkeys(kind.required)
    empty |= {"limits": {}} if "limits" in empty else {}
    if kind is not None and "items" in kind.required:
        fields["items"] = [dict.fromkeys(ANSWER) | row for row in fields.get("items", ())]
    return read_event({"event": name, **empty, **fields})


def event_from(line: Mapping[str, Any]) -> Event:
    """Return the event of a line, or of a part of one."""
    return event_of(**{"name": line["event"], **{name: value for name, value in line.items() if name != "event"}})


def raw(lines: Iterable[Event]) -> list[dict[str, Any]]:
    """Return journal lines as the file stores them."""
    return [line.line() for line in lines]
