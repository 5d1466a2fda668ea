"""Hazards 1-5, 17, 19, 20 of a wake that is stored as running sums: each occurred without its remedy."""

import math

import numpy as np
import pydantic
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.model.effects.local_wake import LocalWake
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.estimators import Raw
from study_app.haptics.model.layout import SAFETY, SAMPLE
from study_app.haptics.model.scene import Knee
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import pack
from tests.haptics.scenes import (
    COMPILED,
    EVERYTHING,
    LIGHT_OIL,
    THESIS,
    TICK_NS,
    UNBENT,
    WATER,
    WATER_FACTOR,
    Hand,
    examples,
    liquid,
    moving,
    scene,
    vectors,
)
from tests.haptics.tails import LEGS, TICKS, difference, pass_time, tank, wakes, walk

LAMBDA = 0.999975


def at_the_hand(**wake):
    """Return a scene at scale 1 with the raw difference as velocity, so that the input of the wake is known exactly."""
    return tank(**wake).model_copy(update={"scale": 1.0, "velocity": Raw()})


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="hours are for compiled code")
def test_hazard_01_the_scale_does_not_underflow_after_hours():
    hand = Hand(at_the_hand(decay=LAMBDA, resolution_m=2e-4))
    hand.sweep(0.5, 150)
    tremble = [(0.075 + 5e-5, 0, 0), (0.075, 0, 0)]  # within the resolution: nothing is stored, nothing falls off
    pass_time(hand, tremble, 1_600_000, after_ns=20 * TICK_NS)  # the decay of 8.9 h, which as one factor would be 0
    assert hand.model.liquid_states[0].wake.held == 100
    again = hand.sweep(0.5, 60, start_m=0.075)
    speeds = np.array([sample.velocity_mps[0] for sample in again])
    for k, sample in enumerate(again):
        expected = (speeds[:k] * LAMBDA ** np.arange(k - 1, -1, -1)).sum() / 100
        assert sample.wake_mps[0] == pytest.approx(expected, rel=1e-9, abs=1e-100)


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="millions of ticks are for compiled code")
def test_hazard_02_stored_numbers_do_not_grow_without_bound():
    length, angle = 1700, np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    hand = Hand(at_the_hand(length=length, scaling=length, decay=LAMBDA))
    circle = 0.03 * np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)])
    sample = pass_time(hand, circle, 2_000_000)
    tracks = hand.model.liquid_states[0].wake
    assert LAMBDA ** (2 * length) < tracks.scale <= 1.0
    speed = np.linalg.norm(circle[1] - circle[0]) * 1000
    assert hand.model.rows.elements.speed_mps.max() < speed / LAMBDA ** (2 * length)
    expected = speed * (LAMBDA ** np.arange(length)).sum() / length
    assert np.linalg.norm(sample.wake_mps) == pytest.approx(expected, rel=1e-9)


def floats(dtype):
    """Yield the dtypes of all floating-point fields, including those of nested records."""
    if dtype.names:
        for name in dtype.names:
            yield from floats(dtype[name])
    elif dtype.base.kind != "i":
        yield dtype.base


@pytest.mark.parametrize("scene", EVERYTHING.values(), ids=EVERYTHING)
def test_hazard_03_all_that_is_kept_has_double_precision(scene):
    kinds = (
        {kind for rows in pack(scene).arrays for kind in floats(rows.dtype)} | set(floats(SAMPLE)) | set(floats(SAFETY))
    )
    assert kinds == {np.dtype(np.float64)}


