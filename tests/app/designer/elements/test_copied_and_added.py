"""What is copied, pasted, filled in or added by its name; several entries that are selected and move together."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication

from study_app.app.designer.edit_steps import Steps
from study_app.authoring.edited_study import Study
from study_app.protocol.source.files import shipped_file
from study_app.viewmodels.designer.requests import DuplicateEntries, MoveEntries

pytestmark = pytest.mark.slow

CONDITIONS = ("blocks", "liquids", "conditions")
ITEMS = ("questionnaires", "liquid", "items")
SHIFT, CONTROL, ALT = (
    Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.AltModifier,
)  # fmt: skip


@pytest.fixture
def four(designer: Any) -> Any:
    """The form of a block with four conditions."""
    text = designer.file.read_text()
    extra = "".join(
        f'\n[conditions.{name}]\nliquid = "thin"\ndelay_ms = {10 * at}\n' for at, name in enumerate("cd", 1)
    )
    text = text.replace('conditions = ["thin", "thick"]', 'conditions = ["thin", "thick", "c", "d"]') + extra
    designer.file.write_text(text)
    designer.controller.open("kitchen")
    designer.editing.select(("blocks", "liquids"))
    QApplication.processEvents()
    return designer


def names(designer: Any) -> str:
    return " ".join(designer.editing.opened.study.document["blocks"]["liquids"]["conditions"])


def chosen(designer: Any) -> tuple[int, ...]:
    shown: tuple[int, ...] = designer.row(*CONDITIONS).field.chosen
    return shown


def click(qtbot: Any, designer: Any, at: int, held: Any = Qt.KeyboardModifier.NoModifier) -> None:
    row = designer.row(*CONDITIONS).field.rows[at]
    qtbot.mouseClick(row, Qt.MouseButton.LeftButton, held, QPoint(30, row.height() // 2))


def test_entries_are_selected_by_the_mouse_and_move_and_go_together(qtbot: Any, four: Any, editors: None) -> None:
    before = four.text
    click(qtbot, four, 1)
    click(qtbot, four, 2, SHIFT)
    assert chosen(four) == (1, 2)
    assert "one of 2 selected" in four.row(*CONDITIONS).field.rows[2].accessibleName()
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Up, ALT)
    assert names(four) == "thick c thin d"
    assert chosen(four) == (0, 1)
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Down, ALT)
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Down, ALT)
    assert names(four) == "thin d thick c"
    assert chosen(four) == (2, 3)
    click(qtbot, four, 0, CONTROL)
    assert chosen(four) == (0, 2, 3)
    steps = len(four.editing.opened.history.done)
    qtbot.keyClick(four.row(*CONDITIONS).field.rows[0], Qt.Key.Key_Delete)
    assert names(four) == "d"
    assert len(four.editing.opened.history.done) == steps + 1
    while four.editing.opened.history.done:
        four.editing.undo()
    assert four.text == before


def test_entries_are_selected_by_keys_alone(qtbot: Any, four: Any) -> None:
    click(qtbot, four, 0)
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Down)
    assert chosen(four) == (1,)
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Down, SHIFT)
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Down, SHIFT)
    assert chosen(four) == (1, 2, 3)
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_C, CONTROL)
    copied = QApplication.clipboard().text()
    assert [one in copied for one in ("conditions.thick", "conditions.c", "conditions.d")] == [True] * 3
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Delete)
    assert names(four) == "thin"


def test_dragging_one_of_several_selected_entries_moves_them_all(qtbot: Any, four: Any) -> None:
    click(qtbot, four, 2)
    click(qtbot, four, 3, SHIFT)
    row = four.row(*CONDITIONS).field.rows[3]
    qtbot.mousePress(row, Qt.MouseButton.LeftButton, pos=QPoint(10, 10))
    for y in (-40, -200):
        qtbot.mouseMove(row, QPoint(10, y))
        row.dragged.emit(row.mapToParent(QPoint(10, y)).y())
    row.dropped.emit()
    assert names(four) == "c d thin thick"
    assert chosen(four) == (0, 1)


def test_several_questions_are_selected_in_the_form_and_copied_and_deleted_together(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    items = designer.editing.opened.study.document["questionnaires"]["liquid"]["items"]
    count = len(items)
    designer.editing.select((*ITEMS, 0))
    QApplication.processEvents()
    rows = designer.place.form.others
    qtbot.mouseClick(rows[0], Qt.MouseButton.LeftButton, CONTROL, QPoint(60, 10))
    assert designer.place.view.form.path == (*ITEMS, 0)
    assert designer.place.outline.selected == ((*ITEMS, 0), (*ITEMS, 1))
    assert rows[0].chosen
    qtbot.mouseClick(rows[0], Qt.MouseButton.LeftButton, CONTROL, QPoint(60, 10))
    assert not rows[0].chosen
    qtbot.mouseClick(rows[0], Qt.MouseButton.LeftButton, SHIFT, QPoint(60, 10))
    designer.place.form.head.copy.click()
    after = [item["id"] for item in designer.editing.opened.study.document["questionnaires"]["liquid"]["items"]]
    assert len(after) == count + 2
    assert after[1].startswith(items[0]["id"])
    assert after[3].startswith(items[1]["id"])
    assert designer.place.outline.selected == ((*ITEMS, 1), (*ITEMS, 3))
    designer.place.form.head.delete.click()
    assert designer.place.prompt is None
    left = designer.editing.opened.study.document["questionnaires"]["liquid"]["items"]
    assert [item["id"] for item in left] == [item["id"] for item in items]


def test_values_of_a_list_are_moved_and_copied_with_the_others_in_place() -> None:
    study = Study(shipped_file("demo").read_text())
    targets = ("tasks", "reach", "targets_mm")
    first, second = study.document["tasks"]["reach"]["targets_mm"]
    step = Steps().step(study, DuplicateEntries(((*targets, 0), (*targets, 1))))
    copied, _ = study.edited(*step.edits)
    assert copied.document["tasks"]["reach"]["targets_mm"] == (first, first, second, second)
    step = Steps().step(copied, MoveEntries(((*targets, 0), (*targets, 1)), 4))
    moved, _ = copied.edited(*step.edits)
    assert moved.document["tasks"]["reach"]["targets_mm"] == (second, second, first, first)
    assert step.select is None


LEFT = Qt.MouseButton.LeftButton


def test_elements_are_copied_with_comments_and_pasted_into_another_study(qtbot: Any, designer: Any) -> None:
    designer.controller.open("rek2024")
    designer.editing.select(("conditions", "delay_0"))
    qtbot.keyClick(designer.place.outline.tree, Qt.Key.Key_C, CONTROL)
    copied = QGuiApplication.clipboard().text()
    assert "# The thesis says" in copied
    assert "[conditions.delay_0]" in copied
    designer.controller.open("kitchen")
    before = designer.text
    designer.editing.select(("liquids", "thick"))
    QGuiApplication.clipboard().setText(
        copied.replace('"water"', '"thick"') + "\n[liquids.thick]\n# own\ndensity_kg_m3 = 1000\n"
    )
    qtbot.keyClick(designer.place.outline.tree, Qt.Key.Key_V, CONTROL)
    document = designer.editing.opened.study.document
    assert document["conditions"]["delay_0"]["liquid"] == "thick_2"
    assert document["liquids"]["thick_2"] == {"density_kg_m3": 1000}
    assert "# The thesis says" in designer.text
    assert "# own" in designer.text
    assert designer.editing.selected == ("conditions", "delay_0")
    designer.editing.undo()
    assert designer.text == before


def test_questions_are_pasted_as_toml_or_as_plain_lines(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("rek2024", "mine")
    before = designer.text
    tree, items = designer.place.outline.tree, ("questionnaires", "liquid", "items")
    designer.editing.select((*items, 1))
    qtbot.keyClick(tree, Qt.Key.Key_C, CONTROL)
    qtbot.keyClick(tree, Qt.Key.Key_V, CONTROL)
    found = designer.editing.opened.study.document["questionnaires"]["liquid"]["items"]
    assert [item["id"] for item in found[1:3]] == ["immersive", "immersive_2"]
    designer.editing.undo()
    QGuiApplication.clipboard().setText("1. How cold was it?\n- Did it smell?\n")
    qtbot.keyClick(tree, Qt.Key.Key_V, CONTROL)
    found = designer.editing.opened.study.document["questionnaires"]["liquid"]["items"]
    assert [item["text"]["en"] for item in found[2:4]] == ["How cold was it?", "Did it smell?"]
    assert [item["short"]["en"] for item in found[2:4]] == ["How cold was it", "Did it smell"]
    assert [item["id"] for item in found[2:4]] == ["how_cold_was_it", "did_it_smell"]
    assert designer.place.outline.selected == ((*items, 2), (*items, 3))
    designer.editing.undo()
    assert designer.text == before
    designer.editing.select(("study",))
    qtbot.keyClick(tree, Qt.Key.Key_V, CONTROL)
    assert designer.text == before
    assert "select a questionnaire" in designer.place.form.own.text()


def test_a_language_is_added_everywhere_filled_in_and_taken_away(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    before = designer.text
    designer.editing.select(("study",))
    field = designer.row("study", "languages").field
    field.names.activated.emit(field.names.findData("ar"))
    study = designer.editing.opened.study
    missing = [fault for fault in study.faults if fault.missing_language == "ar"]
    assert missing
    assert study.document["pages"]["welcome"]["title"].keys() == {"en"}
    field = designer.row("study", "languages").field
    assert field.row.entries[1].note == f"0 of {len(missing)} texts"
    qtbot.mouseClick(field.copies["ar"], LEFT)
    assert designer.editing.opened.study.faults == ()
    designer.editing.select(("pages", "welcome"))
    title = designer.row("pages", "welcome", "title").field
    assert title.lines["ar"].layoutDirection() == Qt.LayoutDirection.RightToLeft
    assert "not translated yet" in title.copied.text()
    title.lines["ar"].setFocus()
    title.lines["ar"].selectAll()
    qtbot.keyClicks(title.lines["ar"], "Marhaba")
    qtbot.keyClick(title.lines["ar"], Qt.Key.Key_Return)
    assert not designer.row("pages", "welcome", "title").field.copied.isVisible()
    for _ in range(3):
        designer.editing.undo()
    assert designer.text == before


def test_a_picker_adds_what_it_names_in_one_step(designer: Any) -> None:
    designer.controller.open("kitchen")
    before = designer.text
    designer.editing.select(("conditions", "thin"))
    choice = designer.row("conditions", "thin", "liquid").field.list
    choice.activated.emit(choice.findText("New liquid …"))
    assert designer.editing.selected == ("liquids", "liquid")
    assert designer.editing.opened.study.document["conditions"]["thin"]["liquid"] == "liquid"
    designer.editing.undo()
    assert designer.text == before


def test_a_standard_questionnaire_is_found_by_typing_and_lists_questions_that_need_texts(
    qtbot: Any, designer: Any
) -> None:
    designer.controller.begin("template:questionnaire-only", "asked")
    before = designer.text
    adding = designer.place.adding
    designer.place.ask_to_add()
    qtbot.keyClicks(adding.words, "tlx, 6")
    assert adding.list.count() == 1
    assert "Hart" in adding.help.text()
    qtbot.keyClick(adding.words, Qt.Key.Key_Return)
    assert designer.editing.selected == ("questionnaires", "nasa_tlx")
    assert designer.editing.opened.study.document["questionnaires"]["nasa_tlx"] == {"instrument": "nasa-tlx"}
    assert designer.editing.opened.study.faults == ()
    designer.editing.undo()
    designer.place.ask_to_add()
    qtbot.keyClicks(adding.words, "ipq")
    qtbot.keyClick(adding.words, Qt.Key.Key_Return)
    items = designer.editing.opened.study.document["questionnaires"]["ipq"]["items"]
    assert len(items) == 14
    assert all(item.keys() == {"id"} for item in items)
    designer.editing.undo()
    assert designer.text == before


def test_insert_and_enter_add_a_question_below_the_one_whose_text_is_typed(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("template:questionnaire-only", "asked")
    items = ("questionnaires", "about_it", "items")
    designer.select((*items, 0))
    steps = len(designer.editing.opened.history.done)
    designer.place.form.focus((*items, 0, "text"))
    field = QApplication.focusWidget()
    field.selectAll()
    qtbot.keyClicks(field, "How was it?")
    qtbot.keyClick(field, Qt.Key.Key_Insert)
    assert designer.place.adding.isVisible()
    qtbot.keyClick(designer.place.adding.words, Qt.Key.Key_Return)
    typed, new = designer.editing.opened.study.document["questionnaires"]["about_it"]["items"][:2]
    assert typed["text"] == "How was it?"
    assert new["text"].startswith("New question")
    assert designer.editing.selected == (*items, 1)
    assert designer.row(*items, 1, "text").isAncestorOf(QApplication.focusWidget())
    assert len(designer.editing.opened.history.done) == steps + 2


def test_insert_while_an_id_is_typed_renames_and_adds_once(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("template:questionnaire-only", "asked")
    designer.select(("scales", "agreement"))
    steps, field = len(designer.editing.opened.history.done), designer.place.form.head.id
    designer.place.form.head.edit_id()
    qtbot.keyClicks(field, "accord")
    qtbot.keyClick(field, Qt.Key.Key_Insert)
    qtbot.keyClick(designer.place.adding.words, Qt.Key.Key_Return)
    scales = list(designer.editing.opened.study.document["scales"])
    assert scales == ["accord", "scale", "frequency"]
    assert [step.words for step in designer.editing.opened.history.done[steps:]] == ["Rename to accord", "Add scale"]
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Insert)
    qtbot.keyClick(designer.place.adding.words, Qt.Key.Key_Escape)
    assert list(designer.editing.opened.study.document["scales"]) == scales
    assert len(designer.editing.opened.history.done) == steps + 2
