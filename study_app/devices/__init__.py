"""What can be felt with: every device is two C functions, a workspace and a force limit."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

from study_app.errors import DeviceNotFound

if TYPE_CHECKING:
    from study_app.devices.base import Device

# Loaded only when asked for: naming the devices must not load a compiler or a driver.
_DEVICES = {
    "mouse": ("study_app.devices.mouse", "MouseDevice"),
    "scripted": ("study_app.devices.scripted", "ScriptedDevice"),
}


def list_devices() -> tuple[str, ...]:
    """Return the names that ``open_device`` takes, the default first."""
    return tuple(_DEVICES)


def open_device(name: str, **options: Any) -> Device:
    """Return the device ``name``, opened; ``options`` are those of its class.

    Raises
    ------
    DeviceNotFound
        No device has this name, or none is connected.
    """
    if name not in _DEVICES:
        known = ", ".join(_DEVICES)
        raise DeviceNotFound(f"device '{name}' is not known; choose one of: {known}")
    module, kind = _DEVICES[name]
    device = cast("Device", getattr(import_module(module), kind)(**options))
    device.open()
    return device
