"""Forms are answered by keys, mouse, touch or screen reader alone, in a page and in a session."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAccessible, QPointingDevice
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.forms.question_form import FormWidget
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.protocol.wording.languages import words
from study_app.session.transitions.commands import ShowPage, Write
from study_app.session.transitions.events import Begin, Submitted, TaskDone
from study_app.session.transitions.state import Phase
from study_app.session.transitions.table import advance, open_session
from tests.gui.participant.forms.opened_form import KEY, Opened, click, tap
from tests.gui.small import ManualClock
from tests.protocol.forms.mixed import mixed_file


def test_nothing_is_preset_and_every_shown_question_is_told_once(opened: Opened) -> None:
    assert opened.told == []
    assert [event.item for event in opened.events] == ["age", "hand", "used", "thick", "pleasant", "comment"]
    assert not opened.field("pleasant").line.touched
    opened.settle()
    assert len(opened.events) == 6


def test_all_is_answered_by_keys_alone(opened: Opened) -> None:
    opened.type("42")
    opened.press(KEY.Key_Return, KEY.Key_2)
    opened.press(KEY.Key_1, KEY.Key_3, KEY.Key_Down)
    opened.press(KEY.Key_Right, KEY.Key_Right, KEY.Key_Space)
    opened.press(KEY.Key_End, KEY.Key_PageDown, KEY.Key_Left, KEY.Key_Down)
    opened.type("Fine.")
    opened.press(KEY.Key_Return, KEY.Key_Return)
    assert opened.answers == [
        ("age", 42),
        ("hand", "right"),
        ("used", ("mouse",)),
        ("used", ("mouse", "other")),
        ("thick", 2),
        ("pleasant", 100),
        ("pleasant", 50),
        ("pleasant", 45),
        ("comment", "Fine."),
    ]
    assert isinstance(opened.told[-1], Submitted)


def test_all_but_a_text_is_answered_by_mouse_alone(opened: Opened) -> None:
    pad = {key.text(): key for key in opened.field("age").keys}
    for digit in "42":
        click(pad[digit])
    click(opened.field("hand").options[0], QPoint(2, 2))
    click(opened.field("used").options[1])
    click(opened.field("thick").options[5])
    line = opened.field("pleasant").line
    click(line, QPoint(line.width() - 2, line.height() // 2))
    click(opened.page.button)
    assert opened.answers == [("age", 42), ("hand", "left"), ("used", ("falcon",)), ("thick", None), ("pleasant", 100)]
    assert isinstance(opened.told[-1], Submitted)


def test_all_but_a_text_is_answered_by_touch_alone(opened: Opened, finger: QPointingDevice) -> None:
    pad = {key.text(): key for key in opened.field("age").keys}
    for digit in "73":
        tap(finger, pad[digit])
    tap(finger, pad["⌫"])
    tap(finger, pad["5"])
    tap(finger, opened.field("hand").options[1])
    tap(finger, opened.field("thick").options[0])
    line = opened.field("pleasant").line
    tap(finger, line, QPoint(2, line.height() // 2))
    tap(finger, opened.page.button)
    assert opened.answers == [("age", 75), ("hand", "right"), ("thick", 1), ("pleasant", 0)]
    assert isinstance(opened.told[-1], Submitted)


def test_screen_reader_finds_names_states_and_actions(opened: Opened) -> None:
    rating, slider = opened.field("thick"), opened.field("pleasant")
    assert rating.accessibleName() == "5. How thick was it?"
    assert rating.accessibleDescription() == "no answer yet"
    point = QAccessible.queryAccessibleInterface(rating.options[3])
    assert point.text(QAccessible.Text.Name) == "4 Rather"
    assert point.role() == QAccessible.Role.RadioButton
    point.actionInterface().doAction("Toggle")
    assert rating.accessibleDescription() == "chosen: 4 Rather"
    box = QAccessible.queryAccessibleInterface(opened.field("used").options[2])
    assert box.role() == QAccessible.Role.CheckBox
    box.actionInterface().doAction("Toggle")
    assert "no answer yet" in slider.line.accessibleDescription()
    QAccessible.queryAccessibleInterface(slider.line).valueInterface().setCurrentValue(7)
    assert opened.answers == [("thick", 4), ("used", ("other",)), ("pleasant", 35)]
    assert "chosen: 35" in slider.line.accessibleDescription()


def test_wheel_changes_no_slider(opened: Opened) -> None:
    line = opened.field("pleasant").line
    opened.press(KEY.Key_Down)
    centre = line.mapTo(opened.window, line.rect().center())
    QTest.wheelEvent(opened.window.windowHandle(), centre, QPoint(0, 120))
    QApplication.processEvents()
    assert not line.touched
    assert opened.answers == []


ENTERED = {"number": "33", "text": "Fine."}
KEYS = {"choice": (Qt.Key.Key_1,), "rating": (Qt.Key.Key_2,), "slider": (Qt.Key.Key_Home, Qt.Key.Key_Right)}


class Session:
    """The state machine and the window, each telling the other."""

    def __init__(self, study: Any, window: ParticipantWindow) -> None:
        self.window = window
        self.written: list[Write] = []
        key = draw_key(study, stream(1, "key").random)
        self.state = open_session(study, build_schedule(study, "P001", 1), key, "en")
        window.event.connect(self.post)

    def post(self, event: Any) -> None:
        self.state, commands = advance(self.state, event)
        for command in commands:
            if isinstance(command, Write):
                self.written.append(command)
            if isinstance(command, ShowPage) and self.state.phase is not Phase.TASK:
                self.window.show_page(command.page)


@pytest.mark.slow
def test_session_with_forms_is_done_by_keys_alone(tmp_path: Path, qtbot: Any) -> None:
    study = load(mixed_file(tmp_path))
    window = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
    qtbot.addWidget(window)
    window.resize(1366, 768)
    window.show()
    window.activateWindow()
    qtbot.waitExposed(window)
    session = Session(study, window)
    session.post(Begin(0.0))
    for _ in range(200):
        QApplication.processEvents()
        if session.state.phase is Phase.COMPLETE:
            break
        if session.state.phase is Phase.TASK:
            session.post(TaskDone(1.0, "complete", {}))
            continue
        assert isinstance(window.widget, FormWidget)
        page, focused = window.widget, QApplication.focusWidget()
        assert focused is not None
        field = next((one for one in page.part if one is focused or one.isAncestorOf(focused)), None)
        if field is None:
            QTest.keyClick(focused, Qt.Key.Key_Return)
            continue
        QTest.keyClicks(focused, ENTERED.get(field.view.widget, ""))
        for key in KEYS.get(field.view.widget, ()):
            QTest.keyClick(focused, key)
        if QApplication.focusWidget() is focused:
            QTest.keyClick(focused, Qt.Key.Key_Down)
    assert session.state.phase is Phase.COMPLETE
    answered = [
        row for one in session.written if one.event in ("form_answered", "responses") for row in one.fields["items"]
    ]
    assert len(answered) == 3 + 2 * 3 + 6 + 10 + 1
    assert all(row["onset_s"] is not None and row["first_s"] is not None for row in answered)
    values = {row["item"]: row["value"] for row in answered}
    assert (values["age"], values["hand"], values["used"]) == (33, "left", ("mouse",))
    assert (values["thickness"], values["pleasant"], values["effort"], values["sus10"]) == (2, 5, 5, 2)
    window.may_close = True
    window.close()
