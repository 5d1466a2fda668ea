"""Renames in the window: the comments that mention the old name."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from study_app.viewmodels.designer.requests import SetValue

pytestmark = pytest.mark.slow


def test_after_a_rename_comments_that_mention_the_old_name_are_listed_and_left(designer: Any, qtbot: Any) -> None:
    text = designer.file.read_text()
    designer.file.write_text(f"{text}# No thanks to common words.\n# The pages `thanks` and `thanks_2` are short.\n")
    designer.controller.open("kitchen")
    designer.editing.select(("pages", "thanks"))
    head = designer.place.form.head
    head.edit_id()
    qtbot.keyClicks(head.id, "goodbye")
    qtbot.keyClick(head.id, Qt.Key.Key_Return)
    assert "[pages.goodbye]" in designer.text
    assert designer.place.prompt is None  # what is typed next must not go to a card
    assert head.comments.text() == "1 comment mentions “thanks”"
    qtbot.mouseClick(head.comments, Qt.MouseButton.LeftButton)
    card = designer.place.prompt
    lines = [line.accessibleName() for line in card.lines]
    count = len(designer.text.splitlines())
    assert lines == [f"Go to line {count}: # The pages `thanks` and `thanks_2` are short."]
    qtbot.mouseClick(card.lines[0], Qt.MouseButton.LeftButton)
    assert designer.place.file.editor.textCursor().blockNumber() == count - 1
    assert designer.text.endswith("# The pages `thanks` and `thanks_2` are short.\n")
    designer.editing.select(("pages", "welcome"))
    assert not head.comments.isVisible()


def test_after_a_rename_the_button_of_an_absent_key_is_found_at_its_new_path(designer: Any, qtbot: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("conditions", "thick"))
    form = designer.place.form
    path, button = next(iter(form.adds.items()))
    form.head.edit_id()
    qtbot.keyClicks(form.head.id, "thicker")
    qtbot.keyClick(form.head.id, Qt.Key.Key_Return)
    assert designer.editing.selected == ("conditions", "thicker")
    assert form.focus(("conditions", "thicker", path[-1]))
    assert QApplication.focusWidget() is button
    assert not form.focus(path), "there is no element of the old id"


def test_a_rename_says_once_how_many_references_followed(
    designer: Any, qtbot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr("study_app.gui.designer.form.form_head.say", lambda _head, words: said.append(words))
    designer.controller.open("kitchen")
    head = designer.place.form.head
    for path, name, words in (
        (("conditions", "thick"), "honey", "1 place updated"),
        (("tasks", "reach"), "touch", "1 place updated"),
        (("scales", "agreement"), "likert", "2 places updated"),
        (("questionnaires", "liquid", "items", 0), "feels", ""),
    ):
        designer.select(path)
        assert head.followed.text() == ""
        head.edit_id()
        qtbot.keyClicks(head.id, name)
        qtbot.keyClick(head.id, Qt.Key.Key_Return)
        assert head.followed.text() == words
        assert head.followed.isVisible()
        assert not words or said.pop() == words
    designer.editing.undo()
    assert head.followed.text() == ""
    assert not said


@pytest.mark.parametrize("path", [("conditions", "thick"), ("questionnaires", "liquid", "items", 0)])
def test_a_refused_rename_is_not_told_after_another_step(designer: Any, qtbot: Any, path: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue(("study", "version"), "0.7"))
    designer.select(path)
    head = designer.place.form.head
    head.edit_id()
    qtbot.keyClicks(head.id, "9 no!")
    qtbot.keyClick(head.id, Qt.Key.Key_Return)
    assert head.refusal.text()
    designer.editing.undo()
    assert head.followed.text() == ""


def test_an_id_with_answers_is_not_proposed_while_another_one_is_typed(designer: Any) -> None:
    designer.controller.open("kitchen")
    question = ("questionnaires", "liquid", "items", 0)
    designer.select(question)
    designer.editing.recorded = lambda _element: frozenset({"cold"})
    designer.place.id_typed.emit(question, "Cold!")
    assert '"cold_2" is free' in designer.place.form.head.refusal.text()
