"""Pages to read: what they say, which keys go on, breaks that last, long texts, languages to choose from."""

from typing import Any

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QScrollArea, QScroller

from study_app.gui.participant.pages.notices import NoticeWidget, PauseWidget
from study_app.gui.participant.pages.page_widget import page_scale
from study_app.gui.participant.pages.progress_line import ProgressLine, progress_words
from study_app.gui.participant.pages.reading_page import Column, ReadingPage
from study_app.gui.participant.pages.text_page import TextWidget
from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import PausePage, Progress, TextPage, TroublePage
from study_app.session.transitions.events import Continue, LanguageChosen, ResumeAsked
from tests.gui.small import ManualClock, text_page

ENGLISH = words("en")
KINDS = ("instructions", "break", "debrief")


def opened(qtbot: Any, widget: ReadingPage, size: tuple[int, int] = (1366, 768)) -> list[Any]:
    """Show a page; return the list in which its events appear."""
    qtbot.addWidget(widget)
    told: list[Any] = []
    widget.event_made.connect(told.append)
    widget.resize(*size)
    widget.show()
    widget.focus_first()
    QApplication.processEvents()
    return told


def texts(widget: ReadingPage) -> str:
    return " ".join(label.text() for label in widget.findChildren(QLabel))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("key", [Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter])
def test_space_and_enter_go_on_once(qtbot: Any, kind: str, key: Qt.Key) -> None:
    widget = TextWidget(text_page(kind), ENGLISH, ManualClock())
    told = opened(qtbot, widget)
    QTest.keyClick(widget.focusWidget() or widget, key)
    assert [type(event) for event in told] == [Continue]


def test_button_goes_on(qtbot: Any) -> None:
    widget = TextWidget(text_page(), ENGLISH, ManualClock())
    told = opened(qtbot, widget)
    assert widget.button is not None
    assert widget.button.text() == "Go on"
    QTest.mouseClick(widget.button, Qt.MouseButton.LeftButton)
    assert [type(event) for event in told] == [Continue]


def test_consent_is_not_given_by_the_space_bar(qtbot: Any) -> None:
    widget = TextWidget(text_page("consent", button="I agree and take part"), ENGLISH, ManualClock())
    told = opened(qtbot, widget)
    QTest.keyClick(widget.focusWidget() or widget, Qt.Key.Key_Space)
    assert told == []
    QTest.keyClick(widget, Qt.Key.Key_Return)
    assert [type(event) for event in told] == [Continue]


def test_consent_is_given_by_its_button(qtbot: Any) -> None:
    widget = TextWidget(text_page("consent"), ENGLISH, ManualClock())
    told = opened(qtbot, widget)
    assert widget.button is not None
    widget.button.setFocus()
    QTest.keyClick(widget.button, Qt.Key.Key_Space)
    assert [type(event) for event in told] == [Continue]


def test_title_and_paragraphs_are_shown_as_written(qtbot: Any) -> None:
    widget = TextWidget(text_page(paragraphs=("Less than < 8 N & more.", "Second.")), ENGLISH, ManualClock())
    opened(qtbot, widget)
    shown = texts(widget)
    assert "Before you begin" in shown
    assert "Less than &lt; 8 N &amp; more." in shown
    assert "Second." in shown
    assert widget.accessibleName() == "Before you begin"
    assert "Less than < 8 N & more." in widget.accessibleDescription()


def test_text_too_long_for_the_window_scrolls_and_keeps_the_button(qtbot: Any) -> None:
    widget = TextWidget(text_page(paragraphs=("A sentence about the study. " * 30,) * 4), ENGLISH, ManualClock())
    opened(qtbot, widget, (1024, 640))
    assert widget.button is not None
    assert widget.findChild(Column).height() > widget.findChild(QScrollArea).height()
    assert widget.rect().contains(widget.button.geometry())
    assert widget.findChild(QScrollArea).verticalScrollBarPolicy() == Qt.ScrollBarPolicy.ScrollBarAlwaysOn


