"""Held keys, carried-over clicks and digit keys in every window with typing."""

from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QPlainTextEdit, QPushButton, QVBoxLayout, QWidget

from study_app.gui.key_presses import CLICK_MS, RELEASE_MS, digit_of, key_presses
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.widgets.main_view import HOLD_MS, EscapeKey
from study_app.protocol.wording.languages import words
from study_app.session.pages import PausePage
from study_app.session.transitions.events import Chosen, Continue, ForceStopped, PauseRequested, Submitted
from tests.gui.keyboard import Keyboard, PressesReceived, handle_in_focus
from tests.gui.small import ManualClock, choice, number, questionnaire, task_page, text_page
from tests.gui.windows import WINDOWS, two_screens

pytestmark = pytest.mark.slow

KEY = Qt.Key
SETTLED_MS = 3 * RELEASE_MS


@pytest.fixture
def keyboard() -> Keyboard:
    key_presses()
    return Keyboard()


@pytest.fixture
def received(qapp: QApplication) -> Iterator[PressesReceived]:
    spy = PressesReceived(qapp)
    yield spy
    qapp.removeEventFilter(spy)
    spy.deleteLater()


@pytest.fixture
def participant(qtbot: Any) -> Iterator[tuple[ParticipantWindow, list[Any]]]:
    window = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
    qtbot.addWidget(window)
    events: list[Any] = []
    window.event.connect(events.append)
    window.open_on()
    handle_in_focus(window, qtbot)
    yield window, events
    window.may_close = True
    window.close()


def of_kind(events: list[Any], *kinds: type) -> list[Any]:
    return [event for event in events if isinstance(event, kinds)]


@pytest.mark.parametrize("name", [name for name in WINDOWS if name != "rehearsal"])  # Enter would begin it
@pytest.mark.parametrize("key", [KEY.Key_Return, KEY.Key_Space, KEY.Key_Escape], ids=lambda key: key.name)
def test_a_held_key_is_one_press_in_every_window(
    qtbot: Any, tmp_path: Any, monkeypatch: Any, keyboard: Keyboard, received: PressesReceived, name: str, key: Any
) -> None:
    two_screens(monkeypatch)
    window = WINDOWS[name][0](qtbot, tmp_path).window()
    handle_in_focus(window, qtbot)
    begun_ms = keyboard.time_ms
    keyboard.hold(key, repeats=6)
    qtbot.wait(SETTLED_MS)
    assert received.times_ms in ([begun_ms], [])  # none if the window closed with its first event
    for other in QApplication.topLevelWidgets():
        other.close()


def test_a_held_digit_answers_one_statement(qtbot: Any, participant: Any, keyboard: Keyboard) -> None:
    window, events = participant
    window.show_page(questionnaire())
    keyboard.hold(KEY.Key_4, repeats=20, text="4")
    qtbot.wait(SETTLED_MS)
    assert [(event.item, event.value) for event in of_kind(events, Chosen)] == [("item1", 4)]
    keyboard.hold(KEY.Key_1, repeats=20, text="1")
    qtbot.wait(SETTLED_MS)
    assert [event.value for event in of_kind(events, Chosen)] == [4, 1]


def test_a_held_enter_leaves_one_page_and_a_new_press_the_next(
    qtbot: Any, participant: Any, keyboard: Keyboard
) -> None:
    window, events = participant
    window.show_page(text_page("consent"))
    window.event.connect(lambda _event: window.show_page(text_page()))
    keyboard.hold(KEY.Key_Return, repeats=20)
    qtbot.wait(SETTLED_MS)
    assert len(of_kind(events, Continue)) == 1
    keyboard.hold(KEY.Key_Return, repeats=20)
    assert len(of_kind(events, Continue)) == 2


def test_a_key_that_is_down_when_a_page_appears_does_nothing_there(
    qtbot: Any, participant: Any, keyboard: Keyboard
) -> None:
    window, events = participant
    window.show_page(text_page())
    keyboard.press(KEY.Key_Right)
    window.show_page(choice())  # of two answers, → is the second
    keyboard.repeat(KEY.Key_Right, 5)
    keyboard.release(KEY.Key_Right)
    qtbot.wait(SETTLED_MS)
    assert of_kind(events, Chosen) == []
    keyboard.press(KEY.Key_Right)
    assert len(of_kind(events, Chosen)) == 1
    assert len(of_kind(events, Submitted)) == 1


