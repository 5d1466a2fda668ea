"""The form in a small window, and its fields: what is shown is no edit, what is pasted stays within a line."""

from typing import Any

import pytest
import shiboken6
from PySide6.QtCore import QMimeData, QPoint, QRect, Qt
from PySide6.QtWidgets import QWidget, QWidgetItem

from study_app.gui.designer.form.row_widget import RowWidget
from study_app.gui.designer.form.typed_fields import HAND_ON_MS, TypedLine, TypedSentence, TypedText

pytestmark = pytest.mark.slow

BLOCK = ("blocks", "liquids")


@pytest.fixture
def form(designer: Any) -> Any:
    """The form of a page, in a window that shows only the first rows of a block."""
    designer.open()
    designer.window.resize(1024, 640)
    designer.go_to("pages", "welcome")
    return designer.place.form


def is_seen(form: Any, part: QWidget) -> bool:
    viewport = form.area.viewport()
    return viewport.rect().contains(QRect(part.mapTo(viewport, QPoint()), part.size()))


def rows_made(form: Any) -> int:
    """Return how many rows of the form are made; to ask for its rows would make the others."""
    return len(form.inside.findChildren(RowWidget))


def test_a_row_below_the_fold_of_another_element_is_scrolled_to(qtbot: Any, designer: Any, form: Any) -> None:
    designer.editing.select(BLOCK)
    last = form.form.rows[-1].row.path
    assert form.focus(last)
    for _ in range(2):
        row = designer.form_row(*last)
        assert row.isAncestorOf(designer.keyboard)
        assert is_seen(form, row)
        qtbot.wait(50)
    assert form.area.verticalScrollBar().value() > 0


def test_the_help_is_of_the_row_that_has_the_keyboard_after_its_step_made_the_form_anew(designer: Any) -> None:
    designer.controller.begin("template:empty", "helped")
    designer.go_to("blocks", "liquids")
    field = designer.field("blocks", "liquids", "order")
    rows = [row.key for row in designer.place.form.rows]
    field.take_keyboard()
    field.list.setCurrentIndex(field.list.findText("Williams", Qt.MatchFlag.MatchStartsWith))
    field.list.activated.emit(field.list.currentIndex())
    assert [row.key for row in designer.place.form.rows] != rows, "the form was made anew"
    assert designer.form_row("blocks", "liquids", "order").isAncestorOf(designer.keyboard)
    assert designer.place.form.foot.title.text() == "Order"


def test_forms_leave_no_wrapper_of_an_item_of_their_layouts(qtbot: Any, designer: Any) -> None:
    """An event at the address of an item that Qt has deleted would get the wrapper, and a key would fail."""
    designer.controller.begin("template:viscosity-jnd", "thicker")
    for row in [("study",), *((name, id) for name, ids in designer.study.document.items()
                              if isinstance(ids, dict) for id in ids if isinstance(ids[id], dict))]:  # fmt: skip
        designer.go_to(*row)
    qtbot.wait(50)
    assert [one for one in shiboken6.getAllValidWrappers() if type(one) is QWidgetItem] == []


@pytest.mark.variants(3)
@pytest.mark.parametrize("kind", [TypedText, TypedSentence])
@pytest.mark.parametrize("text", ["a\rb", "a\u2029b", "a\r\nb"])
def test_a_shown_text_that_qt_normalises_is_no_edit(qtbot: Any, kind: type[TypedText], text: str) -> None:
    field = kind("Text")
    qtbot.addWidget(field)
    typed: list[str] = []
    field.typed.connect(typed.append)
    field.show_text(text)
    assert not field.pending
    qtbot.wait(2 * HAND_ON_MS)
    assert typed == []
    field.insertPlainText("c")
    assert field.pending
    field.flush()
    assert typed == ["ca\nb"]


@pytest.mark.parametrize(
    ("pasted", "whole"),
    [
        (" thick", "very thick"),
        ("  thick  ", "very  thick  "),
        (" thick \n and\r\nslow", "very thick and slow"),
        ("\u2028thick\u2029slow", "very thick slow"),
    ],
)
def test_a_pasted_text_keeps_its_spaces_but_no_line_break(qtbot: Any, pasted: str, whole: str) -> None:
    field = TypedSentence("Text")
    qtbot.addWidget(field)
    field.insertPlainText("very")
    data = QMimeData()
    data.setText(pasted)
    field.insertFromMimeData(data)
    assert field.words() == whole


@pytest.mark.parametrize("kind", [TypedLine, TypedText, TypedSentence])
def test_a_word_after_letters_of_two_units_is_deleted_before_the_key_is_removed(
    qtbot: Any, kind: type[TypedLine | TypedText]
) -> None:
    field = kind("Text")
    qtbot.addWidget(field)
    field.show_text("😀😀 one two")
    control = Qt.KeyboardModifier.ControlModifier
    qtbot.keyClick(field, Qt.Key.Key_End)
    assert field.nothing_to_delete()
    qtbot.keyClick(field, Qt.Key.Key_Left, control | Qt.KeyboardModifier.ShiftModifier)
    assert not field.nothing_to_delete()
    qtbot.keyClick(field, Qt.Key.Key_End)
    qtbot.keyClick(field, Qt.Key.Key_Left, control)
    assert not field.nothing_to_delete()
    qtbot.keyClick(field, Qt.Key.Key_Delete, control)
    assert field.words() == "😀😀 one "
    field.selectAll()
    assert field.nothing_to_delete()


def test_numbers_are_counted_by_keys_and_taken_ids_refused_while_typing(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    path = ("blocks", "liquids", "repetitions")
    line = designer.field(*path).line
    before = designer.value("blocks", "liquids", "repetitions")
    line.setFocus()
    qtbot.keyClick(line, Qt.Key.Key_Up)
    qtbot.keyClick(line, Qt.Key.Key_Up)
    assert designer.value("blocks", "liquids", "repetitions") == before + 2
    qtbot.keyClick(line, Qt.Key.Key_Down)
    assert line.text() == str(before + 1)
    designer.editing.undo()
    assert designer.value("blocks", "liquids", "repetitions") == before
    head = designer.place.form.head
    designer.fill(head.id, "delays", "")
    assert "is taken" in head.refusal.text()
    qtbot.keyClicks(head.id, "2")
    assert not head.refusal.text()


def test_a_comma_that_may_separate_numbers_is_refused_in_a_list_of_them(designer: Any) -> None:
    designer.open()
    path = ("device", "workspace_mm")
    designer.editing.select(path[:1])
    field = designer.field(*path)

    def size_after(text: str) -> object:
        designer.fill(field.line, text, "")
        designer.place.flush()
        return designer.value("device", "workspace_mm")

    assert size_after("90,5 60; 60") == (90.5, 60, 60)
    assert size_after("100, 60, 60") == (100, 60, 60)
    assert size_after("90,5") == (100, 60, 60)
    assert field.refusal.startswith("“90,5” may be one number or several: separate numbers by spaces or semicolons.")


def test_esc_restores_the_value_of_a_field_that_was_left_with_a_refused_text(qtbot: Any, designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    row = designer.form_row("blocks", "liquids", "repetitions")
    line = row.field.line
    designer.fill(line, "2x\t", "")
    value = designer.value("blocks", "liquids", "repetitions")
    assert row.wrong.sentence.text() == f"“2x” is not a whole number. The study keeps {value}; Esc restores it."
    line.setFocus()
    qtbot.keyClick(line, Qt.Key.Key_Escape)
    assert (line.text(), row.wrong.isVisible()) == (str(value), False)
