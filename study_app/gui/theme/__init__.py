"""Colours, fonts and icons of every window."""

from study_app.gui.theme.icons import draw_icon, icon
from study_app.gui.theme.theme import (
    LIGHT,
    PARTICIPANT,
    RADIUS_CARD,
    RADIUS_CONTROL,
    SHADOW,
    TANK,
    Theme,
    Tone,
    TypeRole,
    font,
)
from study_app.gui.theme.themed import Coloured, Themed, name_scroll_bars, remove_widget, replace_inside

__all__ = [
    "LIGHT",
    "PARTICIPANT",
    "RADIUS_CARD",
    "RADIUS_CONTROL",
    "SHADOW",
    "TANK",
    "Coloured",
    "Theme",
    "Themed",
    "Tone",
    "TypeRole",
    "draw_icon",
    "font",
    "icon",
    "name_scroll_bars",
    "remove_widget",
    "replace_inside",
]
