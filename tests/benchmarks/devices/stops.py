"""Whether a stop is ever lost: python tests/benchmarks/devices/stops.py [MINUTES] runs 30 minutes by default.

The Inverse3's driver runs at 1 kHz over TCP against the emulated service, under the painting windows of a session,
while a simulated hand reaches to and fro in honey. About once a second the force is stopped in mid-stroke; every fifth
time the servo is stopped, and started again. A stop is lost where the service is commanded a force later than 50 ms
after it, or where a stopped servo is not silent. The last line names what was lost; exit code 3 where something was.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass, field

import numpy as np

from study_app.devices.inverse3.device import Inverse3Device
from study_app.devices.inverse3.emulator.server import ServiceServer
from study_app.devices.inverse3.emulator.service import Service
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load

IN_FORCE_S = 0.05
WATCHED_S = 0.15
STROKE_S = 0.8
EVERY = 5


@dataclass(slots=True)
class Found:
    """Counts of stops, and what was wrong of them; ``lateness_us`` are p50 and p99 of the servo's ticks."""

    stops: int = 0
    servo_stops: int = 0
    under_force: int = 0  # stops with more than 0.5 N on the handle
    lost: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    lateness_us: tuple[float, float] = (0.0, 0.0)
    frames: int = 0


def stop_again_and_again(seconds: float) -> Found:
    """Return what was found in so many seconds."""
    found, service = Found(), Service()
    with ServiceServer(service) as server, Inverse3Device(f"127.0.0.1:{server.port}") as device:
        servo = Servo(device)
        servo.start()
        late: list[float] = []
        scene = load("rek2024").scene_for("honey")
        end, side = time.monotonic() + seconds, 1.0
        while time.monotonic() < end and not found.faults:
            reader = servo.telemetry.reader()
            servo.load(scene)
            servo.fade_in()
            service.reach_to(0.04 * side, 0.0, 0.01, duration_s=1.2)
            side = -side
            time.sleep(STROKE_S)
            found.under_force += int(np.linalg.norm(service.force_n) > 0.5)
            late += list(np.percentile(reader.read()["lateness_ns"], [50, 99]) / 1e3)
            whole = found.stops % EVERY == EVERY - 1
            found.stops += 1
            found.servo_stops += whole
            _stop(servo, service, found, whole=whole)
            if servo.fault is not None:
                found.faults.append(servo.fault)
            if whole:
                servo.start()
        servo.stop()
    found.lateness_us = (float(np.median(late[::2])), float(np.median(late[1::2])))
    return found


def _stop(servo: Servo, service: Service, found: Found, *, whole: bool) -> None:
    (servo.stop if whole else servo.stop_force)()
    time.sleep(IN_FORCE_S)
    pushes, commands = int(service.state.pushes), int(service.state.commands)
    time.sleep(WATCHED_S - IN_FORCE_S)
    if service.state.pushes != pushes or service.force_n != (0.0, 0.0, 0.0):
        found.lost.append(f"stop {found.stops}: {service.force_n} N")
    if whole and service.state.commands != commands:
        found.lost.append(f"stop {found.stops}: {service.state.commands - commands} commands of a stopped servo")


def under_windows(seconds: float) -> Found:
    """Return what was found while both windows of a session paint."""
    from study_app.app.windows_load import lend

    windows = lend("gui")
    found = windows.during(lambda: stop_again_and_again(seconds))
    found.frames = windows.frames
    return found


def main(minutes: float) -> int:
    """Run, print, and return the exit code."""
    if sys.platform == "linux" and not any(map(os.environ.get, ("QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"))):
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    found = under_windows(60.0 * minutes)
    print(f"{found.stops} stops, {found.under_force} of them under force, {found.servo_stops} of the servo")
    print(
        f"{found.frames} frames painted; lateness p50 {found.lateness_us[0]:.0f} us, p99 {found.lateness_us[1]:.0f} us"
    )
    print(f"lost stops: {len(found.lost)}; faults: {len(found.faults)}", *found.lost, *found.faults, sep="\n")
    return 3 if found.lost or found.faults else 0


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 30.0))
