"""Screens, graphics card and frame clock."""

from study_app.gui.display.display_check import check_display, missing_for_windows, naming_missing_library
from study_app.gui.display.screens import WITHOUT_OPENGL, Frames, choose_screens, has_graphics_card, place_window

__all__ = [
    "WITHOUT_OPENGL",
    "Frames",
    "check_display",
    "choose_screens",
    "has_graphics_card",
    "missing_for_windows",
    "naming_missing_library",
    "place_window",
]
