import hashlib
from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import block_codes, order_of, orders_of
from study_app.protocol.orders.schedule import PageStep, Schedule, Trial, build_schedule, draw_key, stream
from study_app.protocol.randomization.sequences import (
    Constraint,
    Square,
    assigned_row,
    enrolment_number,
    has_even_borders,
    row,
    row_count,
)
from study_app.protocol.randomization.streams import shuffle
from tests.protocol.sound import ORDER, SOUND

REK = load("rek2024")
SMALL = parse(SOUND.encode(), "small.toml")
seeds = st.integers(min_value=0, max_value=2**64)
participants = st.text(st.sampled_from("ABCP0123456789"), min_size=1, max_size=6)


def codes(schedule: Schedule, block: str) -> list[str]:
    return [trial.code for trial in schedule.trials if trial.block == block]


@pytest.mark.parametrize(
    ("protocol", "digest"),
    [
        (REK, "08b72e46b51b155f8cb86e772c184005ad2a337472d24aa2b19ddee27eb8a3e5"),
        (load("demo"), "8d431528c58487158a5636ff2869637763a4e9b7920ef8303a105ecee7aeae4e"),
        (
            parse(
                SOUND.replace('scale = "agreement"', 'scale = "agreement"\nitem_order = "shuffled"').encode(), "small"
            ),
            "1642d21b6cad98edcbdc8c14b36100cd67d3ba12f82c525c7f3d7740ce9e51f1",
        ),
    ],
    ids=["rek2024", "demo", "small"],
)
def test_whole_schedules_do_not_change(protocol: Protocol, digest: str):
    """Running sessions and stored receipts depend on them: a change needs a new name of a stream or order."""
    steps = [
        repr(build_schedule(protocol, f"P{number:03d}", seed).steps)
        for number in range(1, 51)
        for seed in (0, 1, 20240601, 2**64)
    ]
    assert hashlib.sha256("\n".join(steps).encode()).hexdigest() == digest


def test_orders_of_many_participants_are_even():
    """6 orders of 3 liquids, 600 participants: each order about 100 times (χ², 5 degrees of freedom, p = 0.001)."""
    counts = Counter(tuple(codes(build_schedule(REK, f"P{number}", 7), "liquids")) for number in range(600))
    assert len(counts) == 6
    assert sum((count - 100) ** 2 / 100 for count in counts.values()) < 20.5


@pytest.mark.slow
def test_orders_of_the_parts_are_independent():
    """First liquid (3) and first delay (7) of 2100 participants, a 3 × 7 table: χ², 12 degrees of freedom, p 0.001."""
    table: Counter[tuple[str, str]] = Counter()
    for number in range(2100):
        schedule = build_schedule(REK, f"P{number}", 3)
        table[codes(schedule, "liquids")[0], codes(schedule, "delays")[0]] += 1
    rows, columns = Counter(), Counter()
    for (liquid, delay), count in table.items():
        rows[liquid] += count
        columns[delay] += count
    expected = {(row, column): rows[row] * columns[column] / 2100 for row in rows for column in columns}
    assert sum((table[cell] - mean) ** 2 / mean for cell, mean in expected.items()) < 32.9


def edited(old: str, new: str):
    assert SOUND.count(old) == 1
    return parse(SOUND.replace(old, new).encode(), "small.toml")


@pytest.mark.slow
@given(seeds)
def test_an_extra_draw_in_one_stream_does_not_change_the_others(seed: int):
    before = build_schedule(SMALL, "P1", seed)
    more_repetitions = build_schedule(edited("repetitions = 2", "repetitions = 3"), "P1", seed)
    assert codes(more_repetitions, "feel")[:4] == codes(before, "feel")
    assert codes(more_repetitions, "look") == codes(before, "look")
    shuffled_items = build_schedule(
        edited('scale = "agreement"', 'scale = "agreement"\nitem_order = "shuffled"'), "P1", seed
    )
    assert [trial.code for trial in shuffled_items.trials] == [trial.code for trial in before.trials]
    assert {trial.items for trial in before.trials} == {(), ("warm", "cold")}
    assert {tuple(sorted(trial.items)) for trial in shuffled_items.trials} == {(), ("cold", "warm")}


