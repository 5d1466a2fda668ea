"""A Force Dimension device looked over: library and device found, opened and checked, run at 1 kHz, and let go of.

Everything is done by the driver that a session uses, so what fails there fails here; `failures` has cause and cure.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from study_app.devices.doctor_report import Report
from study_app.devices.doctor_run import SECONDS, examine_by_table
from study_app.devices.force_dimension.device import ForceDimensionDevice
from study_app.devices.force_dimension.emulated import EmulatedForceDimension
from study_app.devices.force_dimension.failures import FAILURES, OPTION
from study_app.errors import DeviceError

_FAULT_AFTER = 1000  # readings


def examine(
    name: str,
    *,
    options: Mapping[str, str | Path] | None = None,
    faults: Sequence[str] = (),
    progress: Callable[[str], object],
    seconds: float = SECONDS,
) -> Report:
    """Look a device over.

    Parameters
    ----------
    name : "force-dimension", "force-dimension:SERIAL" or "force-dimension-emulated"
    options : values of its options, by name
    faults : of an emulated one: words of ``emulated.FAULTS``
    progress : is given what to do, a line at a time
    seconds : how long it is run
    """
    device = _device(name, options or {}, faults)
    return examine_by_table(device, FAILURES, _words, running="error", progress=progress, seconds=seconds)


def _device(name: str, options: Mapping[str, str | Path], faults: Sequence[str]) -> ForceDimensionDevice:
    if name != EmulatedForceDimension.name:
        if faults:
            raise DeviceError(f"'{name}' cannot be given faults: only {EmulatedForceDimension.name} can")
        return ForceDimensionDevice(name.partition(":")[2], library=options.get(OPTION))
    device = EmulatedForceDimension()
    for fault in faults:
        device.emulated.take(fault, _FAULT_AFTER)
    return device


def _words(device: ForceDimensionDevice, fresh_hz: float) -> tuple[str, ...]:
    """Return what is worth reading of what was seen."""
    found, counters = device.describe(), device.counters
    watchdog_s = found.get("watchdog_s")
    return (
        f"opened: {found['system']}, serial number {found.get('serial')}, SDK {found['sdk']}",
        f"velocity threshold {found.get('velocity_threshold')}, "
        f"watchdog {'none' if watchdog_s is None else f'{1000 * watchdog_s:.1f} ms'}",
        f"new positions per second: {fresh_hz:.0f}; readings answered by the time guard: {counters['guarded']}",
        f"forces beyond what the motors give: {counters['saturated']}",
    )
