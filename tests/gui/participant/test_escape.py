"""Esc pauses, and held down it stops the force."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.gui.widgets.escape_key import HOLD_MS, EscapeHold
from study_app.session.pages import EndPage, Page, PausePage, TroublePage
from study_app.session.transitions.events import ForceStopped, ItemShown, PauseAsked
from tests.gui.participant.screens import Opened
from tests.gui.small import questionnaire, task_page, text_page


def is_a_force_stop(event: Any) -> bool:
    return isinstance(event, ForceStopped)


@pytest.mark.parametrize("page", [text_page(), task_page(), questionnaire()], ids=lambda page: type(page).__name__)
def test_short_escape_pauses(opened: Opened, page: Page) -> None:
    opened.window.show_page(page)
    QTest.keyClick(opened.focus, Qt.Key.Key_Escape)
    assert [event for event in opened.events if not isinstance(event, ItemShown)] == [
        PauseAsked(opened.events[-1].at_s, "participant")
    ]


@pytest.mark.slow
def test_escape_held_stops_the_force_and_does_not_pause_as_well(opened: Opened, qtbot: Any) -> None:
    opened.window.show_page(task_page())
    with qtbot.waitSignal(opened.window.event, timeout=5 * HOLD_MS):
        QTest.keyPress(opened.focus, Qt.Key.Key_Escape)
    QTest.keyRelease(opened.focus, Qt.Key.Key_Escape)
    assert opened.events == [ForceStopped(opened.events[0].at_s, "participant")]


@pytest.mark.slow
def test_escape_held_while_the_page_changes_stops_the_force_all_the_same(opened: Opened, qtbot: Any) -> None:
    opened.window.show_page(task_page())
    with qtbot.waitSignal(opened.window.event, timeout=5 * HOLD_MS, check_params_cb=is_a_force_stop):
        QTest.keyPress(opened.focus, Qt.Key.Key_Escape)
        opened.window.show_page(questionnaire())
        opened.window.show_page(text_page())
    QTest.keyRelease(opened.focus, Qt.Key.Key_Escape)
    assert [kind for kind in opened.kinds if kind is not ItemShown] == [ForceStopped]


def test_escape_held_while_the_window_is_left_stops_nothing(opened: Opened) -> None:
    opened.window.show_page(task_page())
    QTest.keyPress(opened.focus, Qt.Key.Key_Escape)
    QApplication.sendEvent(opened.window, QEvent(QEvent.Type.WindowDeactivate))
    QTest.keyRelease(opened.focus, Qt.Key.Key_Escape)
    assert not opened.window.findChild(EscapeHold).findChild(QTimer).isActive()
    assert opened.events == []


def test_short_escape_on_a_pause_or_an_end_does_nothing(opened: Opened) -> None:
    for page in (PausePage(force_off=False), TroublePage("a", "b"), EndPage("a", "b")):
        opened.window.show_page(page)
        QTest.keyClick(opened.focus, Qt.Key.Key_Escape)
    assert opened.events == []
