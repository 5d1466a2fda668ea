"""The questionnaire by mouse alone, by keyboard alone, by touch alone, and as a screen reader finds it."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAccessible, QPointingDevice
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.forms import options_field, question_field, questions_page
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.pages.text_page import TextWidget
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.wording.languages import words
from study_app.session.pages import PausePage
from study_app.session.transitions.events import Chosen, Continue, ItemShown, LanguageChosen, ResumeAsked, Submitted
from tests.gui.small import STATEMENTS, ManualClock, questionnaire, text_page

pytestmark = pytest.mark.slow

GIVEN = (6, 5, 4, None, 7, 2, 1, 4, 7)
KEY = Qt.Key


class Opened:
    """A page in the participant's window, and what it told."""

    def __init__(self, qtbot: Any, page: Any, size: tuple[int, int] = (1366, 768)) -> None:
        self.window = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
        qtbot.addWidget(self.window)
        self.told: list[Any] = []
        self.window.event.connect(self._hear)
        self.window.resize(*size)
        self.window.show()
        self.window.activateWindow()
        qtbot.waitExposed(self.window)
        self.window.show_page(page)
        self.window.grab()
        QApplication.processEvents()

    def _hear(self, event: Any) -> None:
        if not isinstance(event, ItemShown):
            self.told.append(event)

    @property
    def page(self) -> Any:
        return self.window.widget

    @property
    def values(self) -> list[int | None]:
        return [event.value for event in self.told if isinstance(event, Chosen)]

    def close(self) -> None:
        QTest.mouseMove(self.window, QPoint(1, 1))  # or the next test's page comes with the mouse on a cell
        self.window.may_close = True
        self.window.close()


