"""Every window at its least and its usual size: nothing is cut, everything has a name, no button is dead."""

from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible
from PySide6.QtWidgets import QApplication, QLabel

from tests.gui.walk import cut, dead, misnamed, settle, unnamed, unreached, upright
from tests.gui.windows import WINDOWS, two_screens

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def nothing_left(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    two_screens(monkeypatch)
    yield
    for window in QApplication.topLevelWidgets():
        window.close()


@pytest.mark.parametrize("name", WINDOWS)
def test_every_window_fits_names_its_widgets_and_connects_its_buttons(qtbot: Any, tmp_path: Any, name: str) -> None:
    make, sizes = WINDOWS[name]
    window = make(qtbot, tmp_path)
    for size in sizes:
        settle(window, size)

        def fits() -> None:
            assert cut(window) == []

        qtbot.waitUntil(fits)
        assert size is None or window.size().toTuple() == size
    assert unnamed(window) == []
    assert misnamed(window) == []
    assert unreached(window) == []
    assert dead(window) == []
    assert upright(window) == []
    guessing = [each for each in window.findChildren(QLabel) if each.textFormat() is Qt.TextFormat.AutoText]
    assert [each.text() for each in guessing] == [], "Qt would take <b> in a study's text for markup"
    if name.startswith(("opening", "preflight")):
        assert QAccessible.queryAccessibleInterface(window).role() == QAccessible.Role.Window
