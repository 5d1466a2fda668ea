"""The form in a small window, and its fields: what is shown is no edit, what is pasted stays within a line."""

from typing import Any

import pytest
import shiboken6
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidgetItem

from study_app.designer.form.typed_fields import HAND_ON_MS, TypedSentence, TypedText

pytestmark = pytest.mark.slow


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
