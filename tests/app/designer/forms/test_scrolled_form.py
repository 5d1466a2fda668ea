"""The form in a small window, and its fields: what is shown is no edit, what is pasted stays within a line."""

from typing import Any

import pytest
import shiboken6
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtWidgets import QWidget, QWidgetItem

from study_app.gui.designer.form.row_widget import RowWidget
from study_app.gui.designer.form.typed_fields import HAND_ON_MS, TypedSentence, TypedText

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
