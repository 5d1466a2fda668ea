"""The devices by name: the program's own and those at entry points, described, probed, and opened.

Naming and probing the devices loads no compiler, and drivers only as far as probing needs them.
"""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any, Final

from study_app.devices import DEFAULT_DEVICE
from study_app.devices.descriptor import NOT_AVAILABLE, Backend, DeviceDescriptor, Doctor, OpenRequest
from study_app.devices.descriptors import DEVICES
from study_app.errors import DeviceError, DeviceNotFound

if TYPE_CHECKING:
    from study_app.devices.base import Device

ENTRY_POINTS: Final = "liquid_study.devices"
REMOVED: Final = {"falcon-socket": "falcon-emulated, or falcon"}
"""Devices of earlier versions, and what to use in their place."""


@dataclass(frozen=True, slots=True)
class BrokenEntryPoint:
    """A device of another package that cannot be used: its ``name``, the ``package``, and the ``reason`` in a line."""

    name: str
    package: str
    reason: str


@dataclass(frozen=True, slots=True)
class Discovery:
    """All descriptors, the default first and simulated devices last, and what could not be loaded."""

    devices: tuple[DeviceDescriptor, ...]
    broken: tuple[BrokenEntryPoint, ...]


@cache
def discover() -> Discovery:
    """Import every descriptor, once."""
    found = {device.name: device for device in DEVICES}
    broken = []
    for point in entry_points(group=ENTRY_POINTS):
        try:
            device = _load(point, found)
            found[device.name] = device
        except Exception as error:  # noqa: BLE001 - code of another package: it must not end this program
            package = point.dist.name if point.dist is not None else point.module
            reason = " ".join(str(error).split()) or type(error).__name__
            broken.append(BrokenEntryPoint(point.name, package, reason))
    devices = sorted(found.values(), key=lambda device: (device.name != DEFAULT_DEVICE, device.simulated))
    return Discovery(tuple(devices), tuple(broken))


def _load(point: EntryPoint, known: Container[str]) -> DeviceDescriptor:
    """Return the descriptor at an entry point; a name that is ``known`` already is refused."""
    device = point.load()
    if not isinstance(device, DeviceDescriptor):
        raise DeviceError(f"{point.value} is not a DeviceDescriptor but a {type(device).__name__}")
    if device.name in known:
        raise DeviceError(f"a device named '{device.name}' exists already: give it another name")
    return device


def list_devices() -> tuple[str, ...]:
    """Return the names that ``open_device`` takes as they are, the default first."""
    return tuple(device.name for device in discover().devices if not device.argument_required)


def descriptor_of(name: str) -> DeviceDescriptor:
    """Return the descriptor of a device, by its name with or without what follows the colon.

    Raises
    ------
    DeviceNotFound
        No device has this name.
    """
    kind, _, argument = name.partition(":")
    found = {device.name: device for device in discover().devices}.get(kind)
    if found is None and kind in REMOVED:
        raise DeviceNotFound(f"device '{name}' was removed: choose {REMOVED[kind]}")
    if found is None or (argument and not found.argument):
        known = ", ".join(device.usage for device in discover().devices)
        raise DeviceNotFound(f"device '{name}' is not known; choose one of: {known}")
    if found.argument_required and not argument:
        raise DeviceNotFound(f"device '{kind}' needs more than its name: give it as {found.usage}")
    return found


def title_of(name: str) -> str:
    """Return the displayed name of a device; for an unknown one, its name."""
    kind = name.partition(":")[0]
    return next((device.title for device in discover().devices if device.name == kind), name)


def open_device(name: str, **request: Any) -> Device:
    """Return the device ``name``, open; ``request`` are the fields of an `OpenRequest` but its argument.

    ``name`` is one of `list_devices`, or with what follows the colon, such as ``falcon:SERIAL``.

    Raises
    ------
    DeviceNotFound
        No device has this name, or none is connected.
    DeviceError
        It is there, and cannot be used; or it does not take an option.
    """
    device = descriptor_of(name)
    asked = OpenRequest(**request)
    check_options(name, asked.options)
    found = device.open(replace(asked, argument=name.partition(":")[2]))
    if not hasattr(found, "failure"):  # of another package, made for an earlier version
        found.close()
        raise DeviceError(
            f"device '{name}' has no 'failure': let {type(found).__name__} inherit study_app.devices.base.Device"
        )
    return found


def doctor_of(name: str) -> Doctor:
    """Return the diagnosis of a device.

    Raises
    ------
    DeviceNotFound
        No device has this name.
    DeviceError
        It has no diagnosis.
    """
    doctor = descriptor_of(name).doctor
    if doctor is None:
        examined = ", ".join(device.usage for device in discover().devices if device.doctor is not None)
        raise DeviceError(
            f"the doctor looks at {examined}, and '{name}' is none of these: see 'liquid-study devices list'"
        )
    return doctor


def check_options(name: str, options: Iterable[str]) -> None:
    """Reject options that a device does not have.

    Parameters
    ----------
    options : their names

    Raises
    ------
    DeviceNotFound
        No device has this name.
    DeviceError
        It does not take one of them.
    """
    taken = {option.name for option in descriptor_of(name).options}
    for option in options:
        if option not in taken:
            takers = [device.title for device in discover().devices if option in {one.name for one in device.options}]
            only = f"; only these do: {', '.join(takers)}" if takers else ""
            raise DeviceError(f"device '{name}' takes no {option}{only}: leave --{option} out")


def backends() -> list[Backend]:
    """Return the results of all devices' probes, the default device first, then those that could not be loaded."""
    discovery = discover()
    found = [backend for device in discovery.devices for backend in _probed(device)]
    return found + [
        Backend(
            f"{one.name} ({one.package})",
            "entry point",
            NOT_AVAILABLE,
            f"a device of the package {one.package}",
            f"its entry point of the group {ENTRY_POINTS} cannot be loaded ({one.reason}): update or uninstall the "
            f"package {one.package}",
        )
        for one in discovery.broken
    ]


def _probed(device: DeviceDescriptor) -> list[Backend]:
    try:
        return list(device.probe())
    except Exception as error:  # noqa: BLE001 - shown: one device must not hide the others
        reason = " ".join(str(error).split()) or type(error).__name__
        return [Backend(device.usage, device.title, NOT_AVAILABLE, "", f"it cannot be looked for: {reason}")]
