"""The order in which Tab goes through parts that are made after what follows them: Qt would put them last."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget


def stops(part: QWidget) -> list[QWidget]:
    """Return what Tab can go to in a part, in the order in which it was made."""
    return [
        one
        for one in part.findChildren(QWidget)  # lists that drop down are windows of their own
        if one.focusPolicy() & Qt.FocusPolicy.TabFocus and one.focusProxy() is None and one.window() is part.window()
    ]


def lead_by_tab(first: QWidget, parts: Sequence[QWidget]) -> None:
    """Let Tab go from a part to others, one after another."""
    for before, after in pairwise((first, *parts)):
        QWidget.setTabOrder(before, after)


def beyond(here: QWidget | None, parts: Sequence[QWidget], *, forward: bool) -> QWidget | None:
    """Return where Tab goes from the last stop of a part, or Shift+Tab from the first one; None from any other stop.

    It goes to the next of the parts that is shown, and from the last one to the beginning of the window.
    """
    shown = [(part, found) for part in parts if (found := [one for one in stops(part) if _takes_keyboard(one)])]
    at = next((at for at, (_, found) in enumerate(shown) if here is found[-1 if forward else 0]), None)
    if at is None or (at == 0 and not forward):
        return None
    if not forward:
        return shown[at - 1][1][-1]
    if at + 1 == len(shown):
        return next(one for one in stops(shown[at][0].window()) if _takes_keyboard(one))
    part, found = shown[at + 1]
    return next((one for one in found if one is part.focusProxy()), found[0])


def _takes_keyboard(part: QWidget) -> bool:
    return part.isVisible() and part.isEnabled()