def test_text_and_moves_repeat_where_they_began(qtbot: Any, keyboard: Keyboard) -> None:
    window = QWidget()
    first, lines = QLineEdit(), QPlainTextEdit()
    layout = QVBoxLayout(window)
    layout.addWidget(first)
    layout.addWidget(lines)
    qtbot.addWidget(window)
    window.show()
    first.setFocus()
    handle_in_focus(window, qtbot)
    keyboard.hold(KEY.Key_A, repeats=4, text="a")
    assert first.text() == "aaaaa"
    keyboard.hold(KEY.Key_Backspace, repeats=2)
    assert first.text() == "aa"
    keyboard.press(KEY.Key_A, text="a")
    lines.setFocus()
    keyboard.repeat(KEY.Key_A, 3, text="a")
    assert (first.text(), lines.toPlainText()) == ("aaa", "")
    keyboard.time_ms += 300
    keyboard.hold(KEY.Key_A, repeats=2, text="a")
    keyboard.hold(KEY.Key_Return, repeats=3, text="\r")
    assert lines.toPlainText() == "aaa\n"


def test_the_release_of_a_held_button_clicks_once_and_late(qtbot: Any, keyboard: Keyboard) -> None:
    button = QPushButton("Go")
    qtbot.addWidget(button)
    clicks: list[bool] = []
    button.clicked.connect(lambda: clicks.append(True))
    button.show()
    handle_in_focus(button, qtbot)
    button.setFocus()
    keyboard.hold(KEY.Key_Space, repeats=10, text=" ")
    assert clicks == [], "a release is real only if no press with its time stamp follows"
    qtbot.waitUntil(lambda: len(clicks) == 1)


def test_a_shortcut_acts_once_per_press(qtbot: Any, keyboard: Keyboard) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    window.show()
    handle_in_focus(window, qtbot)
    override = QEvent.Type.ShortcutOverride
    assert not keyboard.send(override, KEY.Key_A)
    for _ in range(3):  # the shortcut took the press, so that no press follows
        keyboard.time_ms += 40
        keyboard.release(KEY.Key_A)
        assert keyboard.send(override, KEY.Key_A), "a repeat is not offered to shortcuts"
        keyboard.send(QEvent.Type.KeyPress, KEY.Key_A)
    keyboard.time_ms += 40
    keyboard.release(KEY.Key_A)
    keyboard.time_ms += 300
    assert not keyboard.send(override, KEY.Key_A)


@pytest.mark.parametrize("repeats_from_ms", [200, 300, 500, 660, None])
def test_escape_that_repeats_is_held_and_not_tapped(
    qtbot: Any, participant: Any, keyboard: Keyboard, repeats_from_ms: int | None
) -> None:
    window, events = participant
    window.show_page(task_page())
    keyboard.press(KEY.Key_Escape)
    if repeats_from_ms is not None:
        for due_ms in range(repeats_from_ms, HOLD_MS, 40):
            QTest.qWait(40 if due_ms > repeats_from_ms else repeats_from_ms)
            keyboard.repeat(KEY.Key_Escape, 1)
    qtbot.waitUntil(lambda: len(of_kind(events, ForceStopped)) == 1, timeout=5 * HOLD_MS)
    window.show_page(PausePage(force_off=True, held="force"))
    keyboard.repeat(KEY.Key_Escape, 3)
    keyboard.release(KEY.Key_Escape)
    qtbot.wait(SETTLED_MS)
    assert of_kind(events, PauseRequested, ForceStopped) == [ForceStopped(events[-1].at_s, "participant")]


def test_a_tapped_escape_pauses(qtbot: Any, participant: Any, keyboard: Keyboard) -> None:
    window, events = participant
    window.show_page(task_page())
    keyboard.hold(KEY.Key_Escape, repeats=2)
    qtbot.waitUntil(lambda: len(of_kind(events, PauseRequested)) == 1)
    qtbot.wait(HOLD_MS + SETTLED_MS)
    assert of_kind(events, ForceStopped) == []


def test_a_hold_that_the_program_was_too_busy_to_time_counts_by_its_time_stamps(qtbot: Any, keyboard: Keyboard) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    window.show()
    handle_in_focus(window, qtbot)
    escape = EscapeKey(window, anywhere=True)
    signals: list[str] = []
    escape.held.connect(lambda: signals.append("held"))
    escape.tapped.connect(lambda: signals.append("tapped"))
    for lasts_ms, expected in ((HOLD_MS - 1, "tapped"), (HOLD_MS, "held")):
        keyboard.press(KEY.Key_Escape)
        keyboard.time_ms += lasts_ms
        keyboard.release(KEY.Key_Escape)
        qtbot.waitUntil(lambda expected=expected: expected in signals)
        keyboard.time_ms += 300
    assert signals == ["tapped", "held"]


