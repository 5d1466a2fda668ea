"""The lab with its real page, servo and device: values estimated, computation times, presets that are saved."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.app.lab.controller import LabController
from study_app.app.session.termination import Patience
from study_app.lab.ab_comparison import Setting
from study_app.lab.presets import save
from study_app.protocol.load import load, source_bytes
from study_app.workers.messages import Crashed
from tests.app.lab.worlds import COSTS, ERRORS, OPENS_MS, SOON_MS, Prices
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
    visit.place.path_chosen.emit("circle")
    return visit


def drag(visit: LabController) -> float:
    return float(visit.bench.setting("A").value("body.drag_coefficient"))  # type: ignore[arg-type]


def test_an_estimate_is_shown_applied_on_a_click_and_taken_back(lab: LabController, qtbot: Any) -> None:
    lab.place.estimate_source_chosen.emit("other", None)
    assert lab.view().estimate.message
    qtbot.waitUntil(lambda: lab.view().estimate.may_apply, timeout=OPENS_MS)
    (row,) = lab.view().estimate.rows
    assert row.name == "Drag coefficient"
    assert 0.40 < float(row.value) < 0.44
    assert drag(lab) == Setting("Water", WATER, WATER).value("body.drag_coefficient")
    lab.place.estimate.apply.click()
    assert drag(lab) == pytest.approx(0.42, rel=0.03)
    lab.place.undo_asked.emit()
    assert drag(lab) == pytest.approx(0.47)


def test_it_follows_until_the_place_is_left(lab: LabController, qtbot: Any) -> None:
    lab.place.estimate_source_chosen.emit("other", None)
    qtbot.waitUntil(lambda: lab.view().estimate.may_follow, timeout=OPENS_MS)
    lab.place.estimate_follow_asked.emit(True)
    qtbot.waitUntil(lambda: drag(lab) == pytest.approx(0.42, rel=0.03), timeout=SOON_MS)
    assert lab.view().estimate.follows
    assert lab.live is not None
    assert lab.live.shadow.differing == 0
    lab.place.hide()
    assert lab.estimation.estimation is None
    assert lab.view().estimate.source == "off"


def test_a_file_that_cannot_be_read_is_said_in_the_card(lab: LabController, qtbot: Any, tmp_path: Path) -> None:
    lab.place.estimate_source_chosen.emit("file", tmp_path / "none.csv")
    qtbot.waitUntil(lambda: "none.csv" in lab.view().estimate.message, timeout=OPENS_MS)
    assert lab.view().estimate.source == "off"
    assert lab.trouble == ""
    assert lab.live is not None


def test_a_value_that_the_setting_refuses_is_said_and_the_force_goes_on(
    lab: LabController, qtbot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab.place.estimate_source_chosen.emit("other", None)
    qtbot.waitUntil(lambda: lab.view().estimate.may_apply, timeout=OPENS_MS)
    estimation = lab.estimation.estimation
    assert estimation is not None
    monkeypatch.setattr(type(estimation), "applied", lambda _self, bench: bench.change("body.drag_coefficient", -1.0))
    lab.place.estimate_apply_asked.emit()
    assert "Not applied: " in lab.view().estimate.message
    assert lab.live is not None
    assert lab.live.servo.force_is_on
    assert drag(lab) == pytest.approx(0.47)


def test_an_appraiser_that_died_is_not_waited_for(felt: LabController, prices: Prices, qtbot: Any) -> None:
    qtbot.waitUntil(lambda: bool(prices.asked), timeout=SOON_MS)
    assert felt.view().measuring
    prices.works, prices.told = False, [(1, Crashed(-9))]
    qtbot.waitUntil(lambda: not felt.view().measuring, timeout=SOON_MS)


def test_prices_are_asked_for_once_the_hand_rests_and_old_answers_do_not_count(
    felt: LabController, prices: Prices, qtbot: Any
) -> None:
    qtbot.waitUntil(lambda: len(prices.asked) == 1, timeout=SOON_MS)
    for k in range(10):
        felt.place.changed.emit("liquid.density_kg_m3", 1300.0 - k, True)
    assert felt.view().measuring
    qtbot.waitUntil(lambda: len(prices.asked) == 2, timeout=SOON_MS)
    assert prices.asked[1].liquids[0].density_kg_m3 == 1291.0
    prices.told = [(1, COSTS)]
    qtbot.waitUntil(lambda: not prices.told, timeout=SOON_MS)
    assert felt.view().cost == ()
    prices.told = [(2, COSTS), (2, ERRORS)]
    qtbot.waitUntil(lambda: not felt.view().measuring, timeout=SOON_MS)
    view = felt.view()
    assert [(row.effect, row.ns) for row in view.cost] == [("Servo alone", 60.0), ("Drag", 10.0), ("History", None)]
    assert view.tick_ns == 160.0
    assert [row.value for row in view.errors] == ["2e−15", "< 0.001 N", "9.5 ms"]
    felt.place.changed.emit("liquid.density_kg_m3", 900.0, False)
    assert felt.view().cost == ()  # it was the price of something else


def test_no_price_is_no_reason_to_stop(make_lab: Callable[..., LabController], qtbot: Any) -> None:
    def nobody() -> Prices:
        raise OSError("no more processes")

    visit = make_lab(make_appraiser=nobody)
    visit.place.show()
    qtbot.waitUntil(lambda: visit.live is not None, timeout=OPENS_MS)
    qtbot.waitUntil(lambda: not visit.view().measuring, timeout=SOON_MS)
    assert visit.live is not None
    assert visit.view().trouble == ""


def test_a_preset_is_saved_opened_again_and_used_in_a_study(felt: LabController, qtbot: Any, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_bytes(source_bytes("demo"))
    felt.place.changed.emit("liquid.density_kg_m3", 1234.5, False)
    felt.place.save_asked.emit(tmp_path / "syrup.toml", felt.bench.in_hand)
    qtbot.waitUntil(lambda: felt.view().said == f"Saved as syrup.toml in {tmp_path}", timeout=SOON_MS)
    felt.place.undo_asked.emit()
    assert felt.bench.in_hand.scene.liquids[0].density_kg_m3 != 1234.5
    felt.place.preset_opened.emit(tmp_path / "syrup.toml")
    assert felt.bench.in_hand.scene.liquids[0].density_kg_m3 == 1234.5
    assert felt.view().said == "Opened syrup.toml: Honey"
    assert str(tmp_path / "syrup.toml") in [it.source for it in felt.liquids], "at hand from then on"
    felt.place.use_asked.emit(study, felt.bench.in_hand)
    qtbot.waitUntil(lambda: felt.view().said.startswith("Added to study.toml as [liquids.syrup]"), timeout=SOON_MS)
    assert load(study).scene_of("syrup").liquids[0].density_kg_m3 == 1234.5
    assert sorted(path.name for path in tmp_path.glob("*.toml")) == ["study.toml", "syrup.toml"]
    (tmp_path / "broken.toml").write_text("format = 1")
    felt.place.preset_opened.emit(tmp_path / "broken.toml")
    assert "broken.toml" in felt.view().trouble
    felt.place.save_asked.emit(tmp_path / "nowhere" / "mine.toml", felt.bench.in_hand)
    qtbot.waitUntil(lambda: "cannot be written" in felt.view().trouble, timeout=SOON_MS)
    assert felt.live is not None


def test_what_was_refused_is_no_longer_shown_once_a_file_is_written(
    felt: LabController, qtbot: Any, tmp_path: Path
) -> None:
    setting, study = felt.bench.in_hand, tmp_path / "study.toml"
    felt.place.save_asked.emit(tmp_path / "syrup.toml", setting)
    qtbot.waitUntil(lambda: felt.view().said.startswith("Saved as syrup.toml"), timeout=SOON_MS)
    study.write_bytes(source_bytes("demo"))
    for asked, path, said in (
        (felt.place.use_asked, study, "Added to study.toml"),
        (felt.place.save_asked, tmp_path / "again.toml", "Saved as again.toml"),
    ):
        felt.place.use_asked.emit(tmp_path / "syrup.toml", setting)
        qtbot.waitUntil(lambda: "syrup.toml is not a study file" in felt.view().trouble, timeout=SOON_MS)
        asked.emit(path, setting)
        qtbot.waitUntil(lambda said=said: felt.view().said.startswith(said), timeout=SOON_MS)
        assert felt.view().trouble == ""


def test_a_preset_is_on_the_disk_before_the_program_ends(
    visit: LabController, monkeypatch: Any, tmp_path: Path
) -> None:
    ended = threading.Event()

    def slowly(path: Path, text: str) -> None:
        ended.wait(30.0)
        save(path, text)

    monkeypatch.setattr("study_app.app.lab.preset_saving.save", slowly)
    for name in ("one.toml", "two.toml"):
        visit.place.save_asked.emit(tmp_path / name, visit.bench.a)
    assert not list(tmp_path.iterdir())
    threading.Timer(0.05, ended.set).start()
    visit.end(Patience(20.0))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.toml", "two.toml"]
    assert str(tmp_path / "two.toml") in [it.source for it in visit.liquids]
