"""Less, more and done: by keys, wheel and buttons, only where a level is set, without a number or end marks."""

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QKeyEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from study_app.gui.participant.intervals.setting_controls import STEP_MS, SettingControls
from study_app.gui.participant.pointer_capture import PointerCapture
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.trials.task import lasting
from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import Interval, TaskPage
from study_app.session.transitions.events import Continue, PauseAsked, Stepped, Submitted
from tests.gui.participant.screens import Opened
from tests.gui.small import follow, task_page, view

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
