"""Device names as the operator reads them, and the device that a dialog selects first."""

from __future__ import annotations

from study_app.devices.registry import kind_of, list_devices
from study_app.errors import DeviceError
from study_app.viewmodels.device_list import TITLES

_NOTES = {
    "mouse": " (seen, not felt)",
    "spacemouse": " (seen, not felt)",
    "scripted": " (moves by itself)",
    "falcon-emulated": " (moves by itself)",
}
DEVICE_LABELS = {name: f"{title}{_NOTES.get(name, '')}" for name, title in TITLES.items()}


def device_or_default(device: str) -> str:
    """Return the device, or the default device if the registry does not know it."""
    try:
        kind_of(device)
    except DeviceError:
        return list_devices()[0]
    return device
