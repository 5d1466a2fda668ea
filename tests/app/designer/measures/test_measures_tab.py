"""The tab Measures in its window: what follows an edit, what is ordered and given up, and the repair of levels."""

from typing import Any

import pytest
from pyqtgraph import TextItem
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QEnterEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLineEdit

from study_app.authoring.drafts import discard, drafted_files
from study_app.authoring.kept_settings import keep_setting, kept_participants
from study_app.authoring.writer.edits import Set
from study_app.gui.designer.measures.card_grid import CardGrid
from study_app.gui.designer.measures.limit_colours import limit_colour
from study_app.gui.designer.measures.parts import NumberPart
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.viewmodels.designer.measures.number_cards import (
    ON_AVERAGE,
    UNKNOWN,
    Line,
    LinesCard,
    NumberCard,
    TextsCard,
)
from tests.app.designer.measures.conftest import Worker, jnd, shown

pytestmark = pytest.mark.slow


def click(button: Any) -> None:
    QTest.mouseClick(button, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, button.rect().center())


def test_what_is_simulated_is_typed_at_the_right(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    qtbot.waitUntil(lambda: bool(worker.orders))
    controls = designer.place.measures.controls
    for control, typed in ((controls.threshold, "30"), (controls.lapses, "5"), (controls.participants, "8")):
        control.field.setFocus()
        control.field.selectAll()
        qtbot.keyClicks(control.field, typed)
        qtbot.keyClick(control.field, Qt.Key.Key_Return)
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
        control.field.setFocus()
        control.field.selectAll()
        qtbot.keyClicks(control.field, number)
        qtbot.keyClick(control.field, Qt.Key.Key_Return)

    def shows(number: str, planned: str) -> None:
        qtbot.waitUntil(lambda: (control.field.text(), control.unit.text()) == (number, planned))

    shows("24", "planned")
    simulate("8")
    shows("8", "(24 planned)")
    file = designer.editing.opened.file
    designer.controller.open("kitchen")
    shows("12", "(none planned)")
    designer.controller.open(str(file))
    shows("8", "(24 planned)")
    assert kept_participants(file) == 8
    assert b"participants = 24" in designer.editing.opened.source()
    simulate("24")
    shows("24", "planned")
    assert kept_participants(file) is None  # from now on it follows the file


@pytest.mark.parametrize(
    ("right", "wrong", "shown"),
    [
        ("precision = 0.15", "precision = 15", ("24", "planned")),
        ("format = 2", "format = 9", ("24", "planned")),
        ("participants = 24", "participants = 0", ("12", "(none planned)")),
    ],
)
def test_the_planned_number_of_participants_is_that_of_a_faulty_file_too(
    qtbot: Any, designer: Any, worker: Worker, right: str, wrong: str, shown: tuple[str, str]
) -> None:
    jnd(designer)
    control = designer.place.measures.controls.participants
    designer.file.write_text(designer.text.replace(right, wrong, 1))
    designer.controller.open("kitchen")
    assert designer.editing.opened.study.faults
    qtbot.waitUntil(lambda: (control.field.text(), control.unit.text()) == shown)


def test_a_new_study_has_no_number_of_participants_of_one_that_was_discarded(
    qtbot: Any, designer: Any, worker: Worker
) -> None:
    jnd(designer)
    keep_setting(designer.editing.opened.file, "participants", 8)
    designer.controller.open("kitchen")
    discard(next(file for file in drafted_files() if file.stem == "thicker"))
    jnd(designer)
    qtbot.waitUntil(lambda: designer.place.measures.controls.participants.field.text() == "24")


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
    inks = [limit_colour(page.theme, limit) for limit in ("norm", "slope")]  # those of the axis in the form
    assert [one.color.name().upper() for one in drawn] == [ink.upper() for ink in inks]
    assert {bar.clipped_by for bar in forces.shown.bars} == {None, "slope"}
    assert forces.words.text() == designer.place.view.problems[0].message
    click(forces.repair)
    assert designer.editing.opened.study.protocol is not None
    highest = designer.editing.opened.study.document["stimuli"]["damping"]["levels"][1]
    assert forces.repair.text() == f"Highest level {highest}"
    qtbot.waitUntil(lambda: not forces.bar.isVisible())
    designer.editing.undo()
    assert designer.editing.opened.study.document["stimuli"]["damping"]["levels"][1] == 0.75


@pytest.mark.usefixtures("worker")
def test_each_block_names_its_own_levels_that_are_clipped(qtbot: Any, designer: Any) -> None:
    jnd(designer)
    designer.editing.make("Change", Set(("stimuli", "damping", "standards"), [40]))
    page = designer.place.measures
    qtbot.waitUntil(lambda: "forces" in page.cards)
    forces = page.cards["forces"]
    for block, named in (("viscosity", "levels 0.34 to 0.6 gives up to 64"), ("training", "level 0.5 gives 60")):
        designer.editing.select(("blocks", block))
        said = f"Standard 40 at {named} N·s/m at the hand; the slope limit (1000 Hz, kalman, 1 tick) is 53"
        qtbot.waitUntil(lambda said=said: forces.words.text() == said)
        qtbot.waitUntil(forces.repair.isVisible)
    click(forces.repair)
    assert designer.editing.opened.study.faults == ()


def test_a_block_of_statements_shows_what_people_can_show(qtbot: Any, designer: Any, worker: Worker) -> None:
    designer.controller.open("rek2024")
    designer.editing.select(("blocks", "liquids"))
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


@pytest.mark.variants(3)
@pytest.mark.parametrize("size", [(1600, 1000), (1366, 768), (1024, 640)])
@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_every_element_has_measures_that_fit(
    qtbot: Any, designer: Any, worker: Worker, size: tuple[int, int], theme: Any
) -> None:
    designer.window.show_theme(theme)
    designer.window.resize(*size)
    jnd(designer)
    designer.place.sides.buttons[1].click()
    qtbot.waitUntil(lambda: bool(worker.orders))
    worker.answer()
    shown(qtbot, designer, 2, "93")
    page = designer.place.measures
    assert page.area.widget().minimumSizeHint().width() <= page.area.viewport().width()
    for part in page.findChildren(QAbstractButton) + page.controls.findChildren(QLineEdit):
        assert part.accessibleName() or part.text()
    for path in (("liquids", "damper"), ("study",), ("designs", "pair"), ("tasks", "stir")):
        designer.editing.select(path)
        qtbot.waitUntil(lambda path=path: page.shown is not None and designer.editing.selected == path)
        designer.controller.measures.show()
        assert page.area.widget().minimumSizeHint().width() <= page.area.viewport().width(), path


def test_measures_are_those_of_the_study_that_is_opened(qtbot: Any, designer: Any) -> None:
    def languages() -> list[str]:
        cards = () if designer.place.measures.shown is None else designer.place.measures.shown.cards
        return [line.title for card in cards if isinstance(card, TextsCard) for line in card.languages]

    designer.controller.open("kitchen")
    designer.place.show_tab("measures")
    for study, titles in (("rek2024", ["English", "Dutch"]), ("demo", ["English"])):
        designer.controller.open(study)
        qtbot.waitUntil(lambda titles=titles: languages() == titles)


def test_no_card_moves_while_the_pointer_is_over_the_cards(qtbot: Any) -> None:
    grid = CardGrid()
    qtbot.addWidget(grid)
    grid.resize(600, 800)
    grid.show()
    lines = tuple(Line(f"Liquid {number}", "1 N", 0.5) for number in range(4))
    long, short, other = LinesCard("Force", "", lines), LinesCard("Force", "", ()), LinesCard("Other", "", lines)
    grid.show_cards((long, long, other, other))
    qtbot.wait(20)
    before = grid.parts[2].pos()
    QApplication.sendEvent(grid, QEnterEvent(QPointF(5, 5), QPointF(5, 5), QPointF(5, 5)))
    grid.show_cards((short, short, other, other))
    qtbot.wait(20)
    assert grid.parts[2].pos() == before
    QApplication.sendEvent(grid, QEvent(QEvent.Type.Leave))
    qtbot.waitUntil(lambda: grid.parts[2].y() < before.y())


@pytest.mark.parametrize(("number", "size_px"), [("5.1 – 60", 26), ("4.8 – 240", 16)])
def test_a_number_is_never_cut(qtbot: Any, number: str, size_px: int) -> None:
    part = NumberPart()
    qtbot.addWidget(part)
    part.resize(154, 90)
    part.show_card(NumberCard("JNDs it can measure", number, "%"))
    part.show()
    assert part.number.width() >= part.number.sizeHint().width()
    assert part.number.font().pixelSize() == size_px
    part.resize(300, 90)
    assert part.number.font().pixelSize() == 26
