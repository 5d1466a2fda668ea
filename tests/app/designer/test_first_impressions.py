"""What one sees first: no study, a study that is read-only, the study's own form, and what a deletion takes away."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from study_app.authoring.kept_settings import kept_original

pytestmark = pytest.mark.slow

CONTROL, KEY = Qt.KeyboardModifier.ControlModifier, Qt.Key


def test_tab_goes_first_to_a_new_study_where_none_is_open(qtbot: Any, designer: Any) -> None:
    place = designer.place
    place.setFocus()
    place.focusNextChild()
    assert place.nothing.new.hasFocus()
    qtbot.keyClick(place.nothing.new, KEY.Key_Tab)
    assert place.header.study.hasFocus()


@pytest.mark.parametrize("opened", [False, True])
def test_ctrl_n_begins_a_study_anywhere_and_keeps_what_is_typed_for_one(
    qtbot: Any, designer: Any, opened: bool
) -> None:
    if opened:
        designer.controller.open("kitchen")
        designer.place.parts.focus_outline()
    for _ in range(2):
        qtbot.keyClick(QApplication.focusWidget() or designer.window, KEY.Key_N, CONTROL)
        assert designer.place.stack.currentWidget() is designer.place.new_page
        title = designer.place.new_page.card.questions.title
        assert title.hasFocus()
        qtbot.keyClicks(title, "a")
    assert title.text() == "aa"


def test_the_fields_of_a_copy_can_be_edited_at_once(designer: Any) -> None:
    title = ("pages", "welcome", "title")
    designer.controller.open("demo")
    designer.select(title[:2])
    assert not designer.row(*title).field.isEnabled()
    designer.controller.begin("demo", "mine")
    designer.select(title[:2])
    assert designer.row(*title).field.isEnabled()
    assert kept_original(designer.editing.opened.file) == "demo"
