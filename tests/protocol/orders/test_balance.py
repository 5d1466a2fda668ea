from pathlib import Path

import pytest

from study_app.errors import StudyError
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.balance import balance, describe_balance, evenness, numbered_participants
from tests.golden import check_kept
from tests.protocol.sound import ORDER, SOUND

REK = load("rek2024")


def ordered(order: str, conditions: int = 3, repetitions: int = 1) -> Protocol:
    """The small protocol, its block "feel" with so many conditions in that order."""
    names = [f"c{number}" for number in range(conditions)]
    tables = "".join(f'[conditions.{name}]\nliquid = "thin"\ndelay_ms = {ms}\n' for ms, name in enumerate(names))
    listed = ", ".join(f'"{name}"' for name in names)
    return parse(
        SOUND.replace('["is_thin", "is_thick"]', f"[{listed}]")
        .replace("[tasks.explore]", f"{tables}[tasks.explore]")
        .replace(ORDER, f"{order}\nrepetitions = {repetitions}")
        .encode(),
        "small",
    )


def test_positions_and_successions_are_counted():
    counts = evenness("abc", ["abc", "bca", "abb"])
    assert counts.positions == ((2, 1, 0), (0, 2, 1), (1, 1, 1))
    assert counts.follows == ((0, 2, 0), (0, 1, 2), (1, 0, 0))
    assert counts.after_another == (2, 0, 0, 2, 1, 0)
    assert (counts.longest_run, counts.shortest_distance) == (2, 1)
    assert counts.orders == 3
    assert not counts.positions_even
    assert not counts.follows_even


@pytest.mark.parametrize("conditions", range(2, 13))
def test_a_williams_design_is_balanced_only_after_full_rounds(conditions: int):
    rows = conditions * (1 + conditions % 2)
    protocol = ordered('order = "williams"', conditions)
    for participants in (1, rows - 1, rows, rows + 1, 2 * rows):
        counts = balance(protocol, numbered_participants(participants), 1).blocks[0].evenness
        full = participants % rows == 0
        assert counts.positions_even == full
        assert counts.follows_even == full
        if full:
            assert set(counts.after_another) == {participants // conditions}


def test_a_range_of_ids_is_judged_from_its_first_one():
    assert numbered_participants(3, "A099") == ("A099", "A100", "A101")
    protocol = ordered(WILLIAMS, 3)
    even = {
        first: balance(protocol, numbered_participants(6, first), 1).blocks[0].evenness.balanced
        for first in ("P004", "P061")
    }
    assert even == {"P004": False, "P061": True}
    with pytest.raises(StudyError, match="ends in a number"):
        numbered_participants(6, "anna")


def test_blocks_with_one_code_are_left_out():
    judgement = balance(REK, numbered_participants(5), 3)
    assert [block.id for block in judgement.blocks] == ["liquids", "delays"]
    assert (judgement.study, judgement.participants, judgement.seed) == ("rek2024", 5, 3)
    assert sum(map(sum, judgement.blocks[1].evenness.positions)) == 5 * 7


def test_a_design_needs_participants():
    with pytest.raises(StudyError, match="at least one participant"):
        balance(REK, (), 1)


def test_a_design_does_not_name_conditions():
    text = describe_balance(balance(REK, numbered_participants(12), 1))
    for name in ("honey", "light_oil", "delay_125"):
        assert name not in text
    assert text.splitlines() == [line.rstrip() for line in text.splitlines()]


CONSTRAINED = 'order = "constrained"\nmax_repeats = 1'
WILLIAMS, LATIN, SHUFFLED, FIXED = (f'order = "{order}"' for order in ("williams", "latin", "shuffled", "fixed"))
DESIGNS = (  # order, conditions, repetitions, participants
    (WILLIAMS, 3, 1, numbered_participants(6)),
    (WILLIAMS, 3, 1, numbered_participants(7)),
    (WILLIAMS, 4, 1, numbered_participants(1)),
    (WILLIAMS, 7, 1, numbered_participants(15)),
    (WILLIAMS, 7, 1, numbered_participants(28)),
    (WILLIAMS, 5, 2, numbered_participants(10)),
    (WILLIAMS, 5, 3, numbered_participants(10)),
    (WILLIAMS, 5, 3, numbered_participants(9)),
    (WILLIAMS, 3, 1, ("P001", "A1", "B1", "C1", "D1", "E1")),
    (WILLIAMS, 3, 1, ("P001", "anna", "bob")),
    (LATIN, 2, 1, numbered_participants(2)),
    (LATIN, 4, 1, numbered_participants(4)),
    (LATIN, 4, 1, numbered_participants(5)),
    (SHUFFLED, 3, 2, numbered_participants(20)),
    (SHUFFLED, 3, 1, numbered_participants(20)),
    (CONSTRAINED, 3, 2, numbered_participants(20)),
    (FIXED, 3, 1, numbered_participants(20)),
)


def test_designs_in_words() -> None:
    """The description of the second block, which never changes, is omitted."""
    alone = SOUND.replace('["is_thin", "is_thick"]', '["is_thin"]').replace('["on_time", "both"]', '["both"]')
    descriptions = [describe_balance(balance(parse(alone.encode(), "small"), ("P001",), 1))]
    for order, conditions, repetitions, ids in DESIGNS:
        description = describe_balance(balance(ordered(order, conditions, repetitions), ids, 1))
        descriptions.append(
            f"{order!r}, {conditions} conditions {repetitions} times\n{description.split('Looking (block')[0]}"
        )
    physical = load("physical_liquids")
    descriptions += [
        describe_balance(balance(physical, numbered_participants(participants), 1)) for participants in (1, 6, 12)
    ]
    check_kept(Path(__file__).with_name("designs.txt"), "\n=====\n".join(descriptions).split("\n"))
