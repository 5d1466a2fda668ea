"""Screens, graphics card and frame clock."""

from study_app.gui.display.screens import WITHOUT_OPENGL, Frames, choose_screens, has_graphics_card, place_window

__all__ = ["WITHOUT_OPENGL", "Frames", "choose_screens", "has_graphics_card", "place_window"]
