"""The note while a session is being made ready."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QProgressBar

from study_app.gui.home.startup_window import FIRST_TIME, OpeningWindow


@pytest.fixture
def opening(qtbot: Any) -> OpeningWindow:
    made = OpeningWindow("A first look", "Participant P001")
    qtbot.addWidget(made)
    made.show()
    qtbot.waitExposed(made)
    return made


def test_escape_goes_back_whichever_part_has_the_keyboard(opening: OpeningWindow, qtbot: Any) -> None:
    opening.cancel.setFocus()
    with qtbot.waitSignal(opening.cancelled):
        QTest.keyPress(opening.windowHandle(), Qt.Key.Key_Escape)
    assert not opening.isVisible()


def test_what_is_ready_is_not_cancelled(opening: OpeningWindow, qtbot: Any) -> None:
    with qtbot.assertNotEmitted(opening.cancelled):
        opening.finish()
    assert not opening.isVisible()


def test_the_share_that_is_compiled_fills_the_bar_and_says_why_it_takes_long(opening: OpeningWindow) -> None:
    (bar,) = opening.findChildren(QProgressBar)
    assert (bar.minimum(), bar.maximum()) == (0, 0)
    opening.show_compiled(0.4)
    assert (bar.value(), bar.maximum()) == (40, 100)
    assert opening.step.text() == FIRST_TIME
    opening.say("Push the lever.")
    opening.show_compiled(0.5)
    assert opening.step.text() == "Push the lever."
