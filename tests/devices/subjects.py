"""Every device of the program and the template, open, with control of its motors, operator and cable."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from study_app.devices.registry import open_device
from study_app.haptics.model.layout import new_command, new_reading

MS = 1_000_000
ZERO = (0.0, 0.0, 0.0)
PATIENCE_S = 10.0


def write(device: Any, force_n: Any = ZERO) -> tuple[int, Any]:
    """Command a force; return the device's answer, and the sent force as it reports it."""
    command = new_command()
    command[0].force_n = command[0].sent_n = force_n
    return _called(device.write, device.context, command.ctypes.data), command[0].sent_n.copy()


def _called(function: Any, *arguments: int) -> int:
    """Call a driver's function, which may be known by its address alone."""
    if hasattr(function, "ctypes"):
        return int(function.ctypes(*arguments))
    import ctypes

    return int(ctypes.CFUNCTYPE(ctypes.c_int32, *(ctypes.c_ssize_t,) * len(arguments))(function.address)(*arguments))


class Ticks:
    """Reads and writes a device as the servo does, 1 ms apart."""

    def __init__(self, device: Any, now_ns: int | None = None, pause_s: float = 0.0) -> None:
        self.device, self.reading, self._pause_s = device, new_reading(), pause_s
        exchange = getattr(device, "exchange", None)
        started_ns = 0 if exchange is None or device.name.startswith("falcon") else int(exchange.now_ns)
        self.now_ns = now_ns or max(started_ns, 10 * MS)

    def read(self, pause_ns: int = MS) -> int:
        """Return the answer of a reading."""
        self.now_ns += pause_ns
        self.reading[0].measured = 0
        return _called(self.device.read, self.device.context, self.now_ns, self.reading.ctypes.data)

    def take(self, force_n: Any = ZERO, pause_ns: int = MS) -> tuple[int, Any]:
        """Take a tick; return the answer of the reading, and the sent force as the device reports it."""
        answer = self.read(pause_ns)
        time.sleep(self._pause_s)
        return answer, write(self.device, force_n)[1]

    def after(self, ticks: int, force_n: Any = ZERO) -> int:
        """Return the answer of the last of this number of readings."""
        for _ in range(ticks):
            answer, _ = self.take(force_n)
        return answer

    @property
    def position_m(self) -> Any:
        return self.reading[0].position_m.copy()


@dataclass
class Subject:
    """An open device, with its motors' force in the hand frame [N] and its possible events."""

    device: Any
    acting_n: Callable[[], Any]
    lose: Callable[[], object]
    restore: Callable[[], object] = lambda: None
    press: Callable[[int], object] | None = None
    move: Callable[[], object] | None = None
    elapse: Callable[[], object] = lambda: None
    stroke_ticks: int = 300
    settle_ticks: int = 1
    exact_n: float = 1e-6
    pause_s: float = 0.0

    def ticks(self, now_ns: int | None = None) -> Ticks:
        return Ticks(self.device, now_ns, self.pause_s)

    def push(self, force_n: Any = (0.5, -1.0, 1.5)) -> Ticks:
        """Advance until a force acts fully; return the ticks."""
        ticks = self.ticks()
        ticks.after(self.settle_ticks, force_n)
        until(lambda: np.allclose(self.acting_n(), force_n, atol=self.exact_n), "the force is not sent")
        return ticks

    def is_quiet(self) -> bool:
        return not np.any(self.acting_n())


def until(reached: Callable[[], bool], what: str, seconds: float = PATIENCE_S) -> None:
    """Wait for a condition, which most devices fulfil at once."""
    began = time.perf_counter()
    while not reached():
        assert time.perf_counter() - began < seconds, what
        time.sleep(0.002)


def _simulated(name: str, **limits: Any) -> Subject:
    device: Any = open_device(name, **limits)
    hand = getattr(device, "hand", device)
    return Subject(
        device,
        lambda: hand.force_n,
        lose=getattr(device, "unplug", hand.release),
        press=hand.press,
        move=lambda: hand.reach_to(0.04, 0.0, 0.0, duration_s=0.6),
    )


