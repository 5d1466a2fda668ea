"""The pages of a design's one question, feedback, and the controls where a level is set."""

import time
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QImage, QKeyEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from study_app.gui.participant.intervals.choice_page import ChoiceWidget
from study_app.gui.participant.intervals.feedback_page import FeedbackWidget
from study_app.gui.participant.intervals.number_page import NumberWidget
from study_app.gui.participant.intervals.setting_controls import STEP_MS, SettingControls
from study_app.gui.participant.pointer_capture import PointerCapture
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.questions.choice import ChoiceView
from study_app.protocol.questions.number import NumberView
from study_app.protocol.trials.task import lasting
from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import ChoicePage, FeedbackPage, Interval, NumberPage, Progress, TaskPage
from study_app.session.transitions.events import Chosen, Continue, ItemShown, PauseAsked, Stepped, Submitted
from tests.gui.participant.screens import Opened
from tests.gui.small import follow, task_page, view

ORDINALS = ("first", "second", "third", "fourth")


SOME = Progress(1, 1, "Pair 57", 57, 220, at_most=True)


def choice_page(count: int = 2, language: str = "en") -> ChoicePage:
    said = words(language)
    options = tuple((name, said.design_answers[name]) for name in ORDINALS[:count])
    return ChoicePage(1, ChoiceView("choice", 1, said.design_questions["forced_choice"], True, options=options), SOME)


def number_page(language: str = "en") -> NumberPage:
    said = words(language)
    text = f"{said.modulus.format(number=10)} {said.design_questions['estimation']}"
    return NumberPage(1, NumberView("strength", 1, text, True, least=1e-9), SOME)


def choice(qtbot: QtBot, count: int = 2, language: str = "en", size: tuple[int, int] = (1366, 768)) -> Any:
    return shown(qtbot, ChoiceWidget(choice_page(count, language), words(language), lambda: 1.0), size)


def number(qtbot: QtBot, language: str = "en") -> Any:
    return shown(qtbot, NumberWidget(number_page(language), words(language), lambda: 1.0))


def shown(qtbot: QtBot, widget: Any, size: tuple[int, int] = (1366, 768)) -> Any:
    """Return a page that is shown, and what it said."""
    said: list[Any] = []
    widget.event_made.connect(said.append)
    qtbot.addWidget(widget)
    widget.resize(*size)
    widget.show()
    widget.focus_first()
    QApplication.processEvents()
    return widget, said


def answers(said: list[Any]) -> list[Any]:
    return [event.value for event in said if isinstance(event, Chosen)]


@pytest.mark.parametrize("size", [(1024, 640), (1366, 768)])
def test_buttons_are_large_apart_in_order_named_and_none_is_preselected(qtbot: QtBot, size: tuple[int, int]) -> None:
    page, said = choice(qtbot, 4, size=size)
    assert [type(event) for event in said] == [ItemShown]
    assert [one.text() for one in page.buttons] == ["First", "Second", "Third", "Fourth"]
    assert not any(one.hasFocus() or one.isDefault() for one in page.buttons)
    for button in page.buttons:
        assert button.width() >= 160
        assert button.height() >= 96
        assert button.font().pixelSize() >= 22
        assert (button.accessibleName(), button.accessibleDescription()) == (button.text(), "Which one was stronger?")
    gaps = [b.x() - a.geometry().right() - 1 for a, b in zip(page.buttons, page.buttons[1:], strict=False)]
    assert min(gaps) >= 24
    assert page.buttons[-1].geometry().right() < size[0]


@pytest.mark.parametrize(
    ("key", "language", "value"),
    [
        (Qt.Key.Key_1, "en", "first"),
        (Qt.Key.Key_2, "en", "second"),
        (Qt.Key.Key_Left, "en", "first"),
        (Qt.Key.Key_Right, "en", "second"),
        (Qt.Key.Key_1, "ar", "first"),
        (Qt.Key.Key_Right, "ar", "first"),
        (Qt.Key.Key_Left, "ar", "second"),
    ],
)
def test_one_key_answers_and_continues_once(qtbot: QtBot, key: Qt.Key, language: str, value: str) -> None:
    page, said = choice(qtbot, language=language)
    assert (page.buttons[0].x() > page.buttons[1].x()) == (language == "ar")
    QTest.keyClick(page, key)
    QTest.keyClick(page, Qt.Key.Key_2)
    assert answers(said) == [value]
    assert sum(isinstance(event, Submitted) for event in said) == 1


def test_a_key_that_is_held_from_the_page_before_answers_nothing(qtbot: QtBot) -> None:
    page, said = choice(qtbot)
    held = QKeyEvent(QEvent.Type.KeyPress, Qt.Key.Key_1, Qt.KeyboardModifier.NoModifier, "1", True)
    QApplication.sendEvent(page, held)
    assert answers(said) == []


