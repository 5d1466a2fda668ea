"""A Falcon that is closed while a servo's loop hangs in its bridge."""

import ctypes
import threading

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices import call_gate
from study_app.devices.falcon.emulated import EmulatedFalcon
from study_app.devices.falcon.emulator.emulator import Emulator
from study_app.devices.falcon.wire.constants import ENDPOINT_IN, ERROR_TIMEOUT
from study_app.errors import ServoFault
from study_app.haptics.kernels.c_functions import READ_LOST
from study_app.haptics.runtime import thread
from study_app.haptics.runtime.servo import Servo
from tests.devices.falcon.support.scripted_bridge import BULK_CALL, torques_in

pytestmark = pytest.mark.slow


class HangingBridge:
    """Takes packets; a read from it does not end before ``release`` is set."""

    def __init__(self):
        self.entered, self.release = threading.Event(), threading.Event()
        self.sent = []
        self._function = BULK_CALL(self._transfer)
        self.address = ctypes.cast(self._function, ctypes.c_void_p).value

    def _transfer(self, _handle, endpoint, data, length, transferred, _timeout_ms):
        moved = ctypes.c_int32.from_address(transferred)
        moved.value = 0
        if endpoint == ENDPOINT_IN:
            self.entered.set()
            self.release.wait()
            return ERROR_TIMEOUT  # whereupon the exchange reads once more
        moved.value = length
        self.sent.append(ctypes.string_at(data, length))
        return 0


def test_a_loop_that_hangs_finds_its_bridge_as_it_was_and_ends_the_force(monkeypatch):
    monkeypatch.setattr(thread, "_PATIENCE_S", 0.2)
    monkeypatch.setattr(call_gate, "LEAVE_S", 0.05)
    device, bridge = EmulatedFalcon(emulator=Emulator(running=True, tremor_m=0.0)), HangingBridge()
    device.open()
    servo = Servo(device)
    servo.prepare()
    device.falcon.transfer = bridge.address
    servo.start()
    assert bridge.entered.wait(30)
    bridge.sent.clear()
    turning = servo.loop.thread
    with pytest.raises(ServoFault, match="turn it off"):
        servo.stop()
    device.close()
    assert device.falcon.transfer == bridge.address, "what the loop calls next"
    device.transport.write(b"", 0.1)  # and its transport is open
    assert bridge.sent == []
    bridge.release.set()
    turning.join(30)
    assert not turning.is_alive()
    assert torques_in(bridge.sent[-1]) == [0, 0, 0]
    servo.stop()
    device.close()
    assert device.transport is None
    assert device.read.ctypes(device.context, 0, device.reading.ctypes.data) == READ_LOST
