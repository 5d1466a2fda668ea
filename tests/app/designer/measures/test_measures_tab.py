"""The tab Measures in its window: what follows an edit, what is ordered and given up, and the repair of levels."""

from typing import Any

import pytest
from pyqtgraph import TextItem
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from study_app.authoring.kept_settings import kept_participants
from study_app.authoring.writer.edits import Set
from study_app.viewmodels.designer.measures.number_cards import ON_AVERAGE, UNKNOWN
from tests.app.designer.measures.conftest import Worker, jnd, shown

pytestmark = pytest.mark.slow


def click(button: Any) -> None:
    QTest.mouseClick(button, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, button.rect().center())


def test_what_is_simulated_is_typed_at_the_right(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    qtbot.waitUntil(lambda: bool(worker.orders))
    controls = designer.place.measures.controls
    for control, typed in ((controls.threshold, "30"), (controls.lapses, "5"), (controls.participants, "8")):
        designer.fill(control.field, typed)
    qtbot.waitUntil(lambda: worker.orders[-1].wanted[0].lapses == 0.05)
    observing, grouping, measuring, _ = worker.orders[-1].wanted
    assert (observing.threshold, measuring.lapses, grouping.participants) == (0.3, 0.05, 8)
    qtbot.keyClick(controls.participants.field, Qt.Key.Key_Up)
    qtbot.waitUntil(lambda: worker.orders[-1].wanted[1].participants == 9)
    designer.editing.select(("pages", "welcome"))
    qtbot.waitUntil(lambda: not controls.threshold.isVisible())
    assert controls.participants.isVisible()


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


def test_a_verdict_says_whether_the_participants_are_enough(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    people = designer.place.measures.numbers.parts[2]
    enough, few = ("ok", "check", "Enough"), ("warn", "warning", "Not enough")
    for participants, who, number, verdict, words in (
        (24, "24 planned", "93", enough, "80 % are enough; with 107 trials: 98 %"),
        (12, "12 simulated", "13", few, "Needed: about 22 participants for 80 %; with 107 trials: 22 %"),
        (8, "8 simulated", "13", few, "Needed: more than 60 participants for 80 %; with 107 trials: 22 %"),
    ):
        more = f"{words}. {ON_AVERAGE}"
        designer.place.measures.controls.participants.entered.emit(participants)
        qtbot.waitUntil(lambda n=participants: worker.sizes[-1:] == [n])
        worker.answer()
        qtbot.waitUntil(lambda more=more: people.more.isVisible() and people.more.text() == more)
        assert people.shown.note == verdict
        assert people.accessibleName() == f"{who} in ± 15 %: {number} % of studies, {verdict[2]}. {more}"


@pytest.mark.usefixtures("worker")
def test_a_clipped_level_is_repaired_by_its_button(qtbot: Any, designer: Any) -> None:
    jnd(designer)
    designer.editing.make("Change", Set(("stimuli", "damping", "standards"), [32]),
                          Set(("stimuli", "damping", "levels"), [0.02, 0.75]))  # fmt: skip
    page = designer.place.measures
    qtbot.waitUntil(lambda: "forces" in page.cards and page.cards["forces"].repair.isVisible())
    forces = page.cards["forces"]
    chips = [("neutral", "info", "29 of 31 as asked"), ("bad", "warning", "2 clipped")]
    assert list(forces.shown.verdicts) == chips
    assert [chip.word for chip in forces.chips] == [words for *_, words in chips]
    assert f"{forces.shown.slope_n:.2f}" == "7.99"  # 53 N·s/m at 0.151 m/s, and not the force limit of 8 N
    drawn = [one for one in page.forces.drawn if isinstance(one, TextItem)]
    assert [one.toPlainText() for one in drawn] == ["force limit 8 N", "slope limit 7.99 N"]
    assert {bar.clipped_by for bar in forces.shown.bars} == {None, "slope"}
    assert forces.words.text() == designer.place.view.problems[0].message
    click(forces.repair)
    assert designer.study.protocol is not None
    highest = designer.value("stimuli", "damping", "levels", 1)
    assert forces.repair.text() == f"Highest level {highest}"
    qtbot.waitUntil(lambda: not forces.bar.isVisible())
    designer.editing.undo()
    assert designer.value("stimuli", "damping", "levels", 1) == 0.75


def test_a_block_of_statements_shows_what_people_can_show(qtbot: Any, designer: Any, worker: Worker) -> None:
    designer.open("rek2024", "blocks", "liquids")
    designer.place.pane.show_tab("measures")
    qtbot.waitUntil(lambda: bool(worker.orders))
    (wanted,) = worker.orders[0].wanted
    assert (wanted.block, wanted.participants) == ("liquids", 12)
    grid = designer.place.measures.grid
    titles = [part.accessibleName() for part in grid.parts]
    assert titles[:4] == ["Session", "Balance", "Smallest differences", "Force of each liquid"]
    worker.answer()
    qtbot.waitUntil(lambda: grid.cards[2].lines != ())
    lines = [(line.title, line.number) for line in grid.cards[2].lines]
    assert lines == [("Feels like a liquid", "0.9"), ("Like honey", UNKNOWN)]
    kept = grid.parts[0]
    designer.place.measures.controls.participants.entered.emit(14)
    qtbot.waitUntil(lambda: grid.cards[1].people == "14 simulated")
    assert grid.parts[0] is kept  # only what changed is made anew
    designer.place.pane.show_tab("file")
    facts = designer.place.pane.facts
    qtbot.waitUntil(lambda: facts.isVisible() and len(facts.grid.parts) == 4)
    assert facts.grid.cards[2].anew  # until the answer for 14 is there, it is what 12 can show
    assert facts.grid.cards[2].aside.startswith("12 simulated")
    assert [part.accessibleName() for part in facts.grid.parts] == titles[:4]


def test_a_row_opens_the_measures_of_a_block_that_uses_an_element(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    qtbot.waitUntil(lambda: bool(worker.orders))
    worker.answer()
    shown(qtbot, designer, 2, "93")
    designer.editing.select(("liquids", "damper"))
    page = designer.place.measures
    qtbot.waitUntil(lambda: page.blocks.isVisible() and len(page.blocks.parts) == 1)
    part = page.blocks.parts[0]
    assert "JND 5 – 50 %" in part.buttons[1].accessibleName()  # as it was simulated for the block
    click(part.buttons[1])
    assert designer.editing.selected == ("blocks", "viscosity")
    qtbot.waitUntil(lambda: not page.blocks.isVisible())
