"""Values in TOML notation: on one line, over several, with the quotes of a neighbour."""

from typing import Any

import pytest

from study_app.designer.document.toml_text import inline_value, key_text, toml_value

LONG = [f"statement number {number}" for number in range(6)]


@pytest.mark.parametrize(
    ("value", "like", "text"),
    [
        ([], "", "[]"),
        ([], "[\n  1,\n]", "[]"),
        ((), "", "[]"),
        ([1, 2.5], "", "[1, 2.5]"),
        (["a"], '[\n    "b",\n]', '[\n    "a",\n]'),
        (["a"], '[\n  "b",\n]', '[\n  "a",\n]'),
        (["a"], '["b"]', '["a"]'),
        ({}, "", "{}"),
        ({"en": "Oil", "a b": [True]}, "", '{ en = "Oil", "a b" = [true] }'),
        ("it's", "'oil'", '"it\'s"'),
        ("oil", "'water'", "'oil'"),
        ("oil", '"water"', '"oil"'),
        ("two\nlines", "", '"""\ntwo\nlines"""'),
        (False, "", "false"),
    ],
)
def test_values_are_written_as_their_neighbours(value: Any, like: str, text: str) -> None:
    assert toml_value(value, like) == text


def test_a_list_longer_than_a_line_has_a_line_per_entry() -> None:
    rows = "".join(f'      "statement number {number}",\r\n' for number in range(6))
    assert toml_value(LONG, newline="\r\n", indent="  ") == f"[\r\n{rows}  ]"
    assert toml_value(LONG[:2], column=100) == '[\n    "statement number 0",\n    "statement number 1",\n]'
    assert toml_value(LONG[:2], column=20) == '["statement number 0", "statement number 1"]'


def test_keys_are_quoted_if_they_need_it() -> None:
    assert [key_text(key) for key in ("delay_ms", "80-ms", "80 ms", "é")] == ["delay_ms", "80-ms", '"80 ms"', '"é"']
    assert inline_value({"80 ms": {}}) == '{ "80 ms" = {} }'
