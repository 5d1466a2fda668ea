"""The devices by name: the program's own and those at entry points, described, probed, and opened.

Naming and probing devices loads no compiler, and drivers only if probing needs them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from study_app.devices import DEFAULT_DEVICE
from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend, DeviceDescriptor, Doctor, OpenRequest
from study_app.devices.descriptors import DEVICES as OWN
from study_app.discovery import Registry, Returns
from study_app.errors import DeviceError, DeviceNotFound

if TYPE_CHECKING:
    from study_app.devices.base import Device


def _are_backends(value: object) -> bool:
    """Return whether a value is a sequence of backends; an iterator would be consumed by the check."""
    return isinstance(value, Sequence) and all(isinstance(backend, Backend) for backend in value)


_RETURNS: Final = {
    "open": Returns("a device", lambda value: callable(value.close)),
    "probe": Returns("a list of Backend", _are_backends),
}
DEVICES: Final = Registry("device", {device.name: device for device in OWN}, DeviceDescriptor, "name", _RETURNS)


def all_devices() -> tuple[DeviceDescriptor, ...]:
    """Return the descriptors of all devices, the default first and simulated devices last."""
    return tuple(sorted(DEVICES.values(), key=lambda device: (device.name != DEFAULT_DEVICE, device.simulated)))


def list_devices() -> tuple[str, ...]:
    """Return the device names for ``open_device``, the default first."""
    return tuple(device.name for device in all_devices() if not device.argument_required)


def descriptor_of(name: str) -> DeviceDescriptor:
    """Return the descriptor of a device by its name, with or without an argument after a colon.

    Raises
    ------
    DeviceNotFound
        No device has this name.
    """
    kind, _, argument = name.partition(":")
    descriptor = DEVICES.get(kind)
    if descriptor is None or (argument and not descriptor.argument):
        available = ", ".join(device.usage for device in all_devices())
        raise DeviceNotFound(f"device '{name}' is not known; choose one of: {available}")
    if descriptor.argument_required and not argument:
        raise DeviceNotFound(f"device '{kind}' needs an argument after its name: specify it as {descriptor.usage}")
    return descriptor


def title_of(name: str) -> str:
    """Return the displayed name of a device; for an unknown one, its name."""
    kind = name.partition(":")[0]
    return DEVICES[kind].title if kind in DEVICES else name


def open_device(name: str, **request: Any) -> Device:
    """Open the device ``name``; ``request`` has the fields of an `OpenRequest` except its argument.

    ``name`` is one of `list_devices`, or has an argument after a colon, such as ``falcon:SERIAL``.

    Raises
    ------
    DeviceNotFound
        No device has this name, or none is connected.
    DeviceError
        The device is connected but cannot be used, or it does not have an option.
    """
    device = descriptor_of(name)
    open_request = OpenRequest(**request)
    check_options(name, open_request.options)
    opened = device.open(replace(open_request, argument=name.partition(":")[2]))
    if missing := [attribute for attribute in ("read", "write", "failure") if not hasattr(opened, attribute)]:
        opened.close()
        raise DeviceError(
            f"device '{name}' does not have '{missing[0]}': derive {type(opened).__name__} from "
            "study_app.devices.base.Device"
        )
    return opened


def check_connected(name: str) -> None:
    """Raise DeviceNotFound if the probe of a device finds none, before anything is compiled for it."""
    device = descriptor_of(name)
    states = _probe_device(device)
    reasons = [backend.why for backend in states if backend.state == NONE]
    if reasons and all(backend.state in {NONE, NOT_AVAILABLE} for backend in states):
        raise DeviceNotFound(f"{device.title}: {NONE}{f' ({reasons[0]})' if reasons[0] else ''}")


def doctor_of(name: str) -> Doctor:
    """Return the diagnosis of a device.

    Raises
    ------
    DeviceNotFound
        No device has this name.
    DeviceError
        The device has no diagnosis.
    """
    doctor = descriptor_of(name).doctor
    if doctor is None:
        supported = ", ".join(device.usage for device in all_devices() if device.doctor is not None)
        raise DeviceError(
            f"the doctor command does not support '{name}', only {supported}: see 'liquid-study devices list'"
        )
    return doctor


def check_options(name: str, options: Iterable[str]) -> None:
    """Raise an error for options that a device does not have.

    Parameters
    ----------
    options : names of the options

    Raises
    ------
    DeviceNotFound
        No device has this name.
    DeviceError
        The device does not have one of these options.
    """
    accepted = {option.name for option in descriptor_of(name).options}
    for option in options:
        if option not in accepted:
            accepting = [
                device.title
                for device in all_devices()
                if option in {option_of_device.name for option_of_device in device.options}
            ]
            hint = f"; only these do: {', '.join(accepting)}" if accepting else ""
            raise DeviceError(f"device '{name}' does not use {option}{hint}: omit --{option}")


def backends() -> list[Backend]:
    """Return the results of all devices' probes, the default device first, then those that could not be loaded."""
    probed = [backend for device in all_devices() for backend in _probe_device(device)]
    return probed + [
        Backend(
            f"{plug_in.name} ({plug_in.package})",
            "entry point",
            state=NOT_AVAILABLE,
            can=f"a device from the plug-in {plug_in.package}",
            why=f"it cannot be used ({plug_in.fault}): update or uninstall the package {plug_in.package}",
        )
        for plug_in in DEVICES.plug_ins
        if plug_in.fault
    ]


def _probe_device(device: DeviceDescriptor) -> list[Backend]:
    try:
        return list(device.probe())
    except Exception as error:  # noqa: BLE001 - shown: one device must not hide the others
        reason = " ".join(str(error).split()) or type(error).__name__
        return [
            Backend(device.usage, device.title, state=NOT_AVAILABLE, can="", why=f"the search for it failed: {reason}")
        ]
