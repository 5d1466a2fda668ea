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


@pytest.mark.slow
def test_keys_move_an_end_but_not_beyond_the_other(qtbot: Any, designer: Any) -> None:
    view = axis_of(designer)
    low, high = ends(designer)
    view.ends[0].setFocus()
    for _ in range(3):
        qtbot.keyClick(view.ends[0], Qt.Key.Key_Right)
    assert ends(designer)[0] > low
    assert view.ends[0].accessibleName() == "Lowest level"
    designer.editing.undo()
    assert ends(designer) == (low, high)  # keys without a rest are one step
    for _ in range(60):
        qtbot.keyClick(view.ends[0], Qt.Key.Key_PageUp)
    assert low < ends(designer)[0] < high


@pytest.mark.slow
def test_each_phase_of_a_trial_leads_to_its_field(qtbot: Any, designer: Any) -> None:
    designer.controller.begin("template:viscosity-jnd", "thicker")
    for number, (phase, field) in enumerate((
        (0, ("tasks", "stir", "cycles")),
        (1, ("designs", "pair", "pause_s")),
        (3, ("designs", "pair", "question")),
        (4, ("designs", "pair", "feedback_s")),
        (5, ("designs", "pair", "between_s")),
    )):  # fmt: skip
        designer.go_to("blocks", "training")
        button = designer.field("blocks", "training", "design").extra.phases[phase]
        if number % 2:
            button.setFocus()
            qtbot.keyClick(button, Qt.Key.Key_Space)
        else:
            qtbot.mouseClick(button, LEFT)
        assert designer.editing.selected == field[:2]
        form = designer.place.form
        reached = [row.row.path for row in form.rows if row.isAncestorOf(form.focusWidget())]
        added = [path for path, made in form.adds.items() if made is form.focusWidget()]
        assert reached + added == [field]
        assert button.accessibleName()
