"""Rows, columns and grids of widgets and layouts."""

from typing import Any, Final, TypeAlias, TypeVar

import shiboken6
from PySide6.QtWidgets import QBoxLayout, QGridLayout, QHBoxLayout, QLayout, QVBoxLayout, QWidget

STRETCH: Final = "stretch"
"""A gap that fills the remaining space; a tuple adds its stretch factor."""
Part: TypeAlias = QWidget | QLayout | int | str | tuple[Any, ...]
"""A widget or layout, a gap [px] or `STRETCH`; or a tuple of one of them with its stretch factor and alignment."""
_Margins: TypeAlias = int | tuple[int, int, int, int] | None
"""One margin for all sides [px], or left, top, right and bottom; None for the default of the style."""

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
    layout = QGridLayout(parent) if parent is not None else QGridLayout()
    if margins is not None:
        layout.setContentsMargins(*((margins,) * 4 if isinstance(margins, int) else margins))
    if across is not None:
        layout.setHorizontalSpacing(across)
    if down is not None:
        layout.setVerticalSpacing(down)
    return layout


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
        item, *options = part if isinstance(part, tuple) else (part,)
        if isinstance(item, QLayout):
            add_layout(box, item, *options)
        elif isinstance(item, QWidget):
            box.addWidget(item, *options)
        elif isinstance(item, int):
            box.addSpacing(item)
        else:
            box.addStretch(*options)


def add_layout(outer: QBoxLayout | QGridLayout, inner: QLayout, *place: Any) -> None:
    """Add a layout to a box, optionally with a stretch factor, or to a grid at a position."""
    outer.addLayout(inner, *place)
    _release_items(inner)


def insert_layout(outer: QBoxLayout, at: int, inner: QLayout) -> None:
    """Insert a layout into a row or column."""
    outer.insertLayout(at, inner)
    _release_items(inner)


def _release_items(layout: QLayout) -> None:
    """Release PySide's wrappers of a layout's items when the layout is added to another one.

    PySide does not notice when Qt deletes an item; an event later allocated at its address would get the wrapper.
    """
    for at in range(layout.count()):
        item = layout.itemAt(at)
        if isinstance(item, QLayout):
            _release_items(item)
        elif item is not None:
            shiboken6.invalidate(item)
