"""The outline of a small window: it opens as it was closed, and leads to the form."""

from typing import Any

import pytest
from PySide6.QtCore import QItemSelectionModel, QPoint, Qt
from PySide6.QtWidgets import QApplication

from study_app.gui.designer.outline.rows import ROW_ROLE
from study_app.viewmodels.designer.requests import SetText

pytestmark = pytest.mark.slow

CONTROL, KEY = Qt.KeyboardModifier.ControlModifier, Qt.Key
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def small(designer: Any) -> Any:
    """A study of many elements in a small window."""
    designer.window.resize(1366, 768)
    designer.controller.begin("rek2024", "mine")
    QApplication.processEvents()
    return designer


def open_drawer(qtbot: Any, designer: Any) -> None:
    qtbot.keyClick(QApplication.focusWidget() or designer.window, KEY.Key_1, CONTROL)
    QApplication.processEvents()


def index_of(designer: Any, *path: str | int) -> Any:
    return next(one for one in designer.place.outline.indexes() if one.data(ROW_ROLE).path == path)


def expanded(designer: Any) -> set[Any]:
    tree = designer.place.outline.tree
    return {one.data(ROW_ROLE).path for one in designer.place.outline.indexes() if tree.isExpanded(one)}


def test_the_drawer_opens_as_it_was_closed(qtbot: Any, small: Any) -> None:
    outline, tree = small.place.outline, small.place.outline.tree
    open_drawer(qtbot, small)
    for path in (("liquids",), ("conditions",), ("questionnaires",)):
        tree.expand(index_of(small, *path))
    index = index_of(small, "conditions", "delay_125")
    tree.selectionModel().setCurrentIndex(index, QItemSelectionModel.SelectionFlag.ClearAndSelect)
    tree.verticalScrollBar().setValue(tree.verticalScrollBar().value() + 60)  # away from the lower edge
    before, at = expanded(small), tree.visualRect(tree.currentIndex()).top()
    assert tree.verticalScrollBar().value() > 60
    qtbot.keyClick(tree, KEY.Key_Return)
    assert not outline.isVisible()
    assert small.place.form.isAncestorOf(QApplication.focusWidget())
    small.editing.ask(SetText(("study", "title"), "en", "Another title"))  # the rows are made anew
    small.controller.show_outline()
    open_drawer(qtbot, small)
    assert small.editing.selected == ("conditions", "delay_125")
    assert tree.currentIndex().data(ROW_ROLE).path == ("conditions", "delay_125")
    assert outline.selected == (("conditions", "delay_125"),)
    assert expanded(small) == before
    assert tree.visualRect(tree.currentIndex()).top() == at


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
        assert small.place.form.isAncestorOf(QApplication.focusWidget())
        assert expanded(small) == before
    open_drawer(qtbot, small)
    index = index_of(small, "blocks", "liquids")
    tree.scrollTo(index)
    qtbot.mouseClick(tree.viewport(), LEFT, pos=QPoint(20, tree.visualRect(index).center().y()))
    assert outline.isVisible(), "the sign before the title opens and closes, it does not choose"
    assert ("blocks", "liquids") not in expanded(small)


def test_an_edit_and_its_undo_leave_what_is_seen_and_what_is_closed(qtbot: Any, small: Any) -> None:
    tree = small.place.outline.tree
    small.editing.select(("blocks", "liquids"))
    open_drawer(qtbot, small)
    tree.collapse(index_of(small, "blocks", "liquids"))
    tree.verticalScrollBar().setValue(400)
    before = expanded(small), tree.verticalScrollBar().value()
    assert before[1] == 400
    small.editing.ask(SetText(("blocks", "liquids", "title"), "en", "Another title"))
    small.controller.show_outline()
    QApplication.processEvents()
    assert (expanded(small), tree.verticalScrollBar().value()) == before
    small.editing.undo()
    small.controller.show_outline()
    QApplication.processEvents()
    assert (expanded(small), tree.verticalScrollBar().value()) == before


