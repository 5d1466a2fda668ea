"""Adaptive methods in a study: the next level is a pure function of the answers, in any order, at presented levels."""

import numpy as np
import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.presented.presentation import next_level
from study_app.protocol.trials.methods import TrialResult
from tests.protocol.trials.level_studies import key_of, study

CONSTANT = 'kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 8'
ONE_STANDARD = ("standards = [1, 2]\n", "standards = [2]\n")


def adaptive(method: str, *edits: tuple[str, str]) -> Protocol:
    return study((CONSTANT, method), *edits)


def answers_of(protocol: Protocol, threshold: float, seed: int = 1) -> list[TrialResult]:
    """Return one session's answers of an observer who is correct above the threshold and guesses below."""
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", seed)
    design = protocol.design_of(protocol.blocks["viscosity"])
    draw, results = np.random.default_rng(seed), []
    for trial in schedule.trials:
        due = next_level(protocol, key, schedule, trial, results)
        if due is not None:
            assert due.level is not None
            right = draw.random() < (0.98 if due.level > threshold else 0.5)
            noise = not any(design.arrangements[due.arrangement])
            results.append(
                TrialResult(
                    trial=trial.number, code=trial.code, level=due.level, success=right, correct=right, noise=noise
                )
            )
    return results


@pytest.mark.parametrize("kind", ["questplus", "updown"])
def test_the_next_level_depends_on_the_levels_presented_and_not_on_how_answers_are_listed(kind: str) -> None:
    protocol = adaptive(f'kind = "{kind}"\ntrials = 20', ONE_STANDARD)
    key, schedule = key_of(protocol), build_schedule(protocol, "P001", 1)
    results = answers_of(protocol, 0.4)
    for number in (5, 12, 19):
        earlier = results[:number]
        due = next_level(protocol, key, schedule, schedule.trials[number], results[::-1])
        again = next_level(protocol, key, schedule, schedule.trials[number], earlier)
        assert due is not None
        assert due == again
        assert due.level == results[number].level
    # Answers at another level than would be chosen count at that level.
    other = [
        TrialResult(trial=result.trial, code=result.code, level=0.8, success=True, correct=True)
        for result in results[:10]
    ]
    next_levels = next_level(protocol, key, schedule, schedule.trials[10], other)
    assert next_levels is not None
    assert next_levels.level != results[10].level


@pytest.mark.slow
def test_a_track_ends_once_its_interval_is_narrow() -> None:
    whole = answers_of(adaptive('kind = "questplus"\ntrials = 200', ONE_STANDARD), 0.4)
    ended = answers_of(
        adaptive('kind = "questplus"\ntrials = 200\nstop = { ratio = 2, after = 20 }', ONE_STANDARD), 0.4
    )
    assert 20 <= len(ended) < len(whole)
    assert ended == whole[: len(ended)]
