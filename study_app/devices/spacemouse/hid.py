"""SpaceMice as hidapi presents them: models, reports, connected devices, and reasons why one cannot be opened.

Report 1 is the cap's displacement (three little-endian int16: right, toward the user, down), on newer models followed
by its rotation. Report 2 is the rotation of older models. Report 3 has one bit per button, the lowest bit first. Full
deflection is about 350. The source is pyspacemouse's table of devices, which is based on observations; it has not been
checked here on a device.

Known problems: on Linux the device's node belongs to the administrator, which a udev rule changes; on macOS
3Dconnexion's helper uses the device exclusively, so that it does not open or stays silent; a universal receiver has
several interfaces, only one of which reports motion. Importing this module loads neither a compiler nor hidapi.
"""

import sys
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.errors import DeviceError, DeviceNotFound
from study_app.haptics.model.layout import BUTTON_STOP
from study_app.haptics.model.ranges import Vector

DISPLACEMENT, BUTTONS, LED = 1, 3, 4
FULL_DEFLECTION: Final = 350
DEAD_DEFLECTION: Final = 20
"""Deflection up to which the cap counts as released, since it does not rest at exactly 0."""
FULL_SPEED_MPS: Final = 0.25
_USAGE: Final = (1, 8)
"""Page and usage of the collection that reports motion: generic desktop, multi-axis controller."""

_FIRST_TWO_BUTTONS: Final = 0b11
_KNOWN_BUTTONS: Final = 0b11


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A model of 3Dconnexion; ``escape`` is the bit of its Esc button, or None."""

    name: str
    vendor: int
    product: int
    escape: int | None = None
    light: bool = True


MODELS: Final = (
    Model(name="SpacePilot", vendor=0x046D, product=0xC625, escape=10, light=False),
    Model(name="SpaceNavigator", vendor=0x046D, product=0xC626),
    Model(name="SpaceExplorer", vendor=0x046D, product=0xC627, escape=6),
    Model(name="SpacePilot Pro", vendor=0x046D, product=0xC629, escape=22),
    Model(name="SpaceMouse Pro", vendor=0x046D, product=0xC62B, escape=22),
    Model(name="SpaceMouse Wireless", vendor=0x256F, product=0xC62E),
    Model(name="SpaceMouse Pro Wireless", vendor=0x256F, product=0xC632, escape=22),
    Model(name="SpaceMouse Enterprise", vendor=0x256F, product=0xC633, escape=22),
    Model(name="SpaceMouse Compact", vendor=0x256F, product=0xC635),
    Model(name="SpaceMouse Pro Wireless (Bluetooth)", vendor=0x256F, product=0xC638, escape=22),
    Model(name="SpaceMouse Wireless (new)", vendor=0x256F, product=0xC63A),
    Model(name="SpaceMouse (USB)", vendor=0x256F, product=0xC641, light=False),
    Model(name="Universal Receiver", vendor=0x256F, product=0xC652, escape=22),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Displacement:
    """The displacement of the cap to the right, toward the user and down, about -350 to 350 each."""

    right: int
    toward: int
    down: int


@dataclass(frozen=True, slots=True)
class Buttons:
    """The pressed buttons; bit 0 is the device's first button."""

    held: int


def parse_report(report: bytes) -> Displacement | Buttons | None:
    """Return the displacement or buttons in ``report``; None for other or truncated reports."""
    if not report:
        return None
    kind, rest = report[0], report[1:]
    if kind == DISPLACEMENT and len(rest) >= 6:
        right, toward, down = (int.from_bytes(rest[offset : offset + 2], "little", signed=True) for offset in (0, 2, 4))
        return Displacement(right=right, toward=toward, down=down)
    if kind == BUTTONS and rest:
        return Buttons(int.from_bytes(rest, "little"))
    return None


def program_buttons(held: int, model: Model) -> int:
    """Return the program's buttons: the first one continues; Esc, or the first two together, stops the force.

    Every model can therefore stop the force, and no other button of a large model has an effect.
    """
    buttons = held & _KNOWN_BUTTONS
    escape = model.escape is not None and bool(held >> model.escape & 1)
    if escape or held & _FIRST_TWO_BUTTONS == _FIRST_TWO_BUTTONS:
        buttons |= BUTTON_STOP
    return buttons


def velocity_mps(displacement: Displacement) -> Vector:
    """Return the hand's velocity (x right, y up, z toward the user) for a displacement [m/s]."""
    return _speed(displacement.right), -_speed(displacement.down), _speed(displacement.toward)


