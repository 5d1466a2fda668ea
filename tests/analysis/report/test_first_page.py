"""The first page: a table of verdicts with a sentence each, limits, and how often it is wrong."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from study_app.analysis.data.blocks import Block, Decided, Item
from study_app.analysis.evaluate import evaluate, evaluate_block
from study_app.analysis.findings.delays import (
    ContrastsWithControl,
    DetectionThreshold,
    LowestDelay,
    common_ms,
    equivalent_up_to,
)
from study_app.analysis.findings.finding import Answer, of_tables
from study_app.analysis.findings.recognition import LiquidRecognition, RecognitionResult, given, recognised
from study_app.analysis.findings.statement_tests import DelayTrend, Pairs, gated
from study_app.analysis.report.sections import CLAIMS, answers, empty_studies, first_page
from study_app.analysis.results import Results
from study_app.analysis.statistics.recognition import recognition
from tests.analysis.made_up import DECIDED, ITEMS, delays, everybody, liquids, study

pytestmark = pytest.mark.slow

DELAYS = (0.0, 50.0, 100.0, 150.0)


def of_delays(answer: object, people: int = 16) -> Results:
    settings = delays(DELAYS)
    return evaluate(study(settings, list(everybody(settings, people, answer))))


def rising(from_code: int) -> Results:
    """Return a study in which one statement rises and the other falls by 4 points from a setting (D1 …) on."""
    rng = np.random.default_rng(2)

    def answer(_person: int, _session: int, code: str, item: str) -> int:
        up = 4 * (int(code[1:]) >= from_code)
        return int(np.clip((2 + up if item == ITEMS[0] else 6 - up) + rng.integers(-1, 2), 1, 7))

    return of_delays(answer)


def flat() -> Results:
    return of_delays(lambda person, *_: 3 + person % 2)


def named(results: Results, question: str) -> Answer:
    return next(one for one in answers(results) if one.question == question)


def test_a_delay_that_is_noticed_is_told_with_its_verdict() -> None:
    results = rising(3)
    found = named(results, "noticed from")
    assert found.claims
    assert found.verdict == "shown"
    assert found.text.startswith("From 100 ms on at the latest “Different” and “Harder” change with the delay; ")
    assert f'<td>shown</td><td class="long">{found.text}</td>' in first_page(results, ())


def test_up_to_which_delay_nothing_changes_needs_every_statement() -> None:
    results = rising(3)
    found = named(results, "unchanged up to")
    assert common_ms(results.blocks[0]) == 50.0
    assert found.verdict == "shown"
    assert found.text.startswith("Up to 50 ms mean answers to both statements stay within ±1 point of those at 0 ms")
    against = tuple(
        one if one.item == ITEMS[0] else replace(one, found=replace(one.found, verdict="inconclusive"))
        for one in ContrastsWithControl.of(results.blocks[0])
    )
    block = ContrastsWithControl.add_to(results.blocks[0], against)
    assert equivalent_up_to(against) == {ITEMS[0]: 50.0, ITEMS[1]: None}
    assert common_ms(block) is None
    unclear = named(replace(results, blocks=(block,)), "unchanged up to")
    assert unclear.verdict == "not shown"
    assert "For no delay are mean answers to all statements shown to stay within" in unclear.text


def test_where_nothing_is_shown_it_says_that_this_is_no_evidence() -> None:
    found = named(flat(), "noticed from")
    assert not found.claims
    assert found.verdict == "not shown"
    assert "No delay was shown to be noticed. That is not evidence" in found.text


def test_liquids_are_recognised_by_name_and_the_wrong_name_is_told() -> None:
    settings = liquids(3)

    def answer(_person: int, _session: int, code: str, item: str) -> int:
        """Everybody names the first liquid right, and the second and third as the first."""
        return {("L1", ITEMS[0]): 7, ("L2", ITEMS[1]): 2, ("L3", ITEMS[1]): 2}.get((code, item), 4 + (item == ITEMS[0]))

    right = study(
        settings,
        list(
            everybody(
                settings, 12, lambda p, s, code, item: 7 if (code, item) in {("L1", ITEMS[0]), ("L2", ITEMS[1])} else 2
            )
        ),
    )
    told = named(evaluate(right), "distinguished")
    assert told.claims
    assert told.text.startswith("Recognised above chance: liquid1 and liquid2. Rated differently: ")
    wrong = named(evaluate(study(settings, list(everybody(settings, 12, answer)))), "distinguished")
    assert wrong.text.startswith("No liquid was shown to be recognised above chance. ")


def test_decisions_that_came_later_are_marked_as_exploratory() -> None:
    results = rising(3)
    made = study(delays(DELAYS), list(everybody(delays(DELAYS), 12, lambda p, s, code, i: 1 + int(code[1:]))))
    later = evaluate(replace(made, decided=replace(DECIDED, changed=True)))
    assert named(later, "noticed from").verdict == "suggested"
    assert "suggested" in first_page(later, ())
    assert "suggested" not in first_page(results, ())


def ordered(people: int, decided: Decided = DECIDED) -> Results:
    """Return a study of three liquids that everybody puts in the same order in the second statement."""
    settings = liquids(3)
    trials = list(everybody(settings, people, lambda _p, _s, code, i: 2 * int(code[1:]) if i == ITEMS[1] else 4))
    results = evaluate(study(settings, trials, decided))
    return replace(results, blocks=(LiquidRecognition.add_to(results.blocks[0], None),))


def test_liquids_that_differ_are_told_where_too_few_people_can_show_no_pair() -> None:
    told = named(ordered(5), "distinguished")
    assert told.text == "The liquids were rated differently in “Harder”; which ones is not shown."
    assert told.claims
    assert told.verdict == "shown"
    assert named(ordered(5, replace(DECIDED, primary=ITEMS[:1])), "distinguished").verdict == "suggested"
    results = ordered(7)
    assert named(results, "distinguished").text.startswith("Rated differently: liquid1 – liquid2")
    unclear = Pairs.add_to(
        results.blocks[0],
        tuple(replace(one, tested=replace(one.tested, verdict="not shown")) for one in Pairs.of(results.blocks[0])),
    )
    assert named(replace(results, blocks=(unclear,)), "distinguished").text == (
        "The liquids were rated differently in “Harder”; which ones is not shown."
    )


def test_pairs_of_exploratory_statements_are_given_only_without_primary_ones() -> None:
    results = ordered(8)
    block = results.blocks[0]
    first = replace(Pairs.of(block)[0], tested=replace(Pairs.of(block)[0].tested, verdict="suggested"))
    found = named(replace(results, blocks=(Pairs.add_to(block, (first, *Pairs.of(block)[1:])),)), "distinguished")
    assert found.text == "Rated differently: liquid1 – liquid3 and liquid2 – liquid3."
    assert found.verdict == "shown"


def test_the_verdict_is_of_primary_statements_and_of_exploratory_ones_without_them() -> None:
    """The primary statement changes from 150 ms on, the exploratory one from 50 ms on."""
    settings = delays(DELAYS)
    high = {("D4", "harder"), ("D2", "different"), ("D3", "different"), ("D4", "different")}
    noise = np.random.default_rng(1).integers(0, 2, (16, 4, 2))

    def answer(person: int, _session: int, code: str, item: str) -> int:
        up = 4 * ((code, item) in high)
        wobble = int(noise[person, int(code[1:]) - 1, ITEMS.index(item)])
        return (6 - up if item == "harder" else 1 + up) + wobble

    made = study(settings, list(everybody(settings, 16, answer)), replace(DECIDED, primary=ITEMS[1:]))
    results = evaluate(made)
    found = named(results, "noticed from")
    assert found.text == (
        "From 150 ms on at the latest “Harder” changes with the delay; shorter delays may be noticed too."
    )
    assert found.verdict == "shown"
    block = LowestDelay.add_to(
        results.blocks[0], tuple(one for one in LowestDelay.of(results.blocks[0]) if one.item != "harder")
    )
    block = ContrastsWithControl.add_to(
        block, tuple(one for one in ContrastsWithControl.of(block) if one.item != "harder")
    )
    alone = named(replace(results, blocks=(block,)), "noticed from")
    assert alone.verdict == "suggested"
    assert alone.text.startswith("From 50 ms on at the latest “Different”")


@pytest.mark.parametrize(
    ("decided", "verdict"),
    [
        ({}, "shown"),
        ({"changed": True}, "suggested"),
        ({"primary": ITEMS[1:]}, "suggested"),
        ({"primary": ITEMS[:1]}, "shown"),
    ],
)
def test_a_threshold_alone_is_exploratory_unless_its_statement_is_primary(
    decided: dict[str, Any], verdict: str
) -> None:
    results = rising(3)
    block = ContrastsWithControl.add_to(LowestDelay.add_to(results.blocks[0], ()), ())
    assert DetectionThreshold.of(block) is not None
    assert DetectionThreshold.of(block).effect is not None
    found = named(replace(results, blocks=(block,), decided=replace(results.decided, **decided)), "noticed from")
    assert (found.claims, found.verdict) == (True, verdict)


@pytest.mark.parametrize(("participants", "n"), [(1, 5), (10, 12), (200, 24)])
def test_the_measured_rate_is_that_of_the_nearest_size(participants: int, n: int) -> None:
    told = empty_studies(participants)
    assert f"with {n} participants" in told
    assert "({} of {} studies, 95 % interval".format(*CLAIMS[n]) in told


def test_a_claim_needs_the_test_over_all_statements_corrected_over_the_blocks() -> None:
    """One statement rises a little: alone it is significant; the others, which scatter, hide it."""
    rng = np.random.default_rng(4)
    items = tuple(Item(name, name, name) for name in (*ITEMS, *"abcdefgh"))
    block = Block("b", "Block", "delays", delays(DELAYS), items, tuple("1234567"), None)
    single = {item.id: rng.integers(1, 8, (14, 4, 1)).astype(float) for item in items}
    single[ITEMS[0]] = np.clip(np.arange(1, 5)[:, None] + rng.integers(0, 3, (14, 4, 1)), 1, 7).astype(float)
    decided = replace(DECIDED, primary=ITEMS[:1])
    asked = of_tables(block, decided, tuple(map(str, range(14))), single)
    (one,) = gated([asked])
    two = gated([replace(asked, values={ITEMS[1]: asked.values[ITEMS[1]]}), asked])[1]
    assert one.over_all is not None
    assert one.gate == one.over_all.p
    assert two.gate > one.gate  # Holm, over both blocks
    for gate, verdict in ((0.05, "shown"), (0.051, "not shown")):
        (tested,) = (one for one in DelayTrend.of(evaluate_block(None, replace(asked, gate=gate))) if one.primary)
        assert (tested.verdict, tested.p_adjusted) == (verdict, gate)


def test_a_liquid_is_recognised_where_its_interval_lies_above_the_share_of_its_name() -> None:
    # Water 10 of 12, but 19 of all 36 names are water; honey 3 of 12, more than its share of names, but not surely so.
    names = np.column_stack([[0] * 10 + [1] * 2, [1] * 3 + [0] * 9, [2] * 12])
    named = RecognitionResult(
        ("water", "honey", "oil"),
        ("L1", "L2", "L3"),
        ("water", "honey", "oil"),
        recognition(names, [0, 1, 2], 3),
        "shown",
    )
    assert [given(named, label) for label in named.labels] == [19 / 36, 5 / 36, 12 / 36]
    assert recognised(named) == (2,)
    assert recognised(replace(named, verdict="suggested")) == (2,)
    assert recognised(replace(named, verdict="not shown")) == ()