def test_hazard_03_after_5000_ticks_88_percent_of_an_element_is_left():
    ticks = 5000 if COMPILED else 500
    table = simulate(tank(length=6000, scaling=6000, decay=LAMBDA), moving([(1.0, 0, 0)] + [(0.0, 0, 0)] * (ticks + 1)))
    left = (table.wake_x_mps[ticks + 1] / table.wake_x_mps[1]) ** (5000 / ticks)
    assert left == pytest.approx(LAMBDA**5000, rel=1e-11)
    assert left == pytest.approx(0.8824955, abs=5e-8)


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="hundreds of thousands of ticks")
def test_hazard_04_removing_old_elements_does_not_drift():
    length, ticks = 5000, 400_000
    random = np.random.default_rng(4)
    fast = np.repeat(random.random(ticks // 4000) < 0.3, 4000)
    fast[-8000:] = False
    speeds = np.where(fast, 5.0, 1e-3) * (1 + random.random(ticks))
    table = simulate(tank(length=length, scaling=length), moving(np.outer(speeds, [1.0, 0.0, 0.0])))
    after_bursts = [b + length for b in range(4000, ticks - 8000, 4000) if fast[b - 1] and not fast[b : b + 8000].any()]
    assert len(after_bursts) > 10
    for k in [
        *after_bursts,
        *random.integers(length + 1, ticks, 40),
        ticks - 1,
    ]:  # where the last of a burst has just left
        exact = math.fsum(speeds[k - length : k]) / length
        assert table.wake_x_mps[k] == pytest.approx(exact, rel=4e-15, abs=0.0)


@pytest.mark.slow
@pytest.mark.parametrize("tick", [0.0, 1.0, np.pi])
def test_hazard_04_a_fast_burst_that_has_fallen_off_leaves_nothing_behind(tick):
    length = 50
    heading = tick * np.arange(length)
    burst = 1e4 * np.column_stack([np.cos(heading), np.zeros(length), np.sin(heading)]) + 1 / 3
    crumb = np.zeros((length + 1, 3))
    crumb[0] = (0.001, 0.0, 0.0007)
    motion = moving(np.concatenate([burst, crumb]))
    scene = tank(length=length, scaling=length, exponent=1.0)
    assert difference(scene, motion) <= 1e-9
    assert simulate(scene, motion).wake_x_mps[-1] == pytest.approx(0.001 / length, rel=1e-9)


@pytest.mark.compiled
def test_hazard_05_after_a_stop_the_wake_goes_without_a_step():
    legs = [np.tile([np.cos(heading), 0, np.sin(heading)], (170, 1)) for heading in np.radians([0, 60])]
    stop = moving(1.5 * np.concatenate([*legs * 6, np.zeros((1750, 3))]))
    force = vectors(simulate(WATER, stop), "force")[12 * 170 :]
    assert np.linalg.norm(force[0]) > 0.2
    assert np.linalg.norm(np.diff(force, axis=0), axis=1).max() < 0.01
    assert not force[-1].any()


@pytest.mark.parametrize("kind", [Wake, LocalWake])
def test_hazard_17_a_wake_that_would_outrun_the_body_is_refused(kind):
    with pytest.raises(pydantic.ValidationError, match="outrun the body"):
        kind(length=101, scaling=100)


@pytest.mark.parametrize("rate_hz", [250.0, 999.0, 1000.0, 2000.0])
@pytest.mark.parametrize("length", [1, 3, 100])
def test_hazard_17_at_no_rate_does_a_wake_outrun_the_body(length, rate_hz):
    scene = tank(length=length, scaling=length).model_copy(update={"rate_hz": rate_hz})
    towed = simulate(scene, moving(np.tile([2.0, 0.0, 0.0], (300, 1)), 1 / rate_hz))
    assert (towed.fx_n <= 1e-12).all()


@pytest.mark.compiled
@pytest.mark.parametrize("name", THESIS)
@pytest.mark.parametrize("speed_mps", [0.02, 0.5, 2.0, 20.0])
def test_hazard_17_towing_for_ten_seconds_is_never_a_push(name, speed_mps):
    towed = simulate(THESIS[name], moving(np.tile([speed_mps, 0.0, 0.0], (10_000 if COMPILED else 500, 1))))
    assert (towed.fx_n <= 1e-12).all()
    assert (towed.device_fx_n <= 1e-12).all()


@pytest.mark.slow
@settings(max_examples=examples(50), deadline=None)
@given(wake=wakes(), speed=st.floats(0.01, 10))
def test_hazard_17_whatever_the_wake_steady_motion_is_never_pushed_on(wake, speed):
    table = simulate(tank(**wake), moving(np.tile([speed, 0.0, 0.0], (min(TICKS, 600), 1))))
    assert (table.fx_n <= 1e-12).all()


@pytest.mark.slow
@settings(max_examples=examples(60), deadline=None)
@given(wake=wakes(st.just(7)), legs=LEGS)
def test_hazard_19_a_ring_of_seven_wraps_without_a_slip(wake, legs):
    assert difference(scene(liquid(wake=wake), knee=UNBENT), walk(legs)) <= 1e-9


@pytest.mark.slow
@settings(max_examples=examples(20), deadline=None)
@given(seed=st.integers(0, 2**32 - 1), span_m=st.sampled_from([0.0, 0.01]))
def test_hazard_19_every_element_held_is_counted_in_one_segment(seed, span_m):
    random = np.random.default_rng(seed)
    hand = Hand(at_the_hand(length=7, scaling=7, breaking_span_m=span_m))
    place = np.zeros(3)
    for _ in range(60):
        place = place + random.choice([0.0, 1e-4, 1e-3]) * random.choice([-1, 0, 1], 3)
        hand.tick(place)
        tracks = hand.model.liquid_states[0].wake
        rows = np.arange(tracks.first_segment, tracks.last_segment + 1) % 7
        held = np.arange(tracks.stored - tracks.held, tracks.stored) % 7
        assert hand.model.rows.segments.count[rows].sum() == hand.model.rows.elements.moving[held].sum()
        assert tracks.held <= 7


@pytest.mark.parametrize("scene", [WATER, LIGHT_OIL], ids=["water", "light_oil"])
def test_hazard_20_the_first_tick_of_a_motion_meets_a_liquid_at_rest(scene):
    table = simulate(scene, moving(np.tile([1.0, 0.0, 0.0], (3, 1))))
    assert table.fx_n[0] == pytest.approx(-WATER_FACTOR * scene.liquids[0].density_kg_m3 / 1000)
    assert table.wake_x_mps[0] == 0.0
    assert table.wake_x_mps[1] > 0.0


@pytest.mark.parametrize("scene", [WATER, LIGHT_OIL, EVERYTHING["places"]], ids=["water", "light_oil", "places"])
def test_hazard_20_the_first_moving_tick_of_the_servo_meets_a_liquid_at_rest(scene):
    hand = Hand(scene.model_copy(update={"knee": Knee(law="none")}))
    hand.tick((0.0, -0.02, 0.0))
    moved = [hand.tick((0.0003 * k, -0.02, 0.0)) for k in (1, 2)]
    assert not moved[0].wake_mps.any()
    assert moved[0].velocity_mps.any()
    assert moved[1].wake_mps[0] > 0.0