@given(seeds)
def test_the_key_is_a_bijection(seed: int):
    for protocol in (REK, SMALL):
        key = draw_key(protocol, stream(seed, "key").random)
        assert set(key) == set(protocol.blocks)
        for name, block in protocol.blocks.items():
            assert tuple(key[name]) == block_codes(protocol, block)
            assert sorted(key[name].values()) == sorted(block.conditions)


def test_every_key_is_drawn():
    keys = Counter(tuple(draw_key(REK, stream(seed, "key").random)["liquids"].values()) for seed in range(600))
    assert len(keys) == 6
    assert sum((count - 100) ** 2 / 100 for count in keys.values()) < 20.5


def test_a_shuffle_reaches_both_ends_of_the_draw():
    assert shuffle("abc", lambda: 0.0) == ("b", "c", "a")
    assert shuffle("abc", lambda: 1 - 2**-53) == ("a", "b", "c")
    assert shuffle("", lambda: 0.0) == ()


def test_labels_are_neutral_and_in_the_participants_language():
    trials = build_schedule(REK, "P001", 1).trials
    labels = [trial.label(REK, "en") for trial in trials]
    assert labels == [
        "Practice",
        *(f"Liquid setting {index}" for index in (1, 2, 3)),
        "Baseline",
        *(f"Delay setting {index}" for index in range(1, 8)),
    ]
    assert trials[1].label(REK, "nl") == "Vloeistofinstelling 1"


def test_a_schedule_does_not_name_conditions():
    schedule = build_schedule(REK, "P001", 1)
    blinded = [trial for trial in schedule.trials if trial.phase == "main"]
    for name in (*REK.conditions, *REK.liquids):
        for trial in blinded:
            assert name not in repr(trial).replace("like_" + name, "")


def of_six(order: str, more: str = "") -> Protocol:
    """Return the small protocol with six conditions in this order and further keys of the block."""
    names = [f"c{number}" for number in range(6)]
    tables = "".join(f'[conditions.{name}]\nliquid = "thin"\ndelay_ms = {ms}\n' for ms, name in enumerate(names))
    listed = ", ".join(f'"{name}"' for name in names)
    text = SOUND.replace('["is_thin", "is_thick"]', f"[{listed}]").replace(
        "[tasks.explore]", f"{tables}[tasks.explore]"
    )
    return parse(text.replace(ORDER, f'order = "{order}"\n{more}').encode(), "six.toml")


def test_dealt_orders_are_the_same_on_every_machine():
    orders = [codes(build_schedule(of_six("williams"), f"P00{number}", 1), "feel") for number in (1, 2)]
    assert [" ".join(order) for order in orders] == ["L4 L5 L3 L6 L2 L1", "L6 L1 L5 L2 L4 L3"]
    assert " ".join(codes(build_schedule(of_six("latin"), "P001", 1), "feel")) == "L4 L5 L6 L1 L2 L3"


@pytest.mark.slow
@given(seeds, participants)
def test_constrained_orders_keep_their_constraint_over_all_repetitions(seed: int, participant: str):
    protocol = of_six("constrained", "repetitions = 3\nmin_distance = 4")
    order = codes(build_schedule(protocol, participant, seed), "feel")
    assert Counter(order) == dict.fromkeys(("L1", "L2", "L3", "L4", "L5", "L6"), 3)
    assert Constraint(min_distance=4).permits(order)


BREAKS = """
[pages.pause]
kind = "break"
title = { en = "Rest", nl = "Rust" }
body = { en = "Let go.", nl = "Laat los." }

[blocks.warm_up]
"""


def with_breaks(every: int) -> Protocol:
    text = SOUND.replace(ORDER, f'{ORDER}\nbreak_every = {every}\nbreak_page = "pause"')
    return parse(text.replace("[blocks.warm_up]\n", BREAKS).encode(), "small.toml")


@pytest.mark.parametrize(
    ("every", "expected"), [(1, "1 pause 2 pause 3 pause 4"), (2, "1 2 pause 3 4"), (3, "1 2 3 pause 4")]
)
def test_breaks_are_between_trials_and_not_after_the_last(every: int, expected: str):
    protocol = with_breaks(every)
    steps = build_schedule(protocol, "P001", 1).steps
    in_block = [
        step.page_id if isinstance(step, PageStep) else str(step.index)
        for step in steps
        if step == PageStep("pause") or (isinstance(step, Trial) and step.block == "feel")
    ]
    assert in_block == expected.split()
    assert in_block.count("pause") == order_of(protocol, protocol.blocks["feel"]).breaks
    assert build_schedule(protocol, "P001", 1).trials == build_schedule(SMALL, "P001", 1).trials


