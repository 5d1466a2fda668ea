"""The Help page: links lead to headings, to other pages and outside the program."""

import pytest
from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QDesktopServices, QTextDocument, QTextTable

from study_app.gui.help.view import PAGE
from tests.gui import windows

pytestmark = pytest.mark.slow


@pytest.fixture
def place(qtbot):
    return windows.help_pages(qtbot)


def test_pages_shown_before_are_let_go_of_with_their_pictures(place, qtbot):
    for name in ("first-session", "video", "triggers", "video"):
        place.open_page(name)
    qtbot.waitUntil(lambda: len(place.reader.findChildren(QTextDocument)) == 1)


def test_a_link_leads_to_a_heading_of_another_page_and_back_returns(place, qtbot):
    place.reader.anchorClicked.emit(QUrl("delays.md#the-whole-delay"))
    assert place.reader.page == "delays"
    top = place.reader.cursorForPosition(place.reader.viewport().rect().topLeft())
    top_blocks = {top.block().text(), top.block().next().text(), top.block().next().next().text()}
    assert "The whole delay" in top_blocks
    assert place.list.currentItem().data(PAGE) == "delays"
    place.reader.anchorClicked.emit(QUrl("no-such-page.md"))
    assert place.reader.page == "delays"
    qtbot.keyClick(place, Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    assert place.reader.page == "index"
    assert not place.back.isEnabled()


@pytest.mark.parametrize(
    ("link", "page"),
    [("../delays.md", "delays"), ("0002-compiled-servo-loop.md", "decisions/0002-compiled-servo-loop")],
)
def test_a_link_on_a_page_of_a_folder_begins_there(place, link, page):
    place.open_page("decisions/0001-layers-point-downwards")
    place.reader.anchorClicked.emit(QUrl(link))
    assert place.reader.page == page


def test_an_address_is_opened_outside_the_program(place, monkeypatch):
    addresses = []
    monkeypatch.setattr(QDesktopServices, "openUrl", addresses.append)
    place.reader.anchorClicked.emit(QUrl("https://jobqueue.dask.org"))
    assert addresses == [QUrl("https://jobqueue.dask.org")]
    assert place.reader.page == "index"


def test_tables_after_code_begin_with_their_heading_and_bars_have_no_backslash(place):
    place.open_page("lab-streaming-layer")
    table = next(frame for frame in place.reader.document().rootFrame().childFrames() if isinstance(frame, QTextTable))
    assert table.cellAt(0, 0).firstCursorPosition().block().text() == "field"
    place.open_page("commands")
    assert "none∣gui∣gui+cpu" in place.reader.document().toPlainText()
