import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.simulated import MouseDevice
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.scene import Liquid, Scene
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo

THESIS = {
    "water": Liquid(
        id="water", density_kg_m3=1000, effects=("drag", "wake"), wake=Wake(length=1700, scaling=1700, exponent=0.75)
    ),
    "honey": Liquid(id="honey", density_kg_m3=1400),
    "light_oil": Liquid(
        id="light_oil", density_kg_m3=4500, effects=("drag", "wake"), wake=Wake(length=125, scaling=250, exponent=0.25)
    ),
}
LIQUIDS = sorted(THESIS)
FRAME_MS = 16  # between two pointer events


def scene_of(liquid):
    return Scene(liquids=(THESIS[liquid],) if liquid else ())


def samples_along(liquid, pointer, duration_s, *, frame_ms=FRAME_MS):
    """Return the samples while the pointer goes along x as ``pointer(t)`` says, after the start fade."""
    device = MouseDevice()
    device.point_to(pointer(0.0), 0.0, 0.0)
    with Servo(device, clock=VirtualClock()) as servo:
        servo.load(scene_of(liquid))
        servo.advance(600)
        reader = servo.telemetry.reader()
        for frame in range(round(duration_s * 1000) // frame_ms):
            device.point_to(pointer(frame * frame_ms * 1e-3), 0.0, 0.0)
            servo.advance(frame_ms)
        return reader.read()


def pointer_position(t):
    """Return the pointer's position: from -45 mm at 0.3 m/s to rest at 35 mm."""
    return min(-0.045 + 0.3 * t, 0.035)


def behind_ms(samples):
    """Return how much later than the pointer the handle passes the middle [ms]."""
    return int(np.argmax(samples.position_m[:, 0] >= 0)) - 150


def test_in_free_space_the_handle_follows_20_to_30_ms_behind():
    assert 20 <= behind_ms(samples_along(None, pointer_position, 1.0, frame_ms=1)) <= 30


@pytest.mark.parametrize("liquid", LIQUIDS)
def test_in_a_liquid_it_lags_visibly(liquid):
    samples = samples_along(liquid, pointer_position, 0.27)
    assert behind_ms(samples) > behind_ms(samples_along(None, pointer_position, 0.27)) + 20
    pointer = pointer_position(0.25)
    assert pointer - samples.position_m[250, 0] > 0.012
    assert np.abs(samples.device_force_n).max() > 3


def test_a_wake_carries_it_on_past_the_pointer_and_lets_it_go():
    samples = samples_along("light_oil", pointer_position, 2.0)
    beyond = samples.position_m[:, 0] - 0.035
    assert beyond.max() > 0.005
    assert samples.device_force_n[np.argmax(beyond), 0] > 1
    assert abs(beyond[-1]) < 0.001


def test_without_a_wake_it_is_not_carried_on():
    assert samples_along("honey", pointer_position, 2.0).position_m[:, 0].max() < 0.0355


def test_a_pointer_outside_the_workspace_counts_as_its_border():
    device = MouseDevice(workspace_m=(0.05, 0.03, 0.05))
    device.point_to(1.0, -1.0, 0.01)
    with Servo(device, clock=VirtualClock()) as servo:
        servo.advance(2000)
        assert servo.telemetry.latest().position_m == pytest.approx([0.05, -0.03, 0.01], abs=1e-4)
        assert device.aim_m == pytest.approx((0.05, -0.03, 0.01), abs=1e-6)


pointers = st.lists(st.tuples(st.tuples(*[st.floats(-0.2, 0.2)] * 3), st.integers(1, 250)), min_size=1, max_size=20)


@pytest.mark.slow
@pytest.mark.parametrize("liquid", LIQUIDS)
@settings(deadline=None, max_examples=25)
@given(pointers)
def test_whatever_the_pointer_does_the_handle_is_held_and_comes_to_rest(liquid, jumps):
    device = MouseDevice()
    with Servo(device, clock=VirtualClock()) as servo:
        servo.load(scene_of(liquid))
        reader = servo.telemetry.reader()
        for place, ticks in jumps:
            device.point_to(*place)
            assert servo.advance(ticks) == ticks
        samples = reader.read()
        assert (np.abs(samples.position_m) <= 0.05).all()
        assert np.linalg.norm(samples.device_force_n, axis=1).max(initial=0) <= 8 * (1 + 1e-12)
        servo.advance(2500)
        reader.read()
        servo.advance(100)
        speeds = np.linalg.norm(np.diff(reader.read().position_m, axis=0), axis=1) * 1e3
        assert speeds.max() < 1e-3
