"""A Falcon whose guard process dies in use: without one nothing would end its torque, so it gets none."""

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.falcon.doctor.weighing import Grip
from study_app.devices.falcon.emulated import EmulatedFalcon
from study_app.devices.falcon.homing import PULL_OUT
from study_app.errors import DeviceLost
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW
from tests.devices.falcon.test_device import Ticks, still

pytestmark = pytest.mark.slow


def test_without_its_guard_it_does_not_push():
    device = EmulatedFalcon(emulator=still())
    device.guarded = True
    with device:
        ticks = Ticks(device)
        assert ticks.after(600, (1.0, 1.0, 1.0)) == READ_NEW
        assert device.hand.torques != (0, 0, 0)
        device.check()
        guard = device.guard
        guard.child.kill()
        guard.listener.join()
        assert ticks.after(2, (1.0, 1.0, 1.0)) == READ_LOST  # a packet takes its time
        assert device.hand.torques == (0, 0, 0)
        with pytest.raises(DeviceLost, match="guard process has died"):
            device.check()
        with pytest.raises(DeviceLost, match="guard process has died"):
            Grip(device, virtual=True)
    with device:  # opened anew it has a guard again
        device.check()
        assert Ticks(device, ticks.now_ns).after(600, (1.0, 1.0, 1.0)) == READ_NEW
        assert device.hand.torques != (0, 0, 0)
    device.check()  # which was dismissed, and did not die


def test_a_guard_that_dies_while_it_is_homed_ends_that():
    device = EmulatedFalcon(emulator=still(), progress=lambda line: kill() if line == PULL_OUT else None)
    device.guarded = True

    def kill():
        device.guard.child.kill()
        device.guard.listener.join()

    with pytest.raises(DeviceLost, match="guard process has died"):
        device.open()
    assert device.hand.highest_torque == 0
