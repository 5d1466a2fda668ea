"""The participant's window: pages come whole and go whole; Esc pauses, and held down it stops the force."""

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QObject, QPoint, Qt, QTimer
from PySide6.QtGui import QAccessible, QColor, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QPushButton, QWidget

from study_app.gui.participant.window import LEAST_SIZE
from study_app.gui.theme.theme import PARTICIPANT
from study_app.gui.widgets.main_view import HOLD_MS, EscapeKey
from study_app.protocol.wording.languages import words
from study_app.session.pages import EndPage, FeedbackPage, Page, PausePage, TroublePage
from study_app.session.transitions.events import Chosen, Continue, ForceStopped, PauseRequested, ResumeRequested
from tests.gui.participant.driver import KEY, Participant, name_of, told_of
from tests.gui.small import choice, explore, questionnaire, task_page, text_page, view

Opening = Callable[..., Participant]
SMALL = (1024, 640)
PAGES: list[tuple[Page, str]] = [
    (text_page("consent", languages=("en", "nl")), "Before you begin"),
    (text_page("break", stays_until_s=1000.0, coming=task_page(explore())), "Before you begin"),
    (task_page(explore()), "Move the ball through the liquid"),
    (questionnaire(), "Liquid setting 1"),
    (task_page(), "Hold the ball in the lit ring until it closes"),
    (PausePage(force_off=False), "Pause"),
    (PausePage(force_off=True), "The force is off"),
    (task_page(), "Hold the ball in the lit ring until it closes"),
    (questionnaire(chosen=(("item1", 4),)), "Liquid setting 1"),
    (FeedbackPage(True), "Correct"),
    (TroublePage("One moment", "Help comes."), "One moment"),
    (EndPage("Thank you", "You may let go."), "Thank you"),
]


@pytest.mark.slow
def test_every_page_fills_the_window_names_itself_and_leaves_no_widget_behind(opened: Participant) -> None:
    for page, name in PAGES:
        old = opened.page
        opened.window.show_page(page)
        assert not old.isVisible(), "in the same turn"
        opened.settle()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        assert opened.window.page is page
        assert name_of(opened.page).startswith(name)
        assert opened.page.geometry() == opened.window.rect()
        assert opened.page.isVisible()
        assert opened.window.windowTitle() == words("en").window_title
        assert [child for child in opened.window.children() if isinstance(child, QWidget)] == [opened.page]
        assert told_of(opened.window).role() == QAccessible.Role.Window
        headings = [one for one in opened.page.findChildren(QLabel) if told_of(one).role() == QAccessible.Role.Heading]
        assert not headings or name_of(headings[0]) in opened.page.accessibleName()


@pytest.mark.parametrize("is_right", [True, False])
def test_feedback_names_the_answer_and_shows_a_green_sign_for_a_correct_one_alone(
    opening: Opening, is_right: bool
) -> None:
    opened = opening(FeedbackPage(is_right), size=SMALL)
    assert name_of(opened.page) == (words("en").right if is_right else words("en").not_right)
    image = opened.page.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    colours = np.frombuffer(image.constBits(), np.uint32) & 0xFFFFFF
    assert bool((colours == QColor(PARTICIPANT.ok).rgb() & 0xFFFFFF).any()) == is_right


def test_the_window_stays_one_to_a_screen_reader_whatever_is_connected_to_it(opened: Participant) -> None:
    button = QPushButton()
    button.clicked.connect(opened.window.bring_forward)
    opened.window.open_on()
    assert (told_of(opened.window).role(), name_of(opened.window)) == (
        QAccessible.Role.Window,
        opened.window.windowTitle(),
    )


def on_screen(window: QWidget) -> QImage:
    """Return what the window system has of the window: what was painted and handed over, nothing that is under way."""
    return window.screen().grabWindow(window.winId()).toImage().convertToFormat(QImage.Format.Format_RGB32)


def pixels(image: QImage) -> Any:
    return np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4)[..., :3].copy()


class Watcher(QObject):
    """Looks at the screen at every event of the program, and keeps each picture that differs from the one before.

    Not at those of a painting under way, though: what it has done so far is handed to no screen yet.
    """

    def __init__(self, window: QWidget) -> None:
        super().__init__()
        self.window = window
        self.pictures = [on_screen(window)]

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:  # noqa: N802
        if event.type() != QEvent.Type.Paint:
            self.look()
        return False

    def look(self) -> None:
        seen = on_screen(self.window)
        if seen != self.pictures[-1]:
            self.pictures.append(seen)


