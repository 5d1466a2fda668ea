"""Diagnosis of a Falcon: find it, open it, run its program, home it, and run it for some seconds without force.

It uses the driver of sessions, so that the same failures appear; `examine` returns the observations, which
``failure_modes`` interprets.
"""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from study_app.devices.doctor_report import Report
from study_app.devices.falcon.device import FalconDevice
from study_app.devices.falcon.doctor.failure_report import findings_of
from study_app.devices.falcon.emulated import EmulatedFalcon, new_emulator
from study_app.devices.falcon.emulator.emulator import Emulator
from study_app.devices.falcon.failures import ALL_HOMED, OPEN, Facts, FalconFailure, UsbFailure
from study_app.devices.falcon.mechanics.geometry import WORKSPACE_M
from study_app.devices.falcon.transport.ftdi import FtdiTransport, load_d2xx
from study_app.devices.falcon.transport.usb import find_falcons
from study_app.errors import DeviceError, DeviceLost, ServoFault
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.haptics.runtime.telemetry import timing

SECONDS: Final = 3.0
EMULATED_PATIENCE_S: Final = 5.0
MOVE: Final = "Hold the grip and move it a little …"
_STILL_M = 5e-6  # a third of the least effect of one encoder count
_BEGIN = 100  # samples until positions are those of the grip
_CHUNK_S = 0.25  # the telemetry stores less than is examined


@dataclass(frozen=True, slots=True)
class Examined:
    """The observations: ``facts``, the driver's failure (None: there was none), and ``seen``, in words."""

    facts: Facts
    failure: str | None
    seen: tuple[str, ...]


def examine_device(
    name: str, *, options: Mapping[str, str | Path], faults: Sequence[str] = (), progress: Callable[[str], object]
) -> Report:
    """Examine a Falcon for its `Doctor`; see `examine`."""
    firmware = options.get("firmware")
    found = examine(name, firmware=None if firmware is None else Path(firmware), faults=faults, progress=progress)
    return Report(found.seen, findings_of(found.facts), found.failure)


def examine(
    name: str,
    *,
    firmware: Path | None = None,
    faults: Sequence[str] = (),
    progress: Callable[[str], object],
    seconds: float = SECONDS,
    emulator: Emulator | None = None,
) -> Examined:
    """Examine a Falcon.

    Parameters
    ----------
    name : "falcon", "falcon:SERIAL", "falcon-emulated" or "falcon-socket:PATH"
    firmware : file of its program
    faults : of an emulated one, as ``Emulator.take`` takes them
    progress : receives instructions, one line at a time
    seconds : duration of the run
    emulator : the emulated one; None: a new one
    """
    device = _device(name, firmware, faults, progress, emulator)
    facts = _looked_for() if name.partition(":")[0] == "falcon" else Facts()
    try:
        device.open()
    except FalconFailure as failure:
        facts = _merged(_merged(facts, _opened(device)), failure.facts)
        device.close()
        return Examined(facts, str(failure), _words(device, facts))
    with device:
        facts = _merged(facts, _opened(device))
        facts = _merged(facts, Facts(replies=True, homed=ALL_HOMED, pulled_out=True))
        progress(MOVE)
        ran, failure_text = _ran(device, seconds)
        facts = _merged(facts, ran)
        return Examined(facts, failure_text, _words(device, facts))


def _device(
    name: str,
    firmware: Path | None,
    faults: Sequence[str],
    progress: Callable[[str], object],
    emulator: Emulator | None,
) -> FalconDevice:
    if name != "falcon-emulated":
        if faults:
            raise DeviceError(
                f"'{name}' cannot be given faults: only falcon-emulated can, or emulate-falcon at its end"
            )
        return FalconDevice(name, firmware=firmware, progress=progress)
    emulator = emulator if emulator is not None else new_emulator(None, firmware, WORKSPACE_M)
    for fault in faults:
        emulator.take(fault)
    return EmulatedFalcon(firmware=firmware, progress=progress, emulator=emulator, patience_s=EMULATED_PATIENCE_S)


