from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import RecordedTrial, Trial, build_schedule, reproduce
from study_app.store.verification.reproduction import recorded_trials
from tests.journal_lines import event_from, event_of
from tests.protocol.sound import ORDER, SOUND

REK = load("rek2024")
SHUFFLED = parse(SOUND.replace('scale = "agreement"', 'scale = "agreement"\nitem_order = "shuffled"').encode(), "small")
ORDERS = [
    ORDER,
    'order = "constrained"\nmax_repeats = 1\nrepetitions = 3',
    'order = "williams"\nrepetitions = 3',
    'order = "latin"',
]


def run(protocol: Protocol, participant: str, seed: int) -> list[RecordedTrial]:
    """Return the recorded trials of a whole session."""
    names = ("number", "block", "phase", "part", "index", "of", "code", "items")
    return [
        RecordedTrial(**{name: getattr(trial, name) for name in names})
        for trial in build_schedule(protocol, participant, seed).trials
    ]


@pytest.mark.slow
@given(st.integers(0, 2**64), st.sampled_from(["P001", "P007", "anna"]), st.sampled_from(ORDERS))
def test_an_untouched_session_is_reproduced(seed: int, participant: str, order: str):
    for protocol in (REK, SHUFFLED, parse(SOUND.replace(ORDER, order).encode(), "small")):
        recorded = run(protocol, participant, seed)
        assert reproduce(protocol, seed, participant, recorded, complete=True) == ()


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda trials: [*trials[:1], replace(trials[1], block="look"), *trials[2:]],
         "trial 2: the recorded block is look, but the seed gives feel"),
        (lambda trials: [*trials[:1], replace(trials[1], part=None), *trials[2:]],
         "trial 2: the recorded part is none, but the seed gives 1"),
        (lambda trials: [*trials[:1], replace(trials[1], items=trials[1].items[::-1]), *trials[2:]],
         "trial 2: the recorded items are cold, warm, but the seed gives warm, cold"),
        (lambda trials: [*trials[:1], replace(trials[1], items=()), *trials[2:]],
         "trial 2: the recorded items are none, but the seed gives warm, cold"),
        (lambda trials: [*trials, replace(trials[-1], number=8)],
         "trial 8 was recorded, but the seed does not produce this trial"),
        (lambda trials: trials[:-1], "trial 7 was not recorded, although the session is complete"),
        (lambda trials: trials[:-3], "trials 5 to 7 were not recorded, although the session is complete"),
        (lambda trials: [], "trials 1 to 7 were not recorded, although the session is complete"),
        (lambda trials: trials[:2] + trials[3:], "trial 4 was presented after trial 2, but trial 3 was due"),
        (lambda trials: trials[1:], "trial 2 was presented first, but trial 1 was due"),
    ],
)  # fmt: skip
def test_each_change_of_the_recorded_trials_is_named(
    change: Callable[[list[RecordedTrial]], list[RecordedTrial]], expected: str
):
    recorded = change(run(SHUFFLED, "P001", 3))
    assert reproduce(SHUFFLED, 3, "P001", recorded, complete=True) == (expected,)


@pytest.mark.parametrize(("seed", "participant"), [(2, "P001"), (1, "P002")])
def test_another_seed_or_participant_is_found(seed: int, participant: str):
    assert len(reproduce(REK, seed, participant, run(REK, "P001", 1), complete=True)) > 5


def test_another_order_of_a_block_is_found():
    block = REK.blocks["liquids"].model_copy(update={"order": "fixed"})
    other = REK.model_copy(update={"blocks": {**REK.blocks, "liquids": block}})
    assert reproduce(other, 1, "P001", run(REK, "P001", 1), complete=True) == (
        "trial 2: the recorded code is L2, but the seed gives L1",
        "trial 3: the recorded code is L1, but the seed gives L2",
    )


@pytest.mark.parametrize("trials", range(8))
def test_a_session_that_ended_early_is_reproduced_as_far_as_it_went(trials: int):
    assert reproduce(SHUFFLED, 3, "P001", run(SHUFFLED, "P001", 3)[:trials], complete=False) == ()


def test_repeated_and_unanswered_attempts_are_reproduced():
    first, second, *rest = run(SHUFFLED, "P001", 3)
    recorded = [first, replace(second, items=None), replace(second, items=None), second, *rest]
    assert reproduce(SHUFFLED, 3, "P001", recorded, complete=True) == ()


@pytest.mark.parametrize("reached", [4, 5])
def test_a_block_repeated_after_resuming_is_reproduced_if_the_study_permits_it(reached: int):
    trials = run(SHUFFLED, "P001", 3)
    by = {
        resume: SHUFFLED.model_copy(update={"study": SHUFFLED.study.model_copy(update={"resume": resume})})
        for resume in ("block", "trial")
    }
    for resume, expected in (("block", ()), ("trial", (f"trial 2 was presented after trial {reached}",))):
        differences = reproduce(by[resume], 3, "P001", [*trials[:reached], *trials[1:]], complete=True)
        assert tuple(difference.partition(",")[0] for difference in differences) == expected
    (differences,) = reproduce(by["block"], 3, "P001", [*trials[:reached], *trials[2:]], complete=True)
    assert differences.startswith(f"trial 3 was presented after trial {reached}, but")


def journal(trials: tuple[Trial, ...]) -> Iterator[dict[str, Any]]:
    """The lines of a session whose third trial was repeated, and whose fourth was broken off and never answered."""
    yield {"n": 1, "event": "session_started", "participant": "P001"}
    for trial in trials[:4]:
        for attempt in (1, 2) if trial.number == 3 else (1,):
            which = {"trial": trial.number, "attempt": attempt}
            names = ("block", "phase", "part", "index", "of", "code")
            yield {"event": "trial_started", **which, **{name: getattr(trial, name) for name in names}}
            yield {"event": "trial_ended", **which, "outcome": "complete"}
            if trial.items and trial.number < 4:
                rows = [{"item": item, "number": number, "value": 4} for number, item in enumerate(trial.items, 1)]
                yield {"event": "responses", **which, "items": rows[::-1]}


def test_recorded_trials_are_read_from_a_journal():
    trials = build_schedule(SHUFFLED, "P001", 3).trials
    recorded = recorded_trials(map(event_from, journal(trials)))
    assert [(trial.number, trial.code) for trial in recorded] == [
        (trial.number, trial.code) for trial in (*trials[:3], trials[2], trials[3])
    ]
    assert [trial.items for trial in recorded] == [None, trials[1].items, trials[2].items, trials[2].items, None]
    assert reproduce(SHUFFLED, 3, "P001", recorded, complete=False) == ()


def test_a_line_that_does_not_belong_to_a_journal_is_refused():
    with pytest.raises(KeyError):
        recorded_trials([event_of("responses", trial=1, attempt=1)])
