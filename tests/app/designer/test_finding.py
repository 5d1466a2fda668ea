"""Words of the grammar are found and lead to their fields, in the outline of a large window and in the drawer."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication

from study_app.gui.designer.outline.rows import ROW_ROLE

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
    assert small.place.form.isAncestorOf(small.keyboard)
    open_drawer(qtbot, small)
    assert outline.words.text() == ""
    assert small.editing.selected == found
    above = {("blocks", "liquids"), ("questionnaires", "liquid")}
    assert expanded(small) - before <= above, "what was found stays in sight, and nothing else stays open"


@pytest.fixture
def find(qtbot: Any, designer: Any) -> Any:
    """Types words into the field that finds, which Ctrl+F leads to; returns the titles that are left."""
    designer.open()

    def type_words(words: str) -> list[str]:
        qtbot.keyClick(designer.window, Qt.Key.Key_F, CONTROL)
        field = designer.place.outline.words
        assert field.hasFocus()
        field.selectAll()
        qtbot.keyClicks(field, words)
        return [row.title for row in designer.place.outline.rows if row.path]

    return type_words


def has_keyboard(designer: Any, *path: str | int) -> bool:
    return bool(designer.field(*path).isAncestorOf(designer.keyboard))


def test_enter_goes_to_the_field_whose_label_or_choice_was_found(qtbot: Any, designer: Any, find: Any) -> None:
    words = designer.place.outline.words
    assert find("force limit") == ["Device · Force limit"]
    qtbot.keyClick(words, Qt.Key.Key_Return)
    assert designer.editing.selected == ("device",)
    assert has_keyboard(designer, "device", "force_limit_n")
    assert designer.keyboard.selectedText() == "6"
    qtbot.keyClicks(designer.keyboard, "7")
    assert designer.keyboard.text() == "7"
    titles = find("williams")
    assert titles
    assert all(title.endswith(" · Order") for title in titles)
    qtbot.keyClick(words, Qt.Key.Key_Return)
    block = designer.editing.selected
    assert block[0] == "blocks"
    assert has_keyboard(designer, *block, "order")
    assert "Thin · Delay" in find("delays")


def test_a_line_says_that_nothing_was_found_and_for_which_words(designer: Any, find: Any) -> None:
    nothing = designer.place.outline.nothing
    for words in ("xyzzy", "xyzzyx"):
        assert find(words) == []
        assert nothing.isVisible()
        assert nothing.whole == f'Nothing called "{words}" in this study'
    assert find("force limit")
    assert not nothing.isVisible()


def test_down_leads_into_the_tree_and_enter_or_a_click_there_to_the_field(qtbot: Any, designer: Any, find: Any) -> None:
    outline = designer.place.outline
    find("delay")
    qtbot.keyClick(outline.words, Qt.Key.Key_Down)
    assert outline.tree.hasFocus()
    at = next(one for one in outline.indexes() if one.data(ROW_ROLE).path == ("conditions", "thin"))
    qtbot.mouseClick(outline.tree.viewport(), LEFT, pos=outline.tree.visualRect(at).center())
    assert designer.editing.selected == ("conditions", "thin")
    assert has_keyboard(designer, "conditions", "thin", "delay_ms")
    find("delay")
    qtbot.keyClick(outline.words, Qt.Key.Key_Down)
    for _ in outline.rows:
        if designer.editing.selected == ("conditions", "thick"):
            break
        qtbot.keyClick(outline.tree, Qt.Key.Key_Down)
    assert outline.tree.hasFocus()  # arrows alone only select
    qtbot.keyClick(outline.tree, Qt.Key.Key_Return)
    assert has_keyboard(designer, "conditions", "thick", "delay_ms")


def test_a_key_that_the_file_does_not_have_leads_to_the_button_that_adds_it(
    qtbot: Any, designer: Any, find: Any
) -> None:
    titles = find("break every")
    assert titles[0].endswith(" · Break every")
    qtbot.keyClick(designer.place.outline.words, Qt.Key.Key_Return)
    assert designer.keyboard.accessibleName() == "Add Break every"
    designer.key("Space")
    assert "break_every" in designer.value("blocks")[designer.editing.selected[1]]


def test_the_list_of_what_can_be_added_offers_fields_to_go_to(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    adding = designer.place.adding
    designer.place.ask_to_add()
    count = adding.list.count()
    before = designer.text
    qtbot.keyClicks(adding.words, "williams design")
    assert adding.list.item(0).text() == "Order of block Liquids, Williams"
    qtbot.keyClick(adding.words, Qt.Key.Key_Return)
    assert designer.editing.selected == ("blocks", "liquids")
    assert has_keyboard(designer, "blocks", "liquids", "order")
    designer.place.ask_to_add()
    assert adding.list.count() == count
    qtbot.keyClicks(adding.words, "force limit")
    assert [adding.list.item(at).text() for at in range(adding.list.count())] == ["Force limit of Device"]
    qtbot.keyClick(adding.words, Qt.Key.Key_Return)
    assert has_keyboard(designer, "device", "force_limit_n")
    assert designer.text == before


@pytest.mark.parametrize("part", ["words", "tree"])
def test_esc_closes_the_drawer(qtbot: Any, small: Any, part: str) -> None:
    open_drawer(qtbot, small)
    getattr(small.place.outline, part).setFocus()
    small.key("Escape")
    assert not small.place.outline.isVisible()
    assert small.place.parts.path.outline.hasFocus()
