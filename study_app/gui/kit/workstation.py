"""The settings and screens of this computer, for sessions and windows."""

from typing import Any

from PySide6.QtGui import QScreen

from study_app.devices.registry import descriptor_of
from study_app.errors import DeviceError
from study_app.gui.display.frame_clock import BY_CLOCK, LOCKED
from study_app.gui.display.screens import describe_screen, has_card, screen_shown, screens_shown
from study_app.gui.theme.theme import DARK, LIGHT, Theme
from study_app.store import workstation
from study_app.store.workstation import DEFAULTS, MachineSettings
from study_app.user_folder import settings_file


def settings_here() -> tuple[MachineSettings, str]:
    """Return the settings, and why they are the defaults if the file cannot be used ("" if it can)."""
    settings, trouble = workstation.load_or_default()
    try:
        descriptor_of(settings.device)
    except DeviceError as error:
        return settings.model_copy(update={"device": DEFAULTS.device}), f"{settings_file()}: {error}"
    return settings, trouble


def theme_named(name: str) -> Theme:
    """Return the theme of the operator's windows by its name."""
    return DARK if name == DARK.name else LIGHT


def screen_number(settings: MachineSettings) -> int:
    """Return the number of the participant's screen, from 1."""
    return settings.screen_among([screen.name for screen in screens_shown()])


def text_scale_on(settings: MachineSettings, screen: QScreen) -> float:
    """Return the factor by which the participant's text must be enlarged on a screen."""
    shown = screen_shown(screen)
    return settings.text_scale(shown.width_px, shown.width_mm)


def described(settings: MachineSettings, participant: QScreen, operator: QScreen) -> dict[str, Any]:
    """Return the receipt's description of both screens, with the measurements of the participant's.

    ``frames`` says what times the participant's frames: the screen's swaps where a graphics card draws, else a clock.
    """
    shown = screen_shown(participant)
    frames = {"frames": LOCKED if has_card() else BY_CLOCK}
    measured = settings.describe(shown.name, shown.width_px, shown.width_mm)
    return {"participant": describe_screen(participant) | frames | measured, "operator": describe_screen(operator)}
