"""Elements and keys of a study in the window: added, copied, moved, renamed, switched, deleted, found."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication

from study_app.designer.document.steps import AddElement, AddNamed, ChangeLanguage, RenameElement, SetText, Situation
from study_app.designer.document.study import read
from study_app.designer.document.toml_edits import Set
from study_app.designer.outline import ROW_ROLE
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
    assert row.remove.isHidden()
    assert not [one for one in designer.place.form.rows if one.row.path[-1] == "duration_s"]
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


def test_a_rename_says_how_many_places_follow(designer: Any, qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr("study_app.designer.place.view.say", lambda _widget, words: said.append(words))
    designer.open("kitchen", "pages", "thanks")
    head = designer.place.form.head
    head.edit_id()
    qtbot.keyClicks(head.id, "goodbye")
    qtbot.keyClick(head.id, Qt.Key.Key_Return)
    assert "[pages.goodbye]" in designer.text
    assert (said, designer.steps) == (["1 place updated"], ["Rename to goodbye, 1 place updated"])


ITEMS = ("questionnaires", "liquid", "items")


def test_a_typed_text_leaves_its_copies_in_other_languages() -> None:
    text = (*ITEMS, 0, "text")
    study = read((PROTOCOLS / "demo.toml").read_bytes(), PROTOCOLS)
    for asked in (ChangeLanguage("add", "nl"), ChangeLanguage("copy", "nl")):
        study, _ = study.edited(*asked.step(Situation(study)).edits)
    before = value_at(study.document, text)
    study, _ = study.edited(*SetText(text, "en", "Warm").step(Situation(study)).edits)
    assert value_at(study.document, text) == {**before, "en": "Warm"}


CONDITIONS = ("blocks", "liquids", "conditions")
SHIFT, CONTROL = Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier


@pytest.fixture
def four(designer: Any) -> Any:
    """The form of a block with four conditions."""
    text = designer.file.read_text()
    extra = "".join(
        f'\n[conditions.{name}]\nliquid = "thin"\ndelay_ms = {10 * at}\n' for at, name in enumerate("cd", 1)
    )
    text = text.replace('conditions = ["thin", "thick"]', 'conditions = ["thin", "thick", "c", "d"]') + extra
    designer.file.write_text(text)
    designer.open("kitchen", "blocks", "liquids")
    QApplication.processEvents()
    return designer


def names(designer: Any) -> str:
    return " ".join(designer.value("blocks", "liquids", "conditions"))


def chosen(designer: Any) -> tuple[int, ...]:
    shown: tuple[int, ...] = designer.field(*CONDITIONS).chosen
    return shown


def click(qtbot: Any, designer: Any, at: int, held: Any = Qt.KeyboardModifier.NoModifier) -> None:
    row = designer.field(*CONDITIONS).rows[at]
    qtbot.mouseClick(row, Qt.MouseButton.LeftButton, held, QPoint(30, row.height() // 2))


def test_entries_are_selected_by_the_mouse_and_move_and_go_together(qtbot: Any, four: Any, editors: None) -> None:
    before = four.text
    click(qtbot, four, 1)
    click(qtbot, four, 2, SHIFT)
    assert chosen(four) == (1, 2)
    four.key("alt+Up")
    assert names(four) == "thick c thin d"
    assert chosen(four) == (0, 1)
    four.key("alt+Down")
    four.key("alt+Down")
    assert names(four) == "thin d thick c"
    assert chosen(four) == (2, 3)
    click(qtbot, four, 0, CONTROL)
    assert chosen(four) == (0, 2, 3)
    steps = len(four.steps)
    qtbot.keyClick(four.field(*CONDITIONS).rows[0], Qt.Key.Key_Delete)
    assert names(four) == "d"
    assert len(four.steps) == steps + 1
    assert four.undo_all() == before


def test_insert_and_enter_add_a_question_below_the_one_whose_text_is_typed(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("template:questionnaire-only", "asked")
    items = ("questionnaires", "about_it", "items")
    designer.go_to(*items, 0)
    steps = len(designer.steps)
    designer.place.form.focus((*items, 0, "text"))
    field = designer.keyboard
    field.selectAll()
    qtbot.keyClicks(field, "How was it?")
    qtbot.keyClick(field, Qt.Key.Key_Insert)
    assert designer.place.adding.isVisible()
    qtbot.keyClick(designer.place.adding.words, Qt.Key.Key_Return)
    typed, new = designer.value("questionnaires", "about_it", "items")[:2]
    assert typed["text"] == "How was it?"
    assert new["text"].startswith("New question")
    assert designer.editing.selected == (*items, 1)
    assert designer.form_row(*items, 1, "text").isAncestorOf(designer.keyboard)
    assert len(designer.steps) == steps + 2


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


LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def small(designer: Any) -> Any:
    """A study of many elements in a small window."""
    designer.window.resize(1366, 768)
    designer.controller.begin("rek2024", "mine")
    QApplication.processEvents()
    return designer


def open_drawer(qtbot: Any, designer: Any) -> None:
    designer.key("ctrl+1")
    QApplication.processEvents()


def index_of(designer: Any, *path: str | int) -> Any:
    return next(one for one in designer.place.outline.indexes() if one.data(ROW_ROLE).path == path)


def expanded(designer: Any) -> set[Any]:
    tree = designer.place.outline.tree
    return {one.data(ROW_ROLE).path for one in designer.place.outline.indexes() if tree.isExpanded(one)}


def test_a_click_in_the_drawer_leads_to_the_form_and_leaves_what_is_open(qtbot: Any, small: Any) -> None:
    outline, tree = small.place.outline, small.place.outline.tree
    small.editing.select(("blocks", "liquids"))
    for _ in range(2):
        open_drawer(qtbot, small)
        index = index_of(small, "blocks", "liquids")
        before = expanded(small)
        assert ("blocks", "liquids") in before
        tree.scrollTo(index)
        qtbot.mouseClick(tree.viewport(), LEFT, pos=tree.visualRect(index).center())
        assert not outline.isVisible()
        assert small.place.form.isAncestorOf(small.keyboard)
        assert expanded(small) == before
    open_drawer(qtbot, small)
    index = index_of(small, "blocks", "liquids")
    tree.scrollTo(index)
    qtbot.mouseClick(tree.viewport(), LEFT, pos=QPoint(20, tree.visualRect(index).center().y()))
    assert outline.isVisible(), "the sign before the title opens and closes, it does not choose"
    assert ("blocks", "liquids") not in expanded(small)
