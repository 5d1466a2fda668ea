"""Descriptions of devices for windows; the settings and screens of this computer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from PySide6.QtGui import QScreen

from study_app.devices import DEFAULT_DEVICE
from study_app.devices.descriptor import DRIVER_READY, NONE, READY, Backend, DeviceDescriptor, DeviceOption
from study_app.devices.registry import DEVICES, all_devices, descriptor_of, list_devices, title_of
from study_app.errors import DeviceError
from study_app.gui.display.screens import (
    BY_CLOCK,
    LOCKED,
    describe_screen,
    has_graphics_card,
    screen_shown,
    screens_shown,
)
from study_app.gui.theme.theme import DARK, LIGHT, Theme
from study_app.store import workstation
from study_app.store.workstation import DEFAULTS, REMEMBERED_OPTIONS, MachineSettings
from study_app.user_folder import settings_file

if TYPE_CHECKING:
    from study_app.gui.theme.theme import Tone


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceShown:
    """A device as shown in windows: ``name`` is for ``--device``, ``can`` describes its capabilities.

    ``tone``, ``sign`` and ``word`` are its state; ``why`` is the reason why it cannot be used now, or ""; ``ways`` are
    the libraries for it, each with the result of its probe. ``choosable`` tells whether its name can be used without an
    argument, ``diagnosable`` whether it can be examined.
    """

    name: str
    title: str
    icon: str
    tone: Tone
    sign: str
    word: str
    can: str
    why: str
    ways: tuple[str, ...] = ()
    simulated: bool = False
    choosable: bool = False
    diagnosable: bool = False

    @property
    def is_ready(self) -> bool:
        return self.tone == "ok"


def devices_shown(backends: Sequence[Backend]) -> tuple[DeviceShown, ...]:
    """Return the description of each device, common ones first; a device's backends are merged."""
    names = list(dict.fromkeys(backend.name for backend in backends))
    devices = [_device_shown(name, [backend for backend in backends if backend.name == name]) for name in names]
    return tuple(sorted(devices, key=lambda device: device.simulated))


def device_named(name: str, devices: Iterable[DeviceShown]) -> DeviceShown:
    """Return the description of a device; if no search has found it, one with only its name."""
    try:
        kind = descriptor_of(name).name
    except DeviceError as error:
        return DeviceShown(
            name=name,
            title=name,
            icon="device",
            tone="bad",
            sign="warning",
            word="Not known",
            can="",
            why=as_sentence(str(error)),
        )
    for device in devices:
        if device.name.partition(":")[0] == kind:
            return device
    return device_before_search(name)


def device_before_search(name: str) -> DeviceShown:
    """Return the description of a device before the first search."""
    device = _descriptor(name)
    icon = "device" if device is None else device.icon
    return DeviceShown(
        name=name, title=title_of(name), icon=icon, tone="neutral", sign="clock", word="Looking…", can="", why=""
    )


def device_label(device: str) -> str:
    """Return the label of a device in lists."""
    return descriptor_of(device).label


def device_choices() -> tuple[tuple[str, str], ...]:
    """Return name and label of every device."""
    return tuple((name, device_label(name)) for name in list_devices())


def device_or_default(device: str) -> str:
    """Return the device's name, or the default device's if it is unknown."""
    try:
        descriptor_of(device)
    except DeviceError:
        return DEFAULT_DEVICE
    return device


def window_options() -> tuple[DeviceOption, ...]:
    """Return the device options that windows offer, each name once."""
    return tuple({option.name: option for device in all_devices() for option in device.window_options}.values())


def remembered_options() -> tuple[DeviceOption, ...]:
    """Return the options that are stored on this computer."""
    return tuple(option for option in window_options() if option.name in REMEMBERED_OPTIONS)


def _device_shown(name: str, backends: Sequence[Backend]) -> DeviceShown:
    device = _descriptor(name)
    best_backend = min(backends, key=_usability_rank)
    by_command = device is not None and device.argument_required
    tone, sign, word = _device_state(best_backend, by_command=by_command)
    choosable = device is not None and not by_command
    return DeviceShown(
        name=name,
        title=title_of(name),
        icon="device" if device is None else device.icon,
        tone=tone,
        sign=sign,
        word=word,
        can=as_sentence(backends[0].can),
        why="" if tone == "ok" and not best_backend.why else as_sentence(best_backend.why),
        ways=tuple(f"{backend.by}: {backend.state}" for backend in backends),
        simulated=device is not None and device.simulated,
        choosable=choosable,
        diagnosable=choosable and device is not None and device.doctor is not None,
    )


def _usability_rank(backend: Backend) -> int:
    """Return the rank of a backend; the lowest is closest to being usable."""
    if _is_connected(backend):
        return 0
    return {READY: 1, DRIVER_READY: 1, NONE: 2}.get(backend.state, 3)


def _is_connected(backend: Backend) -> bool:
    return backend.state.startswith("connected")


def _device_state(backend: Backend, *, by_command: bool) -> tuple[Tone, str, str]:
    if _is_connected(backend):
        return ("warn", "warning", "Check it") if backend.why else ("ok", "check", "Connected")
    if backend.state == DRIVER_READY:
        return "neutral", "ring", "Driver ready"
    if backend.state == READY and by_command:
        return "neutral", "info", "Command line only"
    if backend.state == READY:
        return "ok", "check", "Ready"
    return ("neutral", "ring", "Not connected") if backend.state == NONE else ("warn", "warning", "Not available")


def _descriptor(name: str) -> DeviceDescriptor | None:
    """Return the descriptor of a device; None if its module could not be loaded."""
    return DEVICES.get(name.partition(":")[0])


def as_sentence(text: str) -> str:
    """Return a text with a capital letter at the start and a full stop at the end, or ""."""
    return text[:1].upper() + text[1:] + ("" if not text or text[-1] in ".!?" else ".")


def settings_here() -> tuple[MachineSettings, str]:
    """Return the settings, and the reason if they are defaults because the file cannot be read (else "")."""
    settings, problem = workstation.load_or_default()
    try:
        descriptor_of(settings.device)
    except DeviceError as error:
        return settings.model_copy(update={"device": DEFAULTS.device}), f"{settings_file()}: {error}"
    return settings, problem


def theme_named(name: str) -> Theme:
    """Return the theme of the operator's windows with a name; the light one if the name is unknown."""
    return DARK if name == DARK.name else LIGHT


def screen_number(settings: MachineSettings) -> int:
    """Return the number of the participant's screen, from 1."""
    return settings.screen_among([screen.name for screen in screens_shown()])


def text_scale_on(settings: MachineSettings, screen: QScreen) -> float:
    """Return the factor by which the participant's text must be enlarged on a screen."""
    description = screen_shown(screen)
    return settings.text_scale(description.width_px, description.width_mm)


def described_screens(settings: MachineSettings, participant: QScreen, operator: QScreen) -> dict[str, Any]:
    """Return the receipt's description of both screens, with measurements of the participant's.

    ``frames`` names the timing source of the participant's frames: buffer swaps with a graphics card, else a clock.
    """
    description = screen_shown(participant)
    frames = {"frames": LOCKED if has_graphics_card() else BY_CLOCK}
    measured = settings.describe(description.name, description.width_px, description.width_mm)
    return {"participant": describe_screen(participant) | frames | measured, "operator": describe_screen(operator)}
