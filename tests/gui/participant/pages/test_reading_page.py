"""Pages to read: a break that lasts, texts that are longer than the window, languages to choose from."""

from typing import Any

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QScrollArea, QScroller

from study_app.gui.participant.pages.text_page import TextWidget
from study_app.protocol.wording.languages import words
from study_app.session.pages import TextPage
from study_app.session.transitions.events import Continue, LanguageChosen
from tests.gui.small import text_page

ENGLISH = words("en")
LONG = ("A sentence about the study. " * 30,) * 4


class Clock:
    """Seconds that pass when told."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


class Opened:
    """A page on a screen, its clock, and what it told."""

    def __init__(self, qtbot: Any, page: TextPage, size: tuple[int, int] = (1366, 768), language: str = "en") -> None:
        self.clock = Clock()
        self.page = TextWidget(page, words(language), self.clock)
        qtbot.addWidget(self.page)
        self.told: list[Any] = []
        self.page.event_made.connect(self.told.append)
        self.page.resize(*size)
        self.page.show()
        self.page.activateWindow()
        qtbot.waitExposed(self.page)
        self.page.focus_first()
        QApplication.processEvents()

    def press(self, *keys: Qt.Key) -> None:
        for key in keys:
            QTest.keyClick(self.page.focusWidget() or self.page, key)


# breaks


def test_a_break_counts_down_and_then_offers_its_button(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page("break", stays_until_s=130.0))
    button = opened.page.button
    assert button is not None
    assert not button.isVisible()
    assert opened.page.count == ENGLISH.continue_in.format(seconds=30)
    opened.press(Qt.Key.Key_Space, Qt.Key.Key_Return)
    assert opened.told == []
    opened.clock.now_s = 129.4
    opened.page.tick()
    assert opened.page.count == ENGLISH.continue_in.format(seconds=1)
    opened.clock.now_s = 130.0
    opened.page.tick()
    assert opened.page.count == ""
    assert button.isVisible()
    assert button.hasFocus()
    opened.press(Qt.Key.Key_Space)
    assert [type(event) for event in opened.told] == [Continue]


@pytest.mark.slow
def test_the_count_ticks_by_itself_and_stops_at_the_end(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page("break", stays_until_s=130.0))
    opened.clock.now_s = 119.5
    qtbot.waitUntil(lambda: opened.page.count == ENGLISH.continue_in.format(seconds=11))
    opened.clock.now_s = 131.0
    qtbot.waitUntil(lambda: opened.page.count == "")
    assert not opened.page.findChild(QTimer).isActive()


def test_a_break_that_comes_back_after_its_time_waits_no_more(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page("break", stays_until_s=90.0))
    assert opened.page.count == ""
    opened.press(Qt.Key.Key_Space)
    assert [type(event) for event in opened.told] == [Continue]


# long texts


def test_a_long_text_is_read_by_the_keyboard_alone(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page(paragraphs=LONG), (1024, 640))
    bar = opened.page.findChild(QScrollArea).verticalScrollBar()
    button = opened.page.button
    assert button is not None
    assert button.hasFocus()
    opened.press(Qt.Key.Key_Down, Qt.Key.Key_Down)
    assert bar.value() > 0
    assert button.hasFocus()
    opened.press(Qt.Key.Key_Up, Qt.Key.Key_Up)
    assert bar.value() == 0
    opened.press(*[Qt.Key.Key_PageDown] * 12)
    assert bar.value() == bar.maximum()
    opened.press(*[Qt.Key.Key_PageUp] * 12)
    assert bar.value() == 0
    opened.press(Qt.Key.Key_Space)
    assert [type(event) for event in opened.told] == [Continue]


def test_a_page_of_it_keeps_a_line_of_the_page_before(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page(paragraphs=LONG), (1024, 640))
    bar = opened.page.findChild(QScrollArea).verticalScrollBar()
    opened.press(Qt.Key.Key_PageDown)
    assert 0.5 * bar.pageStep() < bar.value() < bar.pageStep()


def test_a_long_text_follows_a_finger(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page(paragraphs=LONG), (1024, 640))
    assert QScroller.hasScroller(opened.page.findChild(QScrollArea).viewport())


# languages


@pytest.mark.parametrize("key", [Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter])
def test_a_key_on_a_language_chooses_it_and_does_not_agree(qtbot: Any, key: Qt.Key) -> None:
    opened = Opened(qtbot, text_page("consent", languages=("en", "nl")))
    assert opened.page.languages is not None
    opened.page.languages.buttons[1].setFocus(Qt.FocusReason.TabFocusReason)
    opened.press(key)
    QApplication.processEvents()
    assert opened.told == [LanguageChosen(100.0, "nl")]


def test_tab_and_an_arrow_choose_a_language(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page("consent", languages=("en", "nl", "de")))
    assert opened.page.languages is not None
    assert opened.page.button is not None
    opened.press(Qt.Key.Key_Tab)
    assert opened.page.languages.buttons[0].hasFocus()
    opened.press(Qt.Key.Key_Tab)
    assert opened.page.button.hasFocus()
    opened.press(Qt.Key.Key_Tab)
    assert opened.page.decline is not None
    assert opened.page.decline.hasFocus()
    opened.press(Qt.Key.Key_Tab, Qt.Key.Key_Right)
    QApplication.processEvents()
    assert opened.told == [LanguageChosen(100.0, "nl")]


def test_tab_comes_to_the_language_of_the_page_wherever_it_stands(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page("consent", languages=("en", "nl", "de"), language="nl"), language="nl")
    assert opened.page.languages is not None
    opened.press(Qt.Key.Key_Tab)
    assert opened.page.languages.buttons[1].hasFocus()
    opened.press(Qt.Key.Key_Left)
    QApplication.processEvents()
    assert opened.told == [LanguageChosen(100.0, "en")]


def test_the_language_of_the_page_is_marked_and_choosing_it_tells_nothing(qtbot: Any) -> None:
    opened = Opened(qtbot, text_page("consent", languages=("en", "nl"), language="nl"), language="nl")
    assert opened.page.languages is not None
    english, dutch = opened.page.languages.buttons
    assert (english.isChecked(), dutch.isChecked()) == (False, True)
    assert (english.text(), dutch.text()) == ("English", "Nederlands")
    QTest.mouseClick(dutch, Qt.MouseButton.LeftButton)
    QApplication.processEvents()
    assert opened.told == []
    assert dutch.isChecked()


def test_a_study_in_one_language_has_no_switch(qtbot: Any) -> None:
    assert Opened(qtbot, text_page("consent")).page.languages is None
