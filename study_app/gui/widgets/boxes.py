"""Widgets and layouts next to each other, or one below the other."""

from typing import Any, Final, TypeAlias, TypeVar

from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QLayout, QVBoxLayout, QWidget

STRETCH: Final = "stretch"
"""A gap that takes the room that is left; in a tuple with its stretch."""
Part: TypeAlias = QWidget | QLayout | int | str | tuple[Any, ...]
"""A widget or layout, or a tuple with its stretch, and with its alignment; a gap [px]; or `STRETCH`."""
Margins: TypeAlias = int | tuple[int, int, int, int] | None
"""The same on all sides [px], or left, top, right and bottom; None: the style's."""

B = TypeVar("B", bound=QBoxLayout)


def hbox(
    *parts: Part, spacing: int | None = None, margins: Margins = None, parent: QWidget | None = None
) -> QHBoxLayout:
    """Return a row of parts, as the layout of ``parent`` where there is one."""
    return _box(QHBoxLayout(), parts, spacing, margins, parent)


def vbox(
    *parts: Part, spacing: int | None = None, margins: Margins = None, parent: QWidget | None = None
) -> QVBoxLayout:
    """Return a column of parts, as the layout of ``parent`` where there is one."""
    return _box(QVBoxLayout(), parts, spacing, margins, parent)


def _box(box: B, parts: tuple[Part, ...], spacing: int | None, margins: Margins, parent: QWidget | None) -> B:
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
            box.addLayout(added, *how)
        elif isinstance(added, QWidget):
            box.addWidget(added, *how)
        elif isinstance(added, int):
            box.addSpacing(added)
        else:
            box.addStretch(*how)
