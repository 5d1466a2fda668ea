"""Widgets that several windows share.

Reading order: accessible, background, boxes, live_plots, main_view; labels; cards; controls, numbers, row_table.
"""

from study_app.gui.widgets.accessible import announce, button_text, plain_tip
from study_app.gui.widgets.background import Background, delayed_call, wait_for_jobs
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, grid, hbox, insert_layout, vbox
from study_app.gui.widgets.cards import (
    QWIDGETSIZE_MAX,
    Bar,
    Card,
    Chip,
    Icon,
    Rule,
    chip_size,
    fill_rounded,
    paint_chip,
    paint_ground,
    scrolled,
    smooth_painter,
)
from study_app.gui.widgets.controls import ActionButton, Check, Choice, IconButton, PressedByEnter, Toggle
from study_app.gui.widgets.labels import Clamped, Elided, Ink, figures, label, set_ink, set_property
from study_app.gui.widgets.main_view import Place, last_focused
from study_app.gui.widgets.numbers import Range

__all__ = [
    "QWIDGETSIZE_MAX",
    "STRETCH",
    "ActionButton",
    "Background",
    "Bar",
    "Card",
    "Check",
    "Chip",
    "Choice",
    "Clamped",
    "Elided",
    "Icon",
    "IconButton",
    "Ink",
    "Place",
    "PressedByEnter",
    "Range",
    "Rule",
    "Toggle",
    "add_layout",
    "add_parts",
    "announce",
    "button_text",
    "chip_size",
    "delayed_call",
    "figures",
    "fill_rounded",
    "grid",
    "hbox",
    "insert_layout",
    "label",
    "last_focused",
    "paint_chip",
    "paint_ground",
    "plain_tip",
    "scrolled",
    "set_ink",
    "set_property",
    "smooth_painter",
    "vbox",
    "wait_for_jobs",
]
