"""What the conditions are is written nowhere but in the sealed key: no id, no parameter, no delay."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.protocol.model import Protocol
from study_app.store.session import SessionStore


def telltales(protocol: Protocol) -> set[str]:
    """Everything that tells a condition: ids of liquids and conditions, their numbers, and delays in ms and s."""
    tables = protocol.model_dump(mode="json", include={"liquids", "conditions"}, exclude_unset=True)
    found: set[str] = set()

    def collect(value: object) -> None:
        if isinstance(value, dict):
            for name, inner in value.items():
                if name not in ("effects", "id"):
                    collect(inner)
        elif isinstance(value, list):
            for inner in value:
                collect(inner)
        elif isinstance(value, float | int) and value:
            found.update({str(value), str(value).removesuffix(".0"), str(value / 1000)})
        elif isinstance(value, str):
            found.add(value)

    collect(tables)
    return found | set(protocol.liquids) | set(protocol.conditions)


def leaks(folder: Path, words: set[str]) -> list[str]:
    """Where one of ``words`` stands by itself: in a name or in a file, the sealed key aside."""
    pattern = re.compile("|".join(rf"(?<![\w.]){re.escape(word)}(?![\w])" for word in sorted(words)))
    found = []
    for path in sorted(folder.rglob("*")):
        if match := pattern.search(str(path.relative_to(folder))):
            found.append(f"{match[0]} in the name {path.name}")
        if path.is_file() and path.name != "key.sealed":
            found += [f"{match[0]} in {path.name}" for match in pattern.finditer(path.read_text(encoding="utf-8"))]
    return found


def test_the_words_to_look_for_are_the_conditions(protocol: Protocol) -> None:
    assert {"quagmire", "mildew", "see_tardy", "learn", "1013.7", "1391.3", "1717", "137", "0.137"} < telltales(
        protocol
    )


def test_a_leak_would_be_found(tmp_path: Path, protocol: Protocol, start: Callable[..., SessionStore]) -> None:
    store = start()
    store.append("note", kind="note", text="this must be mildew, 137 ms")
    store.finish("complete")
    assert leaks(tmp_path / "study", telltales(protocol)) == ["mildew in journal.jsonl", "137 in journal.jsonl"]


@pytest.mark.parametrize("simulated", [False, True], ids=["real", "rehearsed"])
def test_a_finished_session_tells_nothing(
    tmp_path: Path,
    protocol: Protocol,
    start: Callable[..., SessionStore],
    attend: Callable[[SessionStore], None],
    *,
    simulated: bool,
) -> None:
    store = start(simulated=simulated)
    attend(store)
    store.append("note", kind="mark", text="")
    store.finish("complete")
    assert len(list((tmp_path / "study").rglob("*.*"))) >= 7
    assert leaks(tmp_path / "study", telltales(protocol)) == []
    assert not telltales(protocol) & set(re.findall(r"[\w.]+", repr(store.key)))