@pytest.fixture
def opened(qtbot: Any) -> Any:
    made = Opened(qtbot, questionnaire(cannot_judge="Cannot judge"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def finger() -> QPointingDevice:
    return QTest.createTouchDevice()


def tap(finger: QPointingDevice, widget: QWidget, place: QPoint | None = None) -> None:
    """Touch a widget with one finger and let go, as a touch screen tells it to the window."""
    window = widget.window()
    at = widget.mapTo(window, place or widget.rect().center())
    QTest.touchEvent(window, finger).press(0, at, window).commit()
    QTest.touchEvent(window, finger).release(0, at, window).commit()
    QApplication.processEvents()


def column(value: int | None) -> int:
    return 7 if value is None else value - 1


# by the mouse alone


def test_all_is_answered_by_the_mouse_alone(opened: Opened) -> None:
    for row, value in zip(opened.page.fields, GIVEN, strict=True):
        QTest.mouseClick(row.options[column(value)], Qt.MouseButton.LeftButton)
    QTest.mouseClick(opened.page.button, Qt.MouseButton.LeftButton)
    assert opened.values == list(GIVEN)
    assert isinstance(opened.told[-1], Submitted)


# by the keyboard alone


def press(*keys: KEY) -> None:
    for key in keys:
        focus = QApplication.focusWidget()
        assert focus is not None
        QTest.keyClick(focus, key)


def test_all_is_answered_by_the_keyboard_alone(opened: Opened) -> None:
    for value in GIVEN:
        if value is None:
            press(*[KEY.Key_Right] * 8, KEY.Key_Space)
        else:
            press(KEY(KEY.Key_0 + value))
    press(KEY.Key_Return)
    assert opened.values == list(GIVEN)
    assert isinstance(opened.told[-1], Submitted)


def test_backspace_goes_back_and_changes_nothing(opened: Opened) -> None:
    press(KEY.Key_6, KEY.Key_5, KEY.Key_Backspace)
    assert opened.page.fields[1].hasFocus()
    press(KEY.Key_Backspace, KEY.Key_Backspace)
    assert opened.page.fields[0].hasFocus()
    press(KEY.Key_2)
    assert opened.values == [6, 5, 2]
    opened.page.button.setFocus()
    press(KEY.Key_Backspace)
    assert opened.page.fields[8].hasFocus()


def test_arrows_on_the_button_move_among_the_statements(opened: Opened) -> None:
    opened.page.button.setFocus()
    press(KEY.Key_Left, KEY.Key_Right)
    assert opened.page.button.hasFocus()
    press(KEY.Key_Up)
    assert opened.page.fields[8].hasFocus()


# by touch alone


def test_all_is_answered_by_touch_alone(opened: Opened, finger: QPointingDevice) -> None:
    for row, value in zip(opened.page.fields, GIVEN, strict=True):
        tap(finger, row.options[column(value)])
    tap(finger, opened.page.fields[0].options[1], QPoint(2, 2))  # a change, at the corner of its cell
    tap(finger, opened.page.button)
    assert opened.values == [*GIVEN, 2]
    assert isinstance(opened.told[-1], Submitted)


def test_a_finger_that_is_lifted_points_at_nothing(opened: Opened, finger: QPointingDevice) -> None:
    fixed = opened.page.heading
    tap(finger, opened.page.fields[2].options[1])
    assert opened.page.heading == fixed
    assert not any(cell.pointed for row in opened.page.fields for cell in row.options)


def test_a_click_leaves_the_label_of_the_column_that_the_mouse_is_on(opened: Opened) -> None:
    cell = opened.page.fields[4].options[1]
    QTest.mouseMove(cell)
    QTest.mouseClick(cell, Qt.MouseButton.LeftButton)
    assert "Mostly disagree" in opened.page.heading


def test_touch_names_what_is_missing_and_goes_from_part_to_part(qtbot: Any, finger: QPointingDevice) -> None:
    opened = Opened(qtbot, questionnaire(), (1024, 640))
    opened.window.setMinimumSize(1, 1)
    opened.window.resize(880, 640)
    QApplication.processEvents()
    tap(finger, opened.page.tabs[1])
    assert [row.view.number for row in opened.page.fields if row.isVisible()] == [6, 7, 8, 9]
    tap(finger, opened.page.button)
    assert opened.page.message.endswith("6, 7, 8 and 9.")
    for row in opened.page.fields[5:]:
        tap(finger, row.options[2])
    tap(finger, opened.page.button)
    assert [row.view.number for row in opened.page.fields if row.isVisible()] == [1, 2, 3, 4, 5]
    opened.close()


def test_texts_languages_and_a_pause_work_by_touch(qtbot: Any, finger: QPointingDevice) -> None:
    opened = Opened(qtbot, text_page("consent", languages=("en", "nl")))
    assert isinstance(opened.page, TextWidget)
    assert opened.page.languages is not None
    tap(finger, opened.page.languages.buttons[1])
    tap(finger, opened.page.button)
    opened.window.show_page(PausePage(force_off=False))
    tap(finger, opened.page.button)
    assert [type(event) for event in opened.told] == [LanguageChosen, Continue, ResumeAsked]
    opened.close()


# for a screen reader


def told_of(widget: QWidget) -> Any:
    interface = QAccessible.queryAccessibleInterface(widget)
    assert interface is not None
    return interface


def test_a_screen_reader_finds_groups_of_radio_buttons_with_names_and_states(opened: Opened) -> None:
    role, text = QAccessible.Role, QAccessible.Text
    labels = [*(f"{n} {label}" for n, label in enumerate(opened.window.page.labels, 1)), "Cannot judge"]
    for number, (row, statement) in enumerate(zip(opened.page.fields, STATEMENTS, strict=True), 1):
        group = told_of(row)
        assert (group.role(), group.text(text.Name)) == (role.Grouping, f"{number}. {statement}")
        assert group.text(text.Description) == "no answer yet"
        for cell, label in zip(row.options, labels, strict=True):
            button = told_of(cell)
            assert (button.role(), button.text(text.Name)) == (role.RadioButton, label)
            assert button.text(text.Description) == statement
            assert button.state().checkable
            assert not button.state().checked
    press(KEY.Key_3)
    first = opened.page.fields[0]
    assert [bool(told_of(cell).state().checked) for cell in first.options] == [n == 2 for n in range(8)]
    assert told_of(first).text(text.Description) == "chosen: 3 Somewhat disagree"


def test_a_screen_reader_can_choose_by_itself(opened: Opened) -> None:
    told_of(opened.page.fields[3].options[5]).actionInterface().doAction("Toggle")
    assert opened.values == [6]


def test_what_is_pointed_at_chosen_and_missing_is_said(opened: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    for module in (options_field, question_field, questions_page):
        monkeypatch.setattr(module, "say", lambda _widget, text: said.append(text))
    press(KEY.Key_Right, KEY.Key_Space, KEY.Key_4)
    assert said == ["1 Completely disagree", "chosen: 1 Completely disagree", "chosen: 4 Neutral"]
    press(KEY.Key_Return)
    assert said[-1] == "Seven statements still need an answer: 3, 4, 5, 6, 7, 8 and 9."


def test_what_is_said_reaches_qt(qtbot: Any) -> None:
    was = QAccessible.isActive()
    QAccessible.setActive(True)
    opened = Opened(qtbot, questionnaire())
    press(KEY.Key_Right, KEY.Key_Space)  # an announcement that Qt refuses would be a warning, and fail
    opened.close()
    QAccessible.setActive(was)


def test_every_page_and_button_has_a_name(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page("consent", languages=("en", "nl")))
    for widget in (opened.page, opened.page.button, opened.page.languages, *opened.page.languages.buttons):
        assert told_of(widget).text(QAccessible.Text.Name)
    buttons = opened.page.languages.buttons
    assert [bool(told_of(button).state().checked) for button in buttons] == [True, False]
    opened.window.show_page(questionnaire())
    quest = opened.page
    assert isinstance(quest, QuestionnaireWidget)
    assert told_of(quest).text(QAccessible.Text.Name) == "Liquid setting 1"
    assert told_of(quest).text(QAccessible.Text.Description).startswith("How much do you agree")
    opened.close()
