"""What is copied, pasted, filled in or added by its name; several entries that are selected and move together."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication

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
    assert "one of 2 selected" in four.field(*CONDITIONS).rows[2].accessibleName()
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


def test_entries_are_selected_by_keys_alone(qtbot: Any, four: Any) -> None:
    click(qtbot, four, 0)
    four.key("Down")
    assert chosen(four) == (1,)
    four.key("shift+Down")
    four.key("shift+Down")
    assert chosen(four) == (1, 2, 3)
    four.key("ctrl+c")
    copied = QApplication.clipboard().text()
    assert [one in copied for one in ("conditions.thick", "conditions.c", "conditions.d")] == [True] * 3
    four.key("Delete")
    assert names(four) == "thin"


LEFT = Qt.MouseButton.LeftButton


def test_elements_are_copied_with_comments_and_pasted_into_another_study(qtbot: Any, designer: Any) -> None:
    designer.open("rek2024", "conditions", "delay_0")
    qtbot.keyClick(designer.place.outline.tree, Qt.Key.Key_C, CONTROL)
    copied = QGuiApplication.clipboard().text()
    assert "# The thesis says" in copied
    assert "[conditions.delay_0]" in copied
    designer.open()
    before = designer.text
    designer.editing.select(("liquids", "thick"))
    QGuiApplication.clipboard().setText(
        copied.replace('"water"', '"thick"') + "\n[liquids.thick]\n# own\ndensity_kg_m3 = 1000\n"
    )
    qtbot.keyClick(designer.place.outline.tree, Qt.Key.Key_V, CONTROL)
    document = designer.study.document
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
    found = designer.value("questionnaires", "liquid", "items")
    assert [item["id"] for item in found[1:3]] == ["immersive", "immersive_2"]
    designer.editing.undo()
    QGuiApplication.clipboard().setText("1. How cold was it?\n- Did it smell?\n")
    qtbot.keyClick(tree, Qt.Key.Key_V, CONTROL)
    found = designer.value("questionnaires", "liquid", "items")
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
    designer.open()
    before = designer.text
    designer.editing.select(("study",))
    field = designer.field("study", "languages")
    field.names.activated.emit(field.names.findData("ar"))
    study = designer.study
    missing = [fault for fault in study.faults if fault.missing_language == "ar"]
    assert missing
    assert study.document["pages"]["welcome"]["title"].keys() == {"en"}
    field = designer.field("study", "languages")
    assert field.row.entries[1].note == f"0 of {len(missing)} texts"
    qtbot.mouseClick(field.copies["ar"], LEFT)
    assert designer.study.faults == ()
    designer.editing.select(("pages", "welcome"))
    title = designer.field("pages", "welcome", "title")
    assert title.lines["ar"].layoutDirection() == Qt.LayoutDirection.RightToLeft
    assert "not translated yet" in title.copied.text()
    designer.fill(title.lines["ar"], "Marhaba")
    assert not designer.field("pages", "welcome", "title").copied.isVisible()
    for _ in range(3):
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
    assert designer.value("questionnaires", "nasa_tlx") == {"instrument": "nasa-tlx"}
    assert designer.study.faults == ()
    designer.editing.undo()
    designer.place.ask_to_add()
    qtbot.keyClicks(adding.words, "ipq")
    qtbot.keyClick(adding.words, Qt.Key.Key_Return)
    items = designer.value("questionnaires", "ipq", "items")
    assert len(items) == 14
    assert all(item.keys() == {"id"} for item in items)
    designer.editing.undo()
    assert designer.text == before


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
