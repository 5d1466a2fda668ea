"""The participant's window: pages come whole and go whole, Esc pauses or stops, the pointer becomes the hand."""

from __future__ import annotations

from typing import Any

import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QCursor, QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.pages.notices import NoticeWidget, PauseWidget
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.pages.text_page import TextWidget
from study_app.gui.participant.pointer_capture import NOTCHES, SHARE_OF_SCREEN, PointerCapture
from study_app.gui.participant.tank_widget import TankWidget
from study_app.gui.participant.window import LEAST_SIZE, ParticipantWindow
from study_app.gui.widgets.escape_key import HOLD_MS
from study_app.protocol.wording.languages import words
from study_app.session.pages import EndPage, Page, PausePage, TroublePage
from study_app.session.transitions.events import (
    Chosen,
    Continue,
    ForceStopped,
    ItemShown,
    PauseAsked,
    ResumeAsked,
    Submitted,
)
from tests.gui.small import ManualClock, explore, questionnaire, task_page, text_page, view

PAGES: list[tuple[Page, type[QWidget]]] = [
    (text_page("consent"), TextWidget),
    (text_page("break"), TextWidget),
    (task_page(), TankWidget),
    (questionnaire(), QuestionnaireWidget),
    (PausePage(force_off=True), PauseWidget),
    (TroublePage("One moment", "Help comes."), NoticeWidget),
    (EndPage("Thank you", "You may let go."), NoticeWidget),
]


class Opened:
    """A window on a screen, and what it told."""

    def __init__(self, qtbot: Any, *, captures_pointer: bool = False) -> None:
        self.window = ParticipantWindow(
            words("en"), clock=ManualClock(), windowed=True, captures_pointer=captures_pointer
        )
        qtbot.addWidget(self.window)
        self.events: list[Any] = []
        self.places: list[tuple[float, float, float]] = []
        self.buttons: list[int] = []
        self.window.event.connect(self.events.append)
        self.window.pointer.connect(lambda *place: self.places.append(place))
        self.window.buttons.connect(self.buttons.append)
        self.window.open_on()
        qtbot.waitExposed(self.window)
        QApplication.processEvents()

    @property
    def kinds(self) -> list[type]:
        return [type(event) for event in self.events]

    @property
    def focus(self) -> QWidget:
        return self.window.focusWidget() or self.window


@pytest.fixture
def opened(qtbot: Any) -> Any:
    made = Opened(qtbot)
    yield made
    made.window.may_close = True
    made.window.close()


@pytest.fixture
def captured(qtbot: Any) -> Any:
    made = Opened(qtbot, captures_pointer=True)
    yield made
    made.window.may_close = True
    made.window.close()
    assert not made.window._capture.held


def test_before_the_first_page_it_says_that_it_prepares(opened: Opened) -> None:
    assert opened.window.page is None
    assert words("en").preparing in opened.window.widget.accessibleName()


@pytest.mark.parametrize(("page", "kind"), PAGES, ids=lambda value: type(value).__name__)
def test_page_value_becomes_its_widget_and_fills_the_window(opened: Opened, page: Page, kind: type[QWidget]) -> None:
    opened.window.show_page(page)
    assert type(opened.window.widget) is kind
    assert opened.window.page is page
    assert opened.window.widget.geometry() == opened.window.rect()
    assert opened.window.widget.isVisible()


def test_no_widget_is_left_behind(opened: Opened) -> None:
    for page, _ in PAGES * 3:
        opened.window.show_page(page)
        QApplication.processEvents()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        children = [child for child in opened.window.children() if isinstance(child, QWidget)]
        assert children == [opened.window.widget]


def test_old_page_is_hidden_in_the_same_turn(opened: Opened) -> None:
    opened.window.show_page(text_page())
    old = opened.window.widget
    opened.window.show_page(questionnaire())
    assert not old.isVisible()


def test_keyboard_goes_where_the_page_says_and_shows_no_ring_unasked(opened: Opened) -> None:
    for page in (text_page(), questionnaire(), text_page("break")):
        opened.window.show_page(page)
    widget = opened.window.widget
    assert isinstance(widget, TextWidget)
    assert widget.button is not None
    assert opened.focus is widget.button
    assert not widget.button._ringed


def test_page_follows_the_window_down_to_its_least_size(opened: Opened) -> None:
    opened.window.show_page(questionnaire())
    opened.window.resize(LEAST_SIZE)
    assert opened.window.widget.size() == LEAST_SIZE
    opened.window.resize(800, 400)
    assert opened.window.size() == LEAST_SIZE


