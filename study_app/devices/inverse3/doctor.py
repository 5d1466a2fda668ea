"""An Inverse3 looked over: its service and device found, opened with neutral settings, run at 1 kHz, and let go of.

Everything is done by the driver that a session uses, so what fails there fails here; `failures` has cause and cure.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from study_app.devices.doctor_report import Report
from study_app.devices.doctor_run import LEAST_HZ, MOVE, SECONDS, fresh_rate_hz, run_at_rest
from study_app.devices.failure_table import DeviceFailure
from study_app.devices.inverse3.device import Inverse3Device
from study_app.devices.inverse3.emulated import EmulatedInverse3
from study_app.devices.inverse3.emulator.service import Service
from study_app.devices.inverse3.failures import FAILURES
from study_app.errors import DeviceError

_FAULT_AFTER = 1000  # commands
_OPENED: Final = frozenset(
    {
        "no-service",
        "not-websocket",
        "version",
        "no-device",
        "not-ready",
        "uncalibrated",
        "in-use",
        "settings",
    }
)


def examine(
    name: str, *, faults: Sequence[str] = (), progress: Callable[[str], object], seconds: float = SECONDS
) -> Report:
    """Look an Inverse3 over.

    Parameters
    ----------
    name : "inverse3", "inverse3:…" or "inverse3-emulated"
    faults : of an emulated one: words of ``emulator.faults.FAULTS``
    progress : is given what to do, a line at a time
    seconds : how long it is run

    Raises
    ------
    DeviceError
        It cannot have faults.
    """
    device = _device(name, faults, progress)
    try:
        device.open()
    except DeviceFailure as failed:
        return Report((), FAILURES.findings(failed.mode, _before(failed.mode)), str(failed))
    with device:
        progress(MOVE)
        samples, fault = run_at_rest(device, seconds)
        mode = device.failure_mode
    fresh_hz = fresh_rate_hz(samples)
    if mode is None and fresh_hz < LEAST_HZ:
        mode = "rate"
    passed = {one.id for one in FAILURES.modes} - {mode} if fault is None else _OPENED - {mode}
    return Report(_words(device, fresh_hz), FAILURES.findings(mode, passed), fault)


def _device(name: str, faults: Sequence[str], progress: Callable[[str], object]) -> Inverse3Device:
    if name != "inverse3-emulated":
        if faults:
            raise DeviceError(f"'{name}' cannot be given faults: only inverse3-emulated can")
        return Inverse3Device(name.partition(":")[2], progress=progress)
    service = Service()
    for fault in faults:
        service.take(fault, _FAULT_AFTER)
    return EmulatedInverse3(progress=progress, service=service)


def _before(mode: str) -> set[str]:
    """Return the ids of what was tested before a device was refused for ``mode``."""
    ids = [one.id for one in FAILURES.modes if one.id in _OPENED]
    return set(ids[: ids.index(mode)]) if mode in ids else set()


def _words(device: Inverse3Device, fresh_hz: float) -> tuple[str, ...]:
    """Return what is worth reading of what was seen."""
    found = device.describe()
    settings = found["service_settings"]
    scale = found["force_scale"]
    return (
        f"opened, device {found['device_id']}, round trip {found['round_trip_ms']:.2f} ms",
        f"settings {'confirmed' if settings['confirmed'] else 'not confirmed by the service'}",
        "force scale: " + ("not reported by the service: it must be 1" if scale is None else f"{scale:g}"),
        f"new positions per second: {fresh_hz:.0f}",
    )