def _speed(deflection: int) -> float:
    """Return the speed for a deflection [m/s]: 0 in the dead zone, then proportional up to the maximum."""
    excess = min(abs(deflection), FULL_DEFLECTION) - DEAD_DEFLECTION
    proportion = max(excess, 0) / (FULL_DEFLECTION - DEAD_DEFLECTION)
    return FULL_SPEED_MPS * (proportion if deflection > 0 else -proportion)


_UDEV_RULES: Final = (
    'KERNEL=="hidraw*", KERNELS=="*:256F:*", TAG+="uaccess"',
    'KERNEL=="hidraw*", KERNELS=="*:046D:C62[5679B].*", TAG+="uaccess"',
)
_CANNOT_OPEN: Final = {
    "linux": "this account does not have permission to open it: put "
    + " and ".join(f"'{rule}'" for rule in _UDEV_RULES)
    + " into /etc/udev/rules.d/60-spacemouse.rules, run 'sudo udevadm control --reload', then plug it in again",
    "darwin": "3Dconnexion's helper may be using it: quit 3DconnexionHelper (Activity Monitor), or remove 3DxWare",
    "win32": "another program is using it: close that program and 3DxWare",
}
_NO_MOTION_INTERFACE: Final = (
    "is connected, but does not have an interface that reports motion (usage page 1, usage 8): switch on "
    "the mouse itself and pair it, or use its cable"
)


def load_hid() -> Any:
    """Return hidapi's module; on Linux the variant that leaves the kernel's driver attached."""
    names = ("hidraw", "hid") if sys.platform.startswith("linux") else ("hid",)
    reason = ""
    for name in names:
        try:
            return import_module(name)
        except (ImportError, OSError) as error:
            reason = str(error)
    raise DeviceError(
        f"a SpaceMouse needs the package hidapi, which cannot be loaded ({reason}): run 'pip install hidapi'"
    )


def find_space_mice(hid: Any) -> list[tuple[Model, dict[str, Any]]]:
    """Return model and hidapi's description of every interface of every connected SpaceMouse."""
    models = {(model.vendor, model.product): model for model in MODELS}
    listed = [
        (models.get((interface["vendor_id"], interface["product_id"])), interface) for interface in hid.enumerate()
    ]
    return [(model, interface) for model, interface in listed if model is not None]


def choose_interface(interfaces: list[tuple[Model, dict[str, Any]]]) -> tuple[Model, bytes]:
    """Return the first interface that reports motion; an interface without usage information counts as such."""
    if not interfaces:
        raise DeviceNotFound(
            "no SpaceMouse is connected: connect one or turn it on; the supported models are "
            + ", ".join(m.name for m in MODELS)
        )
    usages = [(interface.get("usage_page") or 0, interface.get("usage") or 0) for _, interface in interfaces]
    for usage in (_USAGE, (0, 0)):
        if usage in usages:
            model, chosen = interfaces[usages.index(usage)]
            return model, chosen["path"]
    raise DeviceError(f"the {interfaces[0][0].name} {_NO_MOTION_INTERFACE}")


def open_interface(hid: Any, model: Model, path: bytes) -> Any:
    """Open hidapi's device at this path; raise ``DeviceError`` with the remedy on this system."""
    device = hid.device()
    try:
        device.open_path(path)
    except OSError as error:
        cure = _CANNOT_OPEN.get(sys.platform, _CANNOT_OPEN["win32"])
        raise DeviceError(f"the {model.name} cannot be opened: {cure}") from error
    return device


def probe(hid: Any = None) -> list[Backend]:
    """Return the state of hidapi and the connected SpaceMice.

    Parameters
    ----------
    hid : hidapi's module; None: it is loaded
    """
    can = "visual only, no force: pushing the cap further moves the ball faster"
    by = f"hidapi {_package_version()}"
    try:
        interfaces = find_space_mice(load_hid() if hid is None else hid)
    except (DeviceError, OSError) as error:
        return [Backend("spacemouse", by, state=NOT_AVAILABLE, can=can, why=str(error))]
    if not interfaces:
        return [Backend("spacemouse", by, state=NONE, can=can, why="connect a 3Dconnexion SpaceMouse, or turn it on")]
    names = sorted({model.name for model, _ in interfaces})
    return [Backend("spacemouse", by, state="connected: " + ", ".join(names), can=can)]


def _package_version() -> str:
    try:
        return version("hidapi")
    except PackageNotFoundError:
        return "(not installed)"
