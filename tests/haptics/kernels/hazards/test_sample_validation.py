"""Hazards 6-12: incoming positions and times, and the directions that are computed from them."""

import numpy as np
import pytest

from study_app.haptics.model.estimators import Ewma
from study_app.haptics.model.force_rules import VERSIONS
from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.slope_limits import SLEW_N
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import (
    COMPILED,
    EVERYTHING,
    LIGHT_OIL,
    THESIS,
    TICK_NS,
    UNBENT,
    WATER,
    Hand,
    moving,
    scene,
    vectors,
)
from tests.haptics.tails import all_numbers, pass_time, tank

pytestmark = pytest.mark.slow

ALL = {**THESIS, **EVERYTHING}


@pytest.mark.slow
@pytest.mark.parametrize("scene", [tank(), tank(exponent=0.25), tank(exponent=2.0)], ids=["1", "1/4", "2"])
@pytest.mark.parametrize("speed_mps", [0.0, 5e-324, 1e-300, 1e-4])
def test_hazard_06_rest_has_no_direction(scene, speed_mps):
    resting = np.tile([speed_mps, 0.0, 0.0], (10_000 if COMPILED else 150, 1))
    table = simulate(scene, moving(np.concatenate([resting[:20], np.tile([0, 0, -1.0], (50, 1)), resting])))
    assert np.isfinite(vectors(table, "force")).all()
    assert not vectors(table, "wake")[:21].any()
    moved = vectors(table, "wake")[22:170]
    assert (moved[:, 2] < 0).all()
    assert not moved[:, :2].any()
    assert not vectors(table, "wake")[170:].any()


@pytest.mark.slow
def test_hazard_06_a_hand_may_rest_for_ten_seconds():
    hand = Hand(LIGHT_OIL)
    last = hand.sweep(0.2, 200)[-1]
    rested = pass_time(hand, last.position_m, 10_000 if COMPILED else 300)
    assert np.isfinite(all_numbers(hand.model)).all()
    assert not rested.wake_mps.any()
    assert hand.tick((0.0402, 0, 0)).force_n[0] < 0


@pytest.mark.parametrize("angle_deg", [30.0, 45.0, 52.3, 60.0, 90.0, 120.0])
def test_hazard_07_a_tick_of_exactly_the_breaking_angle_does_not_break(angle_deg):
    random = np.random.default_rng(int(angle_deg))
    for heading, before, after in zip(random.uniform(0, 2 * np.pi, 25), *random.uniform(0.01, 9, (2, 25)), strict=True):
        straight = np.array([np.cos(heading), 0, np.sin(heading)])
        for more, breaks in [(-1e-9, False), (0.0, False), (1e-9, True)]:
            turned_by = heading + np.radians(angle_deg) + more
            turned = np.array([np.cos(turned_by), 0, np.sin(turned_by)])
            motion = moving([*[before * straight] * 10, *[after * turned] * 2])
            wake = vectors(simulate(tank(breaking_angle_deg=angle_deg), motion), "wake")[11]
            old = straight if breaks else turned
            assert wake == pytest.approx(0.1 * before * old + 0.01 * after * turned, abs=1e-12)


def test_hazard_07_no_rounding_breaks_a_straight_line_even_at_a_breaking_angle_of_zero():
    random = np.random.default_rng(1)
    for heading in random.uniform(0, 2 * np.pi, 20):
        speeds = random.uniform(0.01, 9, 60)
        scene = tank(breaking_angle_deg=0.0).model_copy(update={"scale": 1.0, "velocity": Ewma(alpha=1.0)})
        hand = Hand(scene, rules=VERSIONS[2])  # no hand changes its speed so suddenly
        for path_m in np.cumsum(speeds) * 1e-3:
            hand.tick(path_m * np.array([np.cos(heading), 0, np.sin(heading)]))
        assert hand.model.liquid_states[0].wake.held > 50
        assert hand.model.liquid_states[0].wake.last_segment == 0


