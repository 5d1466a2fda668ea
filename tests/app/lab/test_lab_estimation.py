"""The lab with its real page, servo and device: values estimated, presets that are saved."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.app.failures import Patience
from study_app.app.lab_controller import LabController
from study_app.lab.ab_comparison import Setting
from study_app.lab.presets import save
from tests.app.lab.worlds import OPENS_MS, SOON_MS, Prices
from tests.compiled import needs_servo
from tests.lab.estimation.measured import WATER, planted

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp")]


@pytest.fixture
def lab(visit: LabController, qtbot: Any) -> LabController:
    """The lab entered, water selected, a planted water as B, going in circles."""
    other = planted(drag=0.42, length=1700, scaling=1700)
    visit.bench = visit.bench.choose("A", "Water", WATER).choose("B", "Planted", other)
    visit.place.show()
    qtbot.waitUntil(lambda: visit.live is not None, timeout=OPENS_MS)
    visit.place.ask("path", "circle")
    return visit


def drag(visit: LabController) -> float:
    return float(visit.bench.setting("A").value("body.drag_coefficient"))  # type: ignore[arg-type]


def test_an_estimate_is_shown_applied_on_a_click_and_taken_back(lab: LabController, qtbot: Any) -> None:
    lab.place.ask("source", None, "other")
    assert lab.view().estimate.message
    qtbot.waitUntil(lambda: lab.view().estimate.may_apply, timeout=OPENS_MS)
    (row,) = lab.view().estimate.rows
    assert row.name == "Drag coefficient"
    assert 0.40 < float(row.value) < 0.44
    assert drag(lab) == Setting("Water", WATER, WATER).value("body.drag_coefficient")
    lab.place.estimate.apply.click()
    assert drag(lab) == pytest.approx(0.42, rel=0.03)
    lab.place.ask("undo")
    assert drag(lab) == pytest.approx(0.47)


def test_it_follows_until_the_place_is_left(lab: LabController, qtbot: Any) -> None:
    lab.place.ask("source", None, "other")
    qtbot.waitUntil(lambda: lab.view().estimate.may_follow, timeout=OPENS_MS)
    lab.place.ask("follow", True)
    qtbot.waitUntil(lambda: drag(lab) == pytest.approx(0.42, rel=0.03), timeout=SOON_MS)
    assert lab.view().estimate.follows
    assert lab.live is not None
    assert lab.live.shadow.differing == 0
    lab.place.hide()
    assert lab.estimation.estimation is None
    assert lab.view().estimate.source == "off"


def test_a_file_that_cannot_be_read_is_said_in_the_card(lab: LabController, qtbot: Any, tmp_path: Path) -> None:
    lab.place.ask("source", tmp_path / "none.csv", "file")
    qtbot.waitUntil(lambda: "none.csv" in lab.view().estimate.message, timeout=OPENS_MS)
    assert lab.view().estimate.source == "off"
    assert lab.trouble == ""
    assert lab.live is not None


def test_no_price_is_no_reason_to_stop(make_lab: Callable[..., LabController], qtbot: Any) -> None:
    def nobody() -> Prices:
        raise OSError("no more processes")

    visit = make_lab(make_appraiser=nobody)
    visit.place.show()
    qtbot.waitUntil(lambda: visit.live is not None, timeout=OPENS_MS)
    qtbot.waitUntil(lambda: not visit.view().measuring, timeout=SOON_MS)
    assert visit.live is not None
    assert visit.view().trouble == ""


def test_a_preset_is_on_the_disk_before_the_program_ends(
    visit: LabController, monkeypatch: Any, tmp_path: Path
) -> None:
    ended = threading.Event()

    written = []

    def slowly(path: Path, text: str) -> None:
        if path.name == "one.toml":
            ended.wait(30.0)
        save(path, text)
        written.append(path.name)

    monkeypatch.setattr("study_app.app.lab_controller.save", slowly)
    for name in ("one.toml", "two.toml"):
        visit.place.ask("save", tmp_path / name, visit.bench.a)
    assert not list(tmp_path.iterdir())
    threading.Timer(0.05, ended.set).start()
    visit.end(Patience(20.0))
    assert written == ["one.toml", "two.toml"], "in the order in which they were saved"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.toml", "two.toml"]
    assert str(tmp_path / "two.toml") in [it.source for it in visit.liquids]
