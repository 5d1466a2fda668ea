"""The keyboard: the keys of the place, and where it is after a step, a question or another form."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit, QWidget

from study_app.designer.document.steps import SetValue
from study_app.designer.place.view import stops
from study_app.gui.kit.commands import COMMANDS

pytestmark = pytest.mark.slow


PAGE = Path(__file__).parents[3] / "docs" / "designer.md"


def test_every_key_of_the_place_is_one_shortcut(designer: Any) -> None:
    made = [keys.toString() for action in designer.place.actions() for keys in action.shortcuts()]
    made.append(designer.place.header.play.play.shortcut().toString())
    wanted = [keys for one in COMMANDS if not one.within for keys in one.keys]
    assert sorted({"Ins": "Insert"}.get(keys, keys) for keys in made) == sorted(wanted)


def test_the_documentation_lists_every_key() -> None:
    section = PAGE.read_text().split("## Keys")[1].split("\n## ")[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| ")][2:]
    listed = {one.strip() for row in rows for either in row.split(",") for one in either.split(" or ")}
    long = {"Ins": "Insert", "Del": "Delete"}
    assert listed == {long.get(keys, keys) for one in COMMANDS for keys in one.shown}


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


def first_row(designer: Any) -> QWidget:
    return designer.place.form.rows[0]


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


def test_the_first_row_has_the_keyboard_where_undo_removes_the_row_that_had_it(designer: Any) -> None:
    designer.open("kitchen", "tasks", "explore")
    designer.editing.ask(SetValue(("tasks", "explore", "kind"), "reach"))
    designer.field("tasks", "explore", "dwell_s").line.setFocus()
    keyboard = designer.hit("ctrl+z")
    assert designer.value("tasks", "explore", "kind") == "explore"
    assert first_row(designer).isAncestorOf(keyboard)


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