def test_a_click_answers_and_of_four_the_arrows_and_enter(qtbot: QtBot) -> None:
    page, said = choice(qtbot)
    QTest.mouseClick(page.buttons[1], Qt.MouseButton.LeftButton, pos=QPoint(5, 5))
    assert answers(said) == ["second"]
    page, said = choice(qtbot, 4)
    QTest.keyClick(page, Qt.Key.Key_Right)
    QTest.keyClick(page.buttons[0], Qt.Key.Key_Right)
    assert answers(said) == []
    QTest.keyClick(page.buttons[1], Qt.Key.Key_Return)
    assert answers(said) == ["second"]


@pytest.mark.parametrize(("typed", "value"), [("12", 12), ("2.5", 2.5), ("2,5", 2.5), ("1e3", 1000)])
def test_a_number_above_0_is_taken_with_point_or_comma(qtbot: QtBot, typed: str, value: float) -> None:
    page, said = number(qtbot)
    assert page.field.height() >= 96
    QTest.keyClicks(page.field, typed)
    QTest.keyClick(page.field, Qt.Key.Key_Return)
    assert answers(said) == [value]


@pytest.mark.parametrize("typed", ["", "0", "-3", "many", "nan", "inf", "1e400"])
def test_what_is_no_number_above_0_is_reported_and_not_accepted(qtbot: QtBot, typed: str) -> None:
    page, said = number(qtbot)
    QTest.keyClicks(page.field, typed)
    QTest.keyClick(page.field, Qt.Key.Key_Return)
    assert answers(said) == []
    assert page.wrong.text() == "Enter a number above 0."
    QTest.keyClicks(page.field, "4")
    assert page.wrong.text() == ""


def test_digits_on_the_screen_write_a_number(qtbot: QtBot) -> None:
    page, said = number(qtbot)
    keys = {key.text(): key for key in page.keys}
    for text in ("4", "2", "⌫", ".", "5"):
        assert min(keys[text].width(), keys[text].height()) >= 44
        QTest.mouseClick(keys[text], Qt.MouseButton.LeftButton)
    QTest.mouseClick(page.button, Qt.MouseButton.LeftButton)
    assert answers(said) == [4.5]


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("right", [True, False])
def test_feedback_says_in_words_whether_the_answer_was_correct(qtbot: QtBot, language: str, right: bool) -> None:
    said = words(language)
    page, _ = shown(qtbot, FeedbackWidget(FeedbackPage(right), said, lambda: 1.0))
    assert page.accessibleName() == (said.right if right else said.not_right)


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(
    ("size", "text_scale"), [((1366, 716), 1.0), ((1024, 640), 1.0), ((1366, 716), 2.0), ((1024, 640), 2.0)]
)
def test_everything_fits_apart_and_can_be_hit(
    qtbot: QtBot, language: str, size: tuple[int, int], text_scale: float
) -> None:
    said = words(language)
    for widget in (
        ChoiceWidget(choice_page(4, language), said, lambda: 1.0, text_scale=text_scale),
        NumberWidget(number_page(language), said, lambda: 1.0, text_scale=text_scale),
        FeedbackWidget(FeedbackPage(False), said, lambda: 1.0, text_scale=text_scale),
    ):
        page, _ = shown(qtbot, widget, size)
        if isinstance(page, NumberWidget):
            QTest.keyClick(page.field, Qt.Key.Key_Return)  # what is wrong is reported
            QApplication.processEvents()
        assert (page.width(), page.height()) == size
        parts = [one for one in page.findChildren(QWidget) if one.isVisible() and not one.findChildren(QWidget)]
        places = [QRect(one.mapTo(page, QPoint(0, 0)), one.size()) for one in parts]
        for one, place in zip(parts, places, strict=True):
            assert page.rect().contains(place), one
            if isinstance(one, QLabel) and one.wordWrap():
                assert one.height() >= one.heightForWidth(one.width()) - 1, one.text()
            elif isinstance(one, QLabel):
                assert one.width() >= one.sizeHint().width(), one.text()
            if isinstance(one, QAbstractButton | QLineEdit):
                assert min(place.width(), place.height()) >= 44
        for one, other in combinations(places, 2):
            assert not one.intersects(other)


@pytest.mark.parametrize("page", [choice_page(), number_page(), FeedbackPage(True)])
def test_escape_pauses(opened: Any, page: Any) -> None:
    opened.window.show_page(page)
    QApplication.processEvents()
    QTest.keyClick(opened.focus, Qt.Key.Key_Escape)
    assert [event.by for event in opened.events if isinstance(event, PauseAsked)] == ["participant"]


