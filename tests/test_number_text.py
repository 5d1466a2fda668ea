"""Numbers as people type them, whole where they are written so, and with every digit."""

import pytest

from study_app.number_text import exact_text, number_of, typed_numbers


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


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("0, 60, 120", [0, 60, 120]),
        ("0 60;120", [0, 60, 120]),
        ("0,5 1,5", [0.5, 1.5]),
        ("0,5; 1", [0.5, 1]),
        ("7", [7]),
        ("\u22120.5 1e3", [-0.5, 1000.0]),
    ],
)
def test_a_list_of_numbers_is_read_where_its_commas_are_clear(text: str, numbers: list[float]) -> None:
    assert [number for _, number in typed_numbers(text)] == numbers


@pytest.mark.parametrize("text", ["0,5", "0,60,120", "0, 0,5"])
def test_a_comma_between_digits_that_may_separate_them_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="may be one number or several: separate numbers by spaces or semicolons"):
        typed_numbers(text)


@pytest.mark.parametrize(("text", "why"), [("", "one number"), (" , ", "one number"), ("4 thick", "“thick” is not")])
def test_a_list_without_a_number_is_refused(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        typed_numbers(text)
