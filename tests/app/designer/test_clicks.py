"""Clicks that follow typing, and clicks in the drawer of a small window."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QPushButton
from shiboken6 import isValid

from study_app.gui.designer.measures.parts import Strip
from study_app.gui.designer.outline.rows import ROW_ROLE
from study_app.viewmodels.designer.requests import SetValue

pytestmark = pytest.mark.slow

LEFT = Qt.MouseButton.LeftButton


def type_id(qtbot: Any, designer: Any, path: tuple[str, str], name: str) -> None:
    """Select an element and type another id, without leaving the field."""
    designer.editing.select(path)
    field = designer.place.form.head.id
    qtbot.mouseClick(field, LEFT)
    field.selectAll()
    qtbot.keyClicks(field, name)


def test_a_list_that_is_clicked_after_an_id_was_typed_stays_open(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    type_id(qtbot, designer, ("conditions", "thick"), "honey")
    liquids = designer.row("conditions", "thick", "liquid").field.list
    qtbot.mouseClick(liquids, LEFT)
    qtbot.wait(100)
    assert isValid(liquids)
    assert liquids.view().isVisible()
    assert "[conditions.thick]" in designer.text
    liquids.hidePopup()
    qtbot.waitUntil(lambda: "[conditions.honey]" in designer.text)
    assert designer.place.view.form.path == ("conditions", "honey")


def test_a_click_on_a_block_in_the_drawer_closes_it(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.window.resize(1366, 768)
    outline, tree = designer.place.outline, designer.place.outline.tree
    for path, closes in ((("blocks", "liquids"), True), (("conditions",), False)):
        designer.place.parts.focus_outline()
        QApplication.processEvents()
        index = next(one for one in outline.indexes() if one.data(ROW_ROLE).path == path)
        tree.scrollTo(index)
        qtbot.mouseClick(tree.viewport(), LEFT, pos=tree.visualRect(index).center())
        assert designer.place.view.form.path == path
        assert outline.isVisible() is not closes


def test_arrow_keys_walk_the_whole_outline_of_the_empty_study(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("template:empty", "walked")
    tree = designer.place.outline.tree
    qtbot.keyClick(designer.window, Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    seen = []
    for _ in range(60):
        qtbot.keyClick(tree, Qt.Key.Key_Down)
        if tree.currentIndex().data(ROW_ROLE).path:
            assert designer.editing.selected == tree.currentIndex().data(ROW_ROLE).path
            assert designer.place.form.form.path == designer.editing.selected
        seen.append(designer.editing.selected)
    assert {("questionnaires",), ("groups",), ("scene",), ("limits",), ("analysis",)} <= set(seen)
    designer.editing.select(("limits",))
    designer.editing.ask(SetValue(("limits", "lateness_ms"), 3))
    assert designer.editing.opened.study.document["limits"] == {"lateness_ms": 3}


def test_arrow_keys_walk_the_outline_after_a_number_was_typed(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.window.resize(1366, 768)
    designer.editing.select(("conditions", "thick"))
    (delay,) = designer.row("conditions", "thick", "delay_ms").findChildren(QLineEdit)
    qtbot.mouseClick(delay, LEFT)
    qtbot.keyClicks(delay, "5")
    qtbot.keyClick(delay, Qt.Key.Key_Return)
    text = designer.text
    qtbot.keyClick(designer.window, Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    for _ in range(4):
        qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Up)
        QApplication.processEvents()
        assert designer.place.outline.tree.hasFocus()
    assert designer.text == text


def test_a_field_that_is_clicked_after_an_id_was_typed_keeps_the_keyboard(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    type_id(qtbot, designer, ("liquids", "thick"), "honey")
    (density,) = designer.row("liquids", "thick", "density_kg_m3").findChildren(QLineEdit)
    qtbot.mouseClick(density, LEFT)
    qtbot.waitUntil(lambda: "[liquids.honey]" in designer.text)
    field = QApplication.focusWidget()
    assert designer.row("liquids", "honey", "density_kg_m3").isAncestorOf(field)
    field.selectAll()
    qtbot.keyClicks(field, "1402")
    qtbot.waitUntil(lambda: "1402" in designer.text)


def test_a_field_that_is_clicked_thrice_after_an_id_was_typed_takes_what_is_typed(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    type_id(qtbot, designer, ("liquids", "thick"), "honey")
    (density,) = designer.row("liquids", "thick", "density_kg_m3").findChildren(QLineEdit)
    at = density.mapTo(designer.window, density.rect().center())
    QTest.mouseClick(designer.window.windowHandle(), LEFT, pos=at)
    qtbot.waitUntil(lambda: "[liquids.honey]" in designer.text)
    QTest.mouseDClick(designer.window.windowHandle(), LEFT, pos=at)
    QTest.mouseClick(designer.window.windowHandle(), LEFT, pos=at)
    assert QApplication.focusWidget() is density, "the form was made anew under the click"
    assert density.selectedText() == density.text()
    qtbot.keyClicks(density, "1402")
    qtbot.waitUntil(lambda: "density_kg_m3 = 1402" in designer.text)
    qtbot.mouseClick(next(one for one in designer.place.form.adds.values() if one.isVisible()), LEFT)
    assert designer.editing.opened.study.document["liquids"]["honey"]["density_kg_m3"] == 1402
    assert "thick" not in designer.editing.opened.study.document["liquids"]


def test_a_difference_that_is_reverted_outlives_the_click(qtbot: Any, designer: Any) -> None:
    """Qt still handles the click on its button; content that a scroll area drops is deleted at once."""
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue(("blocks", "liquids", "repetitions"), 3))
    designer.place.show_tab("changes")
    shown = designer.controller.changes.card.list
    qtbot.waitUntil(lambda: bool(shown.lines))
    gone: list[bool] = []
    after: list[int] = []
    button = shown.lines[0].revert
    button.destroyed.connect(lambda: gone.append(True))
    shown.revert_asked.connect(lambda _row: after.append(len(gone)))
    qtbot.mouseClick(button, LEFT)
    assert shown.lines == []
    assert after == [0]
    qtbot.waitUntil(lambda: gone == [True])


def test_the_arrow_of_an_entry_opens_what_it_names(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("blocks", "liquids"))
    field = designer.row("blocks", "liquids", "conditions").field
    words = f"Open {field.row.entries[1].title}"
    (arrow,) = (one for one in field.rows[1].findChildren(QPushButton) if one.accessibleName() == words)
    qtbot.mouseClick(arrow, LEFT)
    assert designer.editing.selected == ("conditions", field.row.row.value[1])


@pytest.mark.parametrize("way", ["Enter", "double click"])
def test_an_entry_opens_by_enter_and_a_double_click(qtbot: Any, designer: Any, way: str) -> None:
    designer.controller.open("kitchen")
    designer.select(("blocks", "liquids"))
    field = designer.row("blocks", "liquids", "conditions").field
    qtbot.mouseClick(field.rows[1], LEFT)
    assert designer.editing.selected == ("blocks", "liquids")
    if way == "Enter":
        qtbot.keyClick(field.rows[1], Qt.Key.Key_Return)
    else:
        qtbot.mouseDClick(field.rows[1], LEFT)
    assert designer.editing.selected == ("conditions", field.row.row.value[1])


def test_a_row_of_a_section_opens_by_a_click(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("liquids",))
    qtbot.mouseClick(designer.row("liquids").field.rows[1], LEFT)
    assert designer.editing.selected == ("liquids", "thick")


def test_a_step_of_the_session_bar_opens_by_the_left_button_alone(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    strip, asked = Strip(), list[object]()
    strip.resize(100, 14)
    strip.show_segments((("Welcome", 1.0, False, ("pages", "welcome")),))
    strip.open_asked.connect(asked.append)
    qtbot.mouseClick(strip, Qt.MouseButton.RightButton)
    assert asked == []
    qtbot.mouseClick(strip, LEFT)
    assert asked == [("pages", "welcome")]


def test_the_question_before_a_delete_says_what_goes(designer: Any) -> None:
    designer.controller.begin("template:compare-liquids", "liquids")
    designer.select(("liquids", "syrup"))
    designer.place.form.head.delete.click()
    said = [one.text() for one in designer.place.prompt.findChildren(QLabel)]
    assert "Condition Practice: Liquid" in said
    assert "Also deletes: Block Practice, Condition Practice." in said
    designer.place.prompt.all.click()
    assert "practice" not in designer.editing.opened.study.document["blocks"]
    assert not designer.editing.opened.study.faults


def test_the_question_before_a_delete_names_elements_and_no_places_of_lists(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("liquids", "thick"))
    designer.place.form.head.delete.click()
    said = [one.text() for one in designer.place.prompt.findChildren(QLabel)]
    (besides,) = (words for words in said if words.startswith("Also deletes"))
    assert besides == "Also deletes: Condition Thick."
