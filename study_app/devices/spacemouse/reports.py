"""What a 3Dconnexion SpaceMouse says: its models, its reports byte by byte, and where its deflection leads.

Report 1 is the cap's displacement (three little-endian int16: right, toward the user, down), on newer models with its
rotation behind it; report 2 the rotation of older models; report 3 the buttons, a bit each, the lowest first. Full
deflection is about 350. Sources: pyspacemouse's table of devices, whose own observations these are; never seen here on
a device. Loads neither the compiler nor a driver.
"""

from dataclasses import dataclass
from typing import Final

from study_app.haptics.model.layout import BUTTON_STOP

DISPLACEMENT, BUTTONS, LED = 1, 3, 4
FULL_DEFLECTION: Final = 350
DEAD_DEFLECTION: Final = 20
"""A released cap does not come to rest at exactly 0."""
FULL_SPEED_MPS: Final = 0.25
USAGE: Final = (1, 8)
"""Page and usage of the collection that reports motion: generic desktop, multi-axis controller."""

_PAIR: Final = 0b11
_KNOWN_BUTTONS: Final = 0b11


@dataclass(frozen=True, slots=True)
class Model:
    """One of 3Dconnexion's; ``escape`` is the bit of its Esc button, None where it has none."""

    name: str
    vendor: int
    product: int
    escape: int | None = None
    light: bool = True


MODELS: Final = (
    Model("SpacePilot", 0x046D, 0xC625, 10, light=False),
    Model("SpaceNavigator", 0x046D, 0xC626),
    Model("SpaceExplorer", 0x046D, 0xC627, 6),
    Model("SpacePilot Pro", 0x046D, 0xC629, 22),
    Model("SpaceMouse Pro", 0x046D, 0xC62B, 22),
    Model("SpaceMouse Wireless", 0x256F, 0xC62E),
    Model("SpaceMouse Pro Wireless", 0x256F, 0xC632, 22),
    Model("SpaceMouse Enterprise", 0x256F, 0xC633, 22),
    Model("SpaceMouse Compact", 0x256F, 0xC635),
    Model("SpaceMouse Pro Wireless (Bluetooth)", 0x256F, 0xC638, 22),
    Model("SpaceMouse Wireless (new)", 0x256F, 0xC63A),
    Model("SpaceMouse (USB)", 0x256F, 0xC641, light=False),
    Model("Universal Receiver", 0x256F, 0xC652, 22),
)


@dataclass(frozen=True, slots=True)
class Displacement:
    """Of the cap, about -350 to 350 each: right, toward the user, down."""

    right: int
    toward: int
    down: int


@dataclass(frozen=True, slots=True)
class Buttons:
    """Bit 0 is the device's first button."""

    held: int


def parse(report: bytes) -> Displacement | Buttons | None:
    """Return what ``report`` says; None where that is nothing to us, or it is cut short."""
    if not report:
        return None
    kind, rest = report[0], report[1:]
    if kind == DISPLACEMENT and len(rest) >= 6:
        right, toward, down = (int.from_bytes(rest[at : at + 2], "little", signed=True) for at in (0, 2, 4))
        return Displacement(right, toward, down)
    if kind == BUTTONS and rest:
        return Buttons(int.from_bytes(rest, "little"))
    return None


def program_buttons(held: int, model: Model) -> int:
    """Return the program's buttons for the device's: the first goes on; Esc, or the first two at once, stop the force.

    So every model can stop it, and no button of a large one does anything unexpected.
    """
    buttons = held & _KNOWN_BUTTONS
    escape = model.escape is not None and bool(held >> model.escape & 1)
    if escape or held & _PAIR == _PAIR:
        buttons |= BUTTON_STOP
    return buttons


def velocity_mps(displacement: Displacement) -> tuple[float, float, float]:
    """Return the velocity of the hand (x right, y up, z toward the user) that a displacement asks for [m/s]."""
    return _speed(displacement.right), -_speed(displacement.down), _speed(displacement.toward)


def _speed(deflection: int) -> float:
    """Nothing within the dead zone, from there on in proportion, and no more than full."""
    beyond = min(abs(deflection), FULL_DEFLECTION) - DEAD_DEFLECTION
    share = max(beyond, 0) / (FULL_DEFLECTION - DEAD_DEFLECTION)
    return FULL_SPEED_MPS * (share if deflection > 0 else -share)
