"""Orders of codes, tracks and steps of a session, from rules that a person can check: no recorded draws."""

import tomllib
from collections import Counter
from itertools import groupby, pairwise
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import BlockOrder, FormOrder, Orders, orders_of
from study_app.protocol.orders.schedule import (
    FormStep,
    PageStep,
    Trial,
    blocks_in_order,
    build_schedule,
    codes_of,
    draw_key,
)
from study_app.protocol.orders.tracks import Track, track_of, tracks_of
from study_app.protocol.randomization import stream
from tests.protocol.edited_studies import text_of
from tests.protocol.trials.level_studies import study


def block(name: str = "b", **fields: Any) -> BlockOrder:
    keys: dict[str, Any] = {"phase": "main", "part": 1, "codes": ("A", "B", "C"), "order": "fixed", "repetitions": 1}
    return BlockOrder(id=name, **(keys | fields))


def orders_by_seed(of: BlockOrder, participant: str = "P001") -> list[tuple[str, ...]]:
    return [codes_of("study", of, participant, seed) for seed in range(60)]


def test_codes_in_fixed_order_are_repeated_as_they_are_written() -> None:
    assert set(orders_by_seed(block(repetitions=2))) == {("A", "B", "C", "A", "B", "C")}


def test_shuffled_codes_come_once_in_each_repetition() -> None:
    orders = orders_by_seed(block(order="shuffled", repetitions=3))
    for codes in orders:
        for first in (0, 3, 6):
            assert sorted(codes[first : first + 3]) == ["A", "B", "C"]
    assert len({codes[:3] for codes in orders}) == 6, "every order is drawn"
    assert any(codes[:3] != codes[3:6] != codes[6:] for codes in orders)
    others = (block("c", order="shuffled", repetitions=3), "P001"), (block(order="shuffled", repetitions=3), "P002")
    for other, participant in others:
        assert orders_by_seed(other, participant) != orders, "each block and participant draws its own"


def test_each_round_of_interleaved_tracks_has_the_unfinished_ones() -> None:
    orders = orders_by_seed(block(order="interleaved", slots=(2, 4, 3)))
    for codes in orders:
        rounds = codes[:3], codes[3:6], codes[6:8], codes[8:]
        assert [sorted(codes_of_round) for codes_of_round in rounds] == [
            ["A", "B", "C"], ["A", "B", "C"], ["B", "C"], ["B"],
        ]  # fmt: skip
    assert len({codes[:3] for codes in orders}) == 6
    assert {codes[:3] == codes[3:6] for codes in orders} == {True, False}


def test_blocked_tracks_are_completed_one_after_another_in_a_drawn_order() -> None:
    orders = orders_by_seed(block(order="blocked", slots=(2, 4, 3)))
    for codes in orders:
        runs = [(code, len(list(run))) for code, run in groupby(codes)]
        assert sorted(runs) == [("A", 2), ("B", 4), ("C", 3)]
    assert len({tuple(dict.fromkeys(codes)) for codes in orders}) == 6


