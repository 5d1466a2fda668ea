"""An Inverse3 looked over: its service and device found, opened with neutral settings, run at 1 kHz, and let go of.

Everything is done by the driver that a session uses, so what fails there fails here; `failures` has cause and cure.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from study_app.devices.doctor_report import Report
from study_app.devices.doctor_run import SECONDS, examine_by_table
from study_app.devices.inverse3.device import Inverse3Device
from study_app.devices.inverse3.emulated import EmulatedInverse3
from study_app.devices.inverse3.emulator.service import Service
from study_app.devices.inverse3.failures import FAILURES
from study_app.errors import DeviceError

_FAULT_AFTER = 1000  # commands


def examine(
    name: str,
    *,
    options: Mapping[str, str | Path] | None = None,
    faults: Sequence[str] = (),
    progress: Callable[[str], object],
    seconds: float = SECONDS,
) -> Report:
    """Look an Inverse3 over.

    Parameters
    ----------
    name : "inverse3", "inverse3:…" or "inverse3-emulated"
    faults : of an emulated one: words of ``emulator.faults.FAULTS``
    progress : is given what to do, a line at a time
    seconds : how long it is run
    """
    device = _device(name, faults, progress)
    return examine_by_table(device, FAILURES, _words, running="no-reply", progress=progress, seconds=seconds)


def _device(name: str, faults: Sequence[str], progress: Callable[[str], object]) -> Inverse3Device:
    if name != "inverse3-emulated":
        if faults:
            raise DeviceError(f"'{name}' cannot be given faults: only inverse3-emulated can")
        return Inverse3Device(name.partition(":")[2], progress=progress)
    service = Service()
    for fault in faults:
        service.take(fault, _FAULT_AFTER)
    return EmulatedInverse3(progress=progress, service=service)


def _words(device: Inverse3Device, fresh_hz: float) -> tuple[str, ...]:
    """Return what is worth reading of what was seen."""
    found = device.describe()
    settings = found["service_settings"]
    return (
        f"opened, device {found['device_id']}, round trip {found['round_trip_ms']:.2f} ms",
        f"settings {'confirmed' if settings['confirmed'] else 'not confirmed by the service'}",
        f"force scale: {found['force_scale']:g}",
        f"new positions per second: {fresh_hz:.0f}",
    )
