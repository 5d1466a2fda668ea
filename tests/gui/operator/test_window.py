"""The operator's window draws a view and says what the operator asks for."""

import sys

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.gui.operator import OperatorWindow
from study_app.gui.widgets.escape_key import HOLD_MS

pytestmark = pytest.mark.slow

# The platform without a screen cannot limit or raise windows, and says so.


@pytest.fixture
def window(qtbot):
    made = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=True)
    qtbot.addWidget(made)
    made.show()
    qtbot.waitExposed(made)
    yield made
    made.may_close = True
    if made.question is not None:
        made.question.reject()
    made.close()


@pytest.fixture
def running(window, told, health):
    told.welcome()
    told.start(1)
    window.show_view(told.view(health))
    return window


def test_ending_asks_first_one_question_at_a_time_and_says_status_and_reason(running, qtbot):
    qtbot.mouseClick(running.buttons.end, Qt.MouseButton.LeftButton)
    question = running.question
    running.ask_to_repeat()
    running.ask_to_end()
    assert running.question is question
    qtbot.waitUntil(lambda: question.focusWidget() is not None)
    assert question.focusWidget() is question.choices.checkedButton()
    with qtbot.assertNotEmitted(running.end_asked):
        qtbot.mouseClick(question.back, Qt.MouseButton.LeftButton)
    assert running.question is None
    running.ask_to_end()
    running.question.choices.button(0).click()
    running.question.reason.setText("felt unwell")
    with qtbot.waitSignal(running.end_asked) as asked:
        qtbot.mouseClick(running.question.go_on, Qt.MouseButton.LeftButton)
    assert asked.args == ["withdrawn", "felt unwell"]


def test_a_note_is_kept_by_enter_unless_it_is_empty_and_listed_newest_first(running, told, health, qtbot):
    with qtbot.assertNotEmitted(running.note_written):
        qtbot.keyClick(running.notes.field, Qt.Key.Key_Return)
        qtbot.mouseClick(running.notes.add, Qt.MouseButton.LeftButton)
    running.notes.field.setPlainText("left-handed")
    with qtbot.waitSignal(running.note_written) as written:
        qtbot.keyClick(running.notes.field, Qt.Key.Key_Return)
    assert written.args == ["left-handed"]
    assert running.notes.field.toPlainText() == ""
    told.tell("note", kind="note", text="one")
    told.tell("note", kind="mark", text="")
    running.show_view(told.view(health))
    assert [line.text.text() for line in running.notes.lines[:2]] == ["Mark", "one"]
    assert running.notes.lines[2].isHidden()


def test_escape_held_stops_the_force_and_a_tap_does_not(running, qtbot):
    handle = running.windowHandle()
    asked = []
    running.stop_asked.connect(lambda: asked.append(True))
    QTest.keyPress(handle, Qt.Key.Key_Escape)
    QTest.keyRelease(handle, Qt.Key.Key_Escape)
    assert not running.escape.findChild(QTimer).isActive()
    assert asked == []
    with qtbot.waitSignal(running.stop_asked, timeout=HOLD_MS * 5):
        QTest.keyPress(handle, Qt.Key.Key_Escape)
    QTest.keyRelease(handle, Qt.Key.Key_Escape)


def test_a_question_about_a_trial_goes_with_the_trial(running, told, health, qtbot):
    running.ask_to_repeat()
    told.end(1)
    running.show_view(told.view(health))
    assert running.question is not None  # its statements are being answered
    told.answer(1)
    told.start(2)
    with qtbot.assertNotEmitted(running.repeat_asked):
        running.show_view(told.view(health))
    assert running.question is None


def test_keyboard_is_on_close_session_once_the_session_is_over(running, told, health, qtbot):
    running.header.page.show()  # as where both windows share a screen
    running.buttons.end.setFocus()
    told.tell("session_ended", status="aborted", reason="", fingerprint="wwww-mmmm-wwww")
    running.show_view(told.view(health, force_on=False))
    assert running.focusWidget() is running.buttons.close_session
    with qtbot.waitSignal(running.close_asked):
        qtbot.keyClick(running.focusWidget(), Qt.Key.Key_Return)


def test_no_question_keeps_a_hand_from_the_force_stop_or_from_escape(running, qtbot):
    running.ask_to_end()
    assert running.question.windowModality() == Qt.WindowModality.NonModal
    with qtbot.waitSignal(running.stop_asked):
        qtbot.mousePress(running.stop.stop, Qt.MouseButton.LeftButton)
    qtbot.mouseRelease(running.stop.stop, Qt.MouseButton.LeftButton)
    running.question.activateWindow()
    handle = running.question.windowHandle()
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is handle)
    with qtbot.waitSignal(running.stop_asked, timeout=HOLD_MS * 5):
        QTest.keyPress(handle, Qt.Key.Key_Escape)


def test_closing_is_left_to_who_listens_until_the_session_is_over(running, told, health, qtbot):
    with qtbot.waitSignal(running.close_asked):
        running.close()
    assert running.isVisible()
    told.tell("session_ended", status="completed", reason="")
    running.show_view(told.view(health))
    assert running.buttons.close_session.isVisible()
    running.close()
    assert not running.isVisible()


@pytest.mark.slow
def test_repainting_the_live_plots_keeps_no_reference_to_none(running, health):
    """The PySide pin: from 6.10 on this count drifts with every repaint until the interpreter aborts."""
    for _ in range(5):
        running.show_traces(health, 4.0)
        running.show_lateness(health)
        QApplication.processEvents()
    before = sys.getrefcount(None)
    for step in range(200):
        running.show_traces(health, 4.0 + 0.03 * step)
        if step % 15 == 0:
            running.show_lateness(health)
        running.position.plot.viewport().repaint()
    assert abs(sys.getrefcount(None) - before) < 100
