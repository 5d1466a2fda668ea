"""Catch trials: the largest level, one in every stretch, never first, and no level follows from their answers."""

from collections import Counter
from itertools import pairwise

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.trials.methods import TrialResult
from study_app.protocol.trials.presentation import next_level
from study_app.protocol.trials.tracks import design_of, tracks_of
from tests.protocol.trials.level_studies import answered, key_of, study

CATCH = ("task =", "catch = { share = 0.1 }\ntask =")
LONG = ("repetitions = 8", "repetitions = 20")
YES_NO = ('design = "2ifc"', 'design = "yesno"')


def of_tracks(protocol: Protocol, participant: str = "P001") -> dict[str, list[tuple[bool, float, int]]]:
    """Return of each track whether its slots are catch trials, with level and arrangement."""
    found: dict[str, list[tuple[bool, float, int]]] = {}
    for due, trial in answered(protocol, key_of(protocol), build_schedule(protocol, participant, 1)):
        assert due.level is not None
        found.setdefault(trial.code, []).append((due.catch, due.level, due.arrangement))
    return found


@pytest.mark.parametrize("participant", ["P001", "P002", "P003"])
def test_every_stretch_has_one_and_no_track_begins_with_one(participant: str) -> None:
    for slots in of_tracks(study(LONG, CATCH), participant).values():
        assert len(slots) == 66  # 60 others
        for number in range(6):
            assert sum(catch for catch, _, _ in slots[11 * number : 11 * number + 11]) == 1
        assert not slots[0][0]
        assert {level for catch, level, _ in slots if catch} == {0.8}


@pytest.mark.slow
def test_positions_differ_between_tracks_and_stretches() -> None:
    places = {
        index % 11
        for participant in ("P001", "P002", "P003")
        for slots in of_tracks(study(LONG, CATCH), participant).values()
        for index, (catch, _, _) in enumerate(slots)
        if catch
    }
    assert len(places) > 6


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


def test_noise_trials_keep_their_share_and_catch_trials_present_the_comparison() -> None:
    protocol = study(LONG, CATCH, YES_NO)
    for slots in of_tracks(protocol).values():
        kinds = Counter("catch" if catch else "noise" if level == 0 else "signal" for catch, level, _ in slots)
        assert kinds == {"signal": 60, "noise": 26, "catch": 8}
        assert {arrangement for catch, _, arrangement in slots if catch} == {0}


@pytest.mark.parametrize("method", ['kind = "updown"', 'kind = "questplus"'])
def test_answers_to_catch_trials_move_no_level(method: str) -> None:
    constant = 'kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 8'
    protocol = study((constant, f"{method}\ntrials = 20"), CATCH)
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", 1)
    levels: dict[bool, list[float | None]] = {}
    for attentive in (True, False):
        heard: list[TrialResult] = []
        for trial in schedule.trials:
            due = next_level(protocol, key, schedule, trial, heard)
            assert due is not None
            assert due.level is not None
            right = attentive if due.catch else trial.number % 3 > 0
            heard.append(TrialResult(trial.number, trial.code, due.level, right, right, due.catch))
            levels.setdefault(attentive, []).append(due.level)
    assert levels[True] == levels[False]


def test_a_track_that_has_ended_presents_no_catch_trial_and_no_noise() -> None:
    constant = 'kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 8'
    updown = 'kind = "updown"\ntrials = 60\nstop = { reversals = 2, after = 5 }'
    protocol = study((constant, updown), CATCH, YES_NO)
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", 1)
    design = design_of(protocol, protocol.blocks["viscosity"])
    ended: set[str] = set()
    heard: list[TrialResult] = []
    for trial in schedule.trials:
        due = next_level(protocol, key, schedule, trial, heard)
        if due is None:
            ended.add(trial.code)
            continue
        assert trial.code not in ended
        assert due.level is not None
        success = len(heard) % 2 == 0
        noise = not any(design.arrangements[due.arrangement])
        heard.append(TrialResult(trial.number, trial.code, due.level, success, success, due.catch, noise))
    assert ended == {track.code for track in schedule.trials}


def test_a_track_counts_its_catch_trials() -> None:
    protocol = study(LONG, CATCH)
    assert [(one.slots, len(one.catch)) for one in tracks_of(protocol, protocol.blocks["viscosity"])] == [(66, 6)] * 2
