"""The pointer as the device: captured only in the tank, and mapped to the workspace."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QCursor, QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.window import NOTCHES, SHARE_OF_SCREEN, PointerCapture
from study_app.session.pages import Page
from study_app.session.transitions.events import PauseRequested
from tests.gui.participant.driver import Participant
from tests.gui.small import questionnaire, task_page, text_page


@pytest.mark.parametrize("device", ["participant", "captured"])
def test_the_pointer_is_hidden_only_in_the_tank_and_captured_if_it_is_the_device(request: Any, device: str) -> None:
    window = request.getfixturevalue(device)
    for page, in_tank in ((text_page(), False), (task_page(), True), (questionnaire(), False)):
        window.show(page)
        assert window.window.findChild(PointerCapture).is_held is (in_tank and device == "captured")
        assert (window.page.cursor().shape() == Qt.CursorShape.BlankCursor) is in_tank


def other_window(captured: Participant, qtbot: Any) -> QWidget:
    """Return another window of the program, active instead of the participant's."""
    other = QWidget()
    qtbot.addWidget(other)
    other.show()
    other.activateWindow()
    qtbot.waitUntil(lambda: not captured.window.isActiveWindow())
    return other


@pytest.mark.slow
def test_the_operators_window_lets_the_pointer_go_and_the_trial_goes_on(captured: Participant, qtbot: Any) -> None:
    captured.show(task_page())
    with qtbot.waitSignal(captured.window.settling.timeout):
        other = other_window(captured, qtbot)
        assert not captured.window.findChild(PointerCapture).is_held
    assert other.isActiveWindow()
    assert captured.events == []
    captured.window.activateWindow()
    qtbot.waitUntil(lambda: captured.window.findChild(PointerCapture).is_held)
    assert captured.page.cursor().shape() == Qt.CursorShape.BlankCursor


@pytest.mark.parametrize("page", [text_page(), questionnaire()], ids=lambda page: type(page).__name__)
def test_a_reactivated_window_captures_the_pointer_only_in_the_tank(
    captured: Participant, qtbot: Any, page: Page
) -> None:
    captured.show(task_page())
    other = other_window(captured, qtbot)
    captured.show(page)
    other.hide()
    captured.window.activateWindow()
    qtbot.waitUntil(captured.window.isActiveWindow)
    assert not captured.window.findChild(PointerCapture).is_held


def test_another_program_that_takes_the_keyboard_pauses(captured: Participant, qtbot: Any) -> None:
    captured.show(task_page())
    other = other_window(captured, qtbot)
    with qtbot.waitSignal(captured.window.event):
        other.windowHandle().destroy()  # no window of the program has the keyboard then
    assert captured.events == [PauseRequested(captured.events[0].at_s, "participant")]


class Hand:
    """A captured pointer, moved by events as a window system sends them."""

    def __init__(self, qtbot: Any) -> None:
        self.widget = QWidget()
        qtbot.addWidget(self.widget)
        self.widget.resize(1000, 800)
        self.widget.show()
        self.capture = PointerCapture()
        self.places: list[tuple[float, float, float]] = []
        self.bits: list[int] = []
        self.capture.moved.connect(lambda *place: self.places.append(place))
        self.capture.pressed.connect(self.bits.append)
        self.capture.capture(self.widget, (0.1, 0.06, 0.08))
        QApplication.processEvents()
        self.places.clear()
        self.middle = self.widget.mapToGlobal(self.widget.rect().center())
        self.gain = 0.06 / (SHARE_OF_SCREEN * self.widget.screen().geometry().height())

    def move(self, place: QPoint, modifiers: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
        kind, none = QEvent.Type.MouseMove, Qt.MouseButton.NoButton
        local = QPointF(self.widget.mapFromGlobal(place))
        QApplication.sendEvent(self.widget, QMouseEvent(kind, local, QPointF(place), none, none, modifiers))

    def button(self, kind: QEvent.Type, button: Qt.MouseButton) -> None:
        none = Qt.KeyboardModifier.NoModifier
        place = QPointF(self.middle)
        QApplication.sendEvent(self.widget, QMouseEvent(kind, place, place, button, button, none))

    def wheel(self, eighths: int) -> None:
        QTest.wheelEvent(self.widget.windowHandle(), self.widget.rect().center(), QPoint(0, eighths))


@pytest.fixture
def hand(qtbot: Any) -> Any:
    pointer_hand = Hand(qtbot)
    yield pointer_hand
    pointer_hand.capture.release()


def test_motion_moves_the_hand_right_and_up_shift_and_wheel_are_depth(hand: Hand) -> None:
    hand.move(hand.middle + QPoint(30, -20))
    assert hand.places[-1] == pytest.approx((30 * hand.gain, 20 * hand.gain, 0))
    hand.move(hand.middle + QPoint(40, -40), Qt.KeyboardModifier.ShiftModifier)
    assert hand.places[-1] == pytest.approx((40 * hand.gain, 20 * hand.gain, -20 * hand.gain))
    hand.wheel(-120)
    assert hand.places[-1][2] == pytest.approx(-20 * hand.gain + 0.08 / NOTCHES)


def test_hand_stays_in_the_workspace(hand: Hand) -> None:
    for step in range(1, 60):
        hand.move(hand.middle + QPoint(100 * step, 90 * step))
    hand.wheel(100 * 120)
    assert hand.places[-1] == pytest.approx((0.05, -0.03, -0.04))


def test_pointer_comes_back_to_the_middle_without_a_jump_of_the_hand(hand: Hand) -> None:
    far = hand.middle + QPoint(240, 0)
    hand.move(far)
    place = hand.places[-1]
    QApplication.processEvents()
    assert (QCursor.pos() - hand.middle).manhattanLength() <= 2
    hand.move(far + QPoint(4, 0))  # was under way before the pointer was put back
    assert hand.places[-1][0] == pytest.approx(place[0] + 4 * hand.gain, abs=1e-9)
    hand.move(hand.middle)
    hand.move(hand.middle + QPoint(5, 0))
    assert hand.places[-1][0] == pytest.approx(place[0] + 9 * hand.gain, abs=1e-9)


def test_buttons_are_bits_and_are_let_go_with_the_pointer(hand: Hand) -> None:
    hand.button(QEvent.Type.MouseButtonPress, Qt.MouseButton.LeftButton)
    hand.button(QEvent.Type.MouseButtonPress, Qt.MouseButton.RightButton)
    hand.button(QEvent.Type.MouseButtonRelease, Qt.MouseButton.LeftButton)
    assert hand.bits == [1, 3, 2]
    hand.capture.release()
    assert hand.bits[-1] == 0
    assert not hand.capture.is_held


def test_hand_stays_where_it_was_from_one_capture_to_the_next(hand: Hand) -> None:
    hand.move(hand.middle + QPoint(30, 0))
    place = hand.places[-1]
    hand.capture.release()
    hand.move(hand.middle + QPoint(200, 0))
    assert hand.places[-1] == place
    hand.capture.capture(hand.widget, (0.1, 0.06, 0.08))
    assert hand.places[-1] == pytest.approx(place)
