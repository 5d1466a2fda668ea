"""Zero force at a stop, at the end and after a fault, and the way back to a force."""

import gc
import weakref

import numpy as np
import pytest

from study_app.errors import DeviceLost, ServoFault
from study_app.haptics.model.layout import (
    BUTTON_STOP,
    LIMITER_STOP,
    STATUS_DEVICE_LOST,
    STATUS_NON_FINITE,
    STATUS_OK,
    STATUS_STALE_FAULT,
)
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from tests.compiled import needs_servo
from tests.haptics.running import bring_to_force, is_zero
from tests.haptics.scenes import HONEY, WATER

pytestmark = needs_servo


def test_a_force_stop_is_zero_on_the_next_tick(servo, probe):
    bring_to_force(servo)
    servo.stop_force()
    assert not servo.force_is_on
    servo.advance(1)
    assert is_zero(probe.forces_n[-1])
    assert servo.telemetry.latest().limiters & LIMITER_STOP
    servo.advance(1000)
    assert is_zero(probe.forces_n[-1000:])


def test_the_stop_button_of_the_device_is_heard_by_the_servo_itself(servo, probe):
    bring_to_force(servo)
    probe.state.buttons = BUTTON_STOP
    servo.advance(1)
    assert is_zero(probe.forces_n[-1])
    assert not servo.force_is_on
    probe.state.buttons = 0
    servo.advance(1000)
    assert is_zero(probe.forces_n[-1000:])


def test_after_a_force_stop_the_force_fades_in_as_at_the_start(servo, probe):
    bring_to_force(servo)
    full = np.linalg.norm(probe.forces_n[-1])
    servo.stop_force()
    servo.advance(100)
    servo.fade_in()
    assert servo.force_is_on
    servo.advance(600)
    sizes = np.linalg.norm(probe.forces_n[-600:], axis=1)
    assert sizes[249] == pytest.approx(full / 2, rel=0.02)
    assert sizes[-1] == pytest.approx(full, rel=0.01)


def test_a_force_stop_outlasts_a_change_of_scene(servo, probe):
    bring_to_force(servo)
    servo.stop_force()
    servo.load(WATER)
    servo.advance(200)
    assert is_zero(probe.forces_n[-200:])


def test_an_exception_in_the_host_ends_in_zero_force(probe):
    def host():
        with Servo(probe, clock=VirtualClock()) as servo:
            bring_to_force(servo)
            raise RuntimeError("host")

    with pytest.raises(RuntimeError, match="host"):
        host()
    assert is_zero(probe.forces_n[-1])


@pytest.mark.slow
def test_a_servo_nobody_holds_ends_in_zero_force(probe):
    servo = Servo(probe, clock=VirtualClock())
    bring_to_force(servo)
    gone = weakref.ref(servo)
    del servo
    gc.collect()
    assert gone() is None
    assert is_zero(probe.forces_n[-1])


def test_a_stopped_servo_starts_again_at_rest_and_fades_in(servo, probe):
    bring_to_force(servo)
    servo.stop()
    written = len(probe.forces_n)
    servo.advance(100)
    assert servo.telemetry.latest().scene == 0
    assert is_zero(probe.forces_n[written:])
    servo.load(HONEY)
    servo.advance(250)
    assert 0.2 < np.linalg.norm(probe.forces_n[-1]) < 4


# faults


@pytest.mark.parametrize("way", ["lost_at_read", "lost_at_write"])
def test_a_lost_device_ends_the_loop_in_zero_force(servo, probe, way):
    bring_to_force(servo)
    probe.state[way] = probe.state.reads + 11
    assert servo.advance(100) == 11
    assert is_zero(probe.forces_n[-1])
    assert servo.telemetry.latest().status == STATUS_DEVICE_LOST
    assert servo.advance(100) == 0
    assert not servo.force_is_on
    assert "'probe' stopped responding" in servo.fault
    with pytest.raises(DeviceLost, match="reconnect it"):
        servo.check()
    with pytest.raises(DeviceLost):
        servo.load(WATER)
    servo.rest()


def test_after_a_loss_the_servo_can_be_restarted(servo, probe):
    bring_to_force(servo)
    probe.state.lost_at_read = probe.state.reads + 1
    servo.advance(10)
    probe.state.lost_at_read = 1 << 60
    servo.stop()
    assert servo.advance(10) == 10
    assert servo.fault is None
    bring_to_force(servo)


def test_a_device_without_news_for_50_ms_is_a_fault(servo, probe):
    bring_to_force(servo)
    probe.state.silent_from_read = probe.state.reads + 1
    assert servo.advance(1000) == 50
    assert servo.telemetry.latest().status == STATUS_STALE_FAULT
    assert is_zero(probe.forces_n[-1])
    with pytest.raises(ServoFault, match="no usable data for 50 ms"):
        servo.check()


def test_a_non_finite_force_is_never_written(servo, probe):
    bring_to_force(servo)
    for model in servo.loop.slots:
        model.liquids.drag.factor_kg_m = np.nan
    assert servo.advance(100) == 1
    assert servo.telemetry.latest().status == STATUS_NON_FINITE
    assert is_zero(probe.forces_n[-1])
    assert np.isfinite(probe.forces_n).all()
    with pytest.raises(ServoFault, match="non-finite force"):
        servo.check()


def test_a_single_non_finite_position_is_skipped(servo, probe):
    bring_to_force(servo)
    probe.state.bad_at_read = probe.state.reads + 5
    assert servo.advance(100) == 100
    assert servo.telemetry.latest().status == STATUS_OK
    assert np.isfinite(probe.forces_n).all()
