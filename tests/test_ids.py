"""Ids made from texts, and free ones."""

import pytest

from study_app.ids import MAX_ID, free_id, free_short_name, id_of, short_name_of


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("How thick was it?", "how_thick_was_it"),
        ("  Don't – stop!  ", "dont_stop"),
        ("Crème brûlée", "creme_brulee"),
        ("Straße", "strasse"),
        ("2. Water", "water"),
        ("50 % honey", "honey"),
        ("_a_", "a"),
        ("Вода", ""),
        ("42", ""),
    ],
)
def test_a_text_gives_an_id(text: str, name: str) -> None:
    assert id_of(text) == name


@pytest.mark.parametrize(
    ("text", "longest", "name"),
    [
        ("how thick was it", 9, "how_thick"),
        ("how thick was it", 12, "how_thick"),
        ("how thick was it", 16, "how_thick_was_it"),
        ("viscosity", 4, "visc"),
    ],
)
def test_an_id_ends_with_a_whole_word_where_it_can(text: str, longest: int, name: str) -> None:
    assert id_of(text, longest) == name


def test_a_free_id_counts_from_2() -> None:
    assert free_id(["a", "a_2"], "a") == "a_3"
    assert free_id(["b"], "a") == "a"
    assert free_id(["a", "a_2"], "a_2") == "a_3"
    long = "x" * MAX_ID
    assert len(free_id([long], long)) <= len(long)


@pytest.mark.parametrize(
    ("name", "taken", "free"),
    [
        ("kitchen", ["kitchen"], "kitchen2"),
        ("kitchen2", ["kitchen", "kitchen2"], "kitchen3"),
        ("rek2024", ["rek2024"], "rek2024v2"),
        ("rek2024v2", ["rek2024", "rek2024v2"], "rek2024v3"),
        ("k" * 40, ["k" * 40], "k" * 39 + "2"),
        ("new", ["kitchen"], "new"),
    ],
)
def test_a_free_short_name_has_letters_and_digits_alone(name: str, taken: list[str], free: str) -> None:
    assert free_short_name(taken, name) == free


def test_a_title_gives_a_short_name() -> None:
    assert short_name_of("2 liquids: Crème, and Oil!") == "liquidscremeandoil"
    assert len(short_name_of("word " * 40)) == 40