def change(opened: Participant, page: Page) -> list[QImage]:
    """Show a page; return every picture that the screen had meanwhile, the old page's and the new one's with them."""
    watcher = Watcher(opened.window)
    app = QApplication.instance()
    assert app is not None
    app.installEventFilter(watcher)
    opened.window.show_page(page)
    for _ in range(3):
        QApplication.processEvents()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        watcher.look()
    app.removeEventFilter(watcher)
    return watcher.pictures


@pytest.mark.nightly
@pytest.mark.slow
def test_the_screen_shows_the_old_page_and_then_the_new_one(opening: Opening) -> None:
    opened = opening(size=SMALL)
    for page, _ in PAGES:
        if opened.window.painting is not None:
            opened.window.painting.join()  # else a page asks to wait for the tank
        pictures = change(opened, page)
        whole = opened.window.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
        assert len(pictures) == 2, f"{len(pictures) - 2} pictures that are neither page, before {page}"
        assert pictures[-1] == whole


def test_the_first_view_adds_the_ball_and_nothing_else(opening: Opening) -> None:
    opened = opening(task_page(), SMALL)
    before = pixels(on_screen(opened.window))
    opened.window.show_view(view((0.0, 0.01, 0.0), lit=None, reached=0))
    QApplication.processEvents()
    differs = (before != pixels(on_screen(opened.window))).any(axis=2)
    inside = np.zeros_like(differs)
    for name in ("ball", "shadow", "plumb"):
        place = opened.page.parts[name].place.toAlignedRect()
        inside[place.top() : place.bottom() + 1, place.left() : place.right() + 1] = True
    assert differs.any()
    assert not (differs & ~inside).any()


def waiting_for_paint(opened: Participant) -> threading.Event:
    """Let the tank be painted until the event that is returned is set."""
    done = threading.Event()
    opened.window.painting = threading.Thread(target=done.wait)
    opened.window.painting.start()
    return done


@pytest.mark.slow
def test_a_tank_that_is_still_being_painted_is_waited_for_on_a_page_that_says_so(opening: Opening, qtbot: Any) -> None:
    opened = opening(size=SMALL)
    done = waiting_for_paint(opened)
    assert len(change(opened, task_page(explore()))) == 2
    assert opened.page.accessibleName() == words("en").trouble_title
    opened.window.show_view(view(lit=None, elapsed_s=40.0))
    opened.press(KEY.Key_Space)  # neither view nor key does anything yet
    assert opened.window.tank is None
    done.set()
    qtbot.waitUntil(lambda: opened.window.tank is not None)
    assert not opened.window.waiting.isActive()


def test_a_page_that_comes_while_a_tank_is_waited_for_is_shown_at_once(opening: Opening) -> None:
    opened = opening(size=SMALL)
    done = waiting_for_paint(opened)
    opened.window.show_page(task_page())
    opened.window.show_page(PausePage(force_off=True))
    done.set()
    assert opened.window.painting is not None
    opened.window.painting.join()
    opened.window.waiting.timeout.emit()
    assert opened.window.tank is None
    assert opened.window.page == PausePage(force_off=True)


def test_a_pause_paints_the_tank_that_it_interrupted(opened: Participant, qtbot: Any) -> None:
    opened.show(PausePage(force_off=False, coming=task_page()))
    qtbot.waitUntil(lambda: opened.window.painting is not None)


def test_page_follows_the_window_down_to_its_least_size(opened: Participant) -> None:
    opened.show(questionnaire())
    opened.window.resize(LEAST_SIZE)
    assert opened.page.size() == LEAST_SIZE
    opened.window.resize(800, 400)
    assert opened.window.size() == LEAST_SIZE