@pytest.mark.slow
@pytest.mark.parametrize("heading", [0.0, 0.3, np.pi / 4, 1.2])
@pytest.mark.parametrize("hand_mps", [0.005, 0.02])
def test_hazard_08_an_encoders_chatter_does_not_split_slow_motion(heading, hand_mps):
    path_m = hand_mps * np.arange(1, 3001 if COMPILED else 400) / 1000 + 1.23e-5
    places = np.outer(path_m, [np.cos(heading), 0, np.sin(heading)])
    smooth, encoded = Hand(WATER), Hand(WATER)
    for place in places:
        expected = smooth.tick(place)
        sample = encoded.tick(np.round(place / 38e-6) * 38e-6)
        assert np.linalg.norm(sample.force_n - expected.force_n) < 0.02
    tracks = encoded.model.liquid_states[0].wake
    if heading == 0.0:
        assert tracks.last_segment - tracks.first_segment + 1 <= 2


def path_at(times_s):
    """Return a path that begins at rest, ticks and stops, (n, 3) [m, scene]."""
    moving_s = np.minimum(times_s, 2.0)
    x = 0.9 * (moving_s - np.sin(np.pi * moving_s) / np.pi)
    return np.column_stack([x, 0 * x, 0.3 * (1 - np.cos(np.pi * moving_s / 2)) ** 2])


@pytest.mark.skipif(not COMPILED, reason="seconds of motion are for compiled code")
@pytest.mark.parametrize("pace", [[2.0], [0.5], [0.7, 1.3], [0.4, 0.6, 2.0]], ids=["500", "2000", "jitter", "late"])
@pytest.mark.parametrize("decay", [0.999975, 0.9997])
def test_hazard_09_the_force_does_not_depend_on_the_time_between_samples(pace, decay):
    wake = WATER.liquids[0].wake.model_copy(update={"decay": decay})
    scene = WATER.model_copy(update={"liquids": (WATER.liquids[0].model_copy(update={"wake": wake}),)})
    rate_hz = 1000.0 / np.mean(pace)
    usual_s = np.arange(3000) / 1000
    usual = vectors(simulate(scene, Motion(usual_s, path_at(usual_s))), "force")
    other_s = np.cumsum(1e-3 * np.resize(pace, round(3 * rate_hz))) - 1e-3 * pace[0]
    other = simulate(scene.model_copy(update={"rate_hz": rate_hz}), Motion(other_s, path_at(other_s)))
    expected = np.column_stack([np.interp(other_s, usual_s, usual[:, axis]) for axis in range(3)])
    error = np.linalg.norm(vectors(other, "force") - expected, axis=1)
    assert error.max() <= 0.02 * np.linalg.norm(usual, axis=1).max()


@pytest.mark.parametrize(
    ("jump_ns", "taken_s"),
    [(0, 0.2e-3), (1, 0.2e-3), (-TICK_NS, 0.2e-3), (-3 * 10**9, 0.2e-3), (10**8 + 1, 20e-3), (10**10, 20e-3)],
)
def test_hazard_10_a_clock_that_jumps_counts_as_02_to_20_ms(jump_ns, taken_s):
    scene = tank(decay=0.95).model_copy(update={"scale": 1.0})
    hand = Hand(scene)
    before = [hand.tick((2e-4 * k, 0, 0)) for k in range(61)][-1]
    jumped = hand.tick((2e-4 * 61, 0, 0), after_ns=jump_ns)
    moved = before.velocity_mps[0] + (1 - 0.9 ** (taken_s / 1e-3)) * (2e-4 / taken_s - before.velocity_mps[0])
    assert jumped.velocity_mps[0] == pytest.approx(moved)
    after = hand.tick((2e-4 * 62, 0, 0))
    stirred = 0.95 ** (taken_s / 1e-3) * jumped.wake_mps[0] + jumped.velocity_mps[0] / 100
    assert after.wake_mps[0] == pytest.approx(stirred)


@pytest.mark.parametrize("scene", ALL.values(), ids=ALL)
@pytest.mark.parametrize("jump_ns", [0, 1, 10**8, 10**10, -TICK_NS, -(10**12)])
def test_hazard_10_a_clock_that_jumps_does_no_harm(scene, jump_ns):
    hand, before = Hand(scene), np.zeros(3)
    for k in range(160):
        sample = hand.tick((0.0002 * k, -0.01, 0.0), after_ns=jump_ns if k == 60 else TICK_NS)
        assert np.isfinite(sample.force_n).all()
        assert np.linalg.norm(sample.device_force_n) <= 8 * (1 + 1e-12)
        assert np.linalg.norm(sample.device_force_n - before) <= SLEW_N + 1e-9
        before = sample.device_force_n.copy()
    assert sample.velocity_mps[0] == pytest.approx(0.2 * scene.scale, rel=1e-3)
    assert sample.limiters & LIMITER_GLITCH == 0


