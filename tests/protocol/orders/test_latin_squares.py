from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.orders.latin_squares import Square, assigned_row, borders_even, enrolment, row, row_count

SIZES = range(2, 13)


def rows(square: Square, codes: int, repetitions: int = 1) -> list[tuple[int, ...]]:
    return [row(square, codes, number, repetitions) for number in range(row_count(square, codes))]


def positions(orders: list[tuple[int, ...]]) -> set[int]:
    """Return how often codes come in positions: one number if they do so equally often."""
    counts = Counter((position, code) for order in orders for position, code in enumerate(order))
    codes, length = len(set(orders[0])), len(orders[0])
    return {counts[position, code] for position in range(length) for code in range(codes)}


def follows(orders: list[tuple[int, ...]]) -> set[int]:
    """Return how often codes follow others: one number if they do so equally often."""
    counts = Counter(pair for order in orders for pair in pairwise(order))
    codes = len(set(orders[0]))
    return {counts[first, then] for first in range(codes) for then in range(codes) if first != then}


@pytest.mark.parametrize("codes", SIZES)
def test_a_williams_design_is_exact(codes: int):
    orders = rows("williams", codes)
    squares = 1 + codes % 2
    assert len(orders) == len(set(orders)) == squares * codes
    assert all(sorted(order) == list(range(codes)) for order in orders)
    assert positions(orders) == {squares}
    assert follows(orders) == {squares}


def test_williams_designs_as_they_are_printed_in_books():
    assert rows("williams", 4) == [(0, 1, 3, 2), (1, 2, 0, 3), (2, 3, 1, 0), (3, 0, 2, 1)]
    assert rows("williams", 3) == [(0, 1, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0), (0, 2, 1), (1, 0, 2)]
    assert rows("williams", 2) == [(0, 1), (1, 0)]


@pytest.mark.parametrize("codes", SIZES)
def test_a_latin_square_is_even_in_position_alone(codes: int):
    orders = rows("latin", codes)
    assert len(orders) == codes
    assert positions(orders) == {1}
    assert follows(orders) == ({1} if codes == 2 else {0, codes - 1})


@pytest.mark.parametrize("codes", SIZES)
@pytest.mark.parametrize("square", ["williams", "latin"])
def test_repetitions_are_as_even_as_the_first_and_no_code_follows_itself(square: Square, codes: int):
    for repetitions in (2, 3, codes + 1):
        orders = rows(square, codes, repetitions)
        assert len(positions(orders)) == 1
        for order in orders:
            assert all(first != then for first, then in pairwise(order))
            for start in range(0, len(order), codes):
                assert sorted(order[start : start + codes]) == list(range(codes))


@pytest.mark.parametrize("codes", SIZES)
def test_the_borders_of_repetitions_are_even_exactly_where_it_is_said(codes: int):
    told = [repetitions for repetitions in range(1, 2 * codes) if borders_even(codes, repetitions)]
    found = [
        repetitions for repetitions in range(1, 2 * codes) if len(follows(rows("williams", codes, repetitions))) == 1
    ]
    assert told == found
    assert codes in told


def test_a_single_code_has_a_single_row():
    assert row_count("williams", 1) == row_count("latin", 1) == 1
    assert row("williams", 1, 0, 3) == (0, 0, 0)
    assert borders_even(1, 3)


@pytest.mark.parametrize(
    ("participant", "number"),
    [("P007", 7), ("P120", 120), ("7", 7), ("S2P07", 7), ("A1B", 1), ("anna", None), ("P000", 0)],
)
def test_the_number_in_an_id(participant: str, number: int | None):
    assert enrolment(participant) == number


@given(st.integers(1, 30), st.integers(0, 40), st.text("abcxyz", min_size=1, max_size=5))
def test_every_round_deals_every_row(rows: int, rounds: int, study: str):
    numbers = range(1 + rounds * rows, 1 + (rounds + 1) * rows)
    assert sorted(assigned_row(study, "block", rows, f"P{number:03d}") for number in numbers) == list(range(rows))


def test_rounds_blocks_and_studies_deal_in_orders_of_their_own():
    def assigned(study: str, block: str, rounds: int) -> tuple[int, ...]:
        return tuple(assigned_row(study, block, 12, f"P{1 + 12 * rounds + place}") for place in range(12))

    orders = [assigned("a", "x", 0), assigned("a", "x", 1), assigned("a", "y", 0), assigned("b", "x", 0)]
    assert len(set(orders)) == 4


def test_rows_are_dealt_the_same_on_every_machine():
    assert [assigned_row("rek2024", "liquids", 6, f"P{number:03d}") for number in range(1, 13)] == [
        2,
        1,
        5,
        3,
        0,
        4,
        3,
        2,
        5,
        1,
        0,
        4,
    ]
    assert assigned_row("rek2024", "liquids", 6, "P7") == assigned_row("rek2024", "liquids", 6, "P007")


def test_an_id_without_a_number_draws_its_row():
    names = [first + second + third for first in "abcdefghij" for second in "abcdefghij" for third in "abcdef"]
    counts = Counter(assigned_row("study", "block", 6, name) for name in names)
    assert sum((counts[row] - 100) ** 2 / 100 for row in range(6)) < 20.5  # χ², 5 degrees of freedom, p = 0.001
    assert assigned_row("study", "block", 6, "anna") == assigned_row("study", "block", 6, "anna")
