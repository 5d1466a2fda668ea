"""The connections to devices that this computer offers, or why one cannot be used.

It probes without opening a device. It loads no compiler, and drivers only as far as probing needs them.
"""

from study_app.devices.descriptor import NOT_AVAILABLE, Backend, DeviceDescriptor
from study_app.devices.registry import ENTRY_POINTS, discover


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