def test_a_release_that_no_window_received_leaves_no_key_down(qtbot: Any, participant: Any, keyboard: Keyboard) -> None:
    window, events = participant
    window.show_page(questionnaire())
    other = QWidget()
    qtbot.addWidget(other)
    keyboard.press(KEY.Key_4, text="4")
    keyboard.press(KEY.Key_Escape)
    other.show()
    handle_in_focus(other, qtbot)  # where both come up
    qtbot.wait(HOLD_MS + SETTLED_MS)
    assert of_kind(events, ForceStopped, PauseRequested) == []
    handle_in_focus(window, qtbot)
    keyboard.time_ms += 2000
    keyboard.hold(KEY.Key_4, repeats=0, text="4")
    assert [event.value for event in of_kind(events, Chosen)] == [4, 4]
    keyboard.press(KEY.Key_Escape)
    qtbot.waitUntil(lambda: len(of_kind(events, ForceStopped)) == 1, timeout=5 * HOLD_MS)


def test_two_keys_at_once_are_two_presses(qtbot: Any, participant: Any, keyboard: Keyboard) -> None:
    window, events = participant
    window.show_page(questionnaire())
    keyboard.press(KEY.Key_4, text="4")
    keyboard.time_ms += 10
    keyboard.press(KEY.Key_1, text="1")
    keyboard.repeat(KEY.Key_1, 5, text="1")
    keyboard.time_ms += 10
    keyboard.release(KEY.Key_4, text="4")
    keyboard.release(KEY.Key_1, text="1")
    qtbot.wait(SETTLED_MS)
    assert [event.value for event in of_kind(events, Chosen)] == [4, 1]


def test_a_click_within_a_quarter_of_a_second_of_a_page_is_ignored(qtbot: Any, participant: Any) -> None:
    window, events = participant
    window.show_page(text_page())

    def click() -> None:
        place = window.widget.button.mapTo(window, window.widget.button.rect().center())
        QTest.mouseClick(window.windowHandle(), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, place)
        QApplication.processEvents()

    click()
    assert of_kind(events, Continue) == []
    qtbot.wait(CLICK_MS // 2)
    click()
    assert of_kind(events, Continue) == []
    qtbot.wait(CLICK_MS)
    click()
    assert len(of_kind(events, Continue)) == 1


FRENCH = {
    10: (KEY.Key_Ampersand, "&"),
    11: (KEY.Key_Eacute, "é"),
    12: (KEY.Key_QuoteDbl, '"'),
    13: (KEY.Key_Apostrophe, "'"),
}


@pytest.mark.parametrize(("scan", "digit"), [(10, 1), (11, 2), (12, 3), (13, 4)])
def test_the_digit_row_of_a_french_keyboard_answers(
    qtbot: Any, participant: Any, keyboard: Keyboard, scan: int, digit: int
) -> None:
    window, events = participant
    window.show_page(questionnaire())
    key, text = FRENCH[scan]
    keyboard.hold(key, repeats=5, text=text, scan=scan)
    assert [event.value for event in of_kind(events, Chosen)] == [digit]


def test_the_digit_row_of_a_french_keyboard_types_digits_into_a_number_field(
    qtbot: Any, participant: Any, keyboard: Keyboard
) -> None:
    window, events = participant
    window.show_page(number())
    for scan in (13, 11):
        key, text = FRENCH[scan]
        keyboard.hold(key, repeats=0, text=text, scan=scan)
    keyboard.hold(KEY.Key_Comma, repeats=0, text=",", scan=58)
    keyboard.hold(KEY.Key_Ampersand, repeats=1, text="&", scan=10)
    assert window.widget.field.text() == "42,11"
    keyboard.hold(KEY.Key_Return, repeats=3)
    assert [event.value for event in of_kind(events, Chosen)] == [42.11]


@pytest.mark.parametrize(
    ("key", "scan", "modifiers", "digit"),
    [
        (KEY.Key_7, 16, Qt.KeyboardModifier.NoModifier, 7),
        (KEY.Key_7, 79, Qt.KeyboardModifier.KeypadModifier, 7),
        (KEY.Key_Agrave, 19, Qt.KeyboardModifier.NoModifier, 0),
        (KEY.Key_Exclam, 10, Qt.KeyboardModifier.ShiftModifier, None),
        (KEY.Key_Q, 24, Qt.KeyboardModifier.NoModifier, None),
        (KEY.Key_Eacute, 0, Qt.KeyboardModifier.NoModifier, None),
    ],
)
def test_digits_by_meaning_or_by_place(key: Any, scan: int, modifiers: Any, digit: int | None) -> None:
    assert digit_of(QKeyEvent(QEvent.Type.KeyPress, key, modifiers, scan, 0, 0)) == digit
