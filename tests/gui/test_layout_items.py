"""No window keeps Python's wrapper of a layout's item: PySide does not notice when Qt deletes the item.

An event at the same address would get that wrapper, and the class of the item.
"""

import re

import pytest
import shiboken6
from PySide6.QtWidgets import QLabel, QLayoutItem, QVBoxLayout, QWidget

from study_app.gui.widgets.boxes import STRETCH, add_layout, hbox, insert_layout, vbox
from tests.documented import ROOT

READ = re.compile(r"\.(itemAt|takeAt|itemAtPosition|replaceWidget|addLayout|insertLayout)\(")


def wrapped() -> list[QLayoutItem]:
    """Return the wrappers of items; those of layouts live as long as these."""
    return [
        wrapper
        for wrapper in shiboken6.getAllValidWrappers()
        if type(wrapper).__name__ in {"QWidgetItem", "QSpacerItem"}
    ]


def test_only_the_functions_of_boxes_make_wrappers_of_items() -> None:
    readers = {path.name for path in (ROOT / "study_app" / "gui").rglob("*.py") if READ.search(path.read_text("utf-8"))}
    assert readers == {"boxes.py"}


@pytest.mark.usefixtures("qapp")
def test_a_layout_that_is_added_to_that_of_a_widget_leaves_no_wrapper_of_its_items() -> None:
    before = len(wrapped())
    outer, inside = QVBoxLayout(), QWidget()
    inside.setLayout(outer)
    outer.addLayout(inner := hbox(QLabel("a"), STRETCH))
    assert len(wrapped()) in {before, before + 2}  # none with PySide 6.12: then add_layout releases nothing
    shiboken6.delete(inside)
    del inner
    between, other = len(wrapped()), QWidget()
    column = vbox(hbox(QLabel("b"), 8, vbox(QLabel("c"))), parent=other)
    add_layout(column, hbox(QLabel("d"), STRETCH))
    insert_layout(column, 0, hbox(QLabel("e")))
    assert len(wrapped()) == between
    assert [label.text() for label in other.findChildren(QLabel)] == ["b", "c", "d", "e"]
