"""The building blocks of every window: descriptions of fields and commands, and the widgets made from them."""

from study_app.gui.kit.commands import COMMANDS, add_commands, command_tip, connect_button, key_cap, keys_of, with_key
from study_app.gui.kit.devices import (
    described_screens,
    device_choices,
    device_named,
    screen_number,
    settings_here,
    text_scale_on,
    theme_named,
)
from study_app.gui.kit.dialogs import choose_protocol

__all__ = [
    "COMMANDS",
    "add_commands",
    "choose_protocol",
    "command_tip",
    "connect_button",
    "described_screens",
    "device_choices",
    "device_named",
    "key_cap",
    "keys_of",
    "screen_number",
    "settings_here",
    "text_scale_on",
    "theme_named",
    "with_key",
]
