"""The keyboard after what takes it for a moment: a button of the header that can no longer be pressed, a question."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.viewmodels.designer.requests import SetValue

pytestmark = pytest.mark.slow

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