def test_pause_resumes_with_enter_not_with_space(qtbot: Any) -> None:
    widget = PauseWidget(PausePage(force_off=False), ENGLISH, ManualClock())
    told = opened(qtbot, widget)
    QTest.keyClick(widget, Qt.Key.Key_Space)
    assert told == []
    QTest.keyClick(widget, Qt.Key.Key_Return)
    assert [type(event) for event in told] == [ResumeAsked]
    assert ENGLISH.pause_title in texts(widget)


def test_pause_after_a_force_stop_says_that_the_force_is_off(qtbot: Any) -> None:
    widget = PauseWidget(PausePage(force_off=True), ENGLISH, ManualClock())
    told = opened(qtbot, widget)
    assert ENGLISH.force_off_title in texts(widget)
    assert ENGLISH.pause_title not in texts(widget).replace(ENGLISH.force_off_title, "")
    assert widget.button is not None
    assert widget.button.text() == ENGLISH.force_on
    widget.button.click()
    assert [type(event) for event in told] == [ResumeAsked]


@pytest.mark.parametrize("language", ["en", "nl"])
@pytest.mark.parametrize("page", [PausePage(True, "force"), PausePage(True, "pause"), PausePage(False, "pause")])
def test_what_the_operator_stopped_has_nothing_to_press(qtbot: Any, page: PausePage, language: str) -> None:
    said = words(language)
    widget = PauseWidget(page, said, ManualClock())
    told = opened(qtbot, widget)
    assert widget.button is None
    for key in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter):
        QTest.keyClick(widget, key)
    assert told == []
    assert (said.force_held_title in texts(widget)) is (page.held == "force")
    assert (said.force_held_body if page.force_off else said.pause_held_body) in texts(widget)


def test_trouble_has_nothing_to_press(qtbot: Any) -> None:
    page = TroublePage("One moment", "Help comes.")
    widget = NoticeWidget(page, ENGLISH, ManualClock())
    told = opened(qtbot, widget)
    assert widget.button is None
    for key in (Qt.Key.Key_Space, Qt.Key.Key_Return):
        QTest.keyClick(widget, key)
    assert told == []
    assert page.paragraph in texts(widget)


def test_progress_says_part_and_setting(qtbot: Any) -> None:
    progress = Progress(2, 2, "Delay setting 3", 3, 7)
    assert progress_words(progress, ENGLISH) == ("Part 2 of 2", "Delay setting 3 of 7")
    assert progress_words(Progress(1, 1, "Practice", 1, 1), ENGLISH) == ("", "Practice")
    line = ProgressLine(progress, ENGLISH, 0.5)
    qtbot.addWidget(line)
    assert line.accessibleName() == "Part 2 of 2 · Delay setting 3 of 7"


def test_pages_grow_with_the_window_and_never_shrink() -> None:
    assert page_scale(1366, 768) == 1.0
    assert page_scale(1024, 640) == 1.0
    assert page_scale(1920, 1080) == pytest.approx(1920 / 1366)
    assert page_scale(1920, 800) == pytest.approx(800 / 768)
    assert page_scale(10_000, 10_000) == pytest.approx(2.4)


@pytest.mark.parametrize("by_key", [False, True])
def test_consent_can_be_declined_in_every_language(qtbot: Any, by_key: bool) -> None:
    for said in LANGUAGES.values():
        widget = TextWidget(text_page("consent"), said, ManualClock())
        told = opened(qtbot, widget)
        assert widget.decline is not None
        assert widget.decline.text() == said.decline
        assert widget.rect().contains(widget.decline.geometry())
        assert not widget.decline.geometry().intersects(widget.button.geometry())
        if by_key:
            widget.decline.setFocus()
            QTest.keyClick(widget.decline, Qt.Key.Key_Return)
        else:
            QTest.mouseClick(widget.decline, Qt.MouseButton.LeftButton)
        (end,) = told
        assert (end.status, end.reason) == ("withdrawn", "no consent")
    assert TextWidget(text_page(), ENGLISH, ManualClock()).decline is None


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