def test_digits_on_the_screen_keep_their_order_from_right_to_left(qtbot: QtBot) -> None:
    page, _ = number(qtbot, "ar")
    row = [page.keys[place].x() for place in range(6)]
    assert [key.text() for key in page.keys[:6]] == ["1", "2", "3", "4", "5", "6"]
    assert row == sorted(row)


QUESTION = "Adjust the second one until both are equally strong."


def page(*, adjusts: bool, language: str = "en", resting: bool = False) -> TaskPage:
    number = 2 if adjusts or resting else 1
    announced = "Next: the second" if resting else ("First of 2", "Second of 2")[number - 1]
    task = lasting(follow(), 60.0) if adjusts else follow()
    question = words(language).design_questions["adjustment"]
    made: TaskPage = task_page(task, question=question, interval=Interval(number, 2, resting, announced))
    return replace(made, adjusts=adjusts)


def setting(opened: Opened) -> SettingControls:
    """Show the standard, the rest and the interval that is set, as a session does; return the controls."""
    for one in (page(adjusts=False), page(adjusts=False, resting=True), page(adjusts=True)):
        opened.window.show_page(one)
        QApplication.processEvents()
    controls = opened.window.widget.controls
    assert isinstance(controls, SettingControls)
    return controls


def steps(opened: Opened) -> list[int]:
    return [event.steps for event in opened.events if isinstance(event, Stepped)]


