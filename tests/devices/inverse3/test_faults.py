"""Every fault of the emulated service ends in its own message, in zero force, and in silence: one table."""

import itertools
from typing import Any

import pytest

from study_app.devices.failure_table import DeviceFailure
from study_app.devices.inverse3.emulated import EmulatedInverse3
from study_app.devices.inverse3.emulator.faults import FAULTS, OF_OPENING, OF_STREAM
from study_app.devices.inverse3.emulator.service import Service
from study_app.devices.inverse3.failures import FAILURES
from study_app.errors import DeviceError, DeviceLost, ServoFault
from study_app.haptics.model.layout import STATUS_OK
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load
from tests.compiled import needs_servo

pytestmark = needs_servo

OPENING = {
    "not-websocket": "not-websocket",
    "version-3.0": "version",
    "version-3.1": "version",
    "no-device": "no-device",
    "off": "not-ready",
    "uncalibrated": "uncalibrated",
    "in-use": "in-use",
    "gravity-off": "settings",
    "disobeys": "settings",
    "force-scale": "settings",
    "unknown-scale": "unknown-scale",
}
STREAM = {
    "late": "no-reply",
    "silent": "no-reply",
    "closes": "closed",
    "drops": "closed",
    "nan": "not-json",
    "null": "not-finite",
    "infinite": "not-finite",
    "bad-json": "not-json",
    "no-position": "no-position",
    "gone": "no-device",
    "power-off": "not-ready",
    "calibration-lost": "uncalibrated",
    "binary": "protocol",
    "masked": "protocol",
    "fragment": "protocol",
    "too-long": "protocol",
}
HARMLESS = ("slow", "torn")
STROKE_TICKS = 300


def stroke(servo: Servo, hand: Service) -> None:
    """Load honey, and go into the middle of a reach through it."""
    servo.load(load("rek2024").scene_for("honey"))
    servo.advance(800)
    hand.reach_to(0.04, 0.0, 0.0, duration_s=0.6)
    servo.advance(STROKE_TICKS)


def size_n(force_n: Any) -> float:
    return float(sum(axis * axis for axis in force_n) ** 0.5)


def test_the_table_has_every_fault() -> None:
    assert {*OPENING, *STREAM, *HARMLESS} == set(FAULTS)
    assert set(OPENING) == set(OF_OPENING)
    assert set(OF_STREAM) <= set(STREAM)


@pytest.mark.parametrize("fault", OPENING)
def test_a_fault_of_opening_is_refused_with_cause_and_cure_and_without_force(fault: str) -> None:
    service = Service()
    service.take(fault)
    device = EmulatedInverse3(service=service)
    with pytest.raises(DeviceFailure) as refused:
        device.open()
    mode = FAILURES.mode(OPENING[fault])
    assert refused.value.mode == mode.id
    message = str(refused.value)
    assert "\n" not in message
    assert mode.cause in message
    assert message.endswith(mode.cure)
    assert service.state.pushes == 0
    assert service.state.ended == 1
    assert size_n(service.force_n) == 0.0


@pytest.mark.parametrize("fault", STREAM)
def test_a_fault_in_a_stroke_ends_in_its_message_zero_force_and_silence(fault: str) -> None:
    service = Service(tremor_m=0.0)
    device = EmulatedInverse3(service=service)
    device.open()
    servo = Servo(device, clock=VirtualClock())
    stroke(servo, service)
    assert size_n(service.force_n) > 1.0
    service.take(fault)
    taken = servo.advance(100)
    assert taken < 60  # ended by the driver, or after 50 ms by the servo
    assert device.failure_mode == STREAM[fault]
    with pytest.raises((DeviceLost, ServoFault)) as ended:
        servo.check()
    mode = FAILURES.mode(STREAM[fault])
    message = str(ended.value)
    assert message.startswith("the device 'inverse3-emulated' stopped: ")
    assert mode.symptom in message
    assert mode.cure in message
    assert message.endswith("; the force is zero")
    assert size_n(service.force_n) == 0.0  # before anything is closed
    assert size_n(service.state.force_n) == 0.0
    pushes, commands = int(service.state.pushes), int(service.state.commands)
    servo.stop()
    device.close()
    assert service.state.pushes == pushes
    assert mode.id == "no-reply" or service.state.commands == commands  # the driver had ended the stream: silence
    assert size_n(service.force_n) == 0.0


def test_the_force_fades_at_the_handle_while_replies_stay_out() -> None:
    service = Service(tremor_m=0.0)
    with EmulatedInverse3(service=service) as device:
        servo = Servo(device, clock=VirtualClock())
        stroke(servo, service)
        before_n = size_n(service.force_n)
        service.take("silent")
        sizes_n = []
        while servo.advance(1):
            sizes_n.append(size_n(service.force_n))
        assert 45 < len(sizes_n) < 60
        assert sizes_n[4] == pytest.approx(before_n, rel=0.2)
        assert all(after <= before for before, after in itertools.pairwise(sizes_n[4:]))
        assert sizes_n[25] < 0.7 * before_n
        assert sizes_n[44] < 0.2 * before_n
        servo.stop()


@pytest.mark.parametrize("fault", HARMLESS)
def test_states_that_come_slowly_or_in_pieces_are_used_and_their_delay_is_measured(fault: str) -> None:
    service = Service(tremor_m=0.0)
    service.take(fault)
    with EmulatedInverse3(service=service) as device:
        servo = Servo(device, clock=VirtualClock())
        reader = servo.telemetry.reader()
        stroke(servo, service)
        samples = reader.read()
        assert (samples["status"] == STATUS_OK).all()
        assert samples["fresh"].mean() > 0.95
        assert samples["delay_ticks"][-1] == (2 if fault == "slow" else 1)
        assert size_n(service.force_n) > 1.0
        servo.stop()
    assert size_n(service.force_n) == 0.0


def test_an_unknown_fault_is_refused() -> None:
    with pytest.raises(DeviceError, match="fault 'thirst' is not known; choose of: not-websocket, "):
        Service().take("thirst")
