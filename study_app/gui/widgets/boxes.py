"""Widgets and layouts next to each other, or one below the other."""

from typing import Any, Final, TypeAlias, TypeVar

import shiboken6
from PySide6.QtWidgets import QBoxLayout, QGridLayout, QHBoxLayout, QLayout, QVBoxLayout, QWidget

STRETCH: Final = "stretch"
"""A gap that takes the room that is left; in a tuple with its stretch."""
Part: TypeAlias = QWidget | QLayout | int | str | tuple[Any, ...]
"""A widget or layout, or a tuple with its stretch, and with its alignment; a gap [px]; or `STRETCH`."""
_Margins: TypeAlias = int | tuple[int, int, int, int] | None
"""The same on all sides [px], or left, top, right and bottom; None: the style's."""

_B = TypeVar("_B", bound=QBoxLayout)


def hbox(
    *parts: Part, spacing: int | None = None, margins: _Margins = None, parent: QWidget | None = None
) -> QHBoxLayout:
    """Return a row of parts, as the layout of ``parent`` if given."""
    return _box(QHBoxLayout(), parts, spacing, margins, parent)


def vbox(
    *parts: Part, spacing: int | None = None, margins: _Margins = None, parent: QWidget | None = None
) -> QVBoxLayout:
    """Return a column of parts, as the layout of ``parent`` if given."""
    return _box(QVBoxLayout(), parts, spacing, margins, parent)


def grid(
    across: int | None = None, down: int | None = None, *, margins: _Margins = None, parent: QWidget | None = None
) -> QGridLayout:
    """Return a grid with horizontal and vertical gaps [px], as the layout of ``parent`` if given."""
    made = QGridLayout(parent) if parent is not None else QGridLayout()
    if margins is not None:
        made.setContentsMargins(*((margins,) * 4 if isinstance(margins, int) else margins))
    if across is not None:
        made.setHorizontalSpacing(across)
    if down is not None:
        made.setVerticalSpacing(down)
    return made


def _box(box: _B, parts: tuple[Part, ...], spacing: int | None, margins: _Margins, parent: QWidget | None) -> _B:
    if parent is not None:
        parent.setLayout(box)
    if margins is not None:
        box.setContentsMargins(*((margins,) * 4 if isinstance(margins, int) else margins))
    if spacing is not None:
        box.setSpacing(spacing)
    add_parts(box, *parts)
    return box


def add_parts(box: QBoxLayout, *parts: Part) -> None:
    """Add parts at the end of a row or column."""
    for part in parts:
        added, *how = part if isinstance(part, tuple) else (part,)
        if isinstance(added, QLayout):
            add_layout(box, added, *how)
        elif isinstance(added, QWidget):
            box.addWidget(added, *how)
        elif isinstance(added, int):
            box.addSpacing(added)
        else:
            box.addStretch(*how)


def add_layout(outer: QBoxLayout | QGridLayout, inner: QLayout, *place: Any) -> None:
    """Add a layout to another one: at the end with its stretch, or at a position of a grid."""
    outer.addLayout(inner, *place)
    _release_items(inner)


def insert_layout(outer: QBoxLayout, at: int, inner: QLayout) -> None:
    """Insert a layout into a row or column."""
    outer.insertLayout(at, inner)
    _release_items(inner)


def _release_items(layout: QLayout) -> None:
    """Release PySide's wrappers of a layout's items when the layout is added to another one.

    PySide does not notice when Qt deletes an item; an event at its address would get the wrapper and its class.
    """
    for at in range(layout.count()):
        item = layout.itemAt(at)
        if isinstance(item, QLayout):
            _release_items(item)
        elif item is not None:
            shiboken6.invalidate(item)
