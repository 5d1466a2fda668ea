"""Whether a stop of the force is ever lost: python tests/benchmarks/devices/stops.py [DEVICE ...] [--minutes M].

DEVICE is inverse3 (its driver over TCP, against the emulated service), falcon (its driver on the emulated bus) or
force-dimension (its driver with emulated library functions); by default all, 30 minutes each.

The servo runs at 1 kHz under the painting windows of a session, while a simulated hand reaches back and forth in honey.
About once a second the force is stopped in mid-stroke; every fifth time the servo is stopped, and started again. A stop
is lost where the device has a force later than 50 ms after it, or where a stopped servo sends commands. The last line
of each device is its verdict; exit code 3 where one has failed.
"""

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from study_app.devices.driver import FramedDevice
from study_app.devices.emulators.falcon import EmulatedFalcon
from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.emulators.inverse3_service import Service
from study_app.devices.hand import HandOrders
from study_app.devices.registry import open_device
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load
from tests.devices.inverse3.server import ServiceServer

IN_FORCE_S = 0.05
WATCHED_S = 0.15
LOOK_S = 0.005
STROKE_S = 0.8
EVERY = 5
NOISE_N = 0.5


class Stand(NamedTuple):
    """An open device, the hand on it, the force on the handle (with or without servo), and the commands so far."""

    device: FramedDevice
    hand: HandOrders
    acting: Callable[[bool], Any]
    commands: Callable[[], int]


@contextmanager
def inverse3() -> Iterator[Stand]:
    service = Service()
    with ServiceServer(service) as server, open_device(f"inverse3:127.0.0.1:{server.port}") as device:
        yield Stand(device, service, lambda _: service.force_n, lambda: int(service.state.commands))


@contextmanager
def falcon() -> Iterator[Stand]:
    emulator = Emulator(running=True)

    def acting(ticking: bool) -> Any:
        return emulator.torques if ticking else device.held[1]  # without ticks the emulator's time stands still

    with EmulatedFalcon(emulator=emulator) as device:
        yield Stand(device, emulator, acting, lambda: device.counters["requests"])


@contextmanager
def force_dimension() -> Iterator[Stand]:
    with open_device("force-dimension-emulated") as device:
        hand = device.hand
        yield Stand(device, hand, lambda _: hand.force_n, lambda: int(hand.state.handle.written))


STANDS = {"inverse3": inverse3, "falcon": falcon, "force-dimension": force_dimension}


@dataclass(slots=True)
class Found:
    """Counts of stops and their faults; ``lateness_us`` are p50 and p99 of the servo's ticks."""

    stops: int = 0
    servo_stops: int = 0
    under_force: int = 0  # stops with more than `NOISE_N` commanded
    lost: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    lateness_us: tuple[float, float] = (0.0, 0.0)
    frames: int = 0

    @property
    def verdict(self) -> str:
        """Return the result in one line."""
        if self.lost or self.faults:
            return f"FAILED: {len(self.lost)} stops lost, {len(self.faults)} faults"
        if self.under_force == 0:
            return "FAILED: no stop was under force"
        return f"PASSED: none of {self.stops} stops lost"


def stop_again_and_again(name: str, seconds: float) -> Found:
    """Stop the force of a device repeatedly for some seconds; return the findings."""
    findings = Found()
    with STANDS[name]() as stand:
        servo = Servo(stand.device)
        servo.start()
        late: list[float] = []
        scene = load("rek2024").scene_for("honey")
        end, side = time.perf_counter() + seconds, 1.0
        while time.perf_counter() < end and not findings.faults:
            reader = servo.telemetry.reader()
            servo.load(scene)
            servo.fade_in()
            stand.hand.reach_to(0.04 * side, 0.0, 0.01, duration_s=1.2)
            side = -side
            time.sleep(STROKE_S)
            samples = reader.read()
            findings.under_force += int(np.linalg.norm(samples["device_force_n"][-1]) > NOISE_N)
            late += list(np.percentile(samples["lateness_ns"], [50, 99]) / 1e3)
            whole = findings.stops % EVERY == EVERY - 1
            findings.stops += 1
            findings.servo_stops += whole
            _stop(servo, stand, findings, whole=whole)
            if servo.fault is not None:
                findings.faults.append(servo.fault)
            if whole:
                servo.start()
        servo.stop()
    findings.lateness_us = (float(np.median(late[::2])), float(np.median(late[1::2])))
    return findings


def _stop(servo: Servo, stand: Stand, found: Found, *, whole: bool) -> None:
    (servo.stop if whole else servo.stop_force)()
    time.sleep(IN_FORCE_S)
    reader, commands = servo.telemetry.reader(), stand.commands()
    end = time.perf_counter() + WATCHED_S - IN_FORCE_S
    while time.perf_counter() < end:
        acting = stand.acting(not whole)
        if any(acting):
            found.lost.append(f"stop {found.stops}: {acting} acts")
            return
        time.sleep(LOOK_S)
    if not whole and reader.read()["device_force_n"].any():
        found.lost.append(f"stop {found.stops}: the servo sent a force")
    if whole and stand.commands() != commands:
        found.lost.append(f"stop {found.stops}: {stand.commands() - commands} commands of a stopped servo")


def under_windows(name: str, seconds: float) -> Found:
    """Return the findings while both windows of a session paint."""
    from study_app.app.delay_session import WindowsThread

    windows = WindowsThread("gui")
    findings = windows.during(lambda: stop_again_and_again(name, seconds))
    findings.frames = windows.frames
    return findings


def main(names: list[str], minutes: float) -> int:
    """Run, print, and return the exit code."""
    if sys.platform == "linux" and not any(map(os.environ.get, ("QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"))):
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    failed = False
    for name in names:
        findings = under_windows(name, 60.0 * minutes)
        print(
            f"{name}: {findings.stops} stops, {findings.under_force} under force, {findings.servo_stops} of the servo"
        )
        p50_us, p99_us = findings.lateness_us
        print(f"{findings.frames} frames painted; lateness p50 {p50_us:.0f} us, p99 {p99_us:.0f} us")
        print(*findings.lost, *findings.faults, f"{name}: {findings.verdict}", sep="\n", flush=True)
        failed = failed or not findings.verdict.startswith("PASSED")
    return 3 if failed else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("devices", nargs="*", metavar="DEVICE", help=", ".join(STANDS))
    parser.add_argument("--minutes", type=float, default=30.0)
    given = parser.parse_args()
    for unknown in set(given.devices) - set(STANDS):
        parser.error(f"{unknown} is not one of {', '.join(STANDS)}")
    if not given.minutes > 0.0:
        parser.error(f"--minutes must be above 0, not {given.minutes:g}")
    sys.exit(main(given.devices or list(STANDS), given.minutes))