NONSENSE = [(np.nan,) * 3, (0.0, np.inf, 0.0), (-np.inf, 0.0, np.nan), (1e300, 0.0, 0.0), (0.0, 0.0, 1.7e308)]


@pytest.mark.compiled
@pytest.mark.parametrize("scene", ALL.values(), ids=ALL)
@pytest.mark.parametrize("first", [False, True], ids=["later", "first"])
def test_hazard_11_after_a_spell_of_nonsense_the_model_recovers_within_ten_ticks(scene, first):
    rng = np.random.default_rng(3)
    hand, calm = Hand(scene), Hand(scene)
    for k in range(200):
        place = (0.02 * np.sin(0.01 * k), -0.01, 0.0)
        nonsense = rng.random() < 0.1 or (first and k < 3)
        with np.errstate(all="ignore"):
            hand.tick(NONSENSE[k % len(NONSENSE)] if nonsense else place)
        calm.tick(place)
        assert np.isfinite(all_numbers(hand.model)).all()
    for k in range(200, 210):
        after, expected = (moved_hand.tick((0.02 * np.sin(0.01 * k), -0.01, 0.0)) for moved_hand in (hand, calm))
    assert after.velocity_mps == pytest.approx(expected.velocity_mps, rel=0.02, abs=1e-3)
    # What was refused is not in the wake: one in ten of its elements.
    assert np.linalg.norm(after.force_n - expected.force_n) < 0.12 * np.linalg.norm(expected.force_n)
    assert after.limiters & LIMITER_GLITCH == 0


@pytest.mark.parametrize("scene", ALL.values(), ids=ALL)
@pytest.mark.parametrize("far_m", [10.1, 1e155, 1e300, 1.7e308])
def test_hazard_11_no_place_beyond_a_hands_reach_is_a_new_beginning(scene, far_m):
    hand = Hand(scene)
    hand.sweep(0.1, 200)
    for k in range(40):
        lost = hand.tick((0.0, -far_m, far_m * (1 - 1e-12 * (k % 2))))
        assert lost.limiters & LIMITER_GLITCH
        assert np.isfinite(all_numbers(hand.model)).all()
        assert np.isfinite(lost.force_n).all()
    back = hand.sweep(0.1, 20)
    assert not any(sample.limiters & LIMITER_GLITCH for sample in back)
    assert np.isfinite(all_numbers(hand.model)).all()


@pytest.mark.parametrize("scene", ALL.values(), ids=ALL)
@pytest.mark.parametrize("jump_m", [(0.1, 0, 0), (0, -0.1, 0), (0.03, 0.03, 0.03)])
def test_hazard_12_a_jump_of_100_metres_a_second_is_not_felt(scene, jump_m):
    hand = Hand(scene)
    for k in range(40):
        before = hand.tick((2e-4 * k, -0.01, 0.0))
    glitch = hand.tick(np.array([0.008, -0.01, 0.0]) + jump_m)
    assert glitch.limiters & LIMITER_GLITCH
    assert (glitch.velocity_mps == before.velocity_mps).all()
    assert (glitch.force_n == before.force_n).all()
    after = hand.tick((0.0082, -0.01, 0.0))
    assert after.velocity_mps[0] == pytest.approx(before.velocity_mps[0], rel=0.02)


def test_hazard_12_the_fastest_hand_that_is_believed_meets_the_knee_before_its_speed_is_squared():
    bent, unbent = Hand(scene(scale=10)), Hand(scene(scale=10, knee=UNBENT))
    for k in range(200):
        bent_sample, unbent_sample = (hand.tick((9.9e-3 * k, 0.0, 0.0)) for hand in (bent, unbent))
    assert -unbent_sample.force_n[0] > 8000
    lowered = 5 + np.sqrt(1 + 2 * (99 - 5)) - 1
    assert bent_sample.velocity_mps[0] == pytest.approx(lowered, rel=1e-6)
    assert -bent_sample.force_n[0] < 300
    assert np.linalg.norm(bent_sample.device_force_n) <= 8 * (1 + 1e-12)
