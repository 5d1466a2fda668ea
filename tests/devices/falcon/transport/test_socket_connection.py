"""The whole driver in front of an emulated Falcon in another process, in real time, and its guard."""

import json
import signal
import subprocess
import sys

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

PUSHES_AND_DIES = """
import os, signal, sys, time
from study_app.devices.registry import open_device
from study_app.haptics.model.layout import new_command, new_reading
device, reading, command = open_device(sys.argv[1]), new_reading(), new_command()
command[0].force_n = (0.0, 0.0, 2.0)
ticks = 0
while abs(device.held[1]).max() < 100 and ticks < 20_000:
    ticks += 1
    device.read.ctypes(device.context, time.monotonic_ns(), reading.ctypes.data)
    device.write.ctypes(device.context, command.ctypes.data)
    device.transport.pause(0.001)
print(device.guard.watching, flush=True)
os.kill(os.getpid(), getattr(signal, sys.argv[2]))
"""


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


@pytest.mark.parametrize("how", ["SIGKILL", "SIGSEGV"])
def test_a_program_that_dies_pushing_is_quietened_by_its_guard(server, how):
    command = [sys.executable, "-c", PUSHES_AND_DIES, f"falcon-socket:{server.path}", how]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # until its guard has gone, too
    assert ended.returncode == -getattr(signal, how), ended.stderr
    assert ended.stdout == "True\n"
    assert server.emulator.highest_torque >= 100
    assert server.emulator.torques == (0, 0, 0)
    assert server.emulator.homed == 0b111
