"""The place Help: pages are chosen, searched, followed by links, and drawn in the colours of the theme."""

import pytest
from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QDesktopServices, QFontDatabase, QTextDocument, QTextTable

from study_app.gui.help.view import PAGE
from tests.gui import windows

pytestmark = pytest.mark.slow


@pytest.fixture
def place(qtbot):
    return windows.help_pages(qtbot)


def shown(place):
    return place.reader.toPlainText()


def test_a_page_is_chosen_from_the_list_by_key_and_by_mouse(place, qtbot):
    place.list.setFocus()
    for _ in range(2):
        qtbot.keyClick(place.list, Qt.Key.Key_Down)
    assert place.reader.page == "first-session"
    item = place.list.item(4)
    qtbot.mouseClick(place.list.viewport(), Qt.MouseButton.LeftButton, pos=place.list.visualItemRect(item).center())
    assert place.reader.page == item.data(PAGE)


def test_pages_shown_before_are_let_go_of_with_their_pictures(place, qtbot):
    for name in ("first-session", "video", "triggers", "video"):
        place.open_page(name)
    qtbot.waitUntil(lambda: len(place.reader.findChildren(QTextDocument)) == 1)


def test_words_leave_the_pages_that_contain_them(place, qtbot):
    qtbot.keyClicks(place.words, "photodiode")
    assert place.list.item(0).data(PAGE) == "photodiode"
    assert place.reader.page == "index"
    qtbot.keyClick(place.words, Qt.Key.Key_Down)
    assert place.reader.page == "photodiode"
    qtbot.keyClicks(place.words, " zebra")
    assert place.list.count() == 0
    assert place.nothing.isVisible()


def test_a_link_leads_to_a_heading_of_another_page_and_back_returns(place, qtbot):
    place.reader.anchorClicked.emit(QUrl("trials.md#tables-and-report"))
    assert place.reader.page == "trials"
    top = place.reader.cursorForPosition(place.reader.viewport().rect().topLeft())
    seen = {top.block().text(), top.block().next().text(), top.block().next().next().text()}
    assert "Tables and report" in seen
    assert place.list.currentItem().data(PAGE) == "trials"
    place.reader.anchorClicked.emit(QUrl("no-such-page.md"))
    assert place.reader.page == "trials"
    qtbot.keyClick(place, Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    assert place.reader.page == "index"
    assert not place.back.isEnabled()


def test_an_address_is_opened_outside_the_program(place, monkeypatch):
    opened = []
    monkeypatch.setattr(QDesktopServices, "openUrl", opened.append)
    place.reader.anchorClicked.emit(QUrl("https://jobqueue.dask.org"))
    assert opened == [QUrl("https://jobqueue.dask.org")]
    assert place.reader.page == "index"


def test_a_page_has_its_tables_code_and_pictures(place):
    place.open_page("first-session")
    frames = place.reader.document().rootFrame().childFrames()
    assert any(isinstance(frame, QTextTable) for frame in frames)
    fixed = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont).family()
    cursor = place.reader.document().find("liquid-study rehearse demo")
    assert cursor.charFormat().font().family() == fixed
    assert "run -->" not in shown(place)
    picture = place.reader.loadResource(2, QUrl("pictures/home.png"))
    assert 0 < picture.width() / picture.devicePixelRatio() <= place.reader.viewport().width()
