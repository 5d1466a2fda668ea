"""The keys of the designer, shown at buttons, in the card and the documentation; what took the keyboard returns it."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel

from study_app.gui.widgets.controls import Cap
from study_app.viewmodels.designer.keys import GROUPS, KEYS

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


KEY, LEFT = Qt.Key, Qt.MouseButton.LeftButton
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
