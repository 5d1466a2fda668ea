"""The target that is followed: where it is, how fast, and how long."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from study_app.protocol.trials.tasks.follow import Follow

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


@pytest.mark.parametrize(
    "wrong", [{"axis": "y"}, {"amplitude_mm": 0.5}, {"frequency_hz": 0}, {"cycles": 0}, {"lead_s": 0}]
)
def test_what_no_hand_follows_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Follow.model_validate({"kind": "follow", **wrong})
