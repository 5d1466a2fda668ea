import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.errors import StudyError
from study_app.evidence.reference_model import compress_speed
from study_app.haptics.model.estimators import Ewma, Given
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Knee
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import pack, pack_into
from tests.haptics.scenes import UNBENT, examples, moving, scene, vectors


def estimated_velocity(x_m, rate_hz=1000.0, alpha=0.1, interval_s=None):
    """Return the velocity along x for positions x_m."""
    t_s = np.arange(len(x_m)) / rate_hz if interval_s is None else np.cumsum(interval_s)
    position_m = np.column_stack([x_m, np.zeros(len(x_m)), np.zeros(len(x_m))])
    filtering = scene(velocity=Ewma(alpha=alpha), knee=UNBENT, rate_hz=rate_hz)
    return simulate(filtering, Motion(t_s, position_m)).vx_mps


@pytest.mark.compiled
def test_steady_acceleration_is_followed_nine_samples_late():
    t_s = np.arange(3000) / 1000
    v = estimated_velocity(0.5 * t_s**2)
    ideal_of_the_difference = t_s - 0.5e-3
    assert (ideal_of_the_difference - v)[-1] == pytest.approx(9e-3, rel=1e-6)


def test_a_step_of_speed_is_there_to_99_percent_after_44_samples():
    v = estimated_velocity(np.arange(100) * 1e-3)
    assert v[43] < 0.99 <= v[44]
    assert v[1:] == pytest.approx(1 - 0.9 ** np.arange(1, 100))


def test_a_given_velocity_that_is_not_there_is_refused():
    motion = Motion(np.arange(3) / 1000, np.zeros((3, 3)))
    with pytest.raises(StudyError, match="vx_mps"):
        simulate(scene(velocity=Given()), motion)


def test_a_device_cannot_feel_with_given_velocities():
    with pytest.raises(StudyError, match="ewma"):
        pack_into(pack(scene(), capacity=10), scene(velocity=Given()))


@pytest.mark.parametrize(
    ("law", "speed", "expected"),
    [
        ("sqrt", 4.9, 4.9),
        ("sqrt", 5.0, 5.0),
        ("sqrt", 9.0, 7.0),
        ("sqrt", 17.0, 9.0),
        ("square", 5.5, 5.25),
        ("square", 7.0, 9.0),
        ("none", 17.0, 17.0),
    ],
)
def test_the_knee_lowers_speeds_above_its_threshold(law, speed, expected):
    v = speed * np.array([2.0, -1.0, 2.0]) / 3
    knee = Knee(law=law)
    out = vectors(simulate(scene(knee=knee), moving([v])), "velocity")[0]
    assert out == pytest.approx(v * expected / speed)
    assert compress_speed(v, knee) == pytest.approx(v * expected / speed)


@pytest.mark.slow
@settings(max_examples=examples(100), deadline=None)
@given(a=st.floats(0, 100), b=st.floats(0, 100), threshold=st.floats(0.1, 20))
def test_the_square_root_knee_keeps_the_order_of_speeds_and_never_raises_one(a, b, threshold):
    knee = Knee(threshold_mps=threshold)
    slow, fast = sorted([a, b])
    out = simulate(scene(knee=knee), moving([(slow, 0, 0), (fast, 0, 0)])).vx_mps
    assert out[0] <= out[1] + 1e-12
    assert (out <= np.array([slow, fast]) * (1 + 1e-12)).all()
