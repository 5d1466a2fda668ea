import tomllib
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.source.document import Places

TRICKY = '''\
# comment with = and [brackets]
top = "a # no comment"  # a comment
"quoted key" = "it's \\"quoted\\" # here"
dotted . "in part" . three = 3

[first]   # a table
text = """
[not.a.table]
key = "no key"
"""
literal = '’'
[[nor this]]
'’'
quotes = """two ""quotes"""""
when = 1979-05-27 07:32:00
numbers = [
    1, # one
    [2, 3],

    { x = 1, y = [4,
        5] },
]

[first.second."third.fourth"]
deep = true

[[rows]]
name = "a"
[rows.inner]
value = 1

[[rows]]
name = "b"
[[rows.inner]]
value = 2
[[rows.inner]]
value = 3

[last]
end = 1'''.replace("'’'", "'" * 3)

TRICKY_LINES = {
    ("top",): 2,
    ("quoted key",): 3,
    ("dotted",): 4,
    ("dotted", "in part", "three"): 4,
    ("first",): 6,
    ("first", "text"): 7,
    ("first", "literal"): 11,
    ("first", "quotes"): 14,
    ("first", "when"): 15,
    ("first", "numbers"): 16,
    ("first", "numbers", 0): 17,
    ("first", "numbers", 1): 18,
    ("first", "numbers", 1, 1): 18,
    ("first", "numbers", 2): 20,
    ("first", "numbers", 2, "y"): 20,
    ("first", "numbers", 2, "y", 1): 21,
    ("first", "second"): 24,
    ("first", "second", "third.fourth", "deep"): 25,
    ("rows",): 27,
    ("rows", 0, "name"): 28,
    ("rows", 0, "inner", "value"): 30,
    ("rows", 1): 32,
    ("rows", 1, "inner"): 34,
    ("rows", 1, "inner", 0, "value"): 35,
    ("rows", 1, "inner", 1): 36,
    ("last", "end"): 40,
}


@pytest.mark.parametrize(("path", "line"), TRICKY_LINES.items(), ids=str)
def test_lines_of_every_kind_of_notation(path: tuple[str | int, ...], line: int):
    tomllib.loads(TRICKY)
    assert Places(TRICKY).line(path) == line


def test_what_is_missing_is_at_the_table_around_it():
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
        assert str(path[-1]) in lines[line - 1], path


def keys_of(node: Any, path: tuple[str | int, ...] = ()):
    """Yield the paths of all keys."""
    entries = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for step, value in entries:
        if isinstance(step, str):
            yield (*path, step)
        yield from keys_of(value, (*path, step))


@pytest.mark.parametrize("header", ["[", "[]", "[[", "[[]]", "[ = "])
def test_a_header_that_is_being_typed_hides_no_lines_before_it(header: str) -> None:
    places = Places(f"[a]\nb = 1\n{header}")
    assert places.line(("a", "b")) == 2
