"""Several entries of a list in the form: selected by mouse and keys, moved, copied, removed as one step."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
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
