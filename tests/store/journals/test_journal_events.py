from collections.abc import Callable
from typing import Any

import pytest

from study_app.store.journals.journal_events import problem, unknown_events
from study_app.store.sessions.open_session import SessionStore

OF_ALL = {"n": 1, "t_s": 0.0, "at": "2026-03-01T10:00:00.000+01:00"}


def line(event: str, **fields: Any) -> dict[str, Any]:
    return {**OF_ALL, "event": event, **fields}


def test_whatever_the_store_writes_is_in_the_dictionary(
    start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    store = start(recordings=True)
    attend(store)
    store.finish("completed")
    assert list(unknown_events(store.lines)) == []
    assert [problem(each) for each in store.lines if problem(each)] == []


@pytest.mark.parametrize(
    ("held", "sentence"),
    [
        (line("note", kind="note"), "(note) lacks text"),
        ({"n": 4, "event": "resumed"}, "(resumed) lacks t_s, at, by"),
        (line("weather") | {"at": "noon"}, "(weather) holds at 'noon', expected: time"),
        (line("weather") | {"at": "2026-03-01T10:00:00.000"}, "(weather) holds at '2026-03-01T10:00:00.000', expected"),
        (line("weather") | {"t_s": True}, "(weather) holds t_s True, expected: number"),
        (line("weather") | {"t_s": 1e300}, "(weather) has t_s 1e+300"),
        (line("weather") | {"t_s": -1.0}, "(weather) has t_s -1"),
        (line("weather", trial=[]), "(weather) holds trial [], expected: integer"),
        ({"n": 4, "event": ["note"]}, "names no event"),
        (line("page_shown", page=["consent"]), "(page_shown) holds page ['consent'], expected: text"),
        (line("choice", trial="1", item="calm", value=3), "holds trial '1', expected: integer"),
        (line("choice", trial=1, item="calm", value="x" * 999), "…, expected: integer"),
        (line("responses", trial=1, attempt=1, items=[{"item": "calm"}]), "expected: list of answers"),
        (line("trial_ended", trial=1, attempt=1, outcome="complete", force_peak_n="3"), "holds force_peak_n '3'"),
        (line("preflight", checks=[3]), "holds checks [3], expected: list of objects"),
    ],
)
def test_what_is_wrong_with_a_line_is_named(held: dict[str, Any], sentence: str) -> None:
    said = problem(held)
    assert said is not None
    assert sentence in said
    assert len(said) < 300


def test_an_event_of_another_version_is_told_once_and_lacks_nothing() -> None:
    lines = [line("weather", wind="x"), line("note", kind="note", text=""), line("weather")]
    assert list(unknown_events(lines)) == ["weather"]
    assert [problem(each) for each in lines] == [None] * 3
