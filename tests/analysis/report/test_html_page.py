"""Tables of the report as HTML: which columns are aligned as numbers, which texts wrap, and when a table is folded."""

import re
from typing import Any

import pytest

from study_app.analysis.html_page import LONG, table

HEAD = ("Liquid", "Median", "Range", "Verdict")
ROW = ("Honey", "5.5", "2 to 6", "a difference")


def classes(html: str, tag: str) -> list[str]:
    """Return the class of each cell with this tag, or ""."""
    return re.findall(rf'<{tag}(?: class="(\w+)")?>', html)


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ({}, ["", "n", "n", "n"]),
        ({"words": 0}, ["n", "n", "n", "n"]),
        ({"words": 2}, ["", "", "n", "n"]),
        ({"last": 1}, ["", "n", "n", ""]),
        ({"words": 0, "last": 2}, ["n", "n", "", ""]),
    ],
)
def test_columns_between_the_first_and_last_ones_are_numbers(columns: dict[str, Any], expected: list[str]) -> None:
    html = table(HEAD, [ROW], **columns)
    assert classes(html, "th") == classes(html, "td") == expected
    assert re.findall(r">([^<>\n]+)</t[hd]>", html) == [*HEAD, *ROW]


@pytest.mark.parametrize(("characters", "expected"), [(16, ""), (17, "words"), (LONG, "words"), (LONG + 1, "long")])
def test_long_texts_wrap_but_numbers_do_not(characters: int, expected: str) -> None:
    html = table(HEAD[:2], [("x" * characters, "9" * 40)])
    assert classes(html, "td") == [expected, "n"]


@pytest.mark.parametrize(("rows", "folded", "is_folded"), [(12, False, False), (13, False, True), (3, True, True)])
def test_a_table_of_many_rows_is_folded(rows: int, folded: bool, is_folded: bool) -> None:
    html = table(HEAD, [ROW] * rows, folded=folded)
    assert html.count("<td") == 4 * rows
    assert (f"<summary>Table of {rows} rows</summary>" in html) == is_folded