@pytest.mark.parametrize(
    ("page", "key", "told"),
    [
        (text_page("consent"), KEY.Key_Return, Continue),
        (text_page(), KEY.Key_Space, Continue),
        (PausePage(force_off=False), KEY.Key_Return, ResumeRequested),
        (questionnaire(), KEY.Key_4, Chosen),
        (task_page(explore()), KEY.Key_Space, Continue),
    ],
    ids=lambda value: type(value).__name__,
)
def test_click_beside_a_button_leaves_the_page_its_keys(opened: Participant, page: Page, key: KEY, told: type) -> None:
    opened.show(page)
    opened.window.show_view(view(elapsed_s=60.0))
    beside = QPoint(opened.window.width() // 2, opened.window.height() - 12)
    left, none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    QTest.mouseClick(opened.window.windowHandle(), left, none, beside)
    opened.press(key)
    assert told in opened.kinds


@pytest.mark.parametrize("mouse", [False, True])
def test_an_exploration_is_left_after_its_least_time_by_space_or_a_click_of_the_mouse_that_is_the_device(
    opening: Opening, mouse: bool
) -> None:
    opened = opening(task_page(explore()), captures_pointer=mouse)
    for elapsed_s, kinds in ((29.9, []), (30.0, [Continue])):
        opened.window.show_view(view(lit=None, elapsed_s=elapsed_s))
        if mouse:
            opened.click(opened.page)
        else:
            opened.press(KEY.Key_Space)
        assert opened.kinds == kinds
    assert opened.buttons == ([1, 0, 0] if mouse else []), "the last click is no answer to the page that comes next"


def test_a_late_frame_of_the_tank_before_is_not_told_as_one_of_the_next(opened: Participant, qtbot: Any) -> None:
    opened.show(task_page())
    before = opened.window.tank
    assert before is not None
    opened.show(task_page())
    with qtbot.assertNotEmitted(opened.window.painted):
        before.painted.emit(1)
    opened.show(questionnaire())
    opened.window.show_view(view())
    assert opened.window.tank is None, "a view without a tank is ignored"


def test_closing_by_accident_is_a_pause_which_lies_over_the_tank(opened: Participant) -> None:
    opened.show(task_page())
    assert not opened.window.close()
    assert opened.kinds == [PauseRequested]
    opened.show(PausePage(force_off=True))
    under = opened.page.under
    assert under is not None
    opened.show(PausePage(force_off=False))
    assert opened.page.under is under
    opened.window.may_close = True
    assert opened.window.close()


@pytest.mark.parametrize(
    ("page", "pauses", "closes"),
    [
        (text_page(), True, False),
        (task_page(), True, False),
        (questionnaire(), True, False),
        (choice(), True, False),
        (FeedbackPage(False), True, False),
        (PausePage(force_off=False), False, False),
        (TroublePage("One moment", "Help comes."), False, False),
        (EndPage("Thank you", "You may let go."), False, True),
    ],
    ids=lambda value: type(value).__name__,
)
def test_escape_pauses_the_session_and_closes_the_last_page(
    opened: Participant, page: Page, pauses: bool, closes: bool
) -> None:
    closed = list[Page | None]()
    opened.window.left.connect(lambda: closed.append(opened.window.page))
    opened.show(page)
    opened.press(KEY.Key_Escape)
    assert [(type(event), event.by) for event in opened.told] == [(PauseRequested, "participant")] * pauses
    assert (opened.window.isVisible(), closed) == (not closes, [page] * closes)


@pytest.mark.slow
def test_time_is_up_is_told_before_the_questions_unless_a_pause_comes(opened: Participant, qtbot: Any) -> None:
    def timed_out(elapsed_s: float) -> None:
        opened.window.show_page(task_page(explore()))
        opened.window.show_view(view(lit=None, elapsed_s=elapsed_s))
        opened.window.show_page(questionnaire())

    timed_out(119.0)
    assert opened.window.page == questionnaire(), "who goes on before the limit is asked at once"
    opened.events.clear()
    timed_out(120.0)
    assert opened.page.accessibleName() == words("en").time_is_up
    assert opened.window.page is None
    assert opened.events == []
    qtbot.waitUntil(lambda: opened.window.page == questionnaire(), timeout=5000)
    assert opened.focus in opened.page.fields
    opened.window.time_up.setInterval(1)
    timed_out(120.0)
    opened.window.show_page(PausePage(force_off=False))
    qtbot.wait(50)
    assert opened.window.page == PausePage(force_off=False)


@pytest.mark.slow
@pytest.mark.parametrize("follows", [(), (questionnaire(), text_page())], ids=["stays", "changes"])
def test_escape_held_stops_the_force_and_does_not_pause_as_well_though_the_page_changes(
    opened: Participant, qtbot: Any, follows: tuple[Page, ...]
) -> None:
    opened.show(task_page())

    def stopped(event: Any) -> bool:
        return isinstance(event, ForceStopped)

    with qtbot.waitSignal(opened.window.event, timeout=5 * HOLD_MS, check_params_cb=stopped):
        QTest.keyPress(opened.focus, KEY.Key_Escape)
        for page in follows:
            opened.window.show_page(page)
    QTest.keyRelease(opened.focus, KEY.Key_Escape)
    assert opened.told == [ForceStopped(opened.told[0].at_s, "participant")]


def test_escape_held_while_the_window_is_left_stops_nothing(opened: Participant) -> None:
    opened.show(task_page())
    QTest.keyPress(opened.focus, KEY.Key_Escape)
    QApplication.sendEvent(opened.window, QEvent(QEvent.Type.WindowDeactivate))
    QTest.keyRelease(opened.focus, KEY.Key_Escape)
    assert not opened.window.findChild(EscapeKey).findChild(QTimer).isActive()
    assert opened.events == []
