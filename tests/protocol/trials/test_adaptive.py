"""Adaptive methods in a study: the next level is a pure function of the answers, in any order, at presented levels."""

import math
from itertools import pairwise

import numpy as np
import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.trials.methods import TrackSetting, TrialResult, UpDown
from study_app.protocol.trials.presentation import next_level
from study_app.protocol.trials.tracks import design_of, tracks_of
from tests.protocol.trials.level_studies import answered, key_of, study

CONSTANT = 'kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 8'
PRACTICE = """
[blocks.{name}]
phase = "practice"
title = "Practice"
setting_label = "Pair"
task = "stir"
stimulus = "viscosity"
design = "2ifc"
method = "few"
"""
ONE_STANDARD = ("standards = [1, 2]\n", "standards = [2]\n")


def adaptive(method: str, *edits: tuple[str, str]) -> Protocol:
    return study((CONSTANT, method), *edits)


def answers_of(protocol: Protocol, threshold: float, seed: int = 1) -> list[TrialResult]:
    """Return the answers of one session of an observer who is right above the threshold, and half of the time below."""
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", seed)
    design = design_of(protocol, protocol.blocks["viscosity"])
    draw, heard = np.random.default_rng(seed), []
    for trial in schedule.trials:
        due = next_level(protocol, key, schedule, trial, heard)
        if due is not None:
            assert due.level is not None
            right = draw.random() < (0.98 if due.level > threshold else 0.5)
            noise = not any(design.arrangements[due.arrangement])
            heard.append(TrialResult(trial.number, trial.code, due.level, right, right, noise=noise))
    return heard


@pytest.mark.parametrize("kind", ["questplus", "updown"])
def test_levels_move_towards_the_threshold(kind: str) -> None:
    protocol = adaptive(f'kind = "{kind}"\ntrials = 40', ONE_STANDARD)
    heard = answers_of(protocol, threshold=0.4)
    assert len(heard) == 40
    late = [one.level for one in heard[20:]]
    assert 0.25 <= float(np.median(late)) <= 0.65
    assert all(0.1 <= one.level <= 0.8 for one in heard)


def test_each_standard_has_its_tracks_and_the_trials_are_divided_among_them() -> None:
    protocol = adaptive('kind = "updown"\ntrials = 24\ntracks = 2\nbegin = [0.8, 0.2]')
    block = protocol.blocks["viscosity"]
    tracks = tracks_of(protocol, block)
    assert [(one.name, one.standard, one.number, one.slots) for one in tracks] == [
        ("1/1", 1.0, 1, 12),
        ("1/2", 1.0, 2, 12),
        ("2/1", 2.0, 1, 12),
        ("2/2", 2.0, 2, 12),
    ]
    key = key_of(protocol)
    first: dict[str, float] = {}
    for due, one in answered(protocol, key, build_schedule(protocol, "P001", 1)):
        assert due.level is not None
        first.setdefault(key.codes["viscosity"][one.code], due.level)
    assert first == pytest.approx({"1/1": 0.8, "1/2": 0.2, "2/1": 0.8, "2/2": 0.2})


def test_questplus_begins_at_the_nearest_level_of_the_grid() -> None:
    protocol = adaptive('kind = "questplus"\ntrials = 4\nbegin = 0.41', ONE_STANDARD)
    grid = protocol.stimuli["viscosity"].grid
    assert answers_of(protocol, 0.4)[0].level == min(grid, key=lambda one: abs(math.log(one / 0.41)))


@pytest.mark.parametrize("kind", ["questplus", "updown"])
def test_the_next_level_depends_on_the_levels_presented_and_not_on_how_answers_are_listed(kind: str) -> None:
    protocol = adaptive(f'kind = "{kind}"\ntrials = 20', ONE_STANDARD)
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", 1)
    heard = answers_of(protocol, 0.4)
    for number in (5, 12, 19):
        earlier = heard[:number]
        due = next_level(protocol, key, schedule, schedule.trials[number], heard[::-1])
        again = next_level(protocol, key, schedule, schedule.trials[number], earlier)
        assert due is not None
        assert due == again
        assert due.level == heard[number].level
    # Answers at another level than would be chosen count at that level.
    other = [TrialResult(one.trial, one.code, 0.8, True, True) for one in heard[:10]]
    moved = next_level(protocol, key, schedule, schedule.trials[10], other)
    assert moved is not None
    assert moved.level != heard[10].level


def test_practice_blocks_share_codes_and_no_answers() -> None:
    protocol = study(
        (CONSTANT, 'kind = "updown"\ntrials = 20\nbegin = 0.8'),
        ONE_STANDARD,
        ('sequence = ["viscosity"]', 'sequence = ["first", "second", "viscosity"]'),
        more=PRACTICE.format(name="first") + PRACTICE.format(name="second"),
    )
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", 1)
    assert key.codes["first"].keys() == key.codes["second"].keys()
    first, second, main = np.reshape([due.level for due, _ in answered(protocol, key, schedule)], (3, 20)).tolist()
    assert first[-1] != first[0] == 0.8
    assert first == second == main


