"""The participant's window: pages change completely; Esc pauses, and holding it stops the force."""

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
    (task_page(), "Hold the ball in the highlighted ring until it closes"),
    (PausePage(force_off=False), "Pause"),
    (PausePage(force_off=True), "The force is off"),
    (task_page(), "Hold the ball in the highlighted ring until it closes"),
    (questionnaire(chosen=(("item1", 4),)), "Liquid setting 1"),
    (FeedbackPage(True), "Correct"),
    (TroublePage("One moment", "Help comes."), "One moment"),
    (EndPage("Thank you", "You may let go."), "Thank you"),
]


@pytest.mark.slow
def test_every_page_fills_the_window_names_itself_and_leaves_no_widget_behind(participant: Participant) -> None:
    for page, name in PAGES:
        old = participant.page
        participant.window.show_page(page)
        assert not old.isVisible(), "in the same turn"
        participant.settle()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        assert participant.window.page is page
        assert name_of(participant.page).startswith(name)
        assert participant.page.geometry() == participant.window.rect()
        assert participant.page.isVisible()
        assert participant.window.windowTitle() == words("en").window_title
        assert [child for child in participant.window.children() if isinstance(child, QWidget)] == [participant.page]
        assert told_of(participant.window).role() == QAccessible.Role.Window
        headings = [
            label
            for label in participant.page.findChildren(QLabel)
            if told_of(label).role() == QAccessible.Role.Heading
        ]
        assert not headings or name_of(headings[0]) in participant.page.accessibleName()


@pytest.mark.parametrize("is_right", [True, False])
def test_feedback_names_the_verdict_and_shows_green_only_for_a_correct_answer(opening: Opening, is_right: bool) -> None:
    participant = opening(FeedbackPage(is_right), size=SMALL)
    assert name_of(participant.page) == (words("en").right if is_right else words("en").not_right)
    image = participant.page.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    colours = np.frombuffer(image.constBits(), np.uint32) & 0xFFFFFF
    assert bool((colours == QColor(PARTICIPANT.ok).rgb() & 0xFFFFFF).any()) == is_right


def test_the_window_stays_one_to_a_screen_reader_whatever_is_connected_to_it(participant: Participant) -> None:
    button = QPushButton()
    button.clicked.connect(participant.window.bring_forward)
    participant.window.open_on()
    assert (told_of(participant.window).role(), name_of(participant.window)) == (
        QAccessible.Role.Window,
        participant.window.windowTitle(),
    )


def on_screen(window: QWidget) -> QImage:
    """Return the window's picture in the window system, without a paint operation in progress."""
    return window.screen().grabWindow(window.winId()).toImage().convertToFormat(QImage.Format.Format_RGB32)


def pixels(image: QImage) -> Any:
    return np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4)[..., :3].copy()


class Watcher(QObject):
    """A filter that records each new picture of the screen at every event of the program.

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
        picture = on_screen(self.window)
        if picture != self.pictures[-1]:
            self.pictures.append(picture)


def change(participant: Participant, page: Page) -> list[QImage]:
    """Show a page; return every picture on the screen meanwhile, from the old page to the new one."""
    watcher = Watcher(participant.window)
    app = QApplication.instance()
    assert app is not None
    app.installEventFilter(watcher)
    participant.window.show_page(page)
    for _ in range(3):
        QApplication.processEvents()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        watcher.look()
    app.removeEventFilter(watcher)
    return watcher.pictures


@pytest.mark.nightly
@pytest.mark.slow
def test_the_screen_shows_the_old_page_and_then_the_new_one(opening: Opening) -> None:
    participant = opening(size=SMALL)
    for page, _ in PAGES:
        if participant.window.painting is not None:
            participant.window.painting.join()  # else a page asks to wait for the tank
        pictures = change(participant, page)
        whole = participant.window.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
        assert len(pictures) == 2, f"{len(pictures) - 2} pictures that are neither page, before {page}"
        assert pictures[-1] == whole


def test_the_first_view_adds_the_ball_and_nothing_else(opening: Opening) -> None:
    participant = opening(task_page(), SMALL)
    before = pixels(on_screen(participant.window))
    participant.window.show_view(view((0.0, 0.01, 0.0), lit=None, reached=0))
    QApplication.processEvents()
    differs = (before != pixels(on_screen(participant.window))).any(axis=2)
    inside = np.zeros_like(differs)
    for name in ("ball", "shadow", "plumb"):
        place = participant.page.parts[name].place.toAlignedRect()
        inside[place.top() : place.bottom() + 1, place.left() : place.right() + 1] = True
    assert differs.any()
    assert not (differs & ~inside).any()


def block_painting(participant: Participant) -> threading.Event:
    """Keep the tank's painting thread busy until the returned event is set."""
    painted = threading.Event()
    participant.window.painting = threading.Thread(target=painted.wait)
    participant.window.painting.start()
    return painted