@pytest.mark.parametrize(("order", "expected"), [("latin", 3), ("williams", 6)])
def test_places_use_all_rows_of_a_square_before_repeating_one(order: str, expected: int) -> None:
    """A Williams design of three codes has six rows, a Latin square three; in each column codes are even."""
    rows = [codes_of("study", block(order=order), "P001", 1, place) for place in range(1, 2 * expected + 1)]
    assert set(rows[:expected]) == set(rows[expected:]), "all rows, then all again"
    assert len(set(rows)) == expected
    for column in zip(*rows[:expected], strict=True):
        assert Counter(column) == dict.fromkeys("ABC", expected // 3)
    if order == "williams":
        pairs = Counter(pair for row in rows[:expected] for pair in pairwise(row))
        assert Counter(pairs.values()) == {2: 6}, "each code follows each other one twice"
    assert codes_of("study", block(order=order), "P002", 7) == codes_of("study", block(order=order), "P002", 8)


def test_a_session_numbers_its_trials_and_forms_and_has_breaks_between() -> None:
    of_block = block(items=("warm", "cold"), repetitions=2, break_every=2, break_page="rest", order="fixed")
    form = FormOrder("load", ("effort", "hurry"), "fixed")
    practice = block("warm_up", phase="practice", part=None, codes=("practice",), items=("ready",))
    steps = ("hello", form, practice, form, of_block, form, "thanks")
    orders = Orders("study", steps)
    assert orders.answers == 6 * 2 + 3 * 2, "of each main trial and each time of the form"
    schedule = build_schedule(orders, "P001", 5)
    assert (schedule.participant, schedule.seed) == ("P001", 5)
    session_steps = [
        step.page_id if isinstance(step, PageStep)
        else (step.form, step.items, step.after, step.time) if isinstance(step, FormStep)
        else (step.number, step.block, step.phase, step.part, step.index, step.of, step.code, step.items)
        for step in schedule.steps
    ]  # fmt: skip
    questions, questions_of_form = ("effort", "hurry"), ("warm", "cold")

    def trial(number: int, code: str) -> tuple[Any, ...]:
        return number, "b", "main", 1, number - 1, 6, code, questions_of_form

    assert session_steps == [
        "hello", ("load", questions, None, 1), (1, "warm_up", "practice", None, 1, 1, "practice", ("ready",)),
        ("load", questions, "warm_up", 2), trial(2, "A"), trial(3, "B"), "rest", trial(4, "C"), trial(5, "A"), "rest",
        trial(6, "B"), trial(7, "C"), ("load", questions, "b", 3), "thanks",
    ]  # fmt: skip
    assert [step.number for step in schedule.trials] == [1, 2, 3, 4, 5, 6, 7]


def test_shuffled_questions_are_drawn_for_each_trial_and_each_time_a_form_is_asked() -> None:
    items = tuple("abcdef")
    form = FormOrder("load", items, "shuffled")
    of_block = block(items=items, item_order="shuffled", repetitions=2)
    schedule = build_schedule(Orders("study", (form, of_block, form)), "P001", 5)
    item_orders = [step.items for step in schedule.steps if isinstance(step, FormStep | Trial)]
    assert len(item_orders) == len(set(item_orders)) == 8
    assert {tuple(sorted(order)) for order in item_orders} == {items}
    again = build_schedule(Orders("study", (of_block,)), "P001", 5)
    assert [step.items for step in again.trials] == item_orders[1:7], "forms move no draw of a trial"


def test_main_blocks_change_places_and_parts_keep_theirs() -> None:
    main = [block(name, part=part) for part, name in enumerate("xyz", start=1)]
    steps = ("hello", main[0], block("practice", phase="practice", part=None), *main[1:])
    orders_seen = set()
    for seed in range(60):
        orders = Orders("study", steps, "random")
        numbers = blocks_in_order(orders, "P001", seed)
        schedule = build_schedule(orders, "P001", seed)
        names = list(dict.fromkeys(trial.block for trial in schedule.trials))
        expected = ["xyz"[number] for number in numbers]
        assert names == [expected[0], "practice", *expected[1:]]
        parts = dict.fromkeys((trial.block, trial.part) for trial in schedule.trials if trial.phase == "main")
        assert list(parts) == list(zip(expected, (1, 2, 3), strict=True))
        orders_seen.add(numbers)
    assert len(orders_seen) == 6
    assert blocks_in_order(Orders("study", steps, "fixed"), "P001", 1) == (0, 1, 2)
    balanced = Orders("study", steps, "balanced")
    rows = [blocks_in_order(balanced, "P001", 1, place) for place in range(1, 13)]
    assert (len(set(rows[:6])), set(rows[:6])) == (6, set(rows[6:]))


def test_a_track_is_named_by_its_standard_and_number_or_by_its_conditions() -> None:
    two = study(('kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 8',
                 'kind = "updown"\ntrials = 24\ntracks = 2'))  # fmt: skip
    block_of = two.blocks["viscosity"]
    tracks = tracks_of(two, block_of)
    assert tracks == tuple(
        Track(f"{standard}/{number}", float(standard), None, 12, number) for standard in (1, 2) for number in (1, 2)
    )
    assert track_of(two, block_of, "2/1") == tracks[2]
    conditions = study((
        'stimulus = "viscosity"\ndesign = "2ifc"\nmethod = "few"',
        'conditions = ["oil", "other", "late"]\nstandard = "oil"\ndesign = "abx"\nrepetitions = 8',
    ))  # fmt: skip
    assert tracks_of(conditions, conditions.blocks["viscosity"]) == (
        Track("other", None, "other", 8), Track("late", None, "late", 8),
    )  # fmt: skip
    noisy = study(('design = "2ifc"', 'design = "yesno"'), ("repetitions = 8", "repetitions = 20"))
    design = noisy.design_of(noisy.blocks["viscosity"])
    assert {track.slots for track in tracks_of(noisy, noisy.blocks["viscosity"])} == {60 + design.noise(60)}
    with_catch = study(("repetitions = 8", "repetitions = 20"), ("task =", "catch = { share = 0.1 }\ntask ="))
    for track in tracks_of(with_catch, with_catch.blocks["viscosity"]):
        assert (track.slots, len(track.catch)) == (66, 6)
        assert all(first.stop <= second.start for first, second in pairwise(track.catch))
        assert (track.catch[0].start >= 0, track.catch[-1].stop <= 66) == (True, True)
    modulus = '[designs.number]\nkind = "estimation"\nmodulus = { level = 0.5, number = 10 }\n'
    edits = ('design = "2ifc"', 'design = "number"'), ("standards = [1, 2]", 'level = "value"')
    numbered = study(*edits, more=modulus)
    (track,) = tracks_of(numbered, numbered.blocks["viscosity"])
    assert (track.standard, track.slots) == (None, 3 * 8 + 1), "the first trial assigns a number to a level"


def test_the_orders_of_a_study_are_described_block_by_block() -> None:
    tables = tomllib.loads(text_of("brackish"))
    tables["sequence"] = ["consent", "form", "practice", "liquids", "delays"]
    tables["study"]["block_order"] = "balanced"
    more = {"order": "constrained", "repetitions": 6, "max_repeats": 2, "break_every": 4, "break_page": "consent"}
    tables["blocks"]["liquids"] |= more
    protocol = Protocol.model_validate(tables)
    item_ids = ("wet", "calm", "near")
    questions = {"items": item_ids, "item_order": "shuffled"}
    main: dict[str, Any] = {"phase": "main", "repetitions": 1, "order": "shuffled"} | questions
    assert orders_of(protocol) == Orders(
        "brackish",
        (
            "consent",
            FormOrder("form", item_ids, "shuffled"),
            block("practice", phase="practice", part=None, codes=("practice",)),
            BlockOrder(id="liquids", part=1, codes=("L1", "L2"), **(main | more)),
            BlockOrder(id="delays", part=2, codes=("D1", "D2"), **main),
        ),
        "balanced",
    )
    assert orders_of(protocol).answers == 12 * 3 + 2 * 3 + 3
    assert [block.breaks for block in orders_of(protocol).blocks] == [0, 2, 0]
    key = draw_key(protocol, lambda: 0.0)
    assert key.keys() == {"practice", "liquids", "delays"}
    assert key["practice"] == {"practice": "learn"}
    assert {code: {key_codes[code] for key_codes in drawn_keys(protocol)} for code in ("D1", "D2")} == {
        "D1": {"see_prompt", "see_tardy"}, "D2": {"see_prompt", "see_tardy"},
    }  # fmt: skip
    far = tomllib.loads(text_of("brackish"))
    far["blocks"]["liquids"] |= {"order": "constrained", "repetitions": 2, "min_distance": 2}
    assert orders_of(Protocol.model_validate(far)).blocks[1].min_distance == 2


def drawn_keys(protocol: Protocol) -> list[dict[str, str]]:
    """The condition of each code of the delays, in keys that are drawn anew."""
    return [draw_key(protocol, stream(seed, "key").random)["delays"] for seed in range(20)]


def test_a_trial_is_called_by_its_block_and_by_its_number_unless_it_is_the_only_practice() -> None:
    protocol = Protocol.model_validate(tomllib.loads(text_of("brackish")))
    for phase, of, expected in (
        ("practice", 1, "Setting"), ("practice", 2, "Setting 1"), ("main", 1, "Setting 1"), ("main", 2, "Setting 1"),
    ):  # fmt: skip
        trial = Trial(number=7, block="liquids", phase=phase, part=1, index=1, of=of, code="L1", items=())
        assert trial.label(protocol, "en") == expected
