"""The operator's window draws a view and emits the operator's requests."""

import sys
from dataclasses import replace

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QColor, QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.gui.operator.operator_view import TrialTime
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.widgets.main_view import HOLD_MS
from study_app.number_text import clock_text

pytestmark = pytest.mark.slow

# The platform without a screen cannot limit or raise windows, and says so.


@pytest.fixture
def window(qtbot):
    operator_window = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=True)
    qtbot.addWidget(operator_window)
    operator_window.show()
    qtbot.waitExposed(operator_window)
    yield operator_window
    operator_window.may_close = True
    if operator_window.question is not None:
        operator_window.question.reject()
    operator_window.close()


@pytest.fixture
def running(window, demo_session, health):
    demo_session.welcome()
    demo_session.start(1)
    window.show_view(demo_session.view(health))
    return window


def stops(what, _details):
    return what == "stop"


def test_escape_held_stops_the_force_and_a_tap_does_not(running, qtbot):
    handle = running.windowHandle()
    requests = []
    running.asked.connect(lambda *_asked: requests.append(True))
    QTest.keyPress(handle, Qt.Key.Key_Escape)
    QTest.keyRelease(handle, Qt.Key.Key_Escape)
    assert not running.escape.findChild(QTimer).isActive()
    assert requests == []
    with qtbot.waitSignal(running.asked, timeout=HOLD_MS * 5, check_params_cb=stops):
        QTest.keyPress(handle, Qt.Key.Key_Escape)
    QTest.keyRelease(handle, Qt.Key.Key_Escape)


def test_the_first_button_asks_to_pause_and_during_a_pause_to_resume(running, demo_session, health):
    requests = []
    running.asked.connect(lambda request, _details: requests.append(request))
    running.buttons.pause.click()
    demo_session.tell("paused", by="operator")
    running.show_view(demo_session.view(health))
    running.buttons.pause.click()
    assert requests == ["pause", "resume"]


def test_a_question_about_a_trial_goes_with_the_trial(running, demo_session, health, qtbot):
    running.ask_to_repeat()
    demo_session.end(1)
    running.show_view(demo_session.view(health))
    assert running.question is not None  # its statements are being answered
    demo_session.answer(1)
    demo_session.start(2)
    with qtbot.assertNotEmitted(running.asked):
        running.show_view(demo_session.view(health))
    assert running.question is None


def test_keyboard_is_on_close_session_once_the_session_is_over(running, demo_session, health, qtbot):
    running.header.page.show()  # as where both windows share a screen
    running.buttons.end.setFocus()
    demo_session.tell("session_ended", status="aborted", reason="", fingerprint="wwww-mmmm-wwww")
    running.show_view(demo_session.view(health, force_on=False))
    assert running.focusWidget() is running.buttons.close_session
    with qtbot.waitSignal(running.asked, check_params_cb=lambda what, _: what == "close"):
        qtbot.keyClick(running.focusWidget(), Qt.Key.Key_Return)


def test_no_question_keeps_a_hand_from_the_force_stop_or_from_escape(running, qtbot):
    running.ask_to_end()
    assert running.question.windowModality() == Qt.WindowModality.NonModal
    with qtbot.waitSignal(running.asked, check_params_cb=stops):
        qtbot.mousePress(running.stop.stop, Qt.MouseButton.LeftButton)
    qtbot.mouseRelease(running.stop.stop, Qt.MouseButton.LeftButton)
    running.question.activateWindow()
    handle = running.question.windowHandle()
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is handle)
    with qtbot.waitSignal(running.asked, timeout=HOLD_MS * 5, check_params_cb=stops):
        QTest.keyPress(handle, Qt.Key.Key_Escape)


def test_the_force_stop_shows_its_sign_above_its_name_and_below_it_the_other_ways(running):
    stop = running.stop.stop
    picture, ink = stop.grab().toImage(), QColor(stop.theme.on_stop)
    rows = {y for y in range(picture.height()) for x in range(picture.width()) if picture.pixelColor(x, y) == ink}
    middle = stop.height() // 2
    for part, first, last in (("sign", -66, -10), ("name", 2, 36), ("other ways", 42, 78)):
        inked = rows & set(range(middle + first, middle + last))
        assert len(inked) >= 8, part


