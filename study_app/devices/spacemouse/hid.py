"""SpaceMice as hidapi sees them: which are connected, which of their interfaces reports motion, and why none opens.

Known ways to fail: on Linux the device's node belongs to the administrator (a rule for udev helps); on macOS
3Dconnexion's helper seizes it, so that it does not open or stays silent; a universal receiver shows several interfaces,
of which one reports motion. Loads no compiler, and hidapi only when asked to.
"""

import sys
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.devices.spacemouse.reports import MODELS, USAGE, Model
from study_app.errors import DeviceError, DeviceNotFound

UDEV_RULES: Final = (
    'KERNEL=="hidraw*", KERNELS=="*:256F:*", TAG+="uaccess"',
    'KERNEL=="hidraw*", KERNELS=="*:046D:C62[5679B].*", TAG+="uaccess"',
)
CANNOT_OPEN: Final = {
    "linux": "this account may not open it: put "
    + " and ".join(f"'{rule}'" for rule in UDEV_RULES)
    + " into /etc/udev/rules.d/60-spacemouse.rules, run 'sudo udevadm control --reload' and plug it in again",
    "darwin": "3Dconnexion's helper may hold it: quit 3DconnexionHelper (Activity Monitor), or remove 3DxWare",
    "win32": "another program holds it: close it, and 3DxWare",
}
_NO_MOTION_INTERFACE: Final = (
    "is connected, but has no interface that reports motion (usage page 1, usage 8): switch the mouse itself on and "
    "pair it, or use its cable"
)


def load_hid() -> Any:
    """Return hidapi's module: on Linux the one that leaves the kernel's driver in place."""
    names = ("hidraw", "hid") if sys.platform.startswith("linux") else ("hid",)
    reason = ""
    for name in names:
        try:
            return import_module(name)
        except (ImportError, OSError) as error:
            reason = str(error)
    raise DeviceError(f"a SpaceMouse needs the package hidapi, which cannot be loaded ({reason}): pip install hidapi")


def find_space_mice(hid: Any) -> list[tuple[Model, dict[str, Any]]]:
    """Return model and hidapi's description of every interface of every SpaceMouse that is connected."""
    known = {(model.vendor, model.product): model for model in MODELS}
    listed = [(known.get((one["vendor_id"], one["product_id"])), one) for one in hid.enumerate()]
    return [(model, one) for model, one in listed if model is not None]


def choose(found: list[tuple[Model, dict[str, Any]]]) -> tuple[Model, bytes]:
    """Return the first interface that reports motion; one that does not tell what it reports may be one."""
    if not found:
        raise DeviceNotFound(
            "no SpaceMouse is connected: connect it, or turn it on; known models are "
            + ", ".join(m.name for m in MODELS)
        )
    usages = [(one.get("usage_page") or 0, one.get("usage") or 0) for _, one in found]
    for wanted in (USAGE, (0, 0)):
        if wanted in usages:
            model, chosen = found[usages.index(wanted)]
            return model, chosen["path"]
    raise DeviceError(f"the {found[0][0].name} {_NO_MOTION_INTERFACE}")


def opened(hid: Any, model: Model, path: bytes) -> Any:
    """Return hidapi's device of this path, open; raise ``DeviceError`` with what to do on this system."""
    device = hid.device()
    try:
        device.open_path(path)
    except OSError as error:
        cure = CANNOT_OPEN.get(sys.platform, CANNOT_OPEN["win32"])
        raise DeviceError(f"the {model.name} cannot be opened: {cure}") from error
    return device


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
