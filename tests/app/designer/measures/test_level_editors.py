"""The level axis and the trial strip of the form: drags and keys are steps, and what is drawn is the block's own."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from study_app.authoring.edited_study import read
from study_app.authoring.fields import label_of, row_at
from study_app.authoring.new_study import template
from study_app.authoring.writer.edits import Set
from study_app.protocol.load import load
from study_app.protocol.orders.block_orders import order_of
from study_app.protocol.orders.durations import block_duration_s
from study_app.protocol.source.files import shipped_file
from study_app.viewmodels.designer.special.level_axis import level_axis
from study_app.viewmodels.designer.special.trial_strip import trial_strip

LEVELS = ("stimuli", "damping", "levels")
LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


def axis_of(designer: Any) -> Any:
    designer.controller.begin("template:viscosity-jnd", "thicker")
    designer.editing.select(("stimuli", "damping"))
    return designer.field(*LEVELS).view


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


def test_the_axis_says_where_limits_begin() -> None:
    study = template("viscosity-jnd")
    row = row_at(study.document, LEVELS)
    assert row is not None
    shown = level_axis(study, row)
    assert shown is not None
    assert (shown.low, shown.high, shown.logarithmic, shown.unit) == (0.02, 0.6, True, "%")
    assert shown.standard == "standard 8 N·s/m"
    assert shown.least < shown.low < shown.high < shown.most
    assert shown.limits == {}  # they are far away at 8 N·s/m
    strong, _ = study.edited(Set(("stimuli", "damping", "standards"), [32]))
    row = row_at(strong.document, LEVELS)
    assert row is not None
    near = level_axis(strong, row)
    assert near is not None
    slope = near.limits["slope"]
    assert slope.words == "slope limit 53 N·s/m"
    assert slope.level == pytest.approx(53 / 32 - 1, rel=1e-3)
    broken, _ = study.edited(Set(LEVELS, [0.6, 0.02]))
    row = row_at(broken.document, LEVELS)
    assert row is not None
    assert level_axis(broken, row) is None


@pytest.mark.parametrize(
    ("name", "block"),
    [("viscosityjnd", "viscosity"), ("viscosityjnd", "training"), ("delaydetect", "delay"), ("thickness", "thickness")],
)
def test_a_trial_takes_as_long_as_check_says(name: str, block: str) -> None:
    protocol = load(name)
    study = read(shipped_file(name).read_bytes(), shipped_file(name).parent)
    row = row_at(study.document, ("blocks", block, "design"))
    assert row is not None
    strip = trial_strip(study, row)
    assert strip is not None
    trials = order_of(protocol, protocol.blocks[block]).trials
    whole_s = block_duration_s(protocol, protocol.blocks[block], "en")
    breaks_s = whole_s - trials * strip.duration_s
    assert 0 <= breaks_s + 1e-6 < 0.2 * whole_s
    kinds = [phase.kind for phase in strip.phases]
    assert kinds.count("interval") == (1 if name == "thickness" else 2)
    assert ("feedback" in kinds) == (name == "viscosityjnd")
    assert [phase.name for phase in strip.phases][-1] == label_of("between_s") == "Between trials"
    rows_of = {phase.field: row_at(study.document, phase.field) for phase in strip.phases if phase.field}
    assert len(rows_of) >= len(set(kinds))
    assert None not in rows_of.values()


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
        button = designer.field("blocks", "training", "design").view.phases[phase]
        if number % 2:
            button.setFocus()
            qtbot.keyClick(button, Qt.Key.Key_Space)
        else:
            qtbot.mouseClick(button, LEFT)
        assert designer.editing.selected == field[:2]
        form = designer.place.form
        reached = [row.row.row.path for row in form.rows if row.isAncestorOf(form.focusWidget())]
        added = [path for path, made in form.adds.items() if made is form.focusWidget()]
        assert reached + added == [field]
        assert button.accessibleName()
