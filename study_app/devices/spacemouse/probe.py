"""Which SpaceMice are connected, and why one cannot be used. Looks, and opens nothing."""

from importlib.metadata import PackageNotFoundError, version
from typing import Any

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.devices.spacemouse.hid import find_space_mice, load_hid
from study_app.errors import DeviceError


def probe(hid: Any = None) -> list[Backend]:
    """Return what hidapi finds.

    Parameters
    ----------
    hid : hidapi's module; None: it is loaded
    """
    can = "visual only, no force: pushing the cap further moves the ball faster"
    by = f"hidapi {_version()}"
    try:
        found = find_space_mice(load_hid() if hid is None else hid)
    except (DeviceError, OSError) as error:
        return [Backend("spacemouse", by, NOT_AVAILABLE, can, str(error))]
    if not found:
        return [Backend("spacemouse", by, NONE, can, "connect a 3Dconnexion SpaceMouse, or turn it on")]
    names = sorted({model.name for model, _ in found})
    return [Backend("spacemouse", by, "connected: " + ", ".join(names), can)]


def _version() -> str:
    try:
        return version("hidapi")
    except PackageNotFoundError:
        return "(not installed)"
