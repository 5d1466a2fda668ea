"""Forms are answered by keys, mouse, touch or screen reader alone."""

from PySide6.QtCore import QPoint
from PySide6.QtGui import QAccessible, QPointingDevice
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.session.transitions.events import Submitted
from tests.gui.participant.forms.opened_form import KEY, Opened, click, tap


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
