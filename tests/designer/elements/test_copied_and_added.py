"""Several entries that are selected and move together; a question that is added while one is typed."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication

pytestmark = pytest.mark.slow

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
