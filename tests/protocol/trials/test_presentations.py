"""What a trial presents, from rules that a person can check: no recorded draws."""

from collections import Counter
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.presented.presentation import (
    Presentation,
    is_criterion_met,
    link_descriptions,
    link_seed,
    longest_delay_s,
    next_level,
    recorded_presentation,
    trial_result,
)
from study_app.protocol.trials.methods import TrialResult
from tests.protocol.trials.level_studies import key_of, study

CATCH = ("task =", "catch = { share = 0.1 }\ntask =")
TWO = ("standards = [1, 2]", "standards = [2]")
YES_NO = ('design = "2ifc"', 'design = "yesno"')
LONG = ("repetitions = 8", "repetitions = 20")


def presentations(protocol: Protocol) -> list[tuple[Any, Presentation]]:
    """Return trial and presentation of a whole session, every answer of which is correct."""
    key, schedule, results = key_of(protocol), build_schedule(protocol, "P001", 1), list[TrialResult]()
    presented_trials = []
    for trial in schedule.trials:
        due = next_level(protocol, key, schedule, trial, results)
        if due is not None:
            block = protocol.blocks[trial.block]
            answer = str(protocol.design_of(block).correct(due.arrangement))
            which = trial.number, trial.code, due.level, due.arrangement
            results.append(trial_result(protocol, block, *which, answer, catch=due.catch))
            presented_trials.append((trial, due))
    return presented_trials


def test_a_comparison_is_the_standard_changed_by_its_level_in_the_arranged_interval() -> None:
    """Weber fractions: 0.2 of a standard of 2 Pa s is 2.4 Pa s."""
    protocol = study()
    design = protocol.design_of(protocol.blocks["viscosity"])
    presented_trials = presentations(protocol)
    assert len(presented_trials) == 2 * 3 * 8
    for trial, due in presented_trials:
        assert due.level is not None
        assert due.standard is not None
        text = design.arrangement_text(due.arrangement)
        values = [due.standard if letter == "S" else due.standard * (1 + due.level) for letter in text]
        assert [interval.value for interval in due.intervals] == pytest.approx(values)
        assert {interval.condition for interval in due.intervals} == {"oil"}
        assert {interval.vary for interval in due.intervals} == {"viscosity_pa_s"}
        fields = {"block": "viscosity", "code": trial.code, "arrangement": text, "level": due.level}
        assert recorded_presentation(protocol, key_of(protocol).codes, fields) == due
        catch_trial = recorded_presentation(protocol, key_of(protocol).codes, fields | {"catch": True})
        assert (catch_trial.catch, catch_trial.intervals) == (True, due.intervals)
    for code in ("V1", "V2"):
        track = [due for trial, due in presented_trials if trial.code == code]
        assert len({due.standard for due in track}) == 1
        for first in range(0, 24, 3):
            assert sorted(due.level or 0.0 for due in track[first : first + 3]) == [0.2, 0.4, 0.8], "each round"
        for first in range(0, 24, 4):
            assert Counter(due.arrangement for due in track[first : first + 4]) == {0: 2, 1: 2}, "each four trials"
    assert {due.standard for _, due in presented_trials} == {1.0, 2.0}


