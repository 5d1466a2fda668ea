"""Catch trials: the largest level, one in every stretch, never first, and no level follows from their answers."""

from itertools import pairwise

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.presented.presentation import next_level
from study_app.protocol.trials.methods import TrialResult
from tests.protocol.trials.level_studies import answered, key_of, study

CATCH = ("task =", "catch = { share = 0.1 }\ntask =")
LONG = ("repetitions = 8", "repetitions = 20")


def of_tracks(protocol: Protocol, participant: str = "P001") -> dict[str, list[tuple[bool, float, int]]]:
    """Return of each track whether its slots are catch trials, with level and arrangement."""
    trials_of_track: dict[str, list[tuple[bool, float, int]]] = {}
    for due, trial in answered(protocol, key_of(protocol), build_schedule(protocol, participant, 1)):
        assert due.level is not None
        trials_of_track.setdefault(trial.code, []).append((due.catch, due.level, due.arrangement))
    return trials_of_track


def test_levels_and_arrangements_of_the_other_trials_are_those_without_catch_trials() -> None:
    with_catch, without = of_tracks(study(LONG, CATCH)), of_tracks(study(LONG))
    for code, slots in with_catch.items():
        assert [slot for slot in slots if not slot[0]] == without[code]


@pytest.mark.parametrize("share", [0.05, 0.13, 0.3, 1 / 3, 0.5])
@pytest.mark.parametrize("trials", [8, 24, 60, 100])
def test_stretches_cover_the_track_in_order(share: float, trials: int) -> None:
    (block,) = study(LONG, (CATCH[0], CATCH[1].replace("0.1", str(share)))).blocks.values()
    rule = block.catch
    assert rule is not None
    stretches = [rule.stretch(number) for number in range(rule.count(trials))]
    assert abs(len(stretches) - trials * share) < 1
    for before, after in pairwise(stretches):
        assert before.stop == after.start
    assert not stretches or (stretches[0].start == 1 and stretches[-1].stop <= trials + len(stretches))


@pytest.mark.parametrize("method", ['kind = "updown"', 'kind = "questplus"'])
def test_answers_to_catch_trials_do_not_change_the_level(method: str) -> None:
    constant = 'kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 8'
    protocol = study((constant, f"{method}\ntrials = 20"), CATCH)
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", 1)
    levels: dict[bool, list[float | None]] = {}
    for attentive in (True, False):
        results: list[TrialResult] = []
        for trial in schedule.trials:
            due = next_level(protocol, key, schedule, trial, results)
            assert due is not None
            assert due.level is not None
            right = attentive if due.catch else trial.number % 3 > 0
            results.append(
                TrialResult(
                    trial=trial.number, code=trial.code, level=due.level, success=right, correct=right, catch=due.catch
                )
            )
            levels.setdefault(attentive, []).append(due.level)
    assert levels[True] == levels[False]
