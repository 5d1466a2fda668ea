"""The participant's window: pages come whole and go whole; Esc pauses, and held down it stops the force."""

from html import unescape
from typing import Any

import pytest
from PySide6.QtCore import QEvent, QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from study_app.gui.participant.pages.notices import NoticeWidget, PauseWidget
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.pages.text_page import TextWidget
from study_app.gui.participant.tank_widget import TankWidget
from study_app.gui.participant.window import LEAST_SIZE, ParticipantWindow
from study_app.gui.widgets.escape_key import HOLD_MS, EscapeHold
from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import EndPage, Page, PausePage, TroublePage
from study_app.session.transitions.events import Chosen, Continue, ForceStopped, ItemShown, PauseAsked, ResumeAsked
from tests.gui.participant.screens import Opened
from tests.gui.small import explore, questionnaire, task_page, text_page, view

PAGES: list[tuple[Page, type[QWidget]]] = [
    (text_page("consent"), TextWidget),
    (text_page("break"), TextWidget),
    (task_page(), TankWidget),
    (questionnaire(), QuestionnaireWidget),
    (PausePage(force_off=True), PauseWidget),
    (TroublePage("One moment", "Help comes."), NoticeWidget),
    (EndPage("Thank you", "You may let go."), NoticeWidget),
]


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


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("mouse", [False, True])
def test_the_last_page_asks_to_let_go_of_the_device_unless_that_is_the_mouse(
    qtbot: Any, language: str, mouse: bool
) -> None:
    said, shown = words(language), Opened(qtbot, captures_pointer=mouse, language=language)
    for page in (EndPage(said.end_title, said.end_body), EndPage(said.ended_early_title, said.ended_early_body)):
        shown.window.show_page(page)
        lines = unescape(" ".join(line.text() for line in shown.window.widget.findChildren(QLabel)))
        assert page.paragraph in lines
        assert (said.let_go in lines) is not mouse
    shown.window.may_close = True
    shown.window.close()


@pytest.mark.slow
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
    assert not widget.button.ringed


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


def test_closing_by_accident_is_a_pause(opened: Opened) -> None:
    opened.window.show_page(task_page())
    assert not opened.window.close()
    assert opened.kinds == [PauseAsked]
    opened.window.may_close = True
    assert opened.window.close()


def timed_out(window: ParticipantWindow, elapsed_s: float = 120.0) -> None:
    window.show_page(task_page(explore()))
    window.show_view(view(lit=None, elapsed_s=elapsed_s))
    window.show_page(questionnaire())


@pytest.mark.slow
def test_time_is_up_is_told_before_the_questions(opened: Opened, qtbot: Any) -> None:
    timed_out(opened.window)
    assert opened.window.widget.accessibleName() == words("en").time_is_up
    assert opened.window.page is None
    assert opened.events == []
    qtbot.waitUntil(lambda: isinstance(opened.window.widget, QuestionnaireWidget), timeout=5000)
    assert opened.focus in opened.window.widget.fields


def test_who_goes_on_before_the_limit_is_asked_at_once(opened: Opened) -> None:
    timed_out(opened.window, 119.0)
    assert isinstance(opened.window.widget, QuestionnaireWidget)


@pytest.mark.slow
def test_pause_while_time_is_up_is_told_stays(opened: Opened, qtbot: Any) -> None:
    opened.window.time_up.setInterval(1)
    timed_out(opened.window)
    opened.window.show_page(PausePage(force_off=False))
    qtbot.wait(50)
    assert isinstance(opened.window.widget, PauseWidget)


def is_a_force_stop(event: Any) -> bool:
    return isinstance(event, ForceStopped)


@pytest.mark.parametrize("page", [text_page(), task_page(), questionnaire()], ids=lambda page: type(page).__name__)
def test_short_escape_pauses(opened: Opened, page: Page) -> None:
    opened.window.show_page(page)
    QTest.keyClick(opened.focus, Qt.Key.Key_Escape)
    assert [event for event in opened.events if not isinstance(event, ItemShown)] == [
        PauseAsked(opened.events[-1].at_s, "participant")
    ]


@pytest.mark.slow
def test_escape_held_stops_the_force_and_does_not_pause_as_well(opened: Opened, qtbot: Any) -> None:
    opened.window.show_page(task_page())
    with qtbot.waitSignal(opened.window.event, timeout=5 * HOLD_MS):
        QTest.keyPress(opened.focus, Qt.Key.Key_Escape)
    QTest.keyRelease(opened.focus, Qt.Key.Key_Escape)
    assert opened.events == [ForceStopped(opened.events[0].at_s, "participant")]


@pytest.mark.slow
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
    assert not opened.window.findChild(EscapeHold).findChild(QTimer).isActive()
    assert opened.events == []


def test_short_escape_on_a_pause_or_an_end_does_nothing(opened: Opened) -> None:
    for page in (PausePage(force_off=False), TroublePage("a", "b"), EndPage("a", "b")):
        opened.window.show_page(page)
        QTest.keyClick(opened.focus, Qt.Key.Key_Escape)
    assert opened.events == []
