"""What the devices' place and the home's card say of each device, as values. No Qt here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from study_app.devices.backends import NONE, READY, Backend
from study_app.devices.registry import kind_of, list_devices
from study_app.errors import DeviceError

if TYPE_CHECKING:
    from study_app.viewmodels.tones import Tone

TITLES = {
    "mouse": "Mouse",
    "spacemouse": "SpaceMouse",
    "falcon": "Novint Falcon",
    "scripted": "Scripted hand",
    "falcon-emulated": "Emulated Falcon",
    "falcon-socket": "Falcon behind a socket",
}
ICONS = {"mouse": "mouse", "spacemouse": "mouse", "falcon": "device"}
SIMULATED_ICON = "fast_forward"
FELT_BY_PEOPLE = ("mouse", "spacemouse", "falcon")


@dataclass(frozen=True, slots=True)
class Way:
    """One library that a device is reached by: ``state`` is what it found, ``why`` why it cannot be used now."""

    by: str
    state: str
    why: str


@dataclass(frozen=True, slots=True)
class DeviceShown:
    """A device: ``name`` is for ``--device``, ``can`` says what it can and cannot do.

    ``tone``, ``sign`` and ``word`` are its state; ``why`` says why it cannot be used now, "" where it can.
    """

    name: str
    title: str
    icon: str
    tone: Tone
    sign: str
    word: str
    can: str
    why: str
    ways: tuple[Way, ...] = ()

    @property
    def ready(self) -> bool:
        """Whether it can be felt with now."""
        return self.tone == "ok"

    @property
    def choosable(self) -> bool:
        """Whether its name can be taken as it is."""
        return self.name in list_devices()

    @property
    def diagnosable(self) -> bool:
        """Whether an examination can look at it as it is."""
        return self.choosable and self.name.startswith("falcon")


def devices_shown(backends: Sequence[Backend]) -> tuple[DeviceShown, ...]:
    """Return what to show of each device, those that people feel with first; backends of one device are one."""
    names = list(dict.fromkeys(backend.name for backend in backends))
    shown = [_shown(name, [one for one in backends if one.name == name]) for name in names]
    return tuple(sorted(shown, key=lambda device: device.name not in FELT_BY_PEOPLE))


def device_named(name: str, shown: Iterable[DeviceShown]) -> DeviceShown:
    """Return what to show of the preferred device; of one that was not looked at, its name alone."""
    try:
        kind = kind_of(name)
    except DeviceError as error:
        return DeviceShown(name, name, "device", "bad", "warning", "Not known", "", _sentence(str(error)))
    for device in shown:
        if device.name.partition(":")[0] == kind:
            return device
    return looking(name)


def looking(name: str) -> DeviceShown:
    """Return what to show of a device before anybody looked."""
    kind = name.partition(":")[0]
    return DeviceShown(name, TITLES.get(kind, name), _icon(kind), "neutral", "clock", "Looking …", "", "")


def _shown(name: str, ways: Sequence[Backend]) -> DeviceShown:
    kind = name.partition(":")[0]
    best = min(ways, key=_rank)
    tone, sign, word = _state(best)
    return DeviceShown(
        name=name,
        title=TITLES.get(kind, name),
        icon=_icon(kind),
        tone=tone,
        sign=sign,
        word=word,
        can=_sentence(ways[0].can),
        why="" if tone == "ok" and not best.why else _sentence(best.why),
        ways=tuple(Way(way.by, way.state, way.why) for way in ways),
    )


def _rank(backend: Backend) -> int:
    """Return how far a backend is from being felt with; a driver that is ready has not found a device yet."""
    if _connected(backend):
        return 0
    return {READY: 1, NONE: 2}.get(backend.state, 3)


def _connected(backend: Backend) -> bool:
    return backend.state.startswith("connected")


def _state(backend: Backend) -> tuple[Tone, str, str]:
    if _connected(backend):
        return ("warn", "warning", "Look at it") if backend.why else ("ok", "check", "Connected")
    if backend.state == READY and backend.name == "falcon":
        return "neutral", "ring", "Driver ready"
    if backend.state == READY and backend.name not in list_devices():
        return "neutral", "info", "By command"
    if backend.state == READY:
        return "ok", "check", "Ready"
    return ("neutral", "ring", "Not connected") if backend.state == NONE else ("warn", "warning", "Not available")


def _icon(kind: str) -> str:
    return ICONS.get(kind, SIMULATED_ICON)


def _sentence(words: str) -> str:
    """Return a clause with a capital letter and a full stop."""
    return words[:1].upper() + words[1:] + ("" if not words or words[-1] in ".!?" else ".")
