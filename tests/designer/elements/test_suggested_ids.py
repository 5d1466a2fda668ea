"""The id of a new element: suggested once, when its text is left."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from study_app.designer.document.steps import AddElement, AddNamed, RenameElement, SetText
from study_app.designer.document.toml_edits import Set
from study_app.protocol.source.document import value_at

pytestmark = pytest.mark.slow

ITEMS = ("questionnaires", "liquid", "items")


def type_and_leave(qtbot: Any, designer: Any, text: str) -> None:
    """Type into the first empty text and leave it by Tab."""
    designer.place.form.focus_first_text(filled=False)
    qtbot.keyClicks(designer.keyboard, text)
    qtbot.keyClick(designer.keyboard, Qt.Key.Key_Tab)
    QApplication.processEvents()


def id_of_selected(designer: Any) -> str:
    path = designer.editing.selected
    table: Any = value_at(designer.editing.opened.study.document, path)
    return str(table.get("id", path[-1]))


def test_a_new_block_gets_the_id_of_its_title_once_and_undo_gives_every_byte_back(qtbot: Any, designer: Any) -> None:
    designer.open()
    before = designer.text
    designer.editing.ask(AddElement(("blocks",)))
    initial = designer.editing.selected
    designer.place.form.focus_first_text(filled=False)
    for letters in ("Sec", "ond", " part"):
        qtbot.keyClicks(designer.keyboard, letters)
        designer.place.flush()
        assert designer.editing.selected == initial
    qtbot.keyClick(designer.keyboard, Qt.Key.Key_Tab)
    QApplication.processEvents()
    assert designer.editing.selected == ("blocks", "second_part")
    assert designer.place.form.head.id.text() == "second_part"
    assert designer.place.form.isAncestorOf(designer.keyboard)
    designer.editing.ask(SetText(("blocks", "second_part", "title"), "en", "Third part"))
    designer.place.outline.chosen.emit(("blocks", "liquids"))
    assert "second_part" in designer.editing.opened.study.document["blocks"]
    while designer.editing.opened.done:
        designer.editing.undo()
    assert designer.text == before


def test_selecting_another_element_leaves_the_text_too(qtbot: Any, designer: Any) -> None:
    designer.open()
    designer.editing.ask(AddElement(("blocks",)))
    name = designer.editing.selected[1]
    designer.place.form.focus_first_text(filled=False)
    qtbot.keyClicks(designer.keyboard, "Last")
    designer.place.outline.chosen.emit(("blocks", name, "title"))
    assert designer.editing.selected[:2] == ("blocks", "last")


def test_a_question_gets_the_id_of_its_text_unless_answers_are_recorded_or_it_was_renamed(
    qtbot: Any, designer: Any
) -> None:
    designer.open()
    designer.editing.recorded = lambda _element: frozenset({"cold", "question_2"})
    designer.editing.ask(AddElement(ITEMS))
    designer.place.outline.chosen.emit(("study",))
    assert designer.editing.opened.study.document["questionnaires"]["liquid"]["items"][-1]["id"] == "question"
    designer.editing.select((*ITEMS, 2))
    type_and_leave(qtbot, designer, "Cold?")
    assert id_of_selected(designer) == "cold_2"
    designer.editing.ask(AddElement(ITEMS))
    designer.editing.ask(RenameElement(designer.editing.selected, "warm"))
    type_and_leave(qtbot, designer, "Hot?")
    assert id_of_selected(designer) == "warm"


def test_references_follow_the_suggested_id(designer: Any) -> None:
    designer.open()
    designer.editing.ask(AddNamed(("blocks", "liquids", "questionnaire"), "questionnaires"))
    form = designer.editing.selected
    designer.editing.make("Title", Set((*form, "title"), "Afterwards"))
    designer.editing.select(("study",))
    assert designer.editing.opened.study.document["blocks"]["liquids"]["questionnaire"] == "afterwards"