def test_windows_title_is_neutral(opened: Opened) -> None:
    for page, _ in PAGES:
        opened.window.show_page(page)
        assert opened.window.windowTitle() == words("en").window_title


def beside(window: ParticipantWindow) -> QPoint:
    """Return a place in the window where its page has nothing to press."""
    return QPoint(window.width() // 2, window.height() - 12)


@pytest.mark.parametrize(
    ("page", "key", "told"),
    [
        (text_page("consent"), Qt.Key.Key_Return, Continue),
        (text_page(), Qt.Key.Key_Space, Continue),
        (PausePage(force_off=False), Qt.Key.Key_Return, ResumeAsked),
        (questionnaire(), Qt.Key.Key_4, Chosen),
        (task_page(explore()), Qt.Key.Key_Space, Continue),
    ],
    ids=lambda value: type(value).__name__,
)
def test_click_beside_a_button_leaves_the_page_its_keys(opened: Opened, page: Page, key: Qt.Key, told: type) -> None:
    opened.window.show_page(page)
    opened.window.show_view(view(elapsed_s=60.0))
    opened.window.grab()
    QTest.mouseClick(
        opened.window.windowHandle(), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, beside(opened.window)
    )
    QTest.keyClick(opened.focus, key)
    assert told in opened.kinds


def test_events_of_pages_are_passed_on(opened: Opened) -> None:
    opened.window.show_page(text_page())
    QTest.keyClick(opened.focus, Qt.Key.Key_Space)
    assert opened.kinds == [Continue]
    opened.window.show_page(questionnaire(("One statement.",)))
    opened.window.grab()
    QApplication.processEvents()
    QTest.keyClick(opened.focus, Qt.Key.Key_4)
    QTest.keyClick(opened.focus, Qt.Key.Key_Return)
    assert opened.kinds == [Continue, ItemShown, Chosen, Submitted]
    opened.window.show_page(PausePage(force_off=False))
    QTest.keyClick(opened.focus, Qt.Key.Key_Return)
    assert opened.kinds[-1] is ResumeAsked


def test_keyboard_is_on_the_first_statement_when_the_questionnaire_comes(opened: Opened) -> None:
    opened.window.show_page(task_page())
    opened.window.show_page(questionnaire())
    widget = opened.window.widget
    assert isinstance(widget, QuestionnaireWidget)
    assert opened.focus is widget.rows[0]


def is_a_force_stop(event: Any) -> bool:
    return isinstance(event, ForceStopped)


@pytest.mark.parametrize("page", [text_page(), task_page(), questionnaire()], ids=lambda page: type(page).__name__)
def test_short_escape_pauses(opened: Opened, page: Page) -> None:
    opened.window.show_page(page)
    QTest.keyClick(opened.focus, Qt.Key.Key_Escape)
    assert [event for event in opened.events if not isinstance(event, ItemShown)] == [
        PauseAsked(opened.events[-1].at_s, "participant")
    ]


def test_escape_held_stops_the_force_and_does_not_pause_as_well(opened: Opened, qtbot: Any) -> None:
    opened.window.show_page(task_page())
    with qtbot.waitSignal(opened.window.event, timeout=5 * HOLD_MS):
        QTest.keyPress(opened.focus, Qt.Key.Key_Escape)
    QTest.keyRelease(opened.focus, Qt.Key.Key_Escape)
    assert opened.events == [ForceStopped(opened.events[0].at_s, "participant")]


def test_escape_held_while_the_page_changes_stops_the_force_all_the_same(opened: Opened, qtbot: Any) -> None:
    opened.window.show_page(task_page())
    with qtbot.waitSignal(opened.window.event, timeout=5 * HOLD_MS, check_params_cb=is_a_force_stop):
        QTest.keyPress(opened.focus, Qt.Key.Key_Escape)
        opened.window.show_page(questionnaire())
        opened.window.show_page(text_page())
    QTest.keyRelease(opened.focus, Qt.Key.Key_Escape)
    assert [kind for kind in opened.kinds if kind is not ItemShown] == [ForceStopped]


def test_escape_held_while_the_window_is_left_stops_nothing(opened: Opened) -> None:
    opened.window.show_page(task_page())
    QTest.keyPress(opened.focus, Qt.Key.Key_Escape)
    QApplication.sendEvent(opened.window, QEvent(QEvent.Type.WindowDeactivate))
    QTest.keyRelease(opened.focus, Qt.Key.Key_Escape)
    assert not opened.window._escape._timer.isActive()
    assert opened.events == []


def test_short_escape_on_a_pause_or_an_end_does_nothing(opened: Opened) -> None:
    for page in (PausePage(force_off=False), TroublePage("a", "b"), EndPage("a", "b")):
        opened.window.show_page(page)
        QTest.keyClick(opened.focus, Qt.Key.Key_Escape)
    assert opened.events == []


def test_space_leaves_an_exploration_after_its_least_time(opened: Opened) -> None:
    opened.window.show_page(task_page(explore()))
    opened.window.show_view(view(lit=None, elapsed_s=3))
    QTest.keyClick(opened.focus, Qt.Key.Key_Space)
    assert opened.events == []
    opened.window.show_view(view(lit=None, elapsed_s=31))
    QTest.keyClick(opened.focus, Qt.Key.Key_Space)
    assert opened.kinds == [Continue]


def test_a_click_leaves_an_exploration_where_the_mouse_is_the_device(captured: Opened, qtbot: Any) -> None:
    captured.window.show_page(task_page(task=explore()))
    tank = captured.window.tank
    assert tank is not None
    captured.window.show_view(view(elapsed_s=29.9))
    qtbot.mouseClick(tank, Qt.MouseButton.LeftButton)
    assert (captured.kinds, captured.buttons) == ([], [1, 0])
    captured.window.show_view(view(elapsed_s=30.0))
    qtbot.mouseClick(tank, Qt.MouseButton.RightButton)
    assert captured.kinds == []
    qtbot.mouseClick(tank, Qt.MouseButton.LeftButton)
    assert captured.kinds == [Continue]
    assert not any(bits & 1 for bits in captured.buttons[2:])  # it is no answer to the page that comes next


def test_painted_views_are_told(opened: Opened, qtbot: Any) -> None:
    opened.window.show_page(task_page())
    with qtbot.waitSignal(opened.window.painted, timeout=2000) as told:
        opened.window.show_view(view(sample_ns=123_456_789_012))
    assert told.args == [123_456_789_012]


def test_a_late_frame_of_the_tank_before_is_not_told_as_one_of_the_next(opened: Opened, qtbot: Any) -> None:
    opened.window.show_page(task_page())
    before = opened.window.tank
    assert before is not None
    opened.window.show_page(task_page())
    with qtbot.assertNotEmitted(opened.window.painted):
        before.painted.emit(1)


def test_views_without_a_tank_are_ignored(opened: Opened) -> None:
    opened.window.show_page(questionnaire())
    opened.window.show_view(view())
    assert opened.window.tank is None


def test_pause_lies_over_the_tank(opened: Opened) -> None:
    opened.window.show_page(task_page())
    opened.window.show_page(PausePage(force_off=True))
    first = opened.window.widget
    assert isinstance(first, PauseWidget)
    assert first.under is not None
    opened.window.show_page(PausePage(force_off=False))
    again = opened.window.widget
    assert isinstance(again, PauseWidget)
    assert again.under is first.under


def test_pointer_is_free_where_it_is_not_the_device(opened: Opened) -> None:
    opened.window.show_page(task_page())
    assert not opened.window._capture.held
    assert opened.window.widget.cursor().shape() == Qt.CursorShape.BlankCursor


def test_pointer_is_held_and_hidden_in_the_tank_alone(captured: Opened) -> None:
    captured.window.show_page(text_page())
    assert not captured.window._capture.held
    captured.window.show_page(task_page())
    assert captured.window._capture.held
    assert captured.window.widget.cursor().shape() == Qt.CursorShape.BlankCursor
    captured.window.show_page(questionnaire())
    assert not captured.window._capture.held
    assert captured.window.widget.cursor().shape() == Qt.CursorShape.ArrowCursor


def other_window(captured: Opened, qtbot: Any) -> QWidget:
    """Return another window of the program, active instead of the participant's."""
    other = QWidget()
    qtbot.addWidget(other)
    other.show()
    other.activateWindow()
    qtbot.waitUntil(lambda: not captured.window.isActiveWindow())
    return other


def test_the_operators_window_lets_the_pointer_go_and_the_trial_goes_on(captured: Opened, qtbot: Any) -> None:
    captured.window.show_page(task_page())
    with qtbot.waitSignal(captured.window._settling.timeout):
        other = other_window(captured, qtbot)
        assert not captured.window._capture.held
    assert other.isActiveWindow()
    assert captured.events == []
    captured.window.activateWindow()
    qtbot.waitUntil(lambda: captured.window._capture.held)
    assert captured.window.widget.cursor().shape() == Qt.CursorShape.BlankCursor


@pytest.mark.parametrize("page", [text_page(), questionnaire()], ids=lambda page: type(page).__name__)
def test_a_window_that_is_active_again_holds_the_pointer_in_the_tank_alone(
    captured: Opened, qtbot: Any, page: Page
) -> None:
    captured.window.show_page(task_page())
    other = other_window(captured, qtbot)
    captured.window.show_page(page)
    other.hide()
    captured.window.activateWindow()
    qtbot.waitUntil(captured.window.isActiveWindow)
    assert not captured.window._capture.held


def test_another_program_that_takes_the_keyboard_pauses(captured: Opened, qtbot: Any) -> None:
    captured.window.show_page(task_page())
    other = other_window(captured, qtbot)
    with qtbot.waitSignal(captured.window.event):
        other.windowHandle().destroy()  # no window of the program has the keyboard then
    assert captured.events == [PauseAsked(captured.events[0].at_s, "participant")]


def test_closing_by_accident_is_a_pause(opened: Opened) -> None:
    opened.window.show_page(task_page())
    assert not opened.window.close()
    assert opened.kinds == [PauseAsked]
    opened.window.may_close = True
    assert opened.window.close()


# the pointer as a hand


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
        self.capture.take(self.widget, (0.1, 0.06, 0.08))
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
        place, none = QPointF(self.middle), Qt.KeyboardModifier.NoModifier
        event = QWheelEvent(
            place,
            place,
            QPoint(),
            QPoint(0, eighths),
            Qt.MouseButton.NoButton,
            none,
            Qt.ScrollPhase.NoScrollPhase,
            False,
        )
        QApplication.sendEvent(self.widget, event)


@pytest.fixture
def hand(qtbot: Any) -> Any:
    made = Hand(qtbot)
    yield made
    made.capture.release()


def test_motion_moves_the_hand_right_and_up(hand: Hand) -> None:
    hand.move(hand.middle + QPoint(30, -20))
    assert hand.places[-1] == pytest.approx((30 * hand.gain, 20 * hand.gain, 0))


def test_sixty_percent_of_the_screen_is_the_whole_workspace(hand: Hand) -> None:
    height = hand.widget.screen().geometry().height()
    assert hand.gain * SHARE_OF_SCREEN * height == pytest.approx(0.06)


def test_shift_and_wheel_are_depth(hand: Hand) -> None:
    hand.move(hand.middle + QPoint(10, -20), Qt.KeyboardModifier.ShiftModifier)
    assert hand.places[-1] == pytest.approx((10 * hand.gain, 0, -20 * hand.gain))
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
    assert not hand.capture.held


def test_hand_stays_where_it_was_from_one_capture_to_the_next(hand: Hand) -> None:
    hand.move(hand.middle + QPoint(30, 0))
    place = hand.places[-1]
    hand.capture.release()
    hand.move(hand.middle + QPoint(200, 0))
    assert hand.places[-1] == place
    hand.capture.take(hand.widget, (0.1, 0.06, 0.08))
    assert hand.places[-1] == pytest.approx(place)


def timed_out(window: ParticipantWindow, elapsed_s: float = 120.0) -> None:
    window.show_page(task_page(explore()))
    window.show_view(view(lit=None, elapsed_s=elapsed_s))
    window.show_page(questionnaire())


def test_time_is_up_is_told_before_the_questions(opened: Opened, qtbot: Any) -> None:
    timed_out(opened.window)
    assert opened.window.widget.accessibleName() == words("en").time_is_up
    assert opened.window.page is None
    assert opened.events == []
    qtbot.waitUntil(lambda: isinstance(opened.window.widget, QuestionnaireWidget), timeout=5000)
    assert opened.focus in opened.window.widget.rows


def test_who_goes_on_before_the_limit_is_asked_at_once(opened: Opened) -> None:
    timed_out(opened.window, 119.0)
    assert isinstance(opened.window.widget, QuestionnaireWidget)


def test_pause_while_time_is_up_is_told_stays(opened: Opened, qtbot: Any) -> None:
    opened.window._told_up.setInterval(1)
    timed_out(opened.window)
    opened.window.show_page(PausePage(force_off=False))
    qtbot.wait(50)
    assert isinstance(opened.window.widget, PauseWidget)