def _looked_for() -> Facts:
    """Return what the system's lists of devices show, without opening one."""
    import libusb_package  # noqa: PLC0415 - only for a real one

    backend = libusb_package.get_libusb1_backend()
    if backend is None:
        return Facts(usb="no-backend")
    facts = Facts(listed=bool(find_falcons(backend)))
    return replace(facts, ftdi_sees=ftdi_sees()) if sys.platform == "win32" else facts


def ftdi_sees(library: Any = None) -> bool | None:
    """Return whether FTDI's driver has a Falcon; None where its library cannot be loaded."""
    try:
        library = load_d2xx() if library is None else library
        FtdiTransport(library).close()
    except UsbFailure as failure:
        return {"no-ftd2xx": None, "not-found": False}.get(failure.kind, True)
    return True


def _opened(device: FalconDevice) -> Facts:
    """Return the observations until it was homed."""
    found = device.describe()
    if "firmware" not in found:
        return Facts()
    trips = found.get("round_trip_ms")
    return Facts(
        usb=OPEN,
        program="running" if found["firmware"] == "already running" else "loaded",
        round_trip_s=None if trips is None else min(trips.values()) / 1000,
    )


def _ran(device: FalconDevice, seconds: float) -> tuple[Facts, str | None]:
    """Run it at rest, and return the observations, and the servo's fault, if it stopped itself."""
    emulated = isinstance(device, EmulatedFalcon)
    clock = VirtualClock() if emulated else None
    kept: list[Any] = []
    with Servo(device, clock=clock) as servo:
        reader = servo.telemetry.reader()
        for _ in range(max(round(seconds / _CHUNK_S), 1)):
            if isinstance(device, EmulatedFalcon):
                device.hand.reach_to(0.01 * (-1) ** len(kept), 0.005, 0.0)
                servo.advance(round(_CHUNK_S * servo.rate_hz))
            else:
                time.sleep(_CHUNK_S)
            kept.append(reader.read())
        failure = None
        lost = False
        try:
            servo.check()
        except (DeviceLost, ServoFault) as fault:
            failure, lost = str(fault), isinstance(fault, DeviceLost)
        rate_hz = servo.rate_hz
    samples = np.concatenate(kept)[_BEGIN:]
    counters = device.counters
    asked = max(counters["requests"], 1)
    facts = Facts(
        usb="no-device" if lost else OPEN,
        replies=counters["replies"] > 0,
        moved=bool(np.ptp(samples["position_m"], axis=0).max() > _STILL_M) if len(samples) else None,
        broken_share=max(counters["requests"] - counters["replies"] - 1, 0) / asked,
        rate_hz=None if emulated else timing(samples.view(np.recarray), rate_hz).rate_hz or None,
    )
    return facts, failure


def _merged(facts: Facts, newer: Facts) -> Facts:
    """Return all observations; later ones override earlier ones."""
    seen = {field.name: getattr(newer, field.name) for field in fields(Facts) if getattr(newer, field.name) is not None}
    return replace(facts, **seen)


def _words(device: FalconDevice, facts: Facts) -> tuple[str, ...]:
    """Return the main observations in words."""
    found = device.describe()
    words = []
    if facts.usb == OPEN:
        number = found.get("serial")
        words.append(f"opened, serial number {number}" if number else "opened")
    if "firmware" in found:
        words.append(f"program: {found['firmware']}")
    if facts.round_trip_s is not None:
        kept = "kept" if found["event_character"] else "of no use"
        words.append(f"round trip {1000 * facts.round_trip_s:.2f} ms; event character {kept}")
        used = found["calibration"]
        words.append(f"calibration: {used['measured'] if isinstance(used, dict) else 'none'}")
    if facts.broken_share is not None:
        words.append(f"incomplete replies: {facts.broken_share:.2%}")
    if facts.rate_hz is not None:
        words.append(f"ticks per second: {facts.rate_hz:.0f}")
    return tuple(words)
