"""The estimation in the lab with its real page, servo and device: from the choice of a source to the applied value."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from study_app.app.lab.controller import LabController
from study_app.lab.ab_comparison import Setting
from tests.app.lab.worlds import OPENS_MS, SOON_MS
from tests.compiled import needs_servo
from tests.lab.estimation.measured import WATER, planted

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp")]


@pytest.fixture
def beside(visit: LabController, qtbot: Any) -> LabController:
    """The lab entered, water felt beside a planted water, going in circles."""
    other = planted(drag=0.42, length=1700, scaling=1700)
    visit.bench = visit.bench.choose("A", "Water", WATER).choose("B", "Planted", other)
    visit.place.show()
    qtbot.waitUntil(lambda: visit.live is not None, timeout=OPENS_MS)
    visit.place.path_chosen.emit("circle")
    return visit


def drag(visit: LabController) -> float:
    return float(visit.bench.setting("A").value("body.drag_coefficient"))  # type: ignore[arg-type]


def test_an_estimate_is_shown_applied_on_a_click_and_taken_back(beside: LabController, qtbot: Any) -> None:
    beside.place.estimate_source_chosen.emit("other", None)
    assert beside.view().estimate.message
    qtbot.waitUntil(lambda: beside.view().estimate.may_apply, timeout=OPENS_MS)
    (row,) = beside.view().estimate.rows
    assert row.name == "Drag coefficient"
    assert 0.40 < float(row.value) < 0.44
    assert drag(beside) == Setting("Water", WATER, WATER).value("body.drag_coefficient")
    beside.place.estimate.apply.click()
    assert drag(beside) == pytest.approx(0.42, rel=0.03)
    beside.place.undo_asked.emit()
    assert drag(beside) == pytest.approx(0.47)


def test_it_follows_until_the_place_is_left(beside: LabController, qtbot: Any) -> None:
    beside.place.estimate_source_chosen.emit("other", None)
    qtbot.waitUntil(lambda: beside.view().estimate.may_follow, timeout=OPENS_MS)
    beside.place.estimate_follow_asked.emit(True)
    qtbot.waitUntil(lambda: drag(beside) == pytest.approx(0.42, rel=0.03), timeout=SOON_MS)
    assert beside.view().estimate.follows
    assert beside.live is not None
    assert beside.live.shadow.differing == 0
    beside.place.hide()
    assert beside.estimation.estimation is None
    assert beside.view().estimate.source == "off"


def test_a_file_that_cannot_be_read_is_said_in_the_card(beside: LabController, qtbot: Any, tmp_path: Path) -> None:
    beside.place.estimate_source_chosen.emit("file", tmp_path / "none.csv")
    qtbot.waitUntil(lambda: "none.csv" in beside.view().estimate.message, timeout=OPENS_MS)
    assert beside.view().estimate.source == "off"
    assert beside.trouble == ""
    assert beside.live is not None


def test_a_value_that_the_setting_refuses_is_said_and_the_force_goes_on(
    beside: LabController, qtbot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside.place.estimate_source_chosen.emit("other", None)
    qtbot.waitUntil(lambda: beside.view().estimate.may_apply, timeout=OPENS_MS)
    estimation = beside.estimation.estimation
    assert estimation is not None
    monkeypatch.setattr(type(estimation), "applied", lambda _self, bench: bench.change("body.drag_coefficient", -1.0))
    beside.place.estimate_apply_asked.emit()
    assert "Not applied: " in beside.view().estimate.message
    assert beside.live is not None
    assert beside.live.servo.force_is_on
    assert drag(beside) == pytest.approx(0.47)
