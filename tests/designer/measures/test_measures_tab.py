"""The tab Measures in its window: the cards of an element, and the power that another process simulates."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtWidgets import QLabel, QWidget

from study_app.analysis.planning.preregistration import preregistration_of
from study_app.designer.document.steps import RetypeFile
from study_app.designer.document.toml_edits import Set
from study_app.designer.measures.cards import CardGrid, MeasureCard
from study_app.designer.measures.simulation import Simulated
from study_app.gui.home import main_window
from study_app.gui.widgets.controls import ActionButton
from study_app.workers.server import Crashed
from tests.designer.measures.conftest import Worker, open_viscosity_block

pytestmark = pytest.mark.slow
WAITING = "simulating…"


def test_power_is_shown_in_parts_cancelled_by_an_edit_and_kept(qtbot: Any, designer: Any, worker: Worker) -> None:
    open_viscosity_block(designer)
    power = designer.place.measures.power
    qtbot.waitUntil(lambda: bool(worker.orders))
    assert worker.orders[0].power
    assert power.progress.text() == WAITING
    assert not power.table.isVisible()
    cards = designer.place.measures.grid
    assert cards.height() == cards.sizeHint().height()  # no gap above the power
    worker.answer("10 of 200 studies of each size")
    qtbot.waitUntil(lambda: power.progress.text() == "10 of 200 studies of each size")
    assert "| 12 | 80% |" in power.table.text()
    assert designer.place.header.problems.chip_text == "1 warning"  # that of the precision is simulated
    worker.answer()
    qtbot.waitUntil(lambda: not power.progress.isVisible())

    designer.editing.make_step("Change", Set(("methods", "adaptive", "trials"), 60))
    qtbot.waitUntil(lambda: len(worker.orders) == 2)
    assert power.progress.text() == WAITING
    assert power.table.isVisible()  # the earlier table stays until there is another one
    designer.editing.make_step("Change", Set(("methods", "adaptive", "trials"), 100))
    qtbot.waitUntil(lambda: worker.stops == 1)
    qtbot.waitUntil(lambda: len(worker.orders) == 3)
    assert worker.orders[2].protocol.methods["adaptive"].trials == 100
    designer.editing.undo()
    designer.editing.undo()
    qtbot.waitUntil(lambda: not power.progress.isVisible())
    designer.editing.make_step("Change", Set(("pages", "welcome", "title"), "Hello"))
    qtbot.wait(120)
    assert len(worker.orders) == 3  # the answer is kept, and does not depend on a text

    designer.window.go("home")
    assert not worker.works  # nothing is simulated during a session
    assert not designer.controller.measures.rest.isActive()


def test_other_tabs_order_the_warnings_without_the_power(qtbot: Any, designer: Any, worker: Worker) -> None:
    designer.controller.begin_study("template:viscosity-jnd", "thicker")
    designer.place.pane.show_tab("file")
    qtbot.waitUntil(lambda: bool(worker.orders))
    assert not worker.orders[-1].power
    designer.place.pane.show_tab("measures")
    qtbot.waitUntil(lambda: worker.orders[-1].power)


@pytest.mark.parametrize("starts", [True, False])
def test_a_failed_simulation_states_the_reason(qtbot: Any, designer: Any, worker: Worker, starts: bool) -> None:
    def fail() -> Any:
        raise OSError

    if not starts:
        designer.controller.measures.make = fail
    open_viscosity_block(designer)
    progress = designer.place.measures.power.progress
    if starts:
        qtbot.waitUntil(lambda: bool(worker.orders))
        worker.pending_answers.append((1, Crashed(1)))
        sentence = "The process ended with exit code 1; the terminal may show why."
    else:
        sentence = "The simulation process could not be started."
    qtbot.waitUntil(lambda: progress.text() == sentence)
    designer.controller.measures.make = lambda: worker
    designer.editing.make_step("Change", Set(("methods", "adaptive", "trials"), 60))
    qtbot.waitUntil(lambda: progress.text() == WAITING)


def test_numbers_of_a_broken_study_are_of_its_last_valid_state(qtbot: Any, designer: Any, worker: Worker) -> None:
    open_viscosity_block(designer)
    page = designer.place.measures
    qtbot.waitUntil(lambda: bool(worker.orders))
    worker.answer()
    qtbot.waitUntil(page.power.table.isVisible)
    cards = page.grid.cards
    designer.editing.handle_request(RetypeFile(designer.text.replace("[study]", "[study")))
    qtbot.waitUntil(page.earlier.isVisible)
    assert page.grid.cards == cards
    assert not page.grid.isEnabled()
    assert page.power.table.isVisible()
    designer.editing.undo()
    qtbot.waitUntil(lambda: not page.earlier.isVisible())
    assert page.grid.isEnabled()


def test_a_screen_reader_hears_each_count_of_the_balance(qtbot: Any, designer: Any, worker: Worker) -> None:
    designer.open()
    designer.editing.select(("blocks", "liquids"))
    designer.place.pane.show_tab("measures")

    def has_counts() -> bool:
        names = [part.accessibleName() for part in designer.place.measures.findChildren(QWidget)]
        return any("1, position 1: " in name and name.endswith(" times") for name in names)

    qtbot.waitUntil(has_counts)


def test_the_preregistration_of_the_saved_study_is_written_with_its_power(
    qtbot: Any, designer: Any, worker: Worker
) -> None:
    open_viscosity_block(designer)
    write = designer.place.measures.power.preregister
    write.click()
    assert designer.messages.pop()[1] == "It describes the saved study. Save the study first."
    designer.saving.save()
    write.click()
    written = designer.messages.pop()[1]
    assert "does not include a power analysis" in written
    assert "Register this text before the first session." in written
    file = designer.results / "thicker" / "preregistration.md"
    before = file.read_text(encoding="utf-8")
    assert before == preregistration_of(str(designer.editing.opened.file))
    qtbot.waitUntil(lambda: bool(worker.orders))
    worker.answer()
    qtbot.waitUntil(lambda: not designer.place.measures.power.progress.isVisible())
    write.click()
    assert file.read_text(encoding="utf-8") == before, "another text is replaced only after a question"
    designer.place.prompt.confirm.click()
    assert "| 12 | 80% |" in file.read_text(encoding="utf-8")
    (file.parent / "data" / "sub-P001" / "ses-01").mkdir(parents=True)
    file.write_bytes(b"\xff another program's text")
    write.click()
    prompt_text = " ".join(label.text() for label in designer.place.prompt.findChildren(QLabel))
    assert f"{file} differs from the text generated" in prompt_text
    assert "already has 1 session; the text cannot preregister data that already exist" in prompt_text
    designer.place.prompt.confirm.click()
    written = designer.messages.pop()[1]
    assert "The study already has 1 session" in written
    assert "before the first session" not in written


def test_a_preregistration_can_be_opened_and_is_compared_with_the_saved_study(
    qtbot: Any, designer: Any, worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_viscosity_block(designer)
    designer.saving.save()
    power, files = designer.place.measures.power, list[Path]()
    power.preregister.click()
    monkeypatch.setattr(main_window, "open_here", files.append)
    buttons = {button.text(): button for button in designer.window.notice.findChildren(ActionButton)}
    buttons["Open the file"].click()
    assert files == [designer.results / "thicker" / "preregistration.md"]
    designer.editing.make_step("Change", Set(("methods", "adaptive", "trials"), 70))
    qtbot.wait(50)
    assert not power.changed.isVisible()  # it is the saved study that was preregistered
    designer.saving.save()
    qtbot.waitUntil(power.changed.isVisible)
    assert power.changed.text() == "The study has changed since it was preregistered."
    designer.editing.undo()
    designer.saving.save()
    qtbot.waitUntil(lambda: not power.changed.isVisible())


def test_trials_that_would_be_lost_are_shown_above_the_power(qtbot: Any, designer: Any, worker: Worker) -> None:
    open_viscosity_block(designer)
    lost = designer.place.measures.power.lost
    qtbot.waitUntil(lambda: bool(worker.orders))
    assert not lost.isVisible()
    worker.pending_answers.append((1, Simulated(lost=("4 of 4 trials would not be delivered",), waiting=WAITING)))
    qtbot.waitUntil(lost.isVisible)
    assert lost.text() == "4 of 4 trials would not be delivered."


def test_cards_fill_two_columns_and_a_wide_or_last_one_takes_both(qtbot: Any) -> None:
    grid = CardGrid(lambda _path: None)
    qtbot.addWidget(grid)
    for titles, places in (
        ("abCd", {"a": (0, 0, 1, 1), "b": (0, 1, 1, 1), "C": (1, 0, 1, 2), "d": (2, 0, 1, 2)}),
        ("aCbD", {"C": (0, 0, 1, 2), "a": (1, 0, 1, 1), "b": (1, 1, 1, 1), "D": (2, 0, 1, 2)}),
    ):
        before = {part.shown.title: part for part in grid.parts}
        grid.show_cards(tuple(MeasureCard(title, wide=title.isupper()) for title in titles))
        parts = {part.shown.title: part for part in grid.parts}
        assert {title: grid.grid.getItemPosition(grid.grid.indexOf(part)) for title, part in parts.items()} == places
        assert not any(grid.grid.rowStretch(row) for row, *_ in places.values())
    assert (parts["a"], parts["C"] is before["C"]) == (before["a"], False), "the same card at the same place is kept"


def test_a_process_that_has_ended_is_replaced_and_a_late_answer_is_ignored(
    qtbot: Any, designer: Any, worker: Worker
) -> None:
    open_viscosity_block(designer)
    power = designer.place.measures.power
    qtbot.waitUntil(lambda: bool(worker.orders))
    worker.works, second = False, Worker()
    designer.controller.measures.make = lambda: second
    designer.editing.make_step("Change", Set(("methods", "adaptive", "trials"), 60))
    qtbot.waitUntil(lambda: bool(second.orders))
    assert second.orders[0].protocol.methods["adaptive"].trials == 60
    second.answer()
    second.pending_answers += [(7, Simulated(table="the answer to another order"))]
    qtbot.waitUntil(lambda: not power.progress.isVisible())
    assert "| 12 | 80% |" in power.table.text()
    designer.controller.begin_study("template:delay-detection", "later")
    designer.place.pane.show_tab("measures")
    qtbot.waitUntil(lambda: len(second.orders) == 2)
    qtbot.waitUntil(lambda: power.progress.text() == WAITING)
    assert not power.table.isVisible(), "the numbers of the other study are forgotten"
