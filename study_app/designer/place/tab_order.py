"""The order in which Tab goes through parts that are made after what follows them: Qt would put them last."""

from collections.abc import Callable, Sequence
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


def go_on(parts: Sequence[QWidget], by_qt: Callable[[bool], bool], *, forward: bool) -> bool:
    """Let Tab go through parts one after another, then to the beginning of the window, or Shift+Tab back.

    Within a part the order is Qt's, ``by_qt``, with two exceptions: Qt leaves the part too early, or goes to the focus
    proxy of an editor and skips widgets between the focused one and the proxy, such as the entries of a list.
    """
    window = parts[0].window()
    shown = [(part, found) for part in parts if (found := _shown(part))]
    here = window.focusWidget()
    at = next((at for at, (part, _) in enumerate(shown) if here is not None and part.isAncestorOf(here)), None)
    if at is None and forward and shown and here is not None and here.isAncestorOf(parts[0]):
        shown[0][1][0].setFocus(Qt.FocusReason.TabFocusReason)  # from the place itself
        return True
    if at is None or here not in shown[at][1]:
        return by_qt(forward)
    part, found = shown[at]
    rest = found[found.index(here) + 1 :] if forward else found[: found.index(here)][::-1]
    if rest:
        moved = by_qt(forward)
        there = window.focusWidget()
        if there is not None and part.isAncestorOf(there):
            if forward and (first := _first(here, there)) in rest:
                first.setFocus(Qt.FocusReason.TabFocusReason)
            return moved
    to = rest[0] if rest else _entry(shown, at, window, forward=forward)
    if to is None:
        return by_qt(forward)
    to.setFocus(Qt.FocusReason.TabFocusReason if forward else Qt.FocusReason.BacktabFocusReason)
    return True


def _first(here: QWidget, there: QWidget) -> QWidget:
    """Return the first stop of the editor that Tab came into by its focus proxy, else where Tab went."""
    first, around = there, there.parentWidget()
    while around is not None and not around.isAncestorOf(here):
        if around.focusProxy() is not None:
            first = _shown(around)[0]
        around = around.parentWidget()
    return first


def _entry(
    shown: Sequence[tuple[QWidget, list[QWidget]]], at: int, window: QWidget, *, forward: bool
) -> QWidget | None:
    """Return the stop at which Tab enters the part after another one, or Shift+Tab the part before."""
    if not forward:
        return shown[at - 1][1][-1] if at else None
    if at + 1 == len(shown):
        return next(iter(_shown(window)), None)
    part, found = shown[at + 1]
    return next((one for one in found if one is part.focusProxy()), found[0])


def _shown(part: QWidget) -> list[QWidget]:
    return [one for one in stops(part) if one.isVisible() and one.isEnabled()]
