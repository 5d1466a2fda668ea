"""The tab Measures in its window: what follows an edit, what is ordered and given up, and the repair of levels."""

from __future__ import annotations

import time
from typing import Any

import pytest
from pyqtgraph import TextItem
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QEnterEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLineEdit

from study_app.app.designer.measures.measures_worker import (
    Advising,
    Counted,
    Grouping,
    MeasureOrder,
    Measuring,
    Observing,
    start_measure_worker,
)
from study_app.authoring.drafts import discard, drafted_files
from study_app.authoring.kept_settings import keep_setting, kept_participants
from study_app.authoring.new_study import template
from study_app.authoring.writer.edits import Set
from study_app.gui.designer.measures.card_grid import CardGrid
from study_app.gui.designer.measures.limit_colours import limit_colour
from study_app.gui.designer.measures.parts import NumberPart
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.protocol.checks.expected_precision import threshold_plan
from study_app.protocol.source.files import shipped_file
from study_app.viewmodels.designer.measures.number_cards import (
    ANEW,
    FAILED,
    ON_AVERAGE,
    UNKNOWN,
    Line,
    LinesCard,
    NumberCard,
    TextsCard,
)
from study_app.workers.messages import Crashed
from tests.app.designer.measures.conftest import Worker, jnd, shown

pytestmark = pytest.mark.slow


def click(button: Any) -> None:
    QTest.mouseClick(button, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, button.rect().center())


