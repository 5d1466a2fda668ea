"""Numbers as people type them, whole where they are written so, and with every digit."""

from __future__ import annotations

import pytest

from study_app.number_text import exact_text, number_of


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("7", 7),
        ("\u22127", -7),
        ("45 918", 45918),
        ("7.0", 7.0),
        ("0,5", 0.5),
        ("1e3", 1000.0),
        ("1_0", None),
        ("", None),
    ],
)
def test_a_number_is_whole_where_it_is_written_so(text: str, number: float | None) -> None:
    found = number_of(text)
    assert (found, type(found)) == (number, type(number))


@pytest.mark.parametrize(
    ("value", "text"),
    [(1000, "1000"), (1000.0002, "1000.0002"), (0.00002, "0.00002"), (60.0, "60"), (1e22, "1" + 22 * "0"), (-0.0, "0")],
)
def test_an_exact_text_has_every_digit_and_no_exponent(value: float, text: str) -> None:
    assert exact_text(value) == text