@pytest.mark.slow
@pytest.mark.skipif(sys.version_info >= (3, 12), reason="from Python 3.12 on None is immortal: no count ends a program")
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


def test_an_ended_session_that_waits_for_the_disk_asks_to_keep_the_window_open(running, demo_session, health):
    demo_session.tell("session_ended", status="completed", reason="", fingerprint="wwww-mmmm")
    running.show_view(demo_session.view(health, trouble="no space left on the disk", waits=True, force_on=False))
    assert "leave this window open" in running.banner.then.text()
    running.show_view(demo_session.view(health, trouble="the device stopped responding", force_on=False))
    assert running.banner.then.text().startswith("The session is closed")


STATES = {
    "preparing": ("neutral", "clock"),
    "running": ("accent", "play"),
    "paused": ("warn", "pause"),
    "force off": ("warn", "stop"),
    "trouble": ("bad", "warning"),
    "ended": ("neutral", "cross"),
}


def test_each_chip_of_the_header_shows_its_own_state(window, demo_session, health):
    header, view = window.header, demo_session.view(health)
    for state, sign in STATES.items():
        window.show_view(replace(view, state=state, state_word=f"Word of {state}"))
        assert (header.state.tone, header.state.icon, header.state.word) == (*sign, f"Word of {state}")
    window.show_view(replace(view, state="ended", state_word="Complete"))
    assert (header.state.tone, header.state.icon) == ("ok", "check")
    for blinding, icon, word in (("single", "eye", "Single-blind"), ("double", "lock", "Double-blind")):
        window.show_view(replace(view, blinding=blinding))
        assert (header.blind.icon, header.blind.word) == (icon, word)
    for saved_ago_s, over, icon, word in (
        (None, False, "ring", "Nothing to save yet"),
        (1.9, False, "check", "Just saved to disk"),
        (2.1, False, "check", "All saved to disk"),
        (1.9, True, "check", "All saved to disk"),
    ):
        window.show_view(replace(view, saved_ago_s=saved_ago_s, over=over))
        assert (header.saved.icon, header.saved.word) == (icon, word)
    window.show_view(replace(view, study="Study", who="P7", elapsed_s=61, expected_s=770, main_trials=(3, 8)))
    texts = [part.text() for part in (header.clock, header.expected, header.trials)]
    assert texts == ["1:01", "of about 13 min", "3 of 8 trials"]
    assert (header.study.accessibleName(), header.who.accessibleName()) == ("Study", "P7")


@pytest.mark.parametrize(
    ("facts", "hint"),
    [
        ({"over": True}, "The journal is closed and the tables have been written."),
        ({"over": True, "trouble": "it broke"}, ""),
        ({"waits": True, "state": "trouble"}, "The force is off. The answers are kept in memory until they can be "
         "written to disk."),
        ({"state": "trouble"}, "The force is off. All answers so far are on disk."),
        ({"state": "force off"}, "The force stays off until you turn it on again."),
        ({"state": "paused"}, "An interrupted trial starts again."),
        ({"may_repeat": True}, "You will be asked for a reason; both recordings are kept."),
        ({"may_repeat": False}, ""),
    ],
)  # fmt: skip
def test_the_hint_below_the_buttons_fits_the_state(window, demo_session, health, facts, hint):
    window.show_view(replace(demo_session.view(health), **{"state": "running", **facts}))
    assert window.buttons.hint.text() == hint


