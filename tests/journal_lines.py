"""Events of a journal for tests: with nothing where a test says nothing."""

from collections.abc import Mapping
from typing import Any

from study_app.store.journals.journal_events import EVENTS, Event, read_event


def event_of(name: str, **fields: Any) -> Event:
    """Return an event with these fields, and empty ones where its class requires more."""
    kind = EVENTS.get(name)
    empty = {} if kind is None else dict.fromkeys(kind.required)
    empty |= {field: value for field, value in {"items": (), "limits": {}}.items() if field in empty}
    return read_event({"event": name, **empty, **fields})


def event_from(line: Mapping[str, Any]) -> Event:
    """Return the event of a line, or of a part of one."""
    return event_of(**{"name": line["event"], **{name: value for name, value in line.items() if name != "event"}})