def test_slow_numbers_come_are_given_up_and_are_kept(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    page = designer.place.measures
    qtbot.waitUntil(lambda: bool(worker.orders))
    assert [type(one) for one in worker.orders[0].wanted] == [Observing, Grouping, Measuring, Advising]
    assert page.numbers.parts[0].number.text() == UNKNOWN
    assert page.numbers.parts[0].note.text() == ANEW
    assert page.numbers.parts[3].number.text() != UNKNOWN  # how long it lasts is known at once
    worker.answer()
    shown(qtbot, designer, 0, "5 – 50")
    shown(qtbot, designer, 1, "± 26")
    shown(qtbot, designer, 2, "93")
    assert designer.place.header.problems.words == "1 warning"  # that of the precision takes simulated observers
    assert page.function.accessibleDescription().startswith("Share of answers that are correct")
    assert "19 %" in page.track.accessibleDescription()
    assert page.forces.accessibleDescription().startswith("Force at 31 levels")

    designer.editing.make("Change", Set(("methods", "adaptive", "trials"), 60))
    qtbot.waitUntil(lambda: len(worker.orders) == 2)
    assert page.numbers.parts[1].note.text() == ANEW  # grey, with the number of before
    assert page.numbers.parts[1].number.text() == "± 26"
    assert page.function.shown.anew
    designer.editing.make("Change", Set(("methods", "adaptive", "trials"), 100))
    qtbot.waitUntil(lambda: worker.stops == 1)  # what was under way is given up
    qtbot.waitUntil(lambda: len(worker.orders) == 3)
    assert worker.orders[2].wanted[0].plan.trials == 100
    designer.editing.undo()
    designer.editing.undo()
    qtbot.waitUntil(lambda: not page.function.shown.anew)  # kept by what it depends on
    qtbot.wait(120)
    assert len(worker.orders) == 3
    designer.editing.make("Change", Set(("pages", "welcome", "title"), "Hello"))
    qtbot.wait(120)
    assert len(worker.orders) == 3  # nothing depends on a text

    designer.window.go("home")
    assert not worker.works  # a session may begin: nothing is simulated any more
    designer.controller.measures.fit.found.emit()  # as what was looked for when it was left
    qtbot.wait(120)
    assert not designer.controller.measures.slow.rest.isActive()
    designer.window.go("designer")
    designer.editing.make("Break", Set(("study", "version"), 1))
    qtbot.wait(120)
    assert page.numbers.isVisible()  # nothing of them depends on the version
    before = [part.number.text() for part in page.numbers.parts]
    designer.editing.make("Break", Set(("device", "force_limit_n"), 60))
    qtbot.waitUntil(lambda: page.cards["forces"].chips[0].word == "– of 31 as asked")
    assert page.forces.shown.bars == ()
    assert [part.number.text() for part in page.numbers.parts] == before  # no threshold depends on the device
    assert page.area.widget().isEnabled()
    assert not page.earlier.isVisible()


def test_a_card_says_how_far_its_simulations_are_and_that_one_crashed(
    qtbot: Any, designer: Any, worker: Worker
) -> None:
    jnd(designer)
    qtbot.waitUntil(lambda: bool(worker.orders))
    observing, _, *others = worker.orders[0].wanted
    one, people, *_ = designer.place.measures.numbers.parts[1:]
    worker.given.append((1, Counted(observing, 240, 400)))
    qtbot.waitUntil(lambda: one.note.text() == "240 of 400 simulated")
    assert people.note.text() == ANEW  # it waits for its turn
    assert designer.place.measures.cards["function"].legend.text() == "240 of 400 simulated"
    worker.answer(Observing)
    worker.given.append((1, Crashed(1)))
    qtbot.waitUntil(lambda: people.note.text() == FAILED[2])
    assert (people.number.text(), one.number.text()) == (UNKNOWN, "± 26")
    assert people.more.text() == "The process ended with exit code 1; the terminal may show why."
    qtbot.waitUntil(lambda: len(worker.orders) == 2)
    assert worker.orders[1].wanted == tuple(others)  # those after it are simulated all the same
    worker.given.append((2, Crashed(-9)))
    qtbot.waitUntil(lambda: len(worker.orders) == 3)
    worker.given.append((3, Crashed(-9)))
    qtbot.waitUntil(lambda: ANEW not in [part.note.text() for part in designer.place.measures.numbers.parts])
    designer.editing.make("Change", Set(("methods", "adaptive", "trials"), 60))
    qtbot.waitUntil(lambda: len(worker.orders) == 4)
    assert people.note.text() == ANEW  # another study, another try


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

    shows("20", "planned")
    simulate("8")
    shows("8", "(20 planned)")
    file = designer.editing.opened.file
    designer.controller.open("kitchen")
    shows("12", "(none planned)")
    designer.controller.open(str(file))
    shows("8", "(20 planned)")
    assert kept_participants(file) == 8
    assert b"participants = 20" in designer.editing.opened.source()
    simulate("20")
    shows("20", "planned")
    assert kept_participants(file) is None  # from now on it follows the file


def test_a_new_study_has_no_number_of_participants_of_one_that_was_discarded(
    qtbot: Any, designer: Any, worker: Worker
) -> None:
    jnd(designer)
    keep_setting(designer.editing.opened.file, "participants", 8)
    designer.controller.open("kitchen")
    discard(next(file for file in drafted_files() if file.stem == "thicker"))
    jnd(designer)
    qtbot.waitUntil(lambda: designer.place.measures.controls.participants.field.text() == "20")


def test_a_verdict_says_whether_the_participants_are_enough(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    people = designer.place.measures.numbers.parts[2]
    enough, few = ("ok", "check", "Enough"), ("warn", "warning", "Not enough")
    for participants, who, number, verdict, words in (
        (20, "20 planned", "93", enough, "80 % are enough; with 107 trials: 98 %"),
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


def test_without_a_process_the_other_numbers_stay(qtbot: Any, designer: Any) -> None:
    designer.controller.measures.slow.rest.setInterval(10)
    jnd(designer)
    part = designer.place.measures.numbers.parts[1]
    qtbot.waitUntil(lambda: part.note.text() == FAILED[2])
    assert part.more.text() == "The process of the simulations does not start."
    assert designer.place.measures.numbers.parts[3].number.text() == "17"


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


def test_instant_numbers_of_the_largest_study_take_less_than_100_ms(designer: Any) -> None:
    text = shipped_file("rek2024").read_text(encoding="utf-8").replace('name = "rek2024"', 'name = "large"')
    (designer.file.parent / "large.toml").write_text(text, encoding="utf-8")
    designer.controller.open("large")
    designer.editing.select(("blocks", "liquids"))
    designer.place.pane.show_tab("measures")
    spent = []
    for number in range(6):
        designer.editing.make("Change", Set(("device", "force_limit_n"), 4 + 0.1 * number))
        began = time.perf_counter()
        designer.controller.measures.show()
        spent.append(time.perf_counter() - began)
    assert min(spent) < 0.1


@pytest.mark.nightly
def test_the_worker_process_simulates_observers_and_studies() -> None:
    protocol = template("viscosity-jnd").protocol
    assert protocol is not None
    plan = threshold_plan(protocol, protocol.blocks["viscosity"])
    assert plan is not None
    client = start_measure_worker()
    plan = plan.with_trials(20)
    client.order(MeasureOrder((Observing(plan, 0.2, 0.02), Grouping(plan, 6, 0.5))))
    found: list[Any] = []
    for _ in range(600):
        found += client.answers(0.5)
        if found and found[-1][1] is None:
            break
    client.close()
    observed, group = (answer[1] for _, answer in found if isinstance(answer, tuple))
    assert observed.threshold == 0.2
    assert 0.0 <= group.share <= 1.0
    assert group.more_trials > group.trials == 20


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