def mouse(_request: Any, **limits: Any) -> Subject:
    subject = _simulated("mouse", **limits)
    subject.move, subject.stroke_ticks = lambda: subject.device.point_to(0.04, 0.0, 0.0), 30
    return subject


def scripted(_request: Any, **limits: Any) -> Subject:
    return _simulated("scripted", **limits)


def spacemouse(_request: Any, **limits: Any) -> Subject:
    from study_app.devices.spacemouse.device import SpaceMouseDevice
    from tests.devices.spacemouse.fake_hid import FakeHid

    hid = FakeHid()
    device = SpaceMouseDevice(hid=hid, now_s=hid.now_s, **limits)
    device.open()

    def lose() -> None:
        hid.gone.set()
        device.thread.join(PATIENCE_S)

    return Subject(
        device,
        lambda: device.force_n,
        lose=lose,
        restore=hid.gone.clear,
        press=lambda buttons: hid.say(bytes([3, buttons, 0])),
        move=lambda: device.point_to(0.04, 0.0, 0.0),
        stroke_ticks=30,
    )


def falcon(_request: Any, **limits: Any) -> Subject:
    subject = _simulated("falcon-emulated", **limits)
    faults = subject.device.hand.faults
    subject.lose, subject.restore = lambda: faults.on("unplugged"), lambda: faults.off("unplugged")
    subject.settle_ticks, subject.exact_n = 600, 0.02
    subject.elapse = lambda: subject.device.hand.pause(0.002)  # a packet takes its time
    return subject


def inverse3(_request: Any, **limits: Any) -> Subject:
    subject = _simulated("inverse3-emulated", **limits)
    subject.lose = subject.device.hand.disconnected
    return subject


def force_dimension(_request: Any, **limits: Any) -> Subject:
    subject = _simulated("force-dimension-emulated", **limits)
    emulated = subject.device.emulated

    def restore() -> None:
        emulated.state.fault = 0

    subject.lose, subject.restore = lambda: emulated.set_fault("error"), restore
    return subject


def force_dimension_library(request: pytest.FixtureRequest, **limits: Any) -> Subject:
    standin = request.getfixturevalue("standin")
    device = open_device("force-dimension", options={"dhd-library": standin.path}, **limits)
    return Subject(
        device,
        lambda: np.roll(standin.state["force_n"], -1),
        lose=lambda: standin.fault("error"),
        restore=lambda: standin.fault("none"),
        press=standin.loaded.standin_press,
        move=lambda: None,  # it moves by itself
    )


def _of_template(request: pytest.FixtureRequest, way: str, **limits: Any) -> Subject:
    request.getfixturevalue("template")
    device = open_device(f"example-{way}", **limits)
    import ctypes

    from liquid_study_example.driver import library

    def acting_n() -> Any:
        force = (ctypes.c_double * 3)()
        library().maker_force_now(force)
        return np.roll(force, -1)

    return Subject(device, acting_n, lose=library().maker_pull_cable, pause_s=0.002, exact_n=1e-9)


def template_direct(request: pytest.FixtureRequest, **limits: Any) -> Subject:
    return _of_template(request, "direct", **limits)


def template_mailbox(request: pytest.FixtureRequest, **limits: Any) -> Subject:
    return _of_template(request, "mailbox", **limits)


UNFELT = (mouse, scripted, spacemouse)
FELT = (falcon, inverse3, force_dimension, force_dimension_library, template_direct, template_mailbox)
MOVING = (*UNFELT, falcon, inverse3, force_dimension, force_dimension_library)


def over(*subjects: Callable[..., Subject]) -> pytest.MarkDecorator:
    """Parametrise a test over these devices."""
    return pytest.mark.parametrize(
        "make_subject", subjects, ids=[subject.__name__.replace("_", "-") for subject in subjects]
    )
