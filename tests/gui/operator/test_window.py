"""The operator's window draws a view and says what the operator asks for."""

import sys
from dataclasses import replace

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QColor, QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.gui.operator import OperatorWindow
from study_app.gui.operator.stop_panel import LEAST_HEIGHT, LEAST_WIDTH
from study_app.gui.theme.theme import DARK
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


def test_without_force_on_the_hand_the_cockpit_says_so(qtbot, told):
    window = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=True, felt=False)
    qtbot.addWidget(window)
    told.welcome()
    window.show_view(told.view())
    assert window.stop.word.text() == "Visual only, no force"
    window.show_view(told.view(force_on=False))
    assert window.stop.word.text() == "Force is off"
    window.may_close = True


def test_a_view_becomes_texts_and_plots(running, told, health):
    assert running.header.study.text() == "demo"
    assert running.header.state.word == "Running"
    assert running.header.trials.text() == "0 of 4 trials"
    assert running.rail.heading.text() == "Trial 1 of 4"
    assert running.rail.now.elapsed.text() == "0:00 of 0:30"
    assert [card.value.text() for card in running.tiles.cards[:2]] == ["1000.0", "15"]
    assert len(running.rail.lines) == len(told.view(health).steps)
    assert running.stop.word.text() == "Force is on"
    running.show_lateness(health)
    plot = running.lateness.plot
    assert plot.p99_name.textItem.toPlainText() == "p99 15"
    assert "2" in plot.limit_name.textItem.toPlainText()
    health.hand(100.0, (0.09, 0.0, 0.0))
    running.show_traces(health, 100.0)
    assert running.position.plot.reach >= 90.0, "a hand beyond the plot widens it"


def pressed(qtbot, running, signal, question, reason):
    """Give a question its reason, which it needs, and go on; return what is asked for."""
    assert not question.go_on.isEnabled()
    question.reason.setText("  ")
    assert not question.go_on.isEnabled()
    question.reason.setText(reason)
    with qtbot.waitSignal(signal) as asked:
        qtbot.mouseClick(question.go_on, Qt.MouseButton.LeftButton)
    assert running.question is None
    return asked.args


def test_repeating_and_leaving_out_need_a_reason(running, qtbot):
    running.buttons.repeat.click()
    assert pressed(qtbot, running, running.repeat_asked, running.question, "phone rang") == ["phone rang"]
    for choice, trial in ((0, 1), (1, None)):
        running.buttons.exclude.click()
        running.question.choices.button(choice).setChecked(True)
        asked = pressed(qtbot, running, running.exclude_asked, running.question, "talked during the trial")
        assert asked == [trial, "talked during the trial"]


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


@pytest.mark.parametrize("done", range(5))
def test_the_bar_is_filled_as_far_as_the_line_below_it_says(window, told, done):
    told.welcome()
    for trial in told.schedule.trials[: done + 1]:
        told.start(trial.number)
    if done == len(told.schedule.trials):
        told.tell("session_ended", 1.0, status="completed", reason="")
    window.show_view(told.view())
    assert window.header.trials.text() == f"{done} of 4 trials"
    picture = window.header.bar.grab().toImage()
    middle = [picture.pixelColor(x, picture.height() // 2).name() for x in range(picture.width())]
    filled = middle.count(QColor(window.theme.accent).name()) / picture.width()
    assert filled == pytest.approx(done / 4, abs=0.08)  # gaps and round ends


def test_the_limit_a_trial_broke_can_be_read_in_the_smallest_window(window, told, health, qtbot):
    told.welcome()
    told.start(1)
    window.show_view(told.view(health))
    assert window.rail.tally.beyond.isHidden()
    told.end(1, worst_gap_ms=31.0)
    told.start(2)
    told.end(2, first_frame_gap_ms=272.0)
    window.resize(window.minimumSize())
    window.show_view(told.view(health))
    line = window.rail.tally.beyond
    assert line.text() == "Liquid setting 2 out of limits: time to the first frame 272 ms, limit 250 ms."
    assert "longest gap of the servo 31 ms" in line.toolTip()
    qtbot.waitUntil(lambda: line.height() >= line.heightForWidth(line.width()))
    qtbot.waitUntil(lambda: window.rail.tally.rect().contains(line.geometry()))


def test_stop_force_is_large_and_never_disabled_or_moved(window, told, health):
    told.welcome()
    place = window.stop.stop.mapTo(window, window.stop.stop.rect().topLeft())
    size = window.stop.stop.size()
    assert size.width() >= LEAST_WIDTH
    assert size.height() >= LEAST_HEIGHT
    told.start(1)
    views = [told.view(health), told.view(health, force_on=False), told.view(health, trouble="broken")]
    told.tell("paused", by="operator")
    views.append(told.view(health))
    told.tell("session_ended", status="completed", reason="")
    views.append(told.view(health))
    for view in views:
        window.show_view(view)
        QApplication.processEvents()
        assert window.stop.stop.isEnabled()
        assert window.stop.stop.isVisible()
        assert window.stop.stop.mapTo(window, window.stop.stop.rect().topLeft()) == place
        assert window.stop.stop.size() == size


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


def test_pause_becomes_resume_and_after_a_stop_the_panel_offers_the_way_back(running, told, health, qtbot):
    with qtbot.waitSignal(running.pause_asked):
        qtbot.mouseClick(running.buttons.pause, Qt.MouseButton.LeftButton)
    told.tell("paused", by="operator")
    running.show_view(told.view(health))
    assert running.buttons.pause.text() == "Resume"
    with qtbot.waitSignal(running.resume_asked):
        qtbot.mouseClick(running.buttons.pause, Qt.MouseButton.LeftButton)
    told.tell("force_stopped", by="operator")
    running.show_view(told.view(health, force_on=False))
    assert running.stop.word.text() == "Force is off"
    assert running.stop.fade_in.isVisible()
    with qtbot.waitSignal(running.fade_in_asked):
        qtbot.mouseClick(running.stop.fade_in, Qt.MouseButton.LeftButton)


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


def test_trouble_stands_above_everything_and_leaves_the_end(running, told, health):
    running.show_view(told.view(health, trouble="the device 'mouse' stopped responding"))
    assert running.banner.isVisible()
    assert "stopped responding" in running.banner.what.text()
    QApplication.processEvents()
    assert running.arrangement.middle_area.verticalScrollBar().maximum() == 0
    assert running.buttons.end.isEnabled()


def test_the_theme_changes_everything_at_once(running, qtbot):
    with qtbot.waitSignal(running.theme_changed) as changed:
        qtbot.mouseClick(running.header.theme_button, Qt.MouseButton.LeftButton)
    assert changed.args == [DARK]
    assert running.rail.theme is DARK
    assert running.position.plot.theme is DARK
    assert running.position.plot.backgroundBrush().color().name().upper() == DARK.surface
    assert running.position.plot.curves[0].opts["pen"].color().name().upper() == DARK.trace_x


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


def test_the_state_of_a_track_is_shown_where_there_is_one(running, told, health):
    track = running.rail.tally.track
    for lines in ((), ("Track V1: 9 of at most 24 answered", "longest run 8: check"), ()):
        running.show_view(replace(told.view(health), track=lines))
        assert track.isVisible() is bool(lines)
        assert not lines or track.text() == "Track V1: 9 of at most 24 answered  ·  longest run 8: check"