def test_a_copy_closes_the_drawer_and_has_the_keyboard_in_its_first_text(qtbot: Any, small: Any) -> None:
    small.editing.select(("blocks", "liquids"))
    open_drawer(qtbot, small)
    qtbot.keyClick(small.place.outline.tree, KEY.Key_D, CONTROL)
    QApplication.processEvents()
    assert small.editing.selected == ("blocks", "liquids_2")
    assert not small.place.outline.isVisible()
    text = QApplication.focusWidget()
    assert small.row("blocks", "liquids_2", "title").isAncestorOf(text)
    assert text.selectedText() == text.text() == "Baseline settings"
    titles = {row.path: row.title for row in small.place.outline.rows}
    assert titles["blocks", "liquids"] == "Baseline settings"
    assert titles["blocks", "liquids_2"] == "Baseline settings (liquids_2)"


@pytest.mark.parametrize("part", ["words", "tree"])
def test_esc_closes_the_drawer(qtbot: Any, small: Any, part: str) -> None:
    open_drawer(qtbot, small)
    getattr(small.place.outline, part).setFocus()
    qtbot.keyClick(QApplication.focusWidget(), KEY.Key_Escape)
    assert not small.place.outline.isVisible()
    assert small.place.parts.path.outline.hasFocus()


def test_what_was_found_is_gone_to_by_enter_and_the_drawer_lists_all_again(qtbot: Any, small: Any) -> None:
    outline, tree = small.place.outline, small.place.outline.tree
    open_drawer(qtbot, small)
    before = expanded(small)
    qtbot.keyClick(tree, KEY.Key_F, CONTROL)
    assert outline.words.hasFocus()
    qtbot.keyClicks(outline.words, "honey")
    qtbot.keyClick(outline.words, KEY.Key_Return)
    assert tree.hasFocus()
    assert "honey" not in outline.rows[1].title.casefold(), "it holds what was looked for in a text"
    assert small.editing.selected == next(row.path for row in outline.rows if "honey" in row.title.casefold())
    found = small.editing.selected
    qtbot.keyClick(tree, KEY.Key_Return)
    assert not outline.isVisible()
    assert small.place.form.isAncestorOf(QApplication.focusWidget())
    open_drawer(qtbot, small)
    assert outline.words.text() == ""
    assert small.editing.selected == found
    above = {("blocks", "liquids"), ("questionnaires", "liquid")}
    assert expanded(small) - before <= above, "what was found stays in sight, and nothing else stays open"


def test_enter_leads_from_the_outline_of_a_large_window_to_the_form(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    open_drawer(qtbot, designer)
    qtbot.keyClick(designer.place.outline.tree, KEY.Key_Return)
    assert designer.place.outline.isVisible()
    assert designer.place.form.isAncestorOf(QApplication.focusWidget())


def test_a_study_that_begins_in_a_small_window_has_the_keyboard_in_its_form(qtbot: Any, designer: Any) -> None:
    designer.window.resize(1366, 768)
    designer.controller.open("kitchen")
    designer.controller.ask_for_new()
    qtbot.keyClicks(QApplication.focusWidget(), "Cold tea")
    qtbot.keyClick(QApplication.focusWidget(), KEY.Key_Return)
    QApplication.processEvents()
    assert designer.editing.opened.name == "coldtea"
    assert designer.place.form.isAncestorOf(QApplication.focusWidget())


def test_the_keyboard_is_in_the_form_after_a_question_in_a_small_window(qtbot: Any, designer: Any) -> None:
    designer.window.resize(1366, 768)
    designer.controller.open("kitchen")
    designer.controller.ask_to_delete(("liquids", "thick"))
    QApplication.processEvents()
    qtbot.keyClick(QApplication.focusWidget(), KEY.Key_Escape)
    assert designer.place.prompt is None
    assert designer.place.form.isAncestorOf(QApplication.focusWidget())
