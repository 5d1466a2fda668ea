"""The keys of the designer, shown at buttons, in the card and the documentation; what took the keyboard returns it."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel

from study_app.gui.designer.play.play_strip import PlayStrip
from study_app.gui.operator.strip import Strip
from study_app.gui.widgets.controls import Cap
from study_app.viewmodels.designer.keys import GROUPS, KEYS
from study_app.viewmodels.designer.play import under_way
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
    designer.controller.open("kitchen")
    tree, card = designer.place.outline.tree, designer.place.keys
    tree.setFocus()
    qtbot.mouseClick(designer.place.header.keys, Qt.MouseButton.LeftButton)
    assert card.isVisible()
    words = {label.text() for label in card.findChildren(QLabel)}
    assert {*GROUPS, "Duplicate", "Find in the study", "Delete (outline, lists)"} <= words
    assert sorted(cap.words for cap in card.findChildren(Cap)) == sorted(keys for one in KEYS for keys in one.shown)
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Escape)
    assert not card.isVisible()
    tree.setFocus()
    qtbot.keyClick(tree, Qt.Key.Key_F1, SHIFT)
    assert card.isVisible()
    assert card.isAncestorOf(QApplication.focusWidget())
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Escape)
    assert tree.hasFocus()
    qtbot.keyClick(tree, Qt.Key.Key_F1, SHIFT)
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_2, Qt.KeyboardModifier.ControlModifier)
    assert not card.isVisible(), "it does not lie over what one goes to"
    assert designer.place.form.isAncestorOf(QApplication.focusWidget())


def test_buttons_say_their_keys(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.select(("blocks", "liquids"))
    place = designer.place
    head, header, outline = place.form.head, place.header, place.outline
    sides, tabs = place.parts.sides.buttons, place.pane.tabs.buttons
    for part, key in (
        (head.up, "Alt+Up"), (head.down, "Alt+Down"), (head.copy, "Ctrl+D"), (head.delete, "Del"), (head.id, "F2"),
        (header.undo, "Ctrl+Z"), (header.redo, "Ctrl+Shift+Z"), (header.save, "Ctrl+S"), (header.play.play, "F5"),
        (header.problems, "F8"), (header.keys, "Shift+F1"), (outline.add, "Ins"), (outline.duplicate, "Ctrl+D"),
        (place.problems.next, "F8"), (place.parts.path.outline, "Ctrl+1"), (sides[0], "Ctrl+2"), (sides[1], "Ctrl+3"),
        (tabs[0], "Ctrl+Enter"), (tabs[2], "Ctrl+E"),
    ):  # fmt: skip
        assert f"({key})" in part.toolTip(), (key, part.toolTip())
    assert "Ctrl+F" in outline.words.placeholderText()
    for button in (outline.add, outline.duplicate):
        assert button.width() >= button.minimumSizeHint().width(), "there is room for the cap of its key"


def test_what_stops_playing_shows_its_key(qtbot: Any) -> None:
    below_header = PlayStrip()
    qtbot.addWidget(below_header)
    below_header.show_state(under_way("Liquids", "Scripted hand"))
    assert below_header.buttons["stop"].cap == Strip(played=True).stop.cap == "hold Esc"
    assert Strip().stop.cap == ""


def test_the_documentation_lists_every_key() -> None:
    section = PAGE.read_text().split("## Keys")[1].split("\n## ")[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| ")][2:]
    listed = {one.strip() for row in rows for either in row.split(",") for one in either.split(" or ")}
    long = {"Ins": "Insert", "Del": "Delete"}
    assert listed == {long.get(keys, keys) for one in KEYS for keys in one.shown}


KEY, LEFT = Qt.Key, Qt.MouseButton.LeftButton
BLOCK = ("blocks", "liquids")


def press(qtbot: Any, key: KEY) -> Any:
    """Press a key in the part with the keyboard, and return the part that has it then."""
    qtbot.keyClick(QApplication.focusWidget(), key)
    QApplication.processEvents()
    return QApplication.focusWidget()


def typed(qtbot: Any, designer: Any) -> Any:
    """Open a study, type a number into a field of a block, and return the field."""
    designer.controller.open("kitchen")
    designer.select(BLOCK)
    field = designer.row(*BLOCK, "repetitions").field.line
    field.setFocus()
    field.selectAll()
    qtbot.keyClicks(field, "3")
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
            assert press(qtbot, KEY.Key_Space) is field
        else:
            for _ in range(2):  # the second one on a disabled button
                QTest.mouseClick(designer.window.windowHandle(), LEFT, pos=button.mapTo(designer.window, QPoint(9, 9)))
                assert field.hasFocus()
        assert not button.isEnabled()
    assert "repetitions = 3" in designer.file.read_text()


def test_a_button_of_the_header_gives_the_keyboard_back_to_the_outline(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue((*BLOCK, "repetitions"), 3))
    designer.place.outline.tree.setFocus()
    qtbot.mouseClick(designer.place.header.save, LEFT)
    assert designer.place.outline.tree.hasFocus()


@pytest.mark.parametrize(("width", "area"), [(1600, "outline"), (1366, "form")])
def test_save_leads_from_find_to_the_selected_element(qtbot: Any, designer: Any, width: int, area: str) -> None:
    designer.window.resize(width, 768)
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue((*BLOCK, "repetitions"), 3))
    designer.place.parts.focus_find()
    qtbot.mouseClick(designer.place.header.save, LEFT)
    parts = {"outline": designer.place.outline.tree, "form": designer.place.form}
    keyboard = QApplication.focusWidget()
    assert keyboard is parts[area] or parts[area].isAncestorOf(keyboard)


def test_an_undone_step_of_another_element_has_the_keyboard_in_its_form(qtbot: Any, designer: Any) -> None:
    typed(qtbot, designer)
    press(qtbot, KEY.Key_Return)
    designer.select(("device",))
    designer.place.areas.focus_form()
    qtbot.mouseClick(designer.place.header.undo, LEFT)
    assert designer.editing.selected == BLOCK
    assert designer.place.form.rows[0].isAncestorOf(QApplication.focusWidget())


def test_a_question_that_is_given_up_gives_the_keyboard_back(qtbot: Any, designer: Any) -> None:
    field = typed(qtbot, designer)
    designer.controller.ask_to_delete(("liquids", "thick"))
    assert designer.place.prompt.isAncestorOf(QApplication.focusWidget())
    assert press(qtbot, KEY.Key_Escape) is field
