"""From one page to the next: what is on the screen is the old page, then the new one, and never anything else."""

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QObject, QSize, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.pages.text_page import TextWidget
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.wording.languages import words
from study_app.session.pages import EndPage, Page, PausePage, TroublePage
from study_app.session.transitions.events import LanguageChosen
from tests.gui.small import ManualClock, explore, questionnaire, task_page, text_page, view

SIZE = QSize(1024, 640)
SEQUENCE: list[Page] = [
    text_page("consent", languages=("en", "nl")),
    text_page("instructions", coming=task_page(explore())),
    task_page(explore()),
    questionnaire(),
    questionnaire(title="Liquid setting 2"),
    text_page("break", stays_until_s=1000.0),
    task_page(),
    PausePage(force_off=False),
    PausePage(force_off=True),
    task_page(),
    questionnaire(chosen=(("item1", 4),)),
    TroublePage("One moment", "Help comes."),
    EndPage("Thank you", "You may let go."),
]


@pytest.fixture
def window(qtbot: Any) -> Iterator[ParticipantWindow]:
    made = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
    qtbot.addWidget(made)
    made.resize(SIZE)
    made.show()
    qtbot.waitExposed(made)
    QApplication.processEvents()
    yield made
    made.may_close = True
    made.close()


def on_screen(window: QWidget) -> QImage:
    """Return what the window system has of the window: what was painted and handed over, nothing that is under way."""
    return window.screen().grabWindow(window.winId()).toImage().convertToFormat(QImage.Format.Format_RGB32)


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


def change(window: ParticipantWindow, page: Page) -> list[QImage]:
    """Show a page; return every picture that the screen had meanwhile, the old page's and the new one's with them."""
    watcher = Watcher(window)
    app = QApplication.instance()
    assert app is not None
    app.installEventFilter(watcher)
    window.show_page(page)
    for _ in range(3):
        QApplication.processEvents()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        watcher.look()
    app.removeEventFilter(watcher)
    return watcher.pictures


@pytest.mark.nightly
@pytest.mark.slow
def test_the_screen_shows_the_old_page_and_then_the_new_one(window: ParticipantWindow) -> None:
    for page in SEQUENCE:
        pictures = change(window, page)
        whole = window.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
        assert len(pictures) == 2, f"{len(pictures) - 2} pictures that are neither page, before {page}"
        assert pictures[-1] == whole


def test_the_first_view_adds_the_ball_and_nothing_else(window: ParticipantWindow) -> None:
    window.show_page(task_page())
    QApplication.processEvents()
    before = pixels(on_screen(window))
    window.show_view(view((0.0, 0.01, 0.0), lit=None, reached=0))
    QApplication.processEvents()
    differs = (before != pixels(on_screen(window))).any(axis=2)
    tank = window.tank
    assert tank is not None
    inside = np.zeros_like(differs)
    for name in ("ball", "shadow", "plumb"):
        place = tank.things[name].place.toAlignedRect()
        inside[place.top() : place.bottom() + 1, place.left() : place.right() + 1] = True
    assert differs.any()
    assert not (differs & ~inside).any()


def pixels(image: QImage) -> Any:
    return np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4)[..., :3].copy()


def test_tab_goes_round_on_the_page_and_never_to_the_window(window: ParticipantWindow) -> None:
    window.activateWindow()
    window.show_page(text_page("consent", languages=("en", "nl")))
    QApplication.processEvents()
    widget = window.widget
    assert isinstance(widget, TextWidget)
    assert widget.languages is not None
    assert widget.button is not None
    visited = []
    for _ in range(4):
        QTest.keyClick(QApplication.focusWidget() or widget, Qt.Key.Key_Tab)
        visited.append(QApplication.focusWidget())
    assert window not in visited
    assert widget.button in visited
    assert widget.languages.buttons[0] in visited
    window.show_page(questionnaire())
    quest = window.widget
    assert isinstance(quest, QuestionnaireWidget)
    quest.button.setFocus()
    QTest.keyClick(quest.button, Qt.Key.Key_Tab)
    assert quest.fields[0].hasFocus()


def test_the_page_in_another_language_begins_with_the_keyboard_where_it_begins(window: ParticipantWindow) -> None:
    window.activateWindow()
    pages = {code: text_page("consent", languages=("en", "nl"), language=code) for code in ("en", "nl")}

    def answer(event: Any) -> None:
        if isinstance(event, LanguageChosen):
            window.show_page(pages[event.language])

    window.event.connect(answer)
    window.show_page(pages["en"])
    for keys, language in (((Qt.Key.Key_Tab, Qt.Key.Key_Right), "nl"), ((Qt.Key.Key_Tab, Qt.Key.Key_Left), "en")):
        for key in keys:
            QTest.keyClick(QApplication.focusWidget() or window, key)
        QApplication.processEvents()
        assert window.page == pages[language]
        assert QApplication.focusWidget() is window.widget


def test_another_language_changes_every_page_that_follows(window: ParticipantWindow) -> None:
    told: list[Any] = []
    window.event.connect(told.append)
    window.show_page(text_page("consent", languages=("en", "nl", "ar")))
    widget = window.widget
    assert isinstance(widget, TextWidget)
    assert widget.languages is not None
    QTest.mouseClick(widget.languages.buttons[2], Qt.MouseButton.LeftButton)
    QApplication.processEvents()
    assert told == [LanguageChosen(told[0].at_s, "ar")]
    window.show_page(text_page("consent", languages=("en", "nl", "ar"), language="ar"))
    assert window.widget.layoutDirection() == Qt.LayoutDirection.RightToLeft
    assert window.windowTitle() == words("ar").window_title
    window.show_page(questionnaire())
    quest = window.widget
    assert isinstance(quest, QuestionnaireWidget)
    assert quest.button.text() == words("ar").continue_
    window.show_page(text_page("break"))
    assert window.widget.layoutDirection() == Qt.LayoutDirection.LeftToRight


@pytest.mark.slow
def test_a_tank_that_is_still_being_painted_is_waited_for_on_a_page_that_says_so(
    window: ParticipantWindow, qtbot: Any
) -> None:
    done = threading.Event()
    window.painting = threading.Thread(target=done.wait)
    window.painting.start()
    pictures = change(window, task_page(explore()))
    assert len(pictures) == 2
    assert window.tank is None
    assert window.widget.accessibleName() == words("en").trouble_title
    window.show_view(view(lit=None, elapsed_s=40.0))
    QTest.keyClick(window, Qt.Key.Key_Space)  # neither view nor key does anything yet
    assert window.tank is None
    done.set()
    qtbot.waitUntil(lambda: window.tank is not None)
    assert not window.waiting.isActive()


def test_a_page_that_comes_while_a_tank_is_waited_for_is_shown_at_once(window: ParticipantWindow) -> None:
    done = threading.Event()
    window.painting = threading.Thread(target=done.wait)
    window.painting.start()
    window.show_page(task_page())
    window.show_page(PausePage(force_off=True))
    done.set()
    window.painting.join()
    window.waiting.timeout.emit()
    assert window.tank is None
    assert window.page == PausePage(force_off=True)


def test_a_pause_paints_the_tank_that_it_interrupted(window: ParticipantWindow, qtbot: Any) -> None:
    window.show_page(PausePage(force_off=False, coming=task_page()))
    qtbot.waitUntil(lambda: window.painting is not None)
