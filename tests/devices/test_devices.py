import json
import subprocess
import sys
from dataclasses import replace

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices import registry
from study_app.devices.registry import descriptor_of, list_devices, open_device
from study_app.errors import DeviceError, DeviceNotFound
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW, READ_NOTHING_NEW
from study_app.haptics.model.layout import new_reading
from tests.devices.contract import write

MS = 1_000_000


class Readings:
    """Reads a device as the servo would."""

    def __init__(self, device, start_ns=10 * MS):
        self.device, self.now_ns = device, start_ns
        self.reading = new_reading()

    def at(self, now_ns):
        self.now_ns = now_ns
        return self.device.read.ctypes(self.device.context, now_ns, self.reading.ctypes.data)

    def after(self, ticks):
        """Return answer after ``ticks`` of 1 ms; the last reading is in ``reading``."""
        for _ in range(ticks):
            answer = self.at(self.now_ns + MS)
        return answer

    @property
    def position_m(self):
        return self.reading[0].position_m.copy()


def test_the_mouse_is_the_default():
    assert list_devices()[0] == "mouse"


def test_a_device_without_failure_is_closed_and_named(monkeypatch):
    class Bare:
        closed = False

        def close(self):
            self.closed = True

    bare = Bare()
    monkeypatch.setattr(registry, "descriptor_of", lambda _: replace(descriptor_of("mouse"), open=lambda _: bare))
    with pytest.raises(DeviceError, match="device 'mouse' has no 'failure': let Bare inherit"):
        open_device("mouse")
    assert bare.closed


@pytest.mark.parametrize("name", ["mouse", "scripted"])
class TestEverySimulatedDevice:
    def test_is_what_its_name_opens(self, name):
        with open_device(name) as device:
            assert device.name == name
            assert device.describe()["name"] == name

    def test_can_be_described_in_a_receipt(self, name):
        described = open_device(name).describe()
        assert json.loads(json.dumps(described)) == described
        assert described["force_limit_n"] > 0

    def test_takes_its_workspace_and_force_limit_as_options(self, name):
        device = open_device(name, workspace_m=(0.04, 0.03, 0.02), force_limit_n=3.0)
        assert device.workspace_m == (0.04, 0.03, 0.02)
        assert device.force_limit_n == 3.0

    def test_has_a_new_sample_whenever_time_has_passed(self, name):
        readings = Readings(open_device(name))
        assert readings.at(10 * MS) == READ_NEW
        assert readings.at(10 * MS) == READ_NOTHING_NEW
        assert readings.at(11 * MS) == READ_NEW
        assert readings.at(5 * MS) == READ_NOTHING_NEW

    def test_is_pushed_by_the_force_written_to_it(self, name):
        device = open_device(name)
        readings = Readings(device)
        readings.after(1)
        assert write(device, (4.0, 0.0, -4.0))[0] == 0
        readings.after(300)
        assert readings.position_m[0] > 0.005
        assert readings.position_m[2] < -0.005
        assert abs(readings.position_m[1]) < 0.001

    def test_closing_takes_the_force_away(self, name):
        device = open_device(name)
        readings = Readings(device)
        readings.after(1)
        write(device, (4.0, 0.0, 0.0))
        device.close()
        readings.after(300)
        assert abs(readings.position_m[0]) < 0.001

    def test_unplugged_it_answers_no_more_until_it_is_opened_again(self, name):
        device = open_device(name)
        readings = Readings(device)
        device.unplug()
        assert readings.after(1) == READ_LOST
        assert write(device)[0] == READ_LOST
        device.open()
        assert readings.after(1) == READ_NEW

    def test_has_buttons(self, name):
        device = open_device(name)
        readings = Readings(device)
        device.press(0b1001)
        readings.after(1)
        assert readings.reading[0].buttons == 0b1001
        device.release()
        readings.after(1)
        assert readings.reading[0].buttons == 0

    def test_holds_a_place_within_its_workspace(self, name):
        device = open_device(name)
        readings = Readings(device)
        device.hold(0.02, -0.3, 0.0)
        readings.after(1000)
        assert readings.position_m == pytest.approx([0.02, -0.05, 0.0], abs=3e-4)
        assert device.aim_m == (0.02, -0.05, 0.0)
        assert not device.moving


def test_an_unknown_device_is_refused_with_those_there_are():
    with pytest.raises(DeviceNotFound, match="'falcn' is not known; choose one of: mouse, falcon, "):
        open_device("falcn")


@pytest.mark.parametrize("name", ["mouse:2", "falcon-emulated:x", "falcon-sockets:x", ":"])
def test_a_device_of_a_kind_that_has_but_one_is_not_known(name):
    with pytest.raises(DeviceNotFound, match="is not known"):
        descriptor_of(name)


def test_a_socket_needs_its_path():
    with pytest.raises(DeviceNotFound, match="falcon-socket:PATH"):
        open_device("falcon-socket")
    assert descriptor_of("falcon-socket:/run/falcon:1").name == "falcon-socket"


@pytest.mark.parametrize(
    ("name", "firmware", "by_itself", "simulated"),
    [
        ("mouse", False, False, False),
        ("falcon", True, False, False),
        ("falcon:FT1", True, False, False),
        ("spacemouse", False, False, False),
        ("scripted", False, True, True),
        ("falcon-emulated", True, True, True),
        ("falcon-socket:/x", True, False, True),
    ],
)
def test_who_holds_a_device_follows_from_its_name(name, firmware, by_itself, simulated):
    device = descriptor_of(name)
    assert [option.name for option in device.options] == ["firmware"] * firmware
    assert (device.doctor is not None, device.moves_by_itself, device.simulated) == (firmware, by_itself, simulated)


@pytest.mark.slow
def test_naming_the_devices_loads_no_compiler():
    program = "import sys, study_app.devices.registry as d; d.list_devices(); sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
