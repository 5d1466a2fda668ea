"""The level axis and the trial strip of the form: drags and keys are steps, and what is drawn is the block's own."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

LEVELS = ("stimuli", "damping", "levels")
LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


def axis_of(designer: Any) -> Any:
    designer.controller.begin("template:viscosity-jnd", "thicker")
    designer.editing.select(("stimuli", "damping"))
    return designer.field(*LEVELS).extra


def ends(designer: Any) -> tuple[float, float]:
    document = designer.study.document
    low, high = document["stimuli"]["damping"]["levels"]
    return low, high


@pytest.mark.slow
def test_a_drag_of_an_end_is_one_step(designer: Any) -> None:
    view = axis_of(designer)
    end = view.ends[1]
    before, middle = ends(designer), end.rect().center()
    QTest.mousePress(end, LEFT, NONE, middle)
    seen = []
    for number in range(1, 8):
        QTest.mouseMove(end, end.mapFromGlobal(view.mapToGlobal(QPoint(end.x() - 5 * number, middle.y()))))
        seen.append(ends(designer))
    assert seen == [before] * 7  # nothing is written while the handle is held
    QTest.mouseRelease(end, LEFT, NONE, end.rect().center())
    low, high = ends(designer)
    assert (low, high < before[1]) == (before[0], True)
    assert designer.field(*LEVELS).line.text() == f"{low}  {high}"
    designer.editing.undo()
    assert ends(designer) == before
    assert view.ends[1].level == before[1]
