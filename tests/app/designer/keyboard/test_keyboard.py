"""The keyboard: the keys of the place, and where it is after a step, a question or another form."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QLineEdit, QWidget

from study_app.gui.designer.form.languages_field import LanguagesField
from study_app.gui.designer.form.typed_fields import TypedText
from study_app.gui.designer.outline.rows import ROW_ROLE
from study_app.gui.designer.tab_order import stops
from study_app.gui.widgets.controls import Cap
from study_app.viewmodels.designer.keys import GROUPS, KEYS
from study_app.viewmodels.designer.requests import SetValue

pytestmark = pytest.mark.slow


SHIFT = Qt.KeyboardModifier.ShiftModifier
PAGE = Path(__file__).parents[4] / "docs" / "designer.md"


def test_every_key_of_the_place_is_one_shortcut(designer: Any) -> None:
    made = [shortcut.key().toString() for shortcut in designer.place.findChildren(QShortcut)]
    made.append(designer.place.header.play.play.shortcut().toString())
    wanted = [keys for one in KEYS if not one.within for keys in one.keys]
    assert sorted({"Ins": "Insert"}.get(keys, keys) for keys in made) == sorted(wanted)


def test_the_card_lists_every_key_and_esc_gives_the_keyboard_back(qtbot: Any, designer: Any) -> None:
    designer.open()
    tree, card = designer.place.outline.tree, designer.place.keys
    tree.setFocus()
    qtbot.mouseClick(designer.place.header.keys, Qt.MouseButton.LeftButton)
    assert card.isVisible()
    words = {label.text() for label in card.findChildren(QLabel)}
    assert {*GROUPS, "Duplicate", "Find in the study", "Delete (outline, lists)"} <= words
    assert sorted(cap.words for cap in card.findChildren(Cap)) == sorted(keys for one in KEYS for keys in one.shown)
    designer.key("Escape")
    assert not card.isVisible()
    tree.setFocus()
    qtbot.keyClick(tree, Qt.Key.Key_F1, SHIFT)
    assert card.isVisible()
    assert card.isAncestorOf(designer.keyboard)
    designer.key("Escape")
    assert tree.hasFocus()
    qtbot.keyClick(tree, Qt.Key.Key_F1, SHIFT)
    designer.key("ctrl+2")
    assert not card.isVisible(), "it does not lie over what one goes to"
    assert designer.place.form.isAncestorOf(designer.keyboard)


def test_the_documentation_lists_every_key() -> None:
    section = PAGE.read_text().split("## Keys")[1].split("\n## ")[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| ")][2:]
    listed = {one.strip() for row in rows for either in row.split(",") for one in either.split(" or ")}
    long = {"Ins": "Insert", "Del": "Delete"}
    assert listed == {long.get(keys, keys) for one in KEYS for keys in one.shown}


LEFT = Qt.MouseButton.LeftButton
BLOCK = ("blocks", "liquids")


def typed(qtbot: Any, designer: Any) -> Any:
    """Open a study, type a number into a field of a block, and return the field."""
    designer.open("kitchen", *BLOCK)
    field = designer.field(*BLOCK, "repetitions").line
    designer.fill(field, "3", "")
    qtbot.waitUntil(designer.place.header.undo.isEnabled)
    return field


@pytest.mark.variants(3)
@pytest.mark.parametrize("how", ["click", "space"])
@pytest.mark.parametrize("width", [1600, 1366, 1100])
def test_a_button_of_the_header_that_is_disabled_gives_the_keyboard_back(
    qtbot: Any, designer: Any, how: str, width: int
) -> None:
    designer.window.resize(width, 768)
    field = typed(qtbot, designer)
    header = designer.place.header
    for button in (header.undo, header.redo, header.save):
        if how == "space":
            button.setFocus(Qt.FocusReason.TabFocusReason)
            assert designer.hit("Space") is field
        else:
            for _ in range(2):  # the second one on a disabled button
                QTest.mouseClick(designer.window.windowHandle(), LEFT, pos=button.mapTo(designer.window, QPoint(9, 9)))
                assert field.hasFocus()
        assert not button.isEnabled()
    assert "repetitions = 3" in designer.file.read_text()


def test_a_question_that_is_given_up_gives_the_keyboard_back(qtbot: Any, designer: Any) -> None:
    field = typed(qtbot, designer)
    designer.controller.ask_to_delete(("liquids", "thick"))
    assert designer.place.prompt.isAncestorOf(designer.keyboard)
    assert designer.hit("Escape") is field


CONTROL = Qt.KeyboardModifier.ControlModifier


def first_row(designer: Any) -> QWidget:
    return designer.place.form.rows[0]


@pytest.mark.variants(3)
@pytest.mark.parametrize("width", [1600, 1366])
@pytest.mark.parametrize("area", ["form", "outline"])
@pytest.mark.parametrize(
    "path", [("blocks", "liquids"), ("conditions", "thick"), ("questionnaires", "liquid", "items", 0)]
)
def test_a_duplicate_is_selected_everywhere_and_has_the_keyboard(
    designer: Any, width: int, area: str, path: tuple[str | int, ...]
) -> None:
    designer.window.resize(width, 768)
    designer.open("kitchen", *path)
    outline, tree = designer.place.outline, designer.place.outline.tree
    designer.place.areas.focus_form() if area == "form" else designer.place.parts.focus_outline()
    keyboard = designer.hit("ctrl+d")
    copy = (*path[:-1], path[-1] + 1 if isinstance(path[-1], int) else f"{path[-1]}_2")
    assert designer.editing.selected == copy
    assert designer.place.form.form.path == copy
    assert outline.selected == (copy,)
    texts = [row for row in designer.place.form.rows if isinstance(row.field, LanguagesField)]
    if area == "outline" and width == 1600:
        assert tree.hasFocus()
    elif texts:
        assert texts[0].isAncestorOf(keyboard)
        chosen = keyboard.textCursor().selectedText() if isinstance(keyboard, TypedText) else keyboard.selectedText()
        assert chosen == keyboard.words() != ""
    else:
        assert first_row(designer).isAncestorOf(keyboard)
    assert designer.hit("ctrl+1") is tree
    assert tree.currentIndex().data(ROW_ROLE).path == copy
    assert tree.viewport().rect().contains(tree.visualRect(tree.currentIndex()))
    assert first_row(designer).isAncestorOf(designer.hit("Return"))
    assert designer.place.form.form.path == copy


def test_a_reference_leads_to_the_form_of_its_element_and_back(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    designer.field("blocks", "liquids", "task").arrow.setFocus()
    keyboard = designer.hit("Return")
    assert designer.editing.selected == ("tasks", "explore")
    assert first_row(designer).isAncestorOf(keyboard)
    keyboard = designer.hit("alt+Left")
    assert designer.editing.selected == ("blocks", "liquids")
    assert designer.place.form.isAncestorOf(keyboard)


def test_a_field_that_is_added_has_the_keyboard(designer: Any) -> None:
    designer.open("kitchen", "conditions", "thick")
    before = {row.row.row.path for row in designer.place.form.rows}
    next(iter(designer.place.form.adds.values())).setFocus()
    keyboard = designer.hit("Return")
    (added,) = (row for row in designer.place.form.rows if row.row.row.path not in before)
    assert added.isAncestorOf(keyboard)


@pytest.mark.parametrize("back", [False, True])
def test_a_number_that_is_left_by_tab_at_once_keeps_the_keyboard_in_its_form(
    qtbot: Any, designer: Any, back: bool
) -> None:
    path = ("conditions", "thin", "force_delay_ms")
    designer.change(("format = 1", "format = 2"))
    designer.open("kitchen", *path[:2])
    designer.field(*path).line.setFocus()
    rows = [row.row.row.path for row in designer.place.form.rows]
    qtbot.keyClicks(designer.keyboard, "7")
    designer.hit("Backtab" if back else "Tab")  # the key is new in the file: the form is made anew
    assert designer.value("conditions", "thin", "force_delay_ms") == 7
    beside = rows[rows.index(path) + (-1 if back else 1)]
    assert designer.form_row(*beside).isAncestorOf(designer.keyboard)


@pytest.mark.parametrize("width", [1600, 1024])
def test_ctrl_e_goes_to_the_file_and_back_to_the_same_field(designer: Any, width: int) -> None:
    designer.window.resize(width, 640)
    designer.open("kitchen", "blocks", "liquids")
    field = designer.field("blocks", "liquids", "repetitions").line
    field.setFocus()
    assert designer.hit("ctrl+e") is designer.place.file.editor
    assert designer.hit("ctrl+e") is field
    assert designer.hit("ctrl+e") is designer.place.file.editor
    field.setEnabled(False)
    assert first_row(designer).isAncestorOf(designer.hit("ctrl+e")), "the field cannot take the keyboard"


def test_the_first_row_has_the_keyboard_where_undo_removes_the_row_that_had_it(designer: Any) -> None:
    designer.open("kitchen", "tasks", "explore")
    designer.editing.ask(SetValue(("tasks", "explore", "kind"), "reach"))
    designer.field("tasks", "explore", "dwell_s").line.setFocus()
    keyboard = designer.hit("ctrl+z")
    assert designer.value("tasks", "explore", "kind") == "explore"
    assert first_row(designer).isAncestorOf(keyboard)


def test_ctrl_3_goes_to_the_page_and_then_to_the_tabs_where_enter_chooses(designer: Any) -> None:
    designer.open()
    pane = designer.place.pane
    first_row(designer).setFocus()
    assert designer.hit("ctrl+3") not in pane.tabs.buttons
    assert designer.hit("ctrl+3") in pane.tabs.buttons
    pane.tabs.buttons[1].setFocus()
    designer.hit("Return")
    assert pane.tab == "measures"


def test_ctrl_delete_removes_the_key_of_a_field_whose_cross_tab_passes(designer: Any) -> None:
    designer.open()
    block = ("blocks", "liquids")
    designer.go_to(*block)
    text, removable = designer.text, [row for row in designer.place.form.rows if row.remove is not None]
    assert {"title", "order", "repetitions", "questionnaire"} <= {str(row.row.row.path[-1]) for row in removable}
    for row in removable:
        assert row.remove not in stops(designer.place.form)
        assert "(Ctrl+Del)" in row.remove.toolTip()
        path = row.row.row.path
        designer.place.form.focus(path)
        if isinstance(designer.keyboard, QLineEdit):
            designer.keyboard.selectAll()  # as where Tab leads to it
        designer.hit("ctrl+Delete")
        assert path[-1] not in designer.value("blocks", "liquids"), path
        assert designer.place.form.isAncestorOf(designer.keyboard)
        designer.editing.undo()
        assert designer.text == text


def test_ctrl_delete_deletes_a_word_where_one_follows_and_no_key_comes_back_with_what_was_typed(
    qtbot: Any, designer: Any
) -> None:
    designer.open()
    title = ("blocks", "liquids", "title")
    designer.go_to(*title[:2])
    designer.place.form.focus(title)
    field = designer.keyboard
    field.setText("Two liquids")
    field.setCursorPosition(0)
    designer.hit("ctrl+Delete")
    assert field.text() == "liquids"
    field.setCursorPosition(len(field.text()))
    qtbot.keyClicks(field, " now")
    designer.hit("ctrl+Delete")
    assert "title" not in designer.value("blocks", "liquids")


@pytest.mark.parametrize("shown", ["the form gets another row", "the file can be read again"])
def test_what_is_typed_into_the_file_stays_there_where_the_form_is_made_anew(
    qtbot: Any, designer: Any, shown: str
) -> None:
    again = shown == "the file can be read again"
    if again:
        designer.open("rek2024")
        designer.change(("[study]", "[study"))
    designer.open("kitchen", "study")
    designer.place.form.focus_first()
    editor = designer.place.file.editor
    designer.place.show_tab("file")
    editor.setFocus()
    line = designer.text.split("\n").index("[study" if again else "[study]")
    cursor = editor.textCursor()
    cursor.setPosition(editor.document().findBlockByNumber(line).position())
    cursor.movePosition(cursor.MoveOperation.EndOfBlock)
    editor.setTextCursor(cursor)
    typed = "] # and more" if again else '\rcredits = "abc" # and more'
    for letter in typed:
        qtbot.keyClicks(designer.keyboard, letter)
        qtbot.wait(30)
    qtbot.wait(300)
    assert editor.hasFocus()
    assert typed.strip() in designer.text
