from __future__ import annotations

from collections.abc import Callable
from typing import Any

from study_app.store.events import EVENTS, lacking_fields, unknown_events
from study_app.store.session import SessionStore

OF_ALL = {"n": 1, "t_s": 0.0, "at": "2026-03-01T10:00:00.000+01:00"}


def line(event: str, **fields: Any) -> dict[str, Any]:
    return {**OF_ALL, "event": event, **fields}


def test_names_are_unique_and_described_in_a_sentence() -> None:
    assert len({event.name for event in EVENTS}) == len(EVENTS)
    assert all(event.description.endswith(".") for event in EVENTS)


def test_whatever_the_store_writes_is_in_the_dictionary(
    start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    store = start(recordings=True)
    attend(store)
    store.finish("completed")
    assert list(unknown_events(store.lines)) == []
    assert list(lacking_fields(store.lines)) == []


def test_a_line_without_a_field_of_its_event_is_named() -> None:
    lines = [line("note", kind="note"), line("paused"), line("resumed", by="operator"), {"n": 4, "event": "resumed"}]
    assert list(lacking_fields(lines)) == [
        "line 1 (note) lacks text",
        "line 1 (paused) lacks by",
        "line 4 (resumed) lacks t_s, at, by",
    ]


def test_an_event_of_another_version_is_told_once_and_lacks_nothing() -> None:
    lines = [line("weather"), line("note", kind="note", text=""), line("weather")]
    assert list(unknown_events(lines)) == ["weather"]
    assert list(lacking_fields(lines)) == []
