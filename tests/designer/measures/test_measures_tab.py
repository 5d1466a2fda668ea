"""The tab Measures in its window: what follows an edit, what is ordered and given up, and the repair of levels."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QWidget

from study_app.designer.measures.simulation import hypotheses_of
from study_app.store.study_settings import kept_participants
from tests.designer.measures.conftest import Worker, jnd, shown

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


def test_the_number_of_participants_is_kept_for_each_study(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    control = designer.place.measures.controls.participants

    def simulate(number: str) -> None:
        designer.fill(control.field, number)

    def shows(number: str, planned: str) -> None:
        qtbot.waitUntil(lambda: (control.field.text(), control.unit.text()) == (number, planned))

    shows("24", "planned")
    simulate("8")
    shows("8", "(24 planned)")
    file = designer.editing.opened.file
    designer.open()
    shows("12", "(none planned)")
    designer.open(str(file))
    shows("8", "(24 planned)")
    assert kept_participants(file) == 8
    assert b"participants = 24" in designer.editing.opened.source()
    simulate("24")
    shows("24", "planned")
    assert kept_participants(file) is None  # from now on it follows the file


def test_a_row_opens_the_measures_of_a_block_that_uses_an_element(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    qtbot.waitUntil(lambda: bool(worker.orders))
    worker.answer()
    shown(qtbot, designer, 2, "93")
    designer.editing.select(("liquids", "damper"))
    page = designer.place.measures
    qtbot.waitUntil(lambda: page.blocks.isVisible() and len(page.blocks.parts) == 1)
    part = page.blocks.parts[0]
    assert "JNDs" in part.buttons[1].accessibleName()
    click(part.buttons[1])
    assert designer.editing.selected == ("blocks", "viscosity")
    qtbot.waitUntil(lambda: not page.blocks.isVisible())


def test_a_screen_reader_hears_each_count_of_the_balance(qtbot: Any, designer: Any, worker: Worker) -> None:
    designer.open()
    designer.editing.select(("blocks", "liquids"))
    designer.place.pane.show_tab("measures")

    def heard() -> bool:
        names = [part.accessibleName() for part in designer.place.measures.findChildren(QWidget)]
        return any("1, position 1: " in name and name.endswith(" times") for name in names)

    qtbot.waitUntil(heard)
