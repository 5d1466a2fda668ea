"""Rows and columns that are built in one call."""

from typing import Any

from PySide6.QtCore import QMargins
from PySide6.QtWidgets import QHBoxLayout, QLabel, QWidget

from study_app.gui.widgets.boxes import STRETCH, hbox, vbox


def test_a_box_has_the_stretches_gaps_and_margins_that_are_given(qtbot: Any) -> None:
    outer, first, second = QWidget(), QLabel("first"), QLabel("second")
    qtbot.addWidget(outer)
    inner = vbox(first, spacing=0)
    row = hbox(second, (inner, 2), 7, (STRETCH, 3), STRETCH, spacing=5, margins=(1, 2, 3, 4), parent=outer)
    assert outer.layout() is row
    assert first.parent() is second.parent() is outer
    assert [row.stretch(place) for place in range(row.count())] == [0, 2, 0, 3, 0]
    assert [row.itemAt(place).sizeHint().width() for place in (2, 3, 4)] == [7, 0, 0]
    assert row.contentsMargins() == QMargins(1, 2, 3, 4)
    assert (row.spacing(), inner.spacing()) == (5, 0)


def test_a_box_without_spacing_and_margins_has_those_of_the_style(qtbot: Any) -> None:
    outer, other = QWidget(), QWidget()
    for one in (outer, other):
        qtbot.addWidget(one)
    made, plain = hbox(parent=outer), QHBoxLayout(other)
    assert (made.spacing(), made.contentsMargins()) == (plain.spacing(), plain.contentsMargins())