def wheel(widget: QWidget, eighths: int) -> QWheelEvent:
    place = QPointF(widget.rect().center())
    return QWheelEvent(
        place, widget.mapToGlobal(place), QPoint(), QPoint(0, eighths), Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip


@pytest.mark.slow
def test_controls_are_shown_where_a_level_is_set_and_nowhere_else(opened: Opened) -> None:
    opened.window.show_page(page(adjusts=False))
    controls = opened.window.widget.controls
    assert controls.isHidden()
    opened.window.show_page(page(adjusts=False, resting=True))
    assert controls.isHidden()
    opened.window.show_page(page(adjusts=True))
    assert not controls.isHidden()
    assert opened.window.widget.accessibleName() == f"Second of 2. {QUESTION}"
    opened.window.show_page(task_page())
    assert opened.window.widget.controls is None


def test_arrows_step_at_once_and_enter_confirms(opened: Opened) -> None:
    setting(opened)
    for key, count in ((Qt.Key.Key_Right, 3), (Qt.Key.Key_Left, 1)):
        for _ in range(count):
            QTest.keyClick(opened.window, key)
    assert steps(opened) == [1, 1, 1, -1]
    QTest.keyClick(opened.window, Qt.Key.Key_Return)
    assert opened.kinds[-1] is Submitted
    QTest.keyClick(opened.window, Qt.Key.Key_Space)
    assert Continue not in opened.kinds


def test_a_key_that_is_held_steps_eight_times_a_second_and_stops_with_it(opened: Opened, qtbot: Any) -> None:
    setting(opened)
    assert STEP_MS == 125
    QTest.keyPress(opened.window, Qt.Key.Key_Right)
    for _ in range(20):  # the system's own repetition, 30 a second or another rate
        repeated = QKeyEvent(QEvent.Type.KeyPress, Qt.Key.Key_Right, Qt.KeyboardModifier.NoModifier, "", True)
        QApplication.sendEvent(opened.window, repeated)
    assert steps(opened) == [1]
    began_s = time.monotonic()
    qtbot.waitUntil(lambda: len(steps(opened)) >= 5)
    assert time.monotonic() - began_s >= 0.95 * 4 * STEP_MS / 1000
    QTest.keyRelease(opened.window, Qt.Key.Key_Right)
    held = len(steps(opened))
    qtbot.wait(3 * STEP_MS)
    assert len(steps(opened)) == held
    assert set(steps(opened)) == {1}


def test_letting_go_of_one_arrow_keeps_the_other(opened: Opened, qtbot: Any) -> None:
    setting(opened)
    QTest.keyPress(opened.window, Qt.Key.Key_Right)
    QTest.keyPress(opened.window, Qt.Key.Key_Left)
    QTest.keyRelease(opened.window, Qt.Key.Key_Right)
    qtbot.waitUntil(lambda: len(steps(opened)) >= 4)
    QTest.keyRelease(opened.window, Qt.Key.Key_Left)
    assert steps(opened)[:2] == [1, -1]
    assert set(steps(opened)[2:]) == {-1}


def test_a_held_key_does_not_step_in_the_rest_that_follows(opened: Opened, qtbot: Any) -> None:
    setting(opened)
    QTest.keyPress(opened.window, Qt.Key.Key_Right)
    opened.window.show_page(page(adjusts=False, resting=True))
    before = len(steps(opened))
    qtbot.wait(3 * STEP_MS)
    assert len(steps(opened)) == before
    QTest.keyClick(opened.window, Qt.Key.Key_Left)
    QTest.keyClick(opened.window, Qt.Key.Key_Return)
    assert len(steps(opened)) == before
    assert Submitted not in opened.kinds


def test_the_wheel_steps_by_notches_forwards_more(opened: Opened) -> None:
    setting(opened)
    tank = opened.window.widget
    unheard = wheel(tank, 120)
    QApplication.sendEvent(tank, unheard)
    assert not unheard.isAccepted()  # Qt gives it to the window
    for turned in (120, -240, *[30] * 4):  # a touchpad's turns are smaller
        QApplication.sendEvent(opened.window, wheel(tank, turned))
    assert steps(opened) == [1, -2, 1]
    opened.window.show_page(page(adjusts=False, resting=True))
    QApplication.sendEvent(opened.window, wheel(tank, 120))
    assert len(steps(opened)) == 3


def test_the_mouse_presses_and_holds_the_buttons(opened: Opened, qtbot: Any) -> None:
    controls = setting(opened)
    qtbot.mouseClick(controls.less, Qt.MouseButton.LeftButton)
    qtbot.mouseClick(controls.more, Qt.MouseButton.LeftButton)
    assert steps(opened) == [-1, 1]
    qtbot.mousePress(controls.more, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: len(steps(opened)) >= 5)
    qtbot.mouseRelease(controls.more, Qt.MouseButton.LeftButton)
    assert set(steps(opened)[1:]) == {1}
    qtbot.mouseClick(controls.done, Qt.MouseButton.LeftButton)
    assert opened.kinds[-1] is Submitted
    assert opened.window.hasFocus()
    QTest.keyClick(opened.window, Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: PauseAsked in opened.kinds)


def test_where_the_mouse_is_the_device_keys_are_named_and_no_button_is_shown(captured: Opened) -> None:
    controls = setting(captured)
    captured.window.show_view(view(lit=0, target_m=(0.0, 0.0, 0.0)))
    assert controls.isHidden()
    assert captured.window.widget.things["hint"].state == "← Less · More → · Enter: Done"
    QTest.keyClick(captured.window, Qt.Key.Key_Left)
    assert steps(captured) == [-1]
    captured.window.findChild(PointerCapture).pressed.emit(1)
    assert captured.buttons == [1]  # the session hears it as the device's first button


@pytest.mark.parametrize("language", sorted(LANGUAGES))
@pytest.mark.parametrize(("size", "text_scale"), [((1366, 768), 1.0), ((1024, 640), 1.0), ((1366, 768), 2.0)])
def test_buttons_are_within_the_window_large_enough_and_cover_no_word(
    qtbot: Any, language: str, size: tuple[int, int], text_scale: float
) -> None:
    shown = page(adjusts=True, language=language)
    tank = TankWidget(shown, words(language), text_scale=text_scale)
    qtbot.addWidget(tank)
    tank.controls = SettingControls(shown, words(language), lambda: 1.0, tank, buttons=True)
    tank.resize(*size)
    tank.show()
    tank.show_view(view(lit=0, target_m=(0.0, 0.0, 0.0)))
    QApplication.processEvents()
    controls = tank.controls
    assert tank.rect().contains(controls.geometry())
    for button in (controls.less, controls.more, controls.done):
        assert button.height() >= 44
        assert button.width() >= 44
    covered = controls.geometry()
    controls.move(-covered.width(), 0)
    below = tank.grab(covered).toImage().convertToFormat(QImage.Format.Format_Grayscale8)
    greys = np.frombuffer(below.constBits(), np.uint8).reshape(below.height(), -1)[:, : below.width()]
    assert int(greys.max()) - int(greys.min()) < 40, "a word is below the controls"
    assert controls.less.x() < controls.more.x() < controls.done.x()


def test_neither_number_nor_end_is_shown_or_announced(opened: Opened) -> None:
    controls = setting(opened)
    before = {one.text() for one in (controls.less, controls.more, controls.done)}
    for _ in range(60):
        QTest.keyClick(opened.window, Qt.Key.Key_Right)
    assert {one.text() for one in (controls.less, controls.more, controls.done)} == before
    assert all(one.isEnabled() for one in (controls.less, controls.more, controls.done))
    assert not controls.findChildren(QLabel)
    said = [one.accessibleName() + one.accessibleDescription() for one in controls.findChildren(QWidget)]
    assert not any(character.isdigit() for text in said for character in text)
