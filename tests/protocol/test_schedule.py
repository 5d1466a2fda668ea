from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.load import load, parse
from study_app.protocol.schedule import (
    PageStep,
    Schedule,
    Trial,
    block_codes,
    build_schedule,
    draw_key,
    shuffle,
    stream,
)
from tests.protocol.cases import SOUND

REK = load("rek2024")
SMALL = parse(SOUND.encode(), "small.toml")

seeds = st.integers(min_value=0, max_value=2**64)
participants = st.text(st.sampled_from("ABCP0123456789"), min_size=1, max_size=6)


def codes(schedule: Schedule, block: str) -> list[str]:
    return [trial.code for trial in schedule.trials if trial.block == block]


@pytest.mark.parametrize(
    ("participant", "seed", "liquids", "delays"),
    [
        ("P001", 1, "L2 L1 L3", "D5 D4 D3 D6 D7 D2 D1"),
        ("P002", 1, "L1 L3 L2", "D7 D4 D2 D1 D5 D3 D6"),
        ("P007", 20240601, "L2 L1 L3", "D7 D6 D3 D4 D5 D1 D2"),
    ],
)
def test_the_order_is_the_same_on_every_machine(participant: str, seed: int, liquids: str, delays: str):
    schedule = build_schedule(REK, participant, seed)
    assert codes(schedule, "liquids") == liquids.split()
    assert codes(schedule, "delays") == delays.split()


def test_the_key_of_a_rehearsal_is_the_same_on_every_machine():
    key = draw_key(REK, stream(1, "key").random)
    assert list(key["liquids"].values()) == ["light_oil", "honey", "water"]
    assert key["delays"] == {
        "D1": "delay_75",
        "D2": "delay_0",
        "D3": "delay_150",
        "D4": "delay_125",
        "D5": "delay_200",
        "D6": "delay_100",
        "D7": "delay_50",
    }


def test_streams_are_pinned():
    assert [stream(1, "a").random(), stream(1, "b").random(), stream(2, "a").random()] == [
        0.31728946267335123,
        0.17021420984483582,
        0.08061825961078872,
    ]


@given(seeds, participants)
def test_each_condition_comes_once(seed: int, participant: str):
    schedule = build_schedule(REK, participant, seed)
    assert sorted(codes(schedule, "liquids")) == ["L1", "L2", "L3"]
    assert sorted(codes(schedule, "delays")) == ["D1", "D2", "D3", "D4", "D5", "D6", "D7"]
    assert codes(schedule, "practice") == ["practice"]
    assert codes(schedule, "baseline") == ["baseline"]


@given(seeds, participants)
def test_each_condition_comes_once_in_each_repetition(seed: int, participant: str):
    order = codes(build_schedule(SMALL, participant, seed), "feel")
    assert sorted(order[:2]) == sorted(order[2:]) == ["L1", "L2"]


@given(seeds, participants)
def test_steps_follow_the_sequence_and_are_counted(seed: int, participant: str):
    schedule = build_schedule(SMALL, participant, seed)
    assert (schedule.participant, schedule.seed) == (participant, seed)
    assert schedule.steps[0] == PageStep("hello")
    trials = schedule.trials
    assert [trial.number for trial in trials] == list(range(1, 1 + 1 + 4 + 2))
    assert [(trial.block, trial.index, trial.of) for trial in trials] == [
        ("warm_up", 1, 1),
        *(("feel", index, 4) for index in (1, 2, 3, 4)),
        *(("look", index, 2) for index in (1, 2)),
    ]
    assert [trial.phase for trial in trials] == ["practice"] + 6 * ["main"]
    assert [trial.part for trial in trials] == [None, 1, 1, 1, 1, 2, 2]


@given(seeds, participants)
def test_the_same_arguments_give_the_same_schedule(seed: int, participant: str):
    assert build_schedule(REK, participant, seed) == build_schedule(REK, participant, seed)


def test_orders_of_many_participants_are_even():
    """6 orders of 3 liquids, 600 participants: each order about 100 times (χ², 5 degrees of freedom, p = 0.001)."""
    counts = Counter(tuple(codes(build_schedule(REK, f"P{number}", 7), "liquids")) for number in range(600))
    assert len(counts) == 6
    assert sum((count - 100) ** 2 / 100 for count in counts.values()) < 20.5


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


@given(seeds)
def test_a_draw_more_in_one_stream_moves_no_other(seed: int):
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


def test_item_orders_vary_between_trials_where_they_are_shuffled():
    shuffled = edited('scale = "agreement"', 'scale = "agreement"\nitem_order = "shuffled"')
    orders = {trial.items for number in range(10) for trial in build_schedule(shuffled, f"P{number}", 1).trials}
    assert orders == {(), ("warm", "cold"), ("cold", "warm")}


def test_a_fixed_order_is_as_written():
    fixed = edited('order = "shuffled"\nrepetitions = 2', "repetitions = 2")
    for seed in range(20):
        assert codes(build_schedule(fixed, "P1", seed), "feel") == ["L1", "L2", "L1", "L2"]
        assert draw_key(fixed, stream(seed, "key").random)["feel"] == {"L1": "is_thin", "L2": "is_thick"}


@given(seeds)
def test_the_key_is_a_bijection(seed: int):
    for protocol in (REK, SMALL):
        key = draw_key(protocol, stream(seed, "key").random)
        assert set(key) == set(protocol.blocks)
        for name, block in protocol.blocks.items():
            assert tuple(key[name]) == block_codes(block)
            assert sorted(key[name].values()) == sorted(block.conditions)


def test_every_key_is_drawn():
    keys = Counter(tuple(draw_key(REK, stream(seed, "key").random)["liquids"].values()) for seed in range(600))
    assert len(keys) == 6
    assert sum((count - 100) ** 2 / 100 for count in keys.values()) < 20.5


@given(st.lists(st.integers(), max_size=20), seeds)
def test_a_shuffle_keeps_what_it_shuffles(items: list[int], seed: int):
    assert Counter(shuffle(items, stream(seed, "any").random)) == Counter(items)


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


def test_a_schedule_names_no_condition():
    schedule = build_schedule(REK, "P001", 1)
    blinded = [trial for trial in schedule.trials if trial.phase == "main"]
    for name in (*REK.conditions, *REK.liquids):
        for trial in blinded:
            assert name not in repr(trial).replace("like_" + name, "")


def test_trials_are_values():
    trial = build_schedule(REK, "P001", 1).trials[0]
    assert isinstance(trial, Trial)
    assert trial in {trial}
