"""The tab Measures while a part of the study is broken: its numbers stay in grey, the others continue."""

from typing import Any

import pytest

from study_app.authoring.writer.edits import Set
from study_app.viewmodels.designer.measures.number_cards import UNKNOWN
from study_app.viewmodels.designer.requests import RetypeFile
from tests.app.designer.measures.conftest import Worker, jnd, shown

pytestmark = pytest.mark.slow


def test_numbers_of_what_is_broken_stay_in_grey(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    page = designer.place.measures
    qtbot.waitUntil(lambda: bool(worker.orders))
    worker.answer()
    shown(qtbot, designer, 2, "93")
    before = [part.number.text() for part in page.numbers.parts]
    grey, ink = page.theme.text3, lambda part: part.number.palette().color(part.number.foregroundRole()).name().upper()
    designer.editing.make("Break", Set(("tasks", "stir", "frequency_hz"), -1))
    qtbot.waitUntil(page.earlier.isVisible)
    assert [part.number.text() for part in page.numbers.parts] == before
    assert {ink(part) for part in page.numbers.parts} == {grey}
    assert page.function.shown.anew  # drawn in grey, too
    assert "last valid state" in page.earlier.text()
    designer.editing.undo()
    qtbot.waitUntil(lambda: not page.earlier.isVisible())
    designer.editing.ask(RetypeFile(designer.text.replace("[study]", "[study")))
    qtbot.waitUntil(page.earlier.isVisible)
    assert [part.number.text() for part in page.numbers.parts] == before
    designer.editing.undo()
    qtbot.waitUntil(lambda: not page.earlier.isVisible())
    assert grey not in {ink(part) for part in page.numbers.parts}
    assert not page.function.shown.anew


def test_numbers_of_what_is_not_broken_continue(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    facts = designer.place.pane.facts

    def forces() -> list[str]:
        found = [card for card in facts.grid.cards if getattr(card, "title", "") == "Force of each liquid"]
        return [line.number for card in found for line in card.lines]

    designer.editing.select(("blocks", "delays"))
    qtbot.waitUntil(lambda: bool(forces()))
    designer.editing.make("Break", Set(("tasks", "reach", "dwell_s"), -1))
    qtbot.waitUntil(facts.earlier.isVisible)
    assert not facts.grid.isEnabled()
    designer.editing.select(("blocks", "liquids"))
    qtbot.waitUntil(lambda: not facts.earlier.isVisible())
    assert facts.grid.isEnabled()
    before = forces()
    designer.editing.make("Change", Set(("liquids", "thick", "density_kg_m3"), 1700))
    qtbot.waitUntil(lambda: forces() != before)
    designer.editing.undo()
    designer.editing.undo()
    qtbot.waitUntil(lambda: UNKNOWN not in str(facts.grid.cards[0]))
    session = facts.grid.cards[0]
    designer.editing.make("Break", Set(("device", "force_limit_n"), 60))
    qtbot.waitUntil(lambda: set(forces()) == {UNKNOWN})
    assert facts.grid.cards[0] == session  # its length does not depend on the device
    assert not facts.earlier.isVisible()
