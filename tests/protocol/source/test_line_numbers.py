import tomllib
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.source.document import Places
from tests.golden import compare

TRICKY = (Path(__file__).parent / "tricky.toml").read_text(encoding="utf-8")


def test_lines_of_every_kind_of_notation(pytestconfig: pytest.Config):
    places = Places(TRICKY)
    lines = [f"{places.line(path)}: {path}" for path in keys_of(tomllib.loads(TRICKY))]
    compare(Path(__file__).parent / "tricky_lines.txt", lines, pytestconfig, fixed=True)


def test_a_missing_key_has_the_line_of_its_table():
    places = Places(TRICKY)
    assert places.line(("rows", 1, "missing")) == 32
    assert places.line(("last", "end", "of", "all")) == 40
    assert places.line(("nowhere",)) is None
    assert places.line(()) is None


def test_a_table_written_after_its_child_is_at_its_own_header():
    places = Places("[a.b]\nx = 1\n[a]\ny = 2\n")
    assert places.line(("a",)) == 3
    assert places.line(("a", "b")) == 1


@pytest.mark.parametrize("name", ["rek2024", "demo"])
def test_the_line_of_every_key_of_a_shipped_protocol_holds_the_key(name: str):
    text = (Path(__file__).parents[3] / "protocols" / f"{name}.toml").read_text(encoding="utf-8")
    lines, places = text.splitlines(), Places(text)
    paths = list(keys_of(tomllib.loads(text)))
    assert len(paths) > 100
    for path in paths:
        line = places.line(path)
        assert line is not None
        assert isinstance(path[-1], int) or path[-1] in lines[line - 1], path


def keys_of(node: Any, path: tuple[str | int, ...] = ()):
    """Yield the paths of all keys and entries."""
    entries = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for step, value in entries:
        yield (*path, step)
        yield from keys_of(value, (*path, step))


@pytest.mark.parametrize("header", ["[", "[]", "[[", "[[]]", "[ = "])
def test_an_incomplete_header_does_not_hide_earlier_lines(header: str) -> None:
    places = Places(f"[a]\nb = 1\n{header}")
    assert places.line(("a", "b")) == 2
