"""The whole driver in front of an emulated Falcon in another process."""

import json

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.falcon.emulator.emulator import Emulator
from study_app.devices.falcon.emulator.socket_server import EmulatorServer
from study_app.devices.falcon.homing import PULL_OUT, READY, STROKES
from study_app.devices.registry import open_device
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo

pytestmark = pytest.mark.slow


@pytest.fixture
def server(tmp_path):
    with EmulatorServer(Emulator(running=True), tmp_path / "falcon") as server:
        yield server


def test_the_servo_ticks_on_it_and_its_end_is_without_torque(server):
    told = []
    with open_device(f"falcon-socket:{server.path}", progress=told.append) as device:
        assert told == [STROKES, PULL_OUT, READY]
        described = device.describe()
        servo = Servo(device, clock=VirtualClock())  # as fast as replies come: no reply is late for a busy machine
        touch = servo.telemetry.reader()
        assert servo.advance(500) == 500
        assert servo.fault is None
        assert touch.read()["fresh"].sum() > 400
        servo.stop()
    assert described["name"] == "falcon-socket"
    assert str(server.path) not in json.dumps(described)
    assert server.emulator.torques == (0, 0, 0)
    assert server.emulator.lights == 0
