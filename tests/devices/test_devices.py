"""Opening devices by name, alone and together with a servo; simulated devices and their hand."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from study_app.devices import registry, rig
from study_app.devices.registry import descriptor_of, open_device
from study_app.errors import DeviceError, DeviceNotFound
from study_app.haptics.kernels.c_functions import READ_NEW, READ_NOTHING_NEW
from study_app.protocol.randomization.streams import stream
from tests.compiled import needs_servo
from tests.devices.subjects import MS, Ticks, write

SETTINGS = rig.RigSettings(workspace_m=(0.1, 0.06, 0.06), force_limit_n=8.0, elements=100, random=stream(1, "tremor"))


def test_a_device_without_the_parts_of_a_device_is_closed_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    class Bare:
        closed = False

        def close(self) -> None:
            self.closed = True

    bare: Any = Bare()
    monkeypatch.setattr(registry, "descriptor_of", lambda _: replace(descriptor_of("mouse"), open=lambda _: bare))
    with pytest.raises(DeviceError, match="device 'mouse' does not have 'read': derive Bare from"):
        open_device("mouse")
    assert bare.closed


@pytest.mark.usefixtures("falcon_socket")
def test_an_incomplete_name_is_refused_with_the_missing_part() -> None:
    with pytest.raises(DeviceNotFound, match="falcon-socket:PATH"):
        open_device("falcon-socket")


@pytest.mark.slow
def test_naming_the_devices_loads_no_compiler() -> None:
    program = "import sys, study_app.devices.registry as d; d.list_devices(); sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def is_cancelled(devices: list[Any]) -> Callable[[], bool]:
    return lambda: bool(devices)


def failing_callback(_devices: list[Any]) -> Callable[[], bool]:
    def fail() -> bool:
        raise RuntimeError("the window is gone")

    return fail


@needs_servo
@pytest.mark.parametrize(
    ("ask", "error", "words"),
    [(is_cancelled, DeviceError, "'scripted' was cancelled"), (failing_callback, RuntimeError, "the window is gone")],
)
def test_a_device_cancelled_while_it_opens_is_closed_and_gets_no_servo(
    ask: Any, error: type[Exception], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    devices: list[Any] = []
    closed: list[str] = []
    open_before = rig.open_device

    def open_and_watch(*words: Any, **named: Any) -> Any:
        device = open_before(*words, **named)
        devices.append(device)
        monkeypatch.setattr(device, "close", lambda: closed.append(device.name))
        return device

    monkeypatch.setattr(rig, "open_device", open_and_watch)
    with pytest.raises(error, match=words):
        rig.open_rig("scripted", SETTINGS, cancelled=ask(devices))
    assert closed == ["scripted"]


@needs_servo
@pytest.mark.parametrize("name", ["mouse", "scripted"])
def test_the_hand_of_a_simulated_device_is_pushed_holds_a_place_and_lets_go(name: str) -> None:
    device: Any = open_device(name)
    ticks = Ticks(device)
    assert [ticks.read(pause_ns) for pause_ns in (0, 0, MS, -6 * MS)] == [
        READ_NEW, READ_NOTHING_NEW, READ_NEW, READ_NOTHING_NEW,
    ]  # fmt: skip
    write(device, (4.0, 0.0, -4.0))
    for _ in range(300):
        ticks.read()
    assert ticks.position_m[0] > 0.005
    assert ticks.position_m[2] < -0.005
    assert abs(ticks.position_m[1]) < 0.001
    device.close()
    for _ in range(300):
        ticks.read()
    assert abs(ticks.position_m[0]) < 0.001
    device.hold(0.02, -0.3, 0.0)
    ticks.after(1000)
    assert ticks.position_m == pytest.approx([0.02, -0.05, 0.0], abs=3e-4)
    assert device.aim_m == (0.02, -0.05, 0.0)
    assert not device.moving
