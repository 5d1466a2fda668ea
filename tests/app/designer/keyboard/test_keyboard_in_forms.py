"""The keyboard where a step shows another form, or the same form with other rows: it is never lost."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit, QWidget

from study_app.gui.designer.form.languages_field import LanguagesField
from study_app.gui.designer.form.typed_fields import TypedText
from study_app.gui.designer.outline.rows import ROW_ROLE
from study_app.gui.designer.tab_order import stops
from study_app.viewmodels.designer.requests import SetValue

pytestmark = pytest.mark.slow

CONTROL, KEY = Qt.KeyboardModifier.ControlModifier, Qt.Key


def first_row(designer: Any) -> QWidget:
    return designer.place.form.rows[0]


@pytest.mark.variants(3)
@pytest.mark.parametrize("width", [1600, 1366])
@pytest.mark.parametrize("area", ["form", "outline"])
@pytest.mark.parametrize(
    "path", [("blocks", "liquids"), ("conditions", "thick"), ("questionnaires", "liquid", "items", 0)]
)
def test_a_duplicate_is_selected_everywhere_and_has_the_keyboard(
    qtbot: Any, designer: Any, width: int, area: str, path: tuple[str | int, ...]
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


def test_a_reference_leads_to_the_form_of_its_element_and_back(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    designer.field("blocks", "liquids", "task").arrow.setFocus()
    keyboard = designer.hit("Return")
    assert designer.editing.selected == ("tasks", "explore")
    assert first_row(designer).isAncestorOf(keyboard)
    keyboard = designer.hit("alt+Left")
    assert designer.editing.selected == ("blocks", "liquids")
    assert designer.place.form.isAncestorOf(keyboard)


def test_a_field_that_is_added_has_the_keyboard(qtbot: Any, designer: Any) -> None:
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
def test_ctrl_e_goes_to_the_file_and_back_to_the_same_field(qtbot: Any, designer: Any, width: int) -> None:
    designer.window.resize(width, 640)
    designer.open("kitchen", "blocks", "liquids")
    field = designer.field("blocks", "liquids", "repetitions").line
    field.setFocus()
    assert designer.hit("ctrl+e") is designer.place.file.editor
    assert designer.hit("ctrl+e") is field
    assert designer.hit("ctrl+e") is designer.place.file.editor
    field.setEnabled(False)
    assert first_row(designer).isAncestorOf(designer.hit("ctrl+e")), "the field cannot take the keyboard"


def test_the_first_row_has_the_keyboard_where_undo_removes_the_row_that_had_it(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", "tasks", "explore")
    designer.editing.ask(SetValue(("tasks", "explore", "kind"), "reach"))
    designer.field("tasks", "explore", "dwell_s").line.setFocus()
    keyboard = designer.hit("ctrl+z")
    assert designer.value("tasks", "explore", "kind") == "explore"
    assert first_row(designer).isAncestorOf(keyboard)


def test_ctrl_3_goes_to_the_page_and_then_to_the_tabs_where_enter_chooses(qtbot: Any, designer: Any) -> None:
    designer.open()
    pane = designer.place.pane
    first_row(designer).setFocus()
    assert designer.hit("ctrl+3") not in pane.tabs.buttons
    assert designer.hit("ctrl+3") in pane.tabs.buttons
    pane.tabs.buttons[1].setFocus()
    designer.hit("Return")
    assert pane.tab == "measures"


def test_ctrl_delete_removes_the_key_of_a_field_whose_cross_tab_passes(qtbot: Any, designer: Any) -> None:
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


def test_what_is_typed_into_a_missing_text_stays_in_its_language(qtbot: Any, designer: Any) -> None:
    designer.open()
    designer.editing.ask(SetValue(("study", "languages"), ("en", "de")))
    designer.editing.ask(SetValue(("study", "title"), {"en": "Kitchen"}))
    designer.editing.select(("study",))
    form = designer.place.form
    qtbot.waitUntil(lambda: bool(form.rows))
    row = next(one for one in form.rows if one.row.row.path == ("study", "title"))
    row.field.lines["de"].setFocus()
    for letter in "Kueche und Bad":
        field = designer.keyboard
        assert field is not None
        QTest.keyClicks(field, letter)
        qtbot.wait(60)
    qtbot.wait(400)
    form.flush()
    assert designer.value("study", "title") == {"en": "Kitchen", "de": "Kueche und Bad"}