@pytest.mark.slow
def test_a_track_ends_once_its_interval_is_narrow() -> None:
    whole = answers_of(adaptive('kind = "questplus"\ntrials = 200', ONE_STANDARD), 0.4)
    ended = answers_of(
        adaptive('kind = "questplus"\ntrials = 200\nstop = { ratio = 2, after = 20 }', ONE_STANDARD), 0.4
    )
    assert 20 <= len(ended) < len(whole)
    assert ended == whole[: len(ended)]


def test_a_staircase_ends_after_so_many_reversals() -> None:
    ended = answers_of(adaptive('kind = "updown"\ntrials = 200\nstop = { reversals = 6 }', ONE_STANDARD), 0.4)
    assert 8 <= len(ended) < 120


@pytest.mark.parametrize(
    ("stop", "after"),
    [
        ('kind = "updown"\ntrials = 200\nstop = { reversals = 1, after = 50 }', 50),
        ('kind = "questplus"\ntrials = 200\nstop = { ratio = 1000, after = 25 }', 25),
    ],
)
def test_a_track_does_not_end_before_so_many_answers(stop: str, after: int) -> None:
    assert len(answers_of(adaptive(stop, ONE_STANDARD), 0.4)) == after


def test_a_step_up_is_a_tenth_of_the_span() -> None:
    heard = answers_of(adaptive('kind = "updown"\nbegin = 0.2', ONE_STANDARD), threshold=0.8)
    steps = [math.log10(after.level / before.level) for before, after in pairwise(heard) if not before.success]
    inner = [
        step for step, one in zip(steps, (one for one in heard if not one.success), strict=False) if one.level < 0.6
    ]
    assert inner == pytest.approx([math.log10(8) / 10] * len(inner))
    assert len(inner) > 3


FROM_ZERO = ("levels = [0.1, 0.8]", 'levels = [0, 0.8]\nspacing = "linear"')
"""Levels from zero on: the smallest comparison is the standard itself."""


def test_a_staircase_moves_on_from_answers_at_a_level_of_zero() -> None:
    method = 'kind = "updown"\nrule = "1down1up"\nratio = 1\nstep_up = 0.2\nbegin = 0'
    protocol = adaptive(method, ONE_STANDARD, FROM_ZERO)
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", 1)
    heard: list[TrialResult] = []
    for trial, right in zip(schedule.trials, (False, True, False, False), strict=False):
        due = next_level(protocol, key, schedule, trial, heard)
        assert due is not None
        assert due.level is not None
        heard.append(TrialResult(trial.number, trial.code, due.level, right, right))
    assert [one.level for one in heard] == pytest.approx([0, 0.2, 0, 0.2])


def test_reversals_at_a_level_of_zero_count() -> None:
    protocol = adaptive('kind = "updown"', ONE_STANDARD, FROM_ZERO)
    track = TrackSetting(protocol.stimuli["viscosity"], design_of(protocol, protocol.blocks["viscosity"]), 1)
    answers = [(0.16, True), (0.08, True), (0.0, False), (0.08, True), (0.0, False)]
    assert UpDown(rule="1down1up", ratio=1, step_up=0.08).reversals(track, answers) == (2, 3, 4)


@pytest.mark.parametrize(
    "method", ['kind = "questplus"\nbegin = 0', 'kind = "questplus"\nstop = { ratio = 1e9, after = 3 }']
)
def test_questplus_counts_answers_at_a_level_of_zero(method: str) -> None:
    protocol = adaptive(method, ONE_STANDARD, FROM_ZERO)
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", 1)
    heard = [TrialResult(one.number, one.code, 0.0, False, False) for one in schedule.trials[:6]]
    due = next_level(protocol, key, schedule, schedule.trials[6], heard)
    assert due is None if "stop" in method else due is not None and due.level != 0


@pytest.mark.parametrize("kind", ["questplus", "updown"])
def test_noise_trials_of_yes_no_have_no_level_of_their_own(kind: str) -> None:
    protocol = adaptive(
        f'kind = "{kind}"\ntrials = 40\nbegin = 0.4', ONE_STANDARD, ('design = "2ifc"', 'design = "yesno"')
    )
    heard = answers_of(protocol, 0.4)
    noise = [one for one in heard if one.level == 0]
    assert 10 <= len(noise) <= 20
    comparisons = [one.level for one in heard if one.level > 0]
    assert len(comparisons) == 40
    assert comparisons[0] == pytest.approx(0.4, rel=0.05)
    assert min(comparisons) >= 0.1
    if kind == "updown":
        steps = [abs(math.log10(after / before)) for before, after in pairwise(comparisons)]
        assert max(steps) <= math.log10(8) / 10 + 1e-9, "a staircase goes on from the last comparison"