@pytest.mark.slow
def test_a_waiting_page_is_shown_while_a_tank_is_painted(opening: Opening, qtbot: Any) -> None:
    participant = opening(size=SMALL)
    painted = block_painting(participant)
    assert len(change(participant, task_page(explore()))) == 2
    assert participant.page.accessibleName() == words("en").trouble_title
    participant.window.show_view(view(lit=None, elapsed_s=40.0))
    participant.press(KEY.Key_Space)  # neither view nor key does anything yet
    assert participant.window.tank is None
    painted.set()
    qtbot.waitUntil(lambda: participant.window.tank is not None)
    assert not participant.window.waiting.isActive()


def test_a_page_requested_while_a_tank_is_painted_is_shown_at_once(opening: Opening) -> None:
    participant = opening(size=SMALL)
    painted = block_painting(participant)
    participant.window.show_page(task_page())
    participant.window.show_page(PausePage(force_off=True))
    painted.set()
    assert participant.window.painting is not None
    participant.window.painting.join()
    participant.window.waiting.timeout.emit()
    assert participant.window.tank is None
    assert participant.window.page == PausePage(force_off=True)


def test_a_pause_paints_the_tank_that_it_interrupted(participant: Participant, qtbot: Any) -> None:
    participant.show(PausePage(force_off=False, coming=task_page()))
    qtbot.waitUntil(lambda: participant.window.painting is not None)


def test_page_follows_the_window_down_to_its_least_size(participant: Participant) -> None:
    participant.show(questionnaire())
    participant.window.resize(LEAST_SIZE)
    assert participant.page.size() == LEAST_SIZE
    participant.window.resize(800, 400)
    assert participant.window.size() == LEAST_SIZE


