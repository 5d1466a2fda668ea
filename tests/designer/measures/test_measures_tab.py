"""The tab Measures in its window: what follows an edit, what is ordered and given up, and the repair of levels."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QWidget

from study_app.designer.measures.simulation import hypotheses_of
from tests.designer.measures.conftest import Worker, jnd

pytestmark = pytest.mark.slow


def click(button: Any) -> None:
    QTest.mouseClick(button, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, button.rect().center())


def test_what_is_simulated_is_typed_at_the_right(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    qtbot.waitUntil(lambda: bool(worker.orders))
    controls = designer.place.measures.controls
    for control, typed in ((controls.threshold, "30"), (controls.lapses, "5"), (controls.participants, "8")):
        designer.fill(control.field, typed)
    qtbot.waitUntil(lambda: worker.orders[-1].controls.participants == 8)
    wanted = worker.orders[-1].controls
    assert (wanted.threshold, wanted.lapses) == (0.3, 0.05)
    qtbot.keyClick(controls.participants.field, Qt.Key.Key_Up)
    qtbot.waitUntil(lambda: worker.orders[-1].controls.participants == 9)
    designer.editing.select(("pages", "welcome"))
    qtbot.waitUntil(lambda: not controls.threshold.isVisible())
    assert controls.participants.isVisible()


@pytest.mark.parametrize("path", [("sequence",), ("blocks", "viscosity_2")])
def test_the_hypothesis_comes_first_with_what_the_planned_participants_show(
    qtbot: Any, designer: Any, worker: Worker, path: tuple[str, ...]
) -> None:
    jnd(designer)
    designer.place.duplicate()
    designer.go_to("sequence")
    designer.click_on(designer.field("analysis", "contrasts").add)
    designer.go_to(*path)
    above = designer.place.measures.hypotheses

    def texts() -> list[str]:
        return [part.text() for part in above.findChildren(QLabel) if part.text()]

    qtbot.waitUntil(lambda: texts()[:2] == ["Hypotheses", "24 planned"])
    qtbot.waitUntil(lambda: bool(worker.orders and worker.orders[-1].block))
    qtbot.waitUntil(lambda: bool(hypotheses_of(worker.orders[-1].protocol)))
    worker.answer()
    words = "Threshold is higher in viscosity than in viscosity_2: 80 % of studies of 12 show a ratio of 1.2"
    qtbot.waitUntil(lambda: words in texts())
    assert designer.place.measures.numbers.isVisible()
    assert above.mapTo(designer.place, above.pos()).y() < designer.place.measures.numbers.mapTo(
        designer.place, designer.place.measures.numbers.pos()).y()  # fmt: skip
    designer.go_to("pages", "welcome")
    qtbot.waitUntil(lambda: "Hypotheses" not in texts())


@pytest.mark.usefixtures("worker")
def test_the_number_of_participants_is_simulated_beside_the_planned_one(designer: Any) -> None:
    jnd(designer)
    control = designer.place.measures.controls.participants
    for typed, planned in (("8", "(24 planned)"), ("24", "planned")):
        designer.fill(control.field, typed)
        assert (control.field.text(), control.unit.text()) == (typed, planned)
    assert b"participants = 24" in designer.editing.opened.source()


def test_a_screen_reader_hears_each_count_of_the_balance(qtbot: Any, designer: Any, worker: Worker) -> None:
    designer.open()
    designer.editing.select(("blocks", "liquids"))
    designer.place.pane.show_tab("measures")

    def heard() -> bool:
        names = [part.accessibleName() for part in designer.place.measures.findChildren(QWidget)]
        return any("1, position 1: " in name and name.endswith(" times") for name in names)

    qtbot.waitUntil(heard)
