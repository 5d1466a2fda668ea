"""The devices by name: what each is, and opening one."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

from study_app.errors import DeviceNotFound

if TYPE_CHECKING:
    from study_app.devices.base import Device


# Loaded only when asked for: naming the devices must not load a compiler or a driver.
_DEVICES = {
    "mouse": ("study_app.devices.mouse", "MouseDevice"),
    "falcon": ("study_app.devices.falcon.device", "FalconDevice"),
    "spacemouse": ("study_app.devices.spacemouse.device", "SpaceMouseDevice"),
    "scripted": ("study_app.devices.scripted", "ScriptedDevice"),
    "falcon-emulated": ("study_app.devices.falcon.emulated", "EmulatedFalcon"),
}
_SOCKET = "falcon-socket"  # and the path of its socket
_MOVED_BY_PROGRAM = ("scripted", "falcon-emulated")


def list_devices() -> tuple[str, ...]:
    """Return the names that ``open_device`` takes as they are, the default first."""
    return tuple(_DEVICES)


def kind_of(name: str) -> str:
    """Return which kind of device ``name`` means, without what tells one of the kind from others.

    Raises
    ------
    DeviceNotFound
        No device has this name.
    """
    kind, _, which = name.partition(":")
    if kind == _SOCKET and which:
        return kind
    if kind == _SOCKET:
        raise DeviceNotFound("falcon-socket needs the path of its socket: falcon-socket:PATH")
    if kind not in _DEVICES or (which and kind != "falcon"):
        known = ", ".join((*_DEVICES, f"{_SOCKET}:PATH"))
        raise DeviceNotFound(f"device '{name}' is not known; choose one of: {known}")
    return kind


def is_falcon(name: str) -> bool:
    """Return whether ``name`` is a Falcon or an emulated one, which takes ``firmware`` and ``tell``."""
    return kind_of(name).startswith("falcon")


def moves_by_itself(name: str) -> bool:
    """Return whether the program holds the handle of ``name``: it then has ``random`` tremor and takes orders."""
    return kind_of(name) in _MOVED_BY_PROGRAM


def is_simulated(name: str) -> bool:
    """Return whether no participant feels ``name``."""
    return moves_by_itself(name) or kind_of(name) == _SOCKET


def open_device(name: str, **options: Any) -> Device:
    """Return the device ``name``, opened; ``options`` are those of its class.

    ``name`` is one of `list_devices`, ``falcon:SERIAL`` or ``falcon-socket:PATH``.

    Raises
    ------
    DeviceNotFound
        No device has this name, or none is connected.
    DeviceError
        It is there, and cannot be used.
    """
    kind = kind_of(name)
    if kind in {"falcon", _SOCKET}:
        options["bridge"] = name
    module, of_kind = _DEVICES["falcon" if kind == _SOCKET else kind]
    device = cast("Device", getattr(import_module(module), of_kind)(**options))
    device.open()
    return device
