"""Parameters changed during a motion: the motion continues, the force has no step, and no energy is added."""

from random import Random

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.devices.simulated import ScriptedDevice
from study_app.errors import StudyError
from study_app.haptics.model.layout import LIMITER_FADE
from study_app.haptics.model.motion import programmed_motion
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import SLEW_N
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load_scene

WATER = load_scene("rek2024", "water")
NUMBERS = {
    "density_kg_m3": 4000.0, "wake.scaling": 9000.0, "wake.exponent": 3.0, "wake.breaking_angle_deg": 90.0,
    "wake.breaking_span_m": 0.0, "wake.decay": 0.999, "wake.resolution_m": 0.01, "body.diameter_m": 0.1,
    "body.drag_coefficient": 1.2, "alpha": 0.5, "threshold_mps": 1.0, "force_limit_n": 2.0, "body.density_kg_m3": 500.0,
}  # fmt: skip
OTHERWISE = {
    "wake.length": 1000, "effects": ("drag",), "knee.law": "none", "velocity": {"kind": "raw"}, "scale": 3.0,
    "origin_m": (0.0, 0.1, 0.0), "region": {"kind": "box", "size_m": (9.0, 9.0, 9.0)},
}  # fmt: skip


def going_round(scene: Scene) -> tuple[Servo, ScriptedDevice]:
    """Return a servo on a hand that goes in circles."""
    device = ScriptedDevice(Random(1), workspace_m=(0.05, 0.05, 0.05))  # noqa: S311 - a hand keeps no secrets
    servo = Servo(device, clock=VirtualClock())
    motion = programmed_motion("circle", rate_hz=1000.0, radius_m=0.3, rest_s=0.1)
    device.follow(motion.t_s, (motion.position_m - motion.position_m.mean(axis=0)) / 10)
    servo.load(scene)
    servo.advance(2500)
    return servo, device


def newest_samples(servo: Servo, ticks: int) -> np.ndarray:
    written = int(servo.telemetry.written[0])
    return servo.telemetry.ring[written - ticks : written].copy()


def test_the_same_numbers_change_nothing_but_the_serial() -> None:
    (adjusted, first), (untouched, second) = going_round(WATER), going_round(WATER)
    for _ in range(10):
        assert adjusted.adjust(WATER) > 1
        adjusted.advance(50)
    untouched.advance(500)
    ours, theirs = newest_samples(adjusted, 500), newest_samples(untouched, 500)
    assert set(theirs.scene) == {1}
    assert list(ours.scene[::50]) == list(range(2, 12))
    for name in ("velocity_mps", "wake_mps", "force_n", "device_force_n", "limiters"):
        assert np.array_equal(ours[name], theirs[name]), name
    assert np.linalg.norm(ours.wake_mps, axis=1).min() > 0.5
    for servo, device in ((adjusted, first), (untouched, second)):
        servo.stop()
        device.close()


@pytest.mark.parametrize("name", NUMBERS)
def test_a_number_is_felt_by_the_next_tick_and_the_wake_goes_on(name: str) -> None:
    servo, device = going_round(WATER)
    before = newest_samples(servo, 1)[0]
    servo.adjust(override_all(WATER, {name: NUMBERS[name]}))
    servo.advance(300)
    after = newest_samples(servo, 300)
    assert set(after.scene) == {2}
    assert not (after.limiters & LIMITER_FADE).any()
    whole = np.concatenate([[before.device_force_n], after.device_force_n])
    assert (
        np.linalg.norm(np.diff(whole, axis=0), axis=1).max() < 2 * SLEW_N
    )  # each way round: a brake is let go at once
    assert np.linalg.norm(after.wake_mps[0]) > 0.1
    servo.stop()
    device.close()


@pytest.mark.parametrize("name", OTHERWISE)
def test_parameters_that_shape_the_state_cannot_be_adjusted(name: str) -> None:
    servo, device = going_round(WATER)
    with pytest.raises(StudyError, match="load the scene instead"):
        servo.adjust(override_all(WATER, {name: OTHERWISE[name]}))
    servo.advance(1)
    assert newest_samples(servo, 1)[0].scene == 1
    servo.rest()
    servo.advance(1)
    assert not servo.may_adjust(WATER)
    servo.stop()
    device.close()


@pytest.mark.slow
@settings(max_examples=25)
@given(st.lists(st.tuples(st.sampled_from([1.0, 100.0, 4000.0, 25000.0]), st.integers(1, 60)), min_size=1, max_size=30))
def test_however_the_numbers_are_thrown_about_the_hand_gets_back_no_more_than_it_put_in(
    steps: list[tuple[float, int]],
) -> None:
    """E ≥ −1 mJ − F R, with the strongest force F and the longest step R, as without a change."""
    servo, device = going_round(WATER)
    for density_kg_m3, ticks in steps:
        servo.adjust(override_all(WATER, {"density_kg_m3": density_kg_m3}))
        servo.advance(ticks)
    rows = newest_samples(servo, 2500 + sum(ticks for _, ticks in steps))
    force_n, place_m = rows.device_force_n, rows.position_m
    work_j = np.cumsum(-np.einsum("ij,ij->i", force_n[:-1], np.diff(place_m, axis=0)))
    most_j = np.linalg.norm(force_n, axis=1).max() * np.linalg.norm(np.diff(place_m, axis=0), axis=1).max()
    forgiven_j = 1e-3 * 1e-3 * len(rows)  # 1 mW
    assert work_j.min() >= -1e-3 - most_j - forgiven_j
    assert np.linalg.norm(force_n, axis=1).max() <= 8.0 + 1e-12
    servo.stop()
    device.close()


def test_a_scene_and_numbers_handed_over_in_one_tick_are_both_taken() -> None:
    servo, device = going_round(WATER)
    oil = load_scene("rek2024", "light_oil")
    servo.adjust(override_all(WATER, {"density_kg_m3": 2000.0}))
    servo.load(oil)
    servo.adjust(override_all(oil, {"force_limit_n": 0.3}))
    servo.advance(600)
    after = newest_samples(servo, 600)
    assert set(after.scene) == {4}
    assert after.limiters[0] & LIMITER_FADE
    assert np.linalg.norm(after.device_force_n, axis=1).max() == pytest.approx(0.3)
    servo.stop()
    device.close()


def test_a_stopped_force_stays_stopped() -> None:
    servo, device = going_round(WATER)
    servo.stop_force()
    servo.adjust(override_all(WATER, {"density_kg_m3": 9000.0}))
    servo.advance(200)
    assert not newest_samples(servo, 200).device_force_n.any()
    servo.stop()
    device.close()
