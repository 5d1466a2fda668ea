"""Each control and shortcut of every window: its name, its tip, and its effect.

``actions.txt`` has a line for each: ``name | tip | signals, opened dialogs, and the first text that appears``
(the designer's texts follow later). It is changed by hand: no option regenerates it.
"""

import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QTimer
from PySide6.QtGui import QAction, QShortcut
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QPlainTextEdit, QWidget
from shiboken6 import isValid

from study_app.designer.window import DesignerPlace
from tests.designer.support.designer import Designer
from tests.designer.support.inputs import name_of
from tests.gui.states import STATES
from tests.gui.transcript import CONTROLS, is_usable, listen, use
from tests.gui.walk import settle
from tests.gui.windows import WINDOWS, two_screens

pytestmark = pytest.mark.slow

FILE = Path(__file__).with_name("actions.txt")
TABLE = {
    window: lines for window, *lines in (part.split("\n") for part in FILE.read_text("utf-8").strip().split("\n\n"))
}
LAST = re.compile(
    "Cancel|Close|Leave|^Home$|theme$|^Help$|^Results$|^Liquid lab$|^Study designer$|^This machine$|Display"
)
"""Controls that are used at the end, since they leave the page."""
REPEATED = re.compile(r"(of|Rehearse) (Feeling|How|Which) ")
"""Controls of further studies, which are those of the first one."""
UNUSED = re.compile("Play from|^Stop$|^Feel|^Rehearse$|^Refresh$")
"""Controls whose effect takes time."""
LEFT = re.compile("'leave entries'|LeaveText")
"""Signals of the field that the keyboard leaves."""
SHORT = ((r"Theme\(name=('\w+').*", r"\1)"), (r"asked\('change', \('([\w.]+)'.*", r"change \1"))
"""Signals whose values are long, or depend on the width of a slider."""


def test_every_window_is_in_the_table() -> None:
    others = {window for window in TABLE if window.startswith("designer, ")}
    assert TABLE.keys() - others == WINDOWS.keys() | STATES.keys() - {"operator, single-blind"}


@pytest.mark.parametrize("window", TABLE)
def test_each_control_has_its_tip_and_effect(
    qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, window: str
) -> None:
    two_screens(monkeypatch)
    monkeypatch.chdir(tmp_path)
    if window.startswith("designer, "):
        window_shown = _designer(tmp_path, *window.removeprefix("designer, ").split("."))
    else:
        window_shown = WINDOWS[window][0](qtbot, tmp_path) if window in WINDOWS else STATES[window][0](qtbot)
    settle(window_shown)
    rows = [" | ".join(row).rstrip(" |") for row in _used(window_shown)]
    for left in QApplication.topLevelWidgets():
        left.hide()
    assert rows == TABLE[window]


def _designer(folder: Path, *path: str) -> QWidget:
    """Return the designer with an element of the demo, whose requests are not carried out."""
    designer = Designer(folder)
    designer.open("kitchen", *(int(step) if step.isdecimal() else step for step in path))
    designer.place.asked.disconnect(designer.controller.handle_request)
    return designer.place


def _used(window: QWidget) -> Iterator[tuple[str, str, str]]:
    """Yield name, tip and effect of each control, then of each shortcut."""
    heard, others = listen(window), {widget for widget in QApplication.topLevelWidgets() if widget.isVisible()}
    names_done: set[str] = set()
    while controls := [widget for widget in window.findChildren(QWidget) if _is_new(widget, names_done)]:
        control = min(controls, key=_order)
        names_done.add(name_of(control))
        tip = control.toolTip().replace("\n", " ")
        yield name_of(control), tip, _effect(window, heard, others, partial(use, control))
    for shortcut in filter(isValid, window.findChildren(QShortcut)):
        yield shortcut.key().toString(), "", _effect(window, heard, others, shortcut.activated.emit)
    for action in filter(isValid, window.findChildren(QAction)):
        if action.shortcuts():
            yield action.shortcut().toString(), action.toolTip(), _effect(window, heard, others, action.trigger)


def _order(control: QWidget) -> int:
    return 2 if LAST.search(name_of(control)) else int(isinstance(control, QLineEdit | QPlainTextEdit))


def _is_new(part: QWidget, names_done: set[str]) -> bool:
    left_out = not isinstance(part, CONTROLS) or REPEATED.search(name_of(part)) or UNUSED.search(name_of(part))
    return not left_out and is_usable(part) and name_of(part) not in {"", *names_done}


def _texts(window: QWidget) -> list[str]:
    return [part.text() for part in window.findChildren(QLabel) if part.isVisible() and part.text()]


def _effect(window: QWidget, heard: list[str], others: set[QWidget], act: Callable[[], object]) -> str:
    """Return the signals of an act, the dialogs that it opened, and the first text that it showed at once."""
    before, dialogs, was_visible = _texts(window), list[str](), window.isVisible()
    heard.clear()

    def close_dialogs() -> None:
        for other in QApplication.topLevelWidgets():
            if other.isVisible() and other not in others:
                dialogs.append(f"opens {other.windowTitle()}")
                other.close()

    closing = QTimer(interval=50)
    closing.timeout.connect(close_dialogs)
    closing.start()
    act()
    QApplication.processEvents()
    closing.stop()
    close_dialogs()
    new = [] if isinstance(window, DesignerPlace) else [text for text in _texts(window) if text not in before][:1]
    for pattern, short in SHORT:
        heard[:] = [re.sub(pattern, short, signal) for signal in heard if not LEFT.search(signal)]
    closes = ["closes"] * (was_visible and not window.isVisible())
    return "; ".join([*dict.fromkeys(heard), *dialogs, *new, *closes]).replace("\n", " ")
