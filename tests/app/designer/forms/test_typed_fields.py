"""Fields that are typed in: what is shown is no edit, and what is pasted stays as it is within a line."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, QMimeData, Qt
from PySide6.QtGui import QFocusEvent
from PySide6.QtWidgets import QApplication

from study_app.gui.designer.form.typed_fields import HAND_ON_MS, TypedLine, TypedSentence, TypedText

pytestmark = pytest.mark.slow


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


@pytest.mark.parametrize(("reason", "marked"), [("TabFocusReason", "New question"), ("MouseFocusReason", "")])
def test_tab_marks_a_sentence_so_that_what_is_typed_replaces_it(qtbot: Any, reason: str, marked: str) -> None:
    field = TypedSentence("Text")
    qtbot.addWidget(field)
    field.show_text("New question")
    QApplication.sendEvent(field, QFocusEvent(QEvent.Type.FocusIn, Qt.FocusReason[reason]))
    assert field.textCursor().selectedText() == marked


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
    designer.controller.open("kitchen")
    designer.editing.select(("blocks", "liquids"))
    path = ("blocks", "liquids", "repetitions")
    line = designer.row(*path).field.line
    before = designer.editing.opened.study.document["blocks"]["liquids"]["repetitions"]
    line.setFocus()
    qtbot.keyClick(line, Qt.Key.Key_Up)
    qtbot.keyClick(line, Qt.Key.Key_Up)
    assert designer.editing.opened.study.document["blocks"]["liquids"]["repetitions"] == before + 2
    qtbot.keyClick(line, Qt.Key.Key_Down)
    assert line.text() == str(before + 1)
    designer.editing.undo()
    assert designer.editing.opened.study.document["blocks"]["liquids"]["repetitions"] == before
    head = designer.place.form.head
    head.id.setFocus()
    head.id.selectAll()
    qtbot.keyClicks(head.id, "delays")
    assert "is taken" in head.refusal.text()
    qtbot.keyClicks(head.id, "2")
    assert not head.refusal.text()


def test_a_comma_that_may_separate_numbers_is_refused_in_a_list_of_them(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    path = ("device", "workspace_mm")
    designer.editing.select(path[:1])
    field = designer.row(*path).field

    def size_after(text: str) -> object:
        field.line.setFocus()
        field.line.selectAll()
        qtbot.keyClicks(field.line, text)
        designer.place.flush()
        return designer.editing.opened.study.document["device"]["workspace_mm"]

    assert size_after("90,5 60; 60") == (90.5, 60, 60)
    assert size_after("100, 60, 60") == (100, 60, 60)
    assert size_after("90,5") == (100, 60, 60)
    assert field.refusal.startswith("“90,5” may be one number or several: separate numbers by spaces or semicolons.")


def test_esc_restores_the_value_of_a_field_that_was_left_with_a_refused_text(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("blocks", "liquids"))
    row = designer.row("blocks", "liquids", "repetitions")
    line = row.field.line
    line.setFocus()
    line.selectAll()
    qtbot.keyClicks(line, "2x\t")
    value = designer.editing.opened.study.document["blocks"]["liquids"]["repetitions"]
    assert row.wrong.sentence.text() == f"“2x” is not a whole number. The study keeps {value}; Esc restores it."
    line.setFocus()
    qtbot.keyClick(line, Qt.Key.Key_Escape)
    assert (line.text(), row.wrong.isVisible()) == (str(value), False)