@pytest.mark.parametrize(
    ("page", "key", "event"),
    [
        (text_page("consent"), KEY.Key_Return, Continue),
        (text_page(), KEY.Key_Space, Continue),
        (PausePage(force_off=False), KEY.Key_Return, ResumeRequested),
        (questionnaire(), KEY.Key_4, Chosen),
        (task_page(explore()), KEY.Key_Space, Continue),
    ],
    ids=lambda value: type(value).__name__,
)
def test_click_beside_a_button_leaves_the_page_its_keys(
    participant: Participant, page: Page, key: KEY, event: type
) -> None:
    participant.show(page)
    participant.window.show_view(view(elapsed_s=60.0))
    beside = QPoint(participant.window.width() // 2, participant.window.height() - 12)
    left, none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    QTest.mouseClick(participant.window.windowHandle(), left, none, beside)
    participant.press(key)
    assert event in participant.kinds


@pytest.mark.parametrize("mouse", [False, True])
def test_an_exploration_is_left_after_its_least_time_by_space_or_a_click_of_the_mouse_that_is_the_device(
    opening: Opening, mouse: bool
) -> None:
    participant = opening(task_page(explore()), captures_pointer=mouse)
    for elapsed_s, kinds in ((29.9, []), (30.0, [Continue])):
        participant.window.show_view(view(lit=None, elapsed_s=elapsed_s))
        if mouse:
            participant.click(participant.page)
        else:
            participant.press(KEY.Key_Space)
        assert participant.kinds == kinds
    assert participant.buttons == ([1, 0, 0] if mouse else []), (
        "the last click is no answer to the page that comes next"
    )


def test_a_late_frame_of_the_previous_tank_is_not_reported_for_the_next(participant: Participant, qtbot: Any) -> None:
    participant.show(task_page())
    before = participant.window.tank
    assert before is not None
    participant.show(task_page())
    with qtbot.assertNotEmitted(participant.window.painted):
        before.painted.emit(1)
    participant.show(questionnaire())
    participant.window.show_view(view())
    assert participant.window.tank is None, "a view without a tank is ignored"


def test_closing_by_accident_is_a_pause_which_lies_over_the_tank(participant: Participant) -> None:
    participant.show(task_page())
    assert not participant.window.close()
    assert participant.kinds == [PauseRequested]
    participant.show(PausePage(force_off=True))
    under = participant.page.under
    assert under is not None
    participant.show(PausePage(force_off=False))
    assert participant.page.under is under
    participant.window.may_close = True
    assert participant.window.close()


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
    participant: Participant, page: Page, pauses: bool, closes: bool
) -> None:
    closed = list[Page | None]()
    participant.window.left.connect(lambda: closed.append(participant.window.page))
    participant.show(page)
    participant.press(KEY.Key_Escape)
    assert [(type(event), event.by) for event in participant.told] == [(PauseRequested, "participant")] * pauses
    assert (participant.window.isVisible(), closed) == (not closes, [page] * closes)


@pytest.mark.slow
def test_time_is_up_is_shown_before_the_questions_unless_a_pause_comes(participant: Participant, qtbot: Any) -> None:
    def timed_out(elapsed_s: float) -> None:
        participant.window.show_page(task_page(explore()))
        participant.window.show_view(view(lit=None, elapsed_s=elapsed_s))
        participant.window.show_page(questionnaire())

    timed_out(119.0)
    assert participant.window.page == questionnaire(), "who goes on before the limit is asked at once"
    participant.events.clear()
    timed_out(120.0)
    assert participant.page.accessibleName() == words("en").time_is_up
    assert participant.window.page is None
    assert participant.events == []
    qtbot.waitUntil(lambda: participant.window.page == questionnaire(), timeout=5000)
    assert participant.focus in participant.page.fields
    participant.window.time_up.setInterval(1)
    timed_out(120.0)
    participant.window.show_page(PausePage(force_off=False))
    qtbot.wait(50)
    assert participant.window.page == PausePage(force_off=False)


@pytest.mark.slow
@pytest.mark.parametrize("follows", [(), (questionnaire(), text_page())], ids=["stays", "changes"])
def test_escape_held_stops_the_force_and_does_not_pause_as_well_though_the_page_changes(
    participant: Participant, qtbot: Any, follows: tuple[Page, ...]
) -> None:
    participant.show(task_page())

    def stopped(event: Any) -> bool:
        return isinstance(event, ForceStopped)

    with qtbot.waitSignal(participant.window.event, timeout=5 * HOLD_MS, check_params_cb=stopped):
        QTest.keyPress(participant.focus, KEY.Key_Escape)
        for page in follows:
            participant.window.show_page(page)
    QTest.keyRelease(participant.focus, KEY.Key_Escape)
    assert participant.told == [ForceStopped(participant.told[0].at_s, "participant")]


def test_escape_held_while_the_window_is_left_stops_nothing(participant: Participant) -> None:
    participant.show(task_page())
    QTest.keyPress(participant.focus, KEY.Key_Escape)
    QApplication.sendEvent(participant.window, QEvent(QEvent.Type.WindowDeactivate))
    QTest.keyRelease(participant.focus, KEY.Key_Escape)
    assert not participant.window.findChild(EscapeKey).findChild(QTimer).isActive()
    assert participant.events == []
