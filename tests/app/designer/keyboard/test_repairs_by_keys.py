"""Problems by keys alone: F8 goes to the repair of a problem, Enter makes it and goes to the next repair."""

from typing import Any

import pytest
from PySide6.QtCore import Qt

from study_app.gui.designer.repair_button import RepairButton

pytestmark = pytest.mark.slow

KEY = Qt.Key


@pytest.fixture
def broken(qtbot: Any, designer: Any) -> Any:
    """The study with two problems, whose repairs were found."""
    text = designer.file.read_text()
    assert text.count('liquid = "thick"') == 1
    designer.file.write_text(
        text.replace('liquid = "thick"', 'liquid = "thik"').replace("force_limit_n = 6", "force_limit_n = 60")
    )
    designer.open()
    found = designer.place.problems
    qtbot.waitUntil(lambda: len(found.lines) == 2 and all(line.repairs for line in found.lines))
    designer.place.outline.tree.setFocus()
    return designer


@pytest.mark.parametrize(("width", "side"), [(1600, "form"), (1024, "pane")])
def test_enter_alone_makes_every_repair(
    qtbot: Any, broken: Any, monkeypatch: pytest.MonkeyPatch, width: int, side: str
) -> None:
    monkeypatch.setattr("study_app.app.designer.repair_search.REST_MS", 1_000_000)  # a user does not wait for repairs
    broken.window.resize(width, 768)
    broken.place.parts.show_side(side)
    first, second = broken.place.view.problems
    for problem, key in ((first, "F8"), (second, "Return")):
        repair = broken.hit(key)
        assert isinstance(repair, RepairButton)
        assert repair.problem.fault.path == problem.fault.path
        assert broken.editing.selected == problem.element
        assert broken.form_row(*problem.fault.path).isAncestorOf(repair)
        assert repair.visibleRegion().boundingRect() == repair.rect()
    field = broken.hit("Return")
    assert broken.place.view.problems == ()
    assert broken.form_row(*second.fault.path).isAncestorOf(field), "nothing is left: the field that was repaired"


def test_enter_passes_problems_without_a_repair_and_ends_at_a_field_of_one(qtbot: Any, broken: Any) -> None:
    text = broken.text.replace("delay_ms = 0", 'delay_ms = "a"', 1).replace("min_s = 5 ", 'min_s = "a" ')
    broken.editing.type_text("Break", text)
    first, unclear, second, last = broken.place.view.problems
    assert broken.hit("F8").problem == first
    assert broken.hit("Return").problem.fault == second.fault
    field = broken.hit("Return")
    assert broken.form_row(*last.fault.path).isAncestorOf(field)
    field = broken.hit("F8")
    assert broken.form_row(*unclear.fault.path).isAncestorOf(field), "F8 passes none"
