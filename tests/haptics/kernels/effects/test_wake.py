import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import elements_needed, pack
from tests.haptics.scenes import COMPILED, UNBENT, examples, liquid, moving, scene, vectors
from tests.haptics.tails import LEGS, PACES, difference, tank, wakes, walk


@pytest.mark.slow
@settings(max_examples=examples(120), deadline=None)
@given(wake=wakes(), legs=LEGS, pace=st.sampled_from(list(PACES)), rate_hz=st.sampled_from([1000.0, 400.0, 2000.0]))
def test_the_wake_equals_its_definition(wake, legs, pace, rate_hz):
    felt = scene(liquid(wake=wake), knee=UNBENT, rate_hz=rate_hz)
    assert difference(felt, walk(legs, pace)) <= 1e-9


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="a million ticks are for compiled code")
@pytest.mark.parametrize(
    ("decay", "ticks", "interval_s"),
    [
        (0.999975, 200_000, 1e-3),
        (1.0, 200_000, 1e-3),
        (0.95, 200_000, 1e-3),
        (0.999975, 1_500_000, 0.02),  # the decay of 3·10⁷ ticks of 1 ms: past where an endless scale would be 0
    ],
)
def test_it_still_does_after_a_million_ticks_and_after_hours(decay, ticks, interval_s):
    random = np.random.default_rng(7)
    speed = np.repeat(random.choice([0.0, 1e-3, 0.1, 1.0, 5.0, 50.0], ticks // 50), 50)
    heading = np.cumsum(np.where(random.random(ticks) < 0.02, random.uniform(-np.pi, np.pi, ticks), 0.01))
    motion = moving(np.column_stack([speed * np.cos(heading), np.zeros(ticks), speed * np.sin(heading)]), interval_s)
    assert difference(tank(length=40, scaling=50, decay=decay, breaking_span_m=0.01), motion) <= 1e-9


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


def test_rest_displaces_the_wake_element_by_element():
    motion = moving(np.concatenate([np.tile([1.0, 0.0, 0.0], (100, 1)), np.zeros((101, 3))]))
    wake = simulate(tank(), motion).wake_x_mps
    assert wake[100:] == pytest.approx(1 - np.arange(101) / 100)
    assert wake[200] == 0.0


def test_a_turn_ends_a_segment_whose_oldest_elements_are_of_a_rest_or_gone():
    legs = [(10, 1.0, 0, 0.0, 0.0), (5, 0.0, 0, 0.0, 0.0), (20, 1.0, 0, 0.0, 0.0), (10, 1.0, 90, 0.0, 0.0)]
    assert difference(tank(length=23, scaling=23, breaking_span_m=1.0), walk(legs)) <= 1e-9


def test_motion_below_a_millimetre_a_second_is_rest():
    creeping = moving(np.tile([0.9e-3, 0.0, 0.0], (50, 1)))
    assert not simulate(tank(), creeping).wake_x_mps.any()
    moving_on = moving(np.tile([1.1e-3, 0.0, 0.0], (50, 1)))
    assert simulate(tank(), moving_on).wake_x_mps[-1] == pytest.approx(49 * 1.1e-5)


def test_vertical_motion_enters_only_where_asked():
    motion = moving(np.tile([1.0, 2.0, 0.0], (11, 1)))
    assert vectors(simulate(tank(), motion), "wake")[10] == pytest.approx([0.1, 0.0, 0.0])
    assert vectors(simulate(tank(axes="xyz"), motion), "wake")[10] == pytest.approx([0.1, 0.2, 0.0])


def test_a_late_tick_stores_one_element_and_decays_for_its_time():
    motion = Motion(np.array([0.0, 0.001, 0.011]), np.zeros((3, 3)), np.tile([1.0, 0.0, 0.0], (3, 1)))
    wake = simulate(tank(decay=0.9), motion).wake_x_mps
    assert wake == pytest.approx([0, 0.01, 0.01 * (1 + 0.9)])
    later = Motion(np.array([0.0, 0.010, 0.011]), np.zeros((3, 3)), np.tile([1.0, 0.0, 0.0], (3, 1)))
    assert simulate(tank(decay=0.9), later).wake_x_mps[2] == pytest.approx(0.01 * (1 + 0.9**10))


def test_length_and_scaling_are_stated_at_1_khz():
    felt = tank(length=101, scaling=150).model_copy(update={"rate_hz": 500.0})
    wake = pack(felt).liquids[0].wake
    assert (wake.length, wake.scaling) == (50, 75.0)
    short = tank(length=1, scaling=1).model_copy(update={"rate_hz": 250.0})
    assert (pack(short).liquids[0].wake.length, pack(short).liquids[0].wake.scaling) == (1, 1.0)
    assert elements_needed(felt) == 50
