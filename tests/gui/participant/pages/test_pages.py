"""Pages to read: what they say, which keys go on, and that they fit."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QScrollArea

from study_app.gui.participant.pages.notices import NoticeWidget, PauseWidget
from study_app.gui.participant.pages.page_widget import page_scale
from study_app.gui.participant.pages.progress_line import ProgressLine, progress_words
from study_app.gui.participant.pages.reading_page import Column, ReadingPage
from study_app.gui.participant.pages.text_page import TextWidget
from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import PausePage, Progress, TroublePage
from study_app.session.transitions.events import Continue, ResumeAsked
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
