"""Elements and keys of a study: added, copied, moved, renamed, switched, removed, deleted and repaired."""

from typing import Any

import pytest
from PySide6.QtCore import Qt

from study_app.designer.document.steps import ChangeLanguage, RenameElement, SetText, Situation
from study_app.designer.document.study import read
from study_app.protocol.source.document import value_at
from tests.designer.document.grown import PROTOCOLS

pytestmark = pytest.mark.slow


def test_an_id_that_is_refused_can_be_replaced_by_one_that_is_free(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", "liquids", "thin")
    designer.editing.ask(RenameElement(("liquids", "thin"), "thick"))
    head = designer.place.form.head
    assert head.refusal.text() == 'The name "thick" is taken: "thick_2" is free.'
    assert head.refusal.use.text() == "Rename to thick_2"
    head.refusal.use.setFocus()
    qtbot.keyClick(head.refusal.use, Qt.Key.Key_Return)
    assert (head.id.text(), designer.editing.selected) == ("thick_2", ("liquids", "thick_2"))
    assert head.id.hasFocus()
    assert not head.refusal.isVisible()


def test_one_key_is_given_in_place_of_another_and_back_without_losing_its_value(designer: Any) -> None:
    designer.open()
    task = ("tasks", "reach")
    designer.editing.select(task)
    before = designer.text
    row = designer.form_row(*task, "count")
    assert row.remove is None
    assert not [one for one in designer.place.form.rows if one.row.row.path[-1] == "duration_s"]
    row.keys.buttons[1].click()
    study = designer.study
    assert study.faults == ()
    assert "count" not in study.document["tasks"]["reach"]
    designer.form_row(*task, "duration_s").keys.buttons[0].click()
    assert designer.value("tasks", "reach", "count") == 6
    designer.editing.undo()
    designer.editing.undo()
    assert designer.text == before
    designer.editing.select(("blocks", "liquids"))
    designer.form_row("blocks", "liquids", "conditions").keys.buttons[1].click()
    assert (
        "nothing that Stimulus can name" in designer.form_row("blocks", "liquids", "conditions").wrong.sentence.text()
    )


def test_after_a_rename_comments_that_mention_the_old_name_are_listed_and_left(designer: Any, qtbot: Any) -> None:
    text = designer.file.read_text()
    designer.file.write_text(f"{text}# No thanks to common words.\n# The pages `thanks` and `thanks_2` are short.\n")
    designer.open("kitchen", "pages", "thanks")
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


ITEMS = ("questionnaires", "liquid", "items")


def test_a_typed_text_leaves_its_copies_in_other_languages() -> None:
    text = (*ITEMS, 0, "text")
    study = read((PROTOCOLS / "demo.toml").read_bytes(), PROTOCOLS)
    for asked in (ChangeLanguage("add", "nl"), ChangeLanguage("copy", "nl")):
        study, _ = study.edited(*asked.step(Situation(study)).edits)
    before = value_at(study.document, text)
    study, _ = study.edited(*SetText(text, "en", "Warm").step(Situation(study)).edits)
    assert value_at(study.document, text) == {**before, "en": "Warm"}