@pytest.mark.slow
@given(seeds, participants)
def test_a_schedule_needs_no_more_than_its_orders(seed: int, participant: str):
    for protocol in (REK, SMALL):
        assert build_schedule(orders_of(protocol), participant, seed) == build_schedule(protocol, participant, seed)


SIZES = range(2, 13)


def rows(square: Square, codes: int, repetitions: int = 1) -> list[tuple[int, ...]]:
    return [row(square, codes, number, repetitions) for number in range(row_count(square, codes))]


def positions(orders: list[tuple[int, ...]]) -> set[int]:
    """Return the distinct counts of codes per position: a single number if they are equal."""
    counts = Counter((position, code) for order in orders for position, code in enumerate(order))
    codes, length = len(set(orders[0])), len(orders[0])
    return {counts[position, code] for position in range(length) for code in range(codes)}


def follows(orders: list[tuple[int, ...]]) -> set[int]:
    """Return the distinct counts of successions of codes: a single number if they are equal."""
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
def test_a_latin_square_balances_only_positions(codes: int):
    orders = rows("latin", codes)
    assert len(orders) == codes
    assert positions(orders) == {1}
    assert follows(orders) == ({1} if codes == 2 else {0, codes - 1})


@pytest.mark.parametrize("codes", SIZES)
@pytest.mark.parametrize("square", ["williams", "latin"])
def test_repetitions_are_as_balanced_as_the_first_and_codes_never_follow_themselves(square: Square, codes: int):
    for repetitions in (2, 3, codes + 1):
        orders = rows(square, codes, repetitions)
        assert len(positions(orders)) == 1
        for order in orders:
            assert all(first != then for first, then in pairwise(order))
            for start in range(0, len(order), codes):
                assert sorted(order[start : start + codes]) == list(range(codes))


@pytest.mark.parametrize("codes", SIZES)
def test_the_borders_of_repetitions_are_even_exactly_where_it_is_said(codes: int):
    claimed = [repetitions for repetitions in range(1, 2 * codes) if has_even_borders(codes, repetitions)]
    counted_out = [
        repetitions for repetitions in range(1, 2 * codes) if len(follows(rows("williams", codes, repetitions))) == 1
    ]
    assert claimed == counted_out
    assert codes in claimed


def test_a_single_code_has_a_single_row():
    assert row_count("williams", 1) == row_count("latin", 1) == 1
    assert row("williams", 1, 0, 3) == (0, 0, 0)
    assert has_even_borders(1, 3)


@pytest.mark.parametrize(
    ("participant", "number"),
    [("P007", 7), ("P120", 120), ("7", 7), ("S2P07", 7), ("A1B", 1), ("anna", None), ("P000", 0)],
)
def test_the_number_in_an_id(participant: str, number: int | None):
    assert enrolment_number(participant) == number


@given(st.integers(1, 30), st.integers(0, 40), st.text("abcxyz", min_size=1, max_size=5))
def test_every_round_deals_every_row(rows: int, rounds: int, study: str):
    numbers = range(1 + rounds * rows, 1 + (rounds + 1) * rows)
    assert sorted(assigned_row(study, "block", rows, f"P{number:03d}") for number in numbers) == list(range(rows))


def test_rounds_blocks_and_studies_deal_in_orders_of_their_own():
    def assigned(study: str, block: str, rounds: int) -> tuple[int, ...]:
        return tuple(assigned_row(study, block, 12, f"P{1 + 12 * rounds + place}") for place in range(12))

    orders = [assigned("a", "x", 0), assigned("a", "x", 1), assigned("a", "y", 0), assigned("b", "x", 0)]
    assert len(set(orders)) == 4


def test_an_id_without_a_number_draws_its_row():
    names = [first + second + third for first in "abcdefghij" for second in "abcdefghij" for third in "abcdef"]
    counts = Counter(assigned_row("study", "block", 6, name) for name in names)
    assert sum((counts[row] - 100) ** 2 / 100 for row in range(6)) < 20.5  # χ², 5 degrees of freedom, p = 0.001
    assert assigned_row("study", "block", 6, "anna") == assigned_row("study", "block", 6, "anna")