@pytest.mark.parametrize(
    ("facts", "advice", "offered"),
    [
        ({}, "End the session, fix the cause, then start a new one.", False),
        ({"may_reconnect": True}, "Plug in the device, then reconnect it.", True),
        ({"may_reconnect": True, "reconnection": "Looking…"}, "Looking…", True),
        ({"waits": True}, "Free up some disk space or reconnect the drive. The session will then", False),
        ({"over": True, "may_reconnect": True}, "The session is closed and the force is off.", False),
        ({"over": True, "waits": True}, "leave this window open until", False),
    ],
)
def test_the_banner_of_a_fault_gives_advice(window, demo_session, health, facts, advice, offered):
    banner = window.banner
    for reconnects in (False, True):
        faulty_view = replace(demo_session.view(health), trouble="the device is gone", reconnects=reconnects, **facts)
        window.show_view(faulty_view)
        assert banner.what.text() == "The device is gone"
        assert advice in banner.then.text()
        assert (banner.reconnect.isHidden(), banner.reconnect.isEnabled()) == (not offered, not reconnects)
    window.show_view(replace(faulty_view, trouble=""))
    assert banner.isHidden()


def test_buttons_notes_and_counts_follow_the_view(window, demo_session, health):
    buttons, notes, rail = window.buttons, window.notes, window.rail
    demo_session.tell("note", 5.0, kind="note", text="slow  hand")
    demo_session.tell("note", 70.0, kind="mark", text="")
    shown_view = replace(
        demo_session.view(health),
        trial_time=TrialTime(elapsed_s=30.0, least_s=15.0, most_s=60.0),
        beyond=("Newest", "Older"),
        counts=(("Answers on disk", "3 of 8"), ("Marks, repeats", "1, 2")),
    )
    for pauses, resumes, repeats, word in ((True, False, True, "Pause"), (False, True, False, "Resume")):
        window.show_view(replace(shown_view, may_pause=pauses, may_resume=resumes, may_repeat=repeats))
        assert (buttons.pause.text(), buttons.pause.isEnabled(), buttons.repeat.isEnabled()) == (word, True, repeats)
    window.show_view(replace(shown_view, may_pause=False, may_resume=False))
    assert not buttons.pause.isEnabled()
    assert [(row.sign.name, row.sign.ink, row.time.text(), row.text.accessibleName()) for row in notes.lines[:2]] == [
        ("flag", "warn", clock_text(shown_view.notes[0].t_s), "Mark"),
        ("pen", "text2", clock_text(shown_view.notes[0].t_s - 70), "slow hand"),
    ]
    assert notes.lines[2].isHidden()
    assert [(name.text(), value.text()) for name, value in rail.tally.counts] == list(shown_view.counts)
    assert (rail.tally.beyond.text(), rail.tally.beyond.toolTip()) == ("Newest.", "Newest\nOlder")
    assert (rail.now.elapsed.text(), rail.now.least.text()) == ("0:30 of 1:00", "at least 0:15")
    assert (rail.now.bar.share, rail.now.bar.tick) == (0.5, 0.25)
    for over in (False, True):
        window.show_view(replace(shown_view, over=over, state="ended" if over else "running"))
        assert [part.isEnabled() for part in (notes.add, notes.mark, notes.field)] == [not over] * 3
        assert [part.isHidden() for part in (buttons.pause, buttons.repeat, buttons.end)] == [over] * 3
        assert buttons.close_session.isHidden() == (not over)


def test_enter_adds_the_note_shift_enter_a_line_and_each_button_sends_its_request(running, qtbot):
    requests = []
    running.asked.connect(lambda request, _details: requests.append(request))
    written, notes = [], running.notes
    notes.note_written.connect(written.append)
    notes.add.click()
    assert (requests, written, running.focusWidget()) == ([], [], notes.field)
    qtbot.keyClicks(notes.field, "left hand")
    qtbot.keyClick(notes.field, Qt.Key.Key_Return, Qt.KeyboardModifier.ShiftModifier)
    qtbot.keyClicks(notes.field, "tired")
    assert written == []
    qtbot.keyClick(notes.field, Qt.Key.Key_Enter)
    assert (written, requests, notes.field.toPlainText()) == (["left hand\ntired"], ["note"], "")
    qtbot.keyClick(notes.field, Qt.Key.Key_Return)
    assert requests == ["note"]
    for button, text, request in (
        (notes.mark, "Mark", "mark"),
        (running.device.diagnose, "Diagnose…", "diagnose"),
        (running.stop.fade_in, "Fade in again", "resume"),
    ):
        requests.clear()
        button.click()
        assert (button.text(), requests) == (text, [request])
