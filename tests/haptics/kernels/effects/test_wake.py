import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import UNBENT, examples, liquid, moving, scene, vectors
from tests.haptics.tails import LEGS, PACES, difference, tank, wakes, walk


@pytest.mark.slow
@settings(max_examples=examples(120), deadline=None)
@given(wake=wakes(), legs=LEGS, pace=st.sampled_from(list(PACES)), rate_hz=st.sampled_from([1000.0, 400.0, 2000.0]))
def test_the_wake_equals_its_definition(wake, legs, pace, rate_hz):
    wake_scene = scene(liquid(wake=wake), knee=UNBENT, rate_hz=rate_hz)
    assert difference(wake_scene, walk(legs, pace)) <= 1e-9


def test_steady_straight_motion_fills_the_wake_to_the_known_gain():
    table = simulate(tank(length=5000, scaling=7000, decay=0.999975), moving(np.tile([2.0, 0.0, 0.0], (5002, 1))))
    # The element stored by the tick before has not decayed yet: sum over ages 0 … 4999.
    assert table.wake_x_mps[5001] / 2 == pytest.approx(4700.18 / 7000, rel=1e-6)


@pytest.mark.parametrize("exponent", [0.25, 0.5, 1.0, 2.0, 4.0])
def test_straight_motion_fills_the_wake_as_the_fill_to_the_power_of_the_exponent(exponent):
    table = simulate(tank(exponent=exponent), moving(np.tile([1.0, 0.0, 0.0], (101, 1))))
    fill = np.arange(101) / 100
    if exponent >= 1:
        assert table.wake_x_mps == pytest.approx(fill**exponent)
    else:
        assert table.wake_x_mps == pytest.approx(fill * (fill**2 + 0.05**2) ** ((exponent - 1) / 2))
        assert table.wake_x_mps[30:] == pytest.approx(fill[30:] ** exponent, rel=0.015)


def test_a_tight_curve_is_one_segment_between_neighbours_and_many_over_the_span():
    angle = np.arange(4000) * 0.02  # 1 m/s on a circle of 50 mm
    motion = moving(np.column_stack([np.cos(angle), np.zeros(4000), np.sin(angle)]))
    follows = simulate(tank(length=1000, scaling=1000, breaking_span_m=0.0), motion)
    cancels = simulate(tank(length=1000, scaling=1000, breaking_span_m=0.068), motion)
    assert np.linalg.norm(vectors(follows, "wake")[-1]) == pytest.approx(1.0, rel=1e-6)
    assert np.linalg.norm(vectors(cancels, "wake")[-1]) < 0.3
