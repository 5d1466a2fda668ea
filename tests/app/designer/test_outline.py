"""The outline in its window: elements dragged, several at once, copied and pasted."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication

from study_app.gui.designer.outline.rows import ROW_ROLE
from study_app.viewmodels.designer.requests import MoveTo

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
LEFT = Qt.MouseButton.LeftButton


def place_of(designer: Any, *path: str | int) -> QPoint:
    """Return the middle of an element's first row."""
    outline = designer.place.outline
    index = next(one for one in outline._indexes() if one.data(ROW_ROLE).path == path)
    outline.tree.scrollTo(index)
    return outline.tree.visualRect(index).center()


def click(qtbot: Any, designer: Any, *path: str | int, held: Any = Qt.KeyboardModifier.NoModifier) -> None:
    qtbot.mouseClick(designer.place.outline.tree.viewport(), LEFT, held, place_of(designer, *path))


def drag(qtbot: Any, designer: Any, start: QPoint, end: QPoint, *, drop: bool = True) -> None:
    view = designer.place.outline.tree.viewport()
    qtbot.mousePress(view, LEFT, pos=start)
    for at in (start + QPoint(0, 20), end):
        event_move(view, at)
    if drop:
        qtbot.mouseRelease(view, LEFT, pos=end)


def event_move(view: Any, at: QPoint) -> None:
    none = Qt.KeyboardModifier.NoModifier
    event = QMouseEvent(QEvent.Type.MouseMove, QPointF(at), QPointF(view.mapToGlobal(at)), LEFT, LEFT, none)
    QApplication.sendEvent(view, event)


def sequence(designer: Any) -> tuple[str, ...]:
    return tuple(designer.editing.opened.study.document["sequence"])


def test_a_row_is_dragged_to_where_the_line_is_and_esc_cancels(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    before, text = sequence(designer), designer.text
    tree = designer.place.outline.tree
    first, third = (
        place_of(designer, designer_path, name) for designer_path, name in (_thing(designer, 0), _thing(designer, 2))
    )
    drag(qtbot, designer, first, third + QPoint(0, 14), drop=False)
    assert tree.target is not None
    assert tree.target[0] == 3
    qtbot.keyClick(tree, Qt.Key.Key_Escape)
    qtbot.mouseRelease(tree.viewport(), LEFT, pos=third)
    assert designer.text == text
    drag(qtbot, designer, first, third + QPoint(0, 14))
    assert sequence(designer) == (*before[1:3], before[0], *before[3:])
    designer.editing.undo()
    assert designer.text == text


def _thing(designer: Any, at: int) -> tuple[str, str]:
    name = sequence(designer)[at]
    return next(
        (section, name) for section in ("pages", "blocks") if name in designer.editing.opened.study.document[section]
    )


def test_several_selected_elements_move_are_copied_and_deleted_together(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("rek2024", "mine")
    document, text = designer.editing.opened.study.document, designer.text
    items = [item["id"] for item in document["questionnaires"]["liquid"]["items"]]
    path = ("questionnaires", "liquid", "items")

    def ids() -> list[str]:
        return [item["id"] for item in designer.editing.opened.study.document["questionnaires"]["liquid"]["items"]]

    designer.editing.select((*path, 0))
    designer.controller._show_outline()
    click(qtbot, designer, *path, 0)
    click(qtbot, designer, *path, 1, held=SHIFT)
    assert designer.place.outline.selected == ((*path, 0), (*path, 1))
    tree = designer.place.outline.tree
    qtbot.keyClick(tree, Qt.Key.Key_Down, Qt.KeyboardModifier.AltModifier)
    assert ids()[:3] == [items[2], items[0], items[1]]
    assert designer.place.outline.selected == ((*path, 1), (*path, 2))
    qtbot.keyClick(tree, Qt.Key.Key_D, CONTROL)
    assert ids()[1:5] == [items[0], f"{items[0]}_2", items[1], f"{items[1]}_2"]
    designer.editing.undo()
    designer.editing.undo()
    assert designer.text == text
    designer.editing.select(("liquids", "honey"))
    designer.controller._show_outline()
    click(qtbot, designer, "liquids", "syrup", held=CONTROL)
    qtbot.keyClick(tree, Qt.Key.Key_Delete)
    prompt = designer.place.prompt
    assert prompt is not None
    assert "2 elements" in prompt.accessibleName()
    prompt.all.click()
    assert not {"honey", "syrup"} & set(designer.editing.opened.study.document["liquids"])
    designer.editing.undo()
    assert designer.text == text


def test_parts_are_numbered_again_where_a_move_would_break_them(designer: Any) -> None:
    designer.controller.begin("rek2024", "mine")
    study = designer.editing.opened.study
    parts = [
        study.document["blocks"][name].get("part") for name in sequence(designer) if name in study.document["blocks"]
    ]
    assert [part for part in parts if part] == [1, 2, 2]
    last = max(
        at for at, name in enumerate(sequence(designer)) if study.document["blocks"].get(name, {}).get("part") == 2
    )
    designer.editing.ask(MoveTo((("sequence", last),), 0))
    after = designer.editing.opened.study
    assert after.document["blocks"][study.document["sequence"][last]]["part"] == 1
    assert not [fault for fault in after.faults if fault.path[-1] == "part"]
