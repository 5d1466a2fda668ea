"""The target that is followed: where it is, how fast, and how long."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.trials.designs import DESIGN_KINDS, Design, Rated, default_design
from study_app.protocol.trials.stimuli import Stimulus
from study_app.protocol.trials.tasks import Follow


def stimulus(**keys: Any) -> Stimulus:
    return Stimulus.model_validate({"vary": "viscosity_pa_s", "levels": (0.1, 0.8)} | keys)


@pytest.mark.parametrize(
    ("keys", "standard", "level", "comparison"),
    [
        ({}, 8.0, 0.5, 12.0),
        ({"direction": "down"}, 8.0, 0.5, 4.0),
        ({"level": "difference"}, 8.0, 0.5, 8.5),
        ({"level": "difference", "direction": "down"}, 8.0, 0.5, 7.5),
        ({"level": "value"}, 8.0, 0.5, 0.5),
        ({"vary": "delay_ms"}, 100.0, 30.0, 130.0),
        ({"vary": "delay_ms"}, 0.0, 30.0, 30.0),
        ({"level": "value"}, None, 3.0, 3.0),
    ],
)
def test_the_comparison_of_a_level(keys: dict[str, str], standard: float | None, level: float, comparison: float):
    assert stimulus(**keys).comparison(standard, level) == comparison
    assert stimulus(**keys).level_between(standard, comparison) == level


@pytest.mark.parametrize(
    ("keys", "low", "high", "ratio"),
    [
        ({"spacing": "log"}, -1.0, 0.5, 10**1.5),
        ({"spacing": "linear"}, 0.2, 0.5, 2.5),
        ({"spacing": "linear"}, 0.0, 0.5, np.inf),
        ({"spacing": "linear"}, -0.2, 0.5, np.inf),
    ],
)
def test_the_ratio_of_two_levels(keys: dict[str, str], low: float, high: float, ratio: float) -> None:
    assert stimulus(**keys).ratio(low, high) == pytest.approx(ratio)


amplitudes, frequencies, leads = st.floats(1, 100), st.floats(0.2, 5), st.floats(0.1, 5)


def test_the_usual_swing_lasts_four_seconds() -> None:
    task = Follow(kind="follow")
    assert (task.amplitude_mm, task.frequency_hz, task.cycles, task.radius_mm, task.lead_s) == (20, 1, 3, 6, 1)
    assert task.limit_s == task.expected_s == 4
    assert task.target_m(0) == task.target_m(-1) == (0, 0, 0)
    assert task.target_m(1.25) == pytest.approx((0.02, 0, 0))
    assert task.target_m(0.25)[0] == pytest.approx(0.02 * (1 - np.cos(np.pi / 4)) / 2)
    assert task.fastest_stroke((0.1, 0.06, 0.06)).speed_mps == pytest.approx(2 * np.pi * 0.02)


@given(amplitude=amplitudes, frequency=frequencies, lead=leads, share=st.floats(0, 1))
def test_the_target_stays_within_its_amplitude(amplitude: float, frequency: float, lead: float, share: float) -> None:
    task = Follow(kind="follow", amplitude_mm=amplitude, frequency_hz=frequency, lead_s=lead)
    assert abs(task.target_m(share * task.limit_s)[0]) <= task.amplitude_m


@pytest.mark.slow
@given(amplitude=amplitudes, frequency=frequencies, lead=leads)
def test_the_pace_is_the_rms_speed_after_the_lead(amplitude: float, frequency: float, lead: float) -> None:
    task = Follow(kind="follow", amplitude_mm=amplitude, frequency_hz=frequency, lead_s=lead)
    step_s = (task.limit_s - task.lead_s) / 1200
    places_m = np.array([task.target_m(task.lead_s + n * step_s)[0] for n in range(1201)])
    assert np.sqrt(np.mean((np.diff(places_m) / step_s) ** 2)) == pytest.approx(task.rms_speed_mps, rel=1e-4)


def design(kind: str) -> Design:
    return Rated(scale="agreement") if kind == "rating" else default_design(kind)


@pytest.mark.parametrize(
    ("kind", "arrangement", "correct"),
    [
        ("2ifc", (True, False), "first"),
        ("2ifc", (False, True), "second"),
        ("4ifc", (False, False, False, True), "fourth"),
        ("abx", (False, True, False), "like_first"),
        ("abx", (True, False, False), "like_second"),
        ("oddity", (True, True, False), "third"),
        ("oddity", (True, False, False), "first"),
        ("samedifferent", (True, True), "same"),
        ("samedifferent", (False, True), "different"),
        ("yesno", (True,), "yes"),
        ("yesno", (False,), "no"),
    ],
)
def test_the_correct_answer(kind: str, arrangement: tuple[bool, ...], correct: str):
    built = design(kind)
    assert built.correct(built.arrangements.index(arrangement)) == correct


class Sharp:
    """An observer who notices every difference and chooses the strongest."""

    smallest = False

    def distinct(self, difference: float, about: float) -> bool:
        return difference != 0


@pytest.mark.parametrize("kind", [kind for kind in DESIGN_KINDS if design(kind).reply == "choice"])
def test_simulated_observer_without_noise_answers_correctly(kind: str):
    built = design(kind)
    for number, arrangement in enumerate(built.arrangements):
        levels = [2.0 if comparison else 1.0 for comparison in arrangement]
        assert built.simulated(levels, 1.5, Sharp()) == built.correct(number)


@pytest.mark.parametrize(
    ("when", "practice", "main"), [("never", False, False), ("practice", True, False), ("always", True, True)]
)
def test_feedback_is_shown_when_the_study_says(when: str, practice: bool, main: bool):
    built = design("2ifc").model_copy(update={"feedback": when})
    assert (built.shows_feedback(True), built.shows_feedback(False)) == (practice, main)


def test_feedback_defaults_to_practice_or_never_if_no_answer_is_correct():
    assert (design("2ifc").shows_feedback(True), design("2ifc").shows_feedback(False)) == (True, False)
    assert not design("estimation").shows_feedback(True)
