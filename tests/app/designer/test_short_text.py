"""The short text of a new question, while its text is typed in the form."""

from __future__ import annotations

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from study_app.viewmodels.designer.requests import AddElement, ChangeLanguage

pytestmark = pytest.mark.slow

ITEMS = ("questionnaires", "liquid", "items")


def write(qtbot: Any, designer: Any, field: str, words: str) -> None:
    line = designer.row(*designer.editing.selected, field).field.lines["en"]
    line.setFocus(Qt.FocusReason.TabFocusReason)
    line.selectAll()
    qtbot.keyClicks(line, words)
    designer.place.flush()
    QApplication.processEvents()


def short(designer: Any) -> Any:
    return designer.row(*designer.editing.selected, "short").row.row.value


def test_the_short_text_follows_the_text_until_it_is_edited(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(AddElement(ITEMS))
    before = designer.text
    assert short(designer) == "New question"
    write(qtbot, designer, "text", "Was it cold?")
    assert short(designer) == "Was it cold"
    assert designer.editing.opened.study.faults == ()
    write(qtbot, designer, "text", "Was it warm?")
    assert short(designer) == "Was it warm"
    designer.editing.undo()
    assert designer.text == before
    designer.editing.redo()
    write(qtbot, designer, "short", "Warm")
    write(qtbot, designer, "text", "Was it warm or cold?")
    assert short(designer) == "Warm"


def test_it_follows_in_the_language_that_is_typed(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(ChangeLanguage("add", "nl"))
    designer.editing.ask(AddElement(ITEMS))
    write(qtbot, designer, "text", "Was it cold?")
    assert short(designer) == {"en": "Was it cold", "nl": "New question"}