def test_catch_trials_present_the_largest_level_and_leave_the_other_levels_as_they_are() -> None:
    with_catch = [due for _, due in presentations(study(LONG, CATCH, TWO))]
    without = [due for _, due in presentations(study(LONG, TWO))]
    catch_numbers = [number for number, due in enumerate(with_catch) if due.catch]
    assert len(without) == 60
    assert len(with_catch) == 60 + len(catch_numbers)
    assert len(catch_numbers) == 6, "a tenth of 60"
    assert {with_catch[number].level for number in catch_numbers} == {0.8}
    assert [due for due in with_catch if not due.catch] == without
    tenths = [10 * number // len(with_catch) for number in catch_numbers]
    assert len(set(tenths)) >= len(catch_numbers) - 1, "spread over the session"


def test_noise_trials_present_only_the_standard() -> None:
    protocol = study(YES_NO, LONG, TWO)
    presented_trials = [due for _, due in presentations(protocol)]
    noise = [due for due in presented_trials if due.level == 0.0]
    design = protocol.design_of(protocol.blocks["viscosity"])
    assert len(presented_trials) - len(noise) == 60
    assert len(noise) == design.noise(60)
    for due in noise:
        assert (due.arrangement, [interval.value for interval in due.intervals]) == (1, [2.0])
    for due in presented_trials:
        if due.level:
            assert [interval.value for interval in due.intervals] == pytest.approx([2.0 * (1 + due.level)])


@pytest.mark.parametrize(
    ("correct", "right", "of", "is_met"),
    [
        ([], 1, 1, False),
        ([True], 1, 1, True),
        ([True, True, False], 2, 3, True),
        ([True, True, False, False], 2, 3, False),
        ([False, True, True], 2, 2, True),
        ([True, None, True], 3, 3, False),
        ([True, True], 2, 3, True),
    ],
)
def test_a_criterion_counts_the_last_answers_of_its_block(
    correct: list[bool | None], right: int, of: int, is_met: bool
) -> None:
    """Answers of another block, and in which order they are listed, do not matter."""
    trials = [SimpleNamespace(number=number, block="b" if number < 50 else "c") for number in range(1, 100)]
    block: Any = SimpleNamespace(id="b", until=SimpleNamespace(right=right, of=of))
    results = [
        TrialResult(trial=number, code="A1", level=1.0, success=value, correct=value)
        for number, value in enumerate(correct, start=1)
    ]
    others = [TrialResult(trial=60, code="A1", level=1.0, success=True, correct=True)]
    schedule: Any = SimpleNamespace(trials=trials)
    assert is_criterion_met(block, schedule, [*others, *reversed(results)]) == is_met
    block.until = None
    assert not is_criterion_met(block, schedule, results)


def test_a_result_states_whether_the_answer_was_correct_and_a_difference_existed() -> None:
    protocol = study(TWO)
    block = protocol.blocks["viscosity"]
    for arrangement in (0, 1):
        right = protocol.design_of(block).arrangement_text(arrangement)[0] == "C"
        result = trial_result(protocol, block, 7, "V1", 0.4, arrangement, "first", catch=True)
        assert (result.trial, result.code, result.level, result.catch, result.noise) == (7, "V1", 0.4, True, False)
        assert (result.correct, result.success) == (right, right)
    detection = study(YES_NO, TWO)
    for arrangement, answer, correct, success in (
        (0, "yes", True, True), (1, "yes", False, True), (1, "no", True, False),
    ):  # fmt: skip
        result = trial_result(detection, detection.blocks["viscosity"], 7, "V1", None, arrangement, answer)
        assert (result.correct, result.success, result.noise) == (correct, success, arrangement == 1)
        assert (result.level, result.catch) == (0.0, False)


def test_a_force_link_description_omits_absent_effects() -> None:
    assert list(link_descriptions()) == []
    assert list(link_descriptions(50.0, 7.5, 0.125)) == [
        "force delayed by 50 ms", "force jitter of 7.5 ms", "12.5 % of force updates lost",
    ]  # fmt: skip


def test_each_attempt_and_interval_has_its_own_jitter() -> None:
    seeds = {
        (seed, who, trial, attempt, interval): link_seed(seed, who, trial, attempt, interval)
        for seed in (1, 2) for who in ("P1", "P2") for trial in (1, 2) for attempt in (1, 2) for interval in (1, 2)
    }  # fmt: skip
    assert len(set(seeds.values())) == len(seeds)
    assert all(0 <= seed < 2**32 for seed in seeds.values())
    assert link_seed(1, "P1", 2, 1, None) == seeds[1, "P1", 2, 1, 1]


def test_a_block_lingers_for_the_longest_delay_that_it_can_present() -> None:
    """With a standard of 100 ms and differences of up to 80 ms it is 180 ms; else it is that of the condition."""
    delays = study(
        ('vary = "viscosity_pa_s"', 'vary = "delay_ms"'),
        ("standards = [1, 2]", 'standards = [100]\nlevel = "difference"'),
        ("[0.1, 0.8]", "[10, 80]"),
        ("[0.2, 0.4, 0.8]", "[20, 40, 80]"),
    )
    assert longest_delay_s(delays, delays.blocks["viscosity"]) == pytest.approx(0.18)
    assert longest_delay_s(study(), study().blocks["viscosity"]) == study().delay_s("oil")
