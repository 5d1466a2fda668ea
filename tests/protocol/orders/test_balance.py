import pytest

from study_app.errors import StudyError
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.balance import balance, describe_balance, evenness, numbered
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


def test_positions_and_what_follows_what_are_counted():
    counted = evenness("abc", ["abc", "bca", "abb"])
    assert counted.positions == ((2, 1, 0), (0, 2, 1), (1, 1, 1))
    assert counted.follows == ((0, 2, 0), (0, 1, 2), (1, 0, 0))
    assert counted.after_another == (2, 0, 0, 2, 1, 0)
    assert (counted.longest_run, counted.shortest_distance) == (2, 1)
    assert counted.orders == 3
    assert not counted.positions_even
    assert not counted.follows_even


def test_even_orders_are_recognised():
    latin = evenness("abc", ["abc", "bca", "cab"])
    assert latin.positions_even
    assert not latin.follows_even
    assert not latin.balanced
    williams = evenness("abc", ["abc", "bca", "cab", "cba", "acb", "bac"])
    assert williams.positions == ((2, 2, 2),) * 3
    assert williams.follows == ((0, 2, 2), (2, 0, 2), (2, 2, 0))
    assert williams.balanced
    assert (williams.longest_run, williams.shortest_distance) == (1, None)


@pytest.mark.parametrize("conditions", range(2, 13))
def test_a_williams_design_balances_every_full_round_and_no_other_number(conditions: int):
    rows = conditions * (1 + conditions % 2)
    protocol = ordered('order = "williams"', conditions)
    for participants in (1, rows - 1, rows, rows + 1, 2 * rows):
        counted = balance(protocol, numbered(participants), 1).blocks[0].evenness
        full = participants % rows == 0
        assert counted.positions_even == full
        assert counted.follows_even == full
        if full:
            assert set(counted.after_another) == {participants // conditions}


def test_blocks_with_one_code_are_left_out():
    judged = balance(REK, numbered(5), 3)
    assert [block.id for block in judged.blocks] == ["liquids", "delays"]
    assert (judged.study, judged.participants, judged.seed) == ("rek2024", 5, 3)
    assert sum(map(sum, judged.blocks[1].evenness.positions)) == 5 * 7


def test_the_seed_matters_to_random_orders_alone():
    def counted(protocol: Protocol, seed: int):
        return balance(protocol, numbered(6), seed).blocks[0].evenness

    assert counted(REK, 1) != counted(REK, 2)
    assert counted(ordered('order = "williams"'), 1) == counted(ordered('order = "williams"'), 2)


def test_a_design_needs_participants():
    with pytest.raises(StudyError, match="no participants"):
        balance(REK, (), 1)


def test_ids_are_those_a_study_suggests():
    assert numbered(2) == ("P001", "P002")
    assert numbered(1000)[-1] == "P1000"


WILLIAMS = """\
small: the orders of 6 participants, each with seed 1

Feeling (block feel): 3 codes, order williams

  position  L1  L2  L3
  1          2   2   2
  2          2   2   2
  3          2   2   2

  after     L1  L2  L3
  L1         0   2   2
  L2         2   0   2
  L3         2   2   0

  Positions are balanced: each code comes in each position twice.
  Carry-over is balanced: each code follows each other one twice.
  6 participants are a full round of 6 rows.

Looking (block look)"""


def test_a_balanced_design_in_words():
    assert describe_balance(balance(ordered('order = "williams"'), numbered(6), 1)).startswith(WILLIAMS)


@pytest.mark.parametrize(
    ("order", "conditions", "repetitions", "participants", "words"),
    [
        (
            "williams",
            3,
            1,
            7,
            "A full round is 6 participants, the next number that fills one is 12: each code then comes in each "
            "position 4 times and follows each other one 4 times.",
        ),
        (
            "williams",
            4,
            1,
            1,
            "A full round is 4 participants, the next number that fills one is 4: each code then comes in each "
            "position once and follows each other one once.",
        ),
        ("williams", 7, 1, 15, "the next number that fills one is 28"),
        ("williams", 7, 1, 15, "Positions are uneven: a code comes in a position 2 to 3 times, 2.14 on average."),
        ("williams", 7, 1, 15, "Carry-over is uneven: a code follows another one 2 to 3 times, 2.14 on average."),
        ("williams", 7, 1, 28, "28 participants are 2 full rounds of 14 rows."),
        ("williams", 5, 2, 10, "From one repetition to the next carry-over cannot be even; with 3 repetitions it can."),
        ("williams", 5, 2, 10, "Positions are balanced: each code comes in each position twice."),
        ("williams", 5, 3, 10, "Carry-over is balanced: each code follows each other one 7 times."),
        ("williams", 5, 3, 9, "each code then comes in each position twice and follows each other one 7 times."),
        ("latin", 4, 1, 4, 'A Latin square evens out positions alone; order = "williams" evens out carry-over too.'),
        ("latin", 4, 1, 5, "the next number that fills one is 8: each code then comes in each position twice."),
        ("shuffled", 3, 2, 20, "Drawn anew in every session: even on average only, and every seed gives other tables."),
        (
            "shuffled",
            3,
            2,
            20,
            "At most 2 of a kind come in a row; the least distance from one to the next of its kind is 1.",
        ),
        ("shuffled", 3, 1, 20, 'order = "williams" would be even exactly, for every 6 participants.'),
        ('constrained"\nmax_repeats = "', 3, 2, 20, "At most 1 of a kind come in a row; the least distance"),
        ("fixed", 3, 1, 20, "Everyone gets the same order: effects of condition and of position cannot be"),
        ("fixed", 3, 1, 20, "Positions are uneven: a code comes in a position 0 to 20 times, 6.67 on average."),
        ('constrained"\nmax_repeats = "', 3, 2, 20, "Drawn anew in every session"),
    ],
)
def test_what_a_design_can_promise(order: str, conditions: int, repetitions: int, participants: int, words: str):
    line = 'order = "constrained"\nmax_repeats = 1' if "constrained" in order else f'order = "{order}"'
    judged = balance(ordered(line, conditions, repetitions), numbered(participants), 1)
    section = describe_balance(judged).split("Looking (block look)")[0]
    assert words in section


def test_two_codes_in_a_latin_square_are_a_williams_design():
    section = describe_balance(balance(ordered('order = "latin"', 2), numbered(2), 1)).split("Looking (block look)")[0]
    assert "Carry-over is balanced: each code follows each other one once." in section
    assert "williams" not in section


def test_ids_that_fill_no_round_are_told():
    protocol = ordered('order = "williams"')
    same = describe_balance(balance(protocol, ("P001", "A1", "B1", "C1", "D1", "E1"), 1))
    assert "A full round is the numbers 1 to 6, 7 to 12 and so on: these ids miss some." in same
    unnumbered = describe_balance(balance(protocol, ("P001", "anna", "bob"), 1))
    assert "No number in the id: anna, bob. Their rows are drawn, even on average only." in unnumbered


def test_one_participant_and_no_block_to_balance():
    alone = SOUND.replace('["is_thin", "is_thick"]', '["is_thin"]').replace('["on_time", "both"]', '["both"]')
    judged = balance(parse(alone.encode(), "small"), ("P001",), 1)
    assert judged.blocks == ()
    assert describe_balance(judged) == (
        "small: the orders of 1 participant, each with seed 1\n\n"
        "No block has more than one code: there is nothing to balance."
    )


def test_a_design_names_no_condition():
    text = describe_balance(balance(REK, numbered(12), 1))
    for name in ("honey", "light_oil", "delay_125"):
        assert name not in text
    assert text.splitlines() == [line.rstrip() for line in text.splitlines()]


def test_the_shipped_study_of_physical_liquids_is_even_after_six_and_after_twelve():
    for participants in (6, 12):
        (block,) = balance(load("physical_liquids"), numbered(participants), 1).blocks
        assert block.evenness.balanced
        assert block.evenness.longest_run == 1
