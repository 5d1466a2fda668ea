"""The liquid lab with its real place, servo and hand: felt, blinded, priced, and never left with a force on."""

from __future__ import annotations

import sys
import threading
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication, QMainWindow

from study_app.app.lab.controller import LabController, compose_lab
from study_app.app.lab.device_opening import LabOpening
from study_app.errors import DeviceNotFound, ServoFault
from study_app.evaluation.appraisal import Costs, EffectCost, Errors
from study_app.evaluation.appraisal_worker import Told
from study_app.gui.lab.view import LabPlace
from study_app.haptics.model.scene import Scene
from study_app.lab.presets import Choice, save
from study_app.protocol.load import load, load_scene, source_bytes
from tests.compiled import needs_servo

pytestmark = [needs_servo, pytest.mark.usefixtures("qapp")]

OPENS_MS = 120_000  # the first time it compiles
SOON_MS = 20_000
COSTS = Costs(160.0, 60.0, (EffectCost("drag", 10.0), EffectCost("history", None, "not asked for")))
ERRORS = Errors(2e-15, 1e-12, 0.0095, ())


class Prices:
    """Answers when told to."""

    def __init__(self) -> None:
        self.asked: list[Scene] = []
        self.told: list[Told] = []
        self.works, self.closed = True, False

    def ask(self, scene: Scene) -> int:
        self.asked.append(scene)
        return len(self.asked)

    def answers(self) -> list[Told]:
        told, self.told = self.told, []
        return told

    def close(self) -> None:
        self.closed = True


class Stays:
    """Draws that exchange nothing."""

    def random(self) -> float:
        return 0.9


@pytest.fixture
def prices() -> Prices:
    return Prices()


@pytest.fixture
def visit(qtbot: Any, prices: Prices) -> Iterator[LabController]:
    """A lab that was not entered yet, with a hand that moves by itself."""
    place = LabPlace()
    place.resize(1300, 800)
    made = LabController(place, make_appraiser=lambda: prices)
    made.device = "scripted"
    yield made
    made.end()
    place.close()
    place.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def felt(visit: LabController, qtbot: Any) -> LabController:
    """The lab entered, honey in the hand, going in circles: a force for as long as nobody stops it."""
    visit.bench = visit.bench.choose("A", "Honey", load_scene("rek2024", "honey"))
    visit.place.show()
    qtbot.waitUntil(lambda: visit.live is not None, timeout=OPENS_MS)
    visit.place.path_chosen.emit("circle")
    qtbot.waitUntil(lambda: force_n(visit) > 0.3, timeout=SOON_MS)
    return visit


def force_n(visit: LabController) -> float:
    """Return the size of the force that was sent last [N]."""
    assert visit.live is not None
    latest = visit.live.servo.telemetry.latest()
    return 0.0 if latest is None else float(np.linalg.norm(latest.device_force_n))


def held_n(live: Any) -> float:
    """Return the size of the force that the device holds [N]."""
    return float(np.linalg.norm(live.device._state.handle.force_n))


def is_let_go(live: Any) -> bool:
    return held_n(live) == 0.0 and not live.servo._loop.live


def test_entering_opens_and_feels_and_leaving_lets_go_of_everything(
    felt: LabController, prices: Prices, qtbot: Any
) -> None:
    live = felt.live
    assert live is not None
    assert sys.excepthook == felt.uncaught.hook
    qtbot.waitUntil(lambda: bool(prices.asked), timeout=SOON_MS)
    view = felt.view()
    assert (view.busy, view.trouble, view.force_on, view.path) == ("", "", True, "circle")
    assert view.trace is not None
    assert view.now is not None
    assert live.shadow.differing == 0
    felt.place.hide()
    assert is_let_go(live)
    assert felt.live is None
    assert prices.closed
    assert sys.excepthook != felt.uncaught.hook
    assert not felt._frames.isActive()


def test_a_servo_that_does_not_end_is_told_of_as_the_place_is_left(
    felt: LabController, prices: Prices, qtbot: Any, monkeypatch: Any, caplog: Any
) -> None:
    live = felt.live
    assert live is not None
    qtbot.waitUntil(lambda: bool(prices.asked), timeout=SOON_MS)
    stop = live.servo.stop

    def stuck() -> None:
        stop()
        raise ServoFault("the servo is stuck: switch the device off")

    monkeypatch.setattr(live.servo, "stop", stuck)
    told: list[tuple[str, str]] = []
    felt.place.told.connect(lambda *words: told.append(words))
    felt.place.hide()
    assert [sentence for _, sentence in told] == ["the servo is stuck: switch the device off."]
    assert prices.closed
    assert felt.live is None
    caplog.clear()


def test_coming_back_opens_it_again(felt: LabController, qtbot: Any) -> None:
    felt.place.hide()
    felt.place.show()
    qtbot.waitUntil(lambda: felt.live is not None and felt.live.trace() is not None, timeout=OPENS_MS)
    assert felt.view().workbench.a.name == "Honey"


def test_closing_the_window_ends_in_zero_force(felt: LabController) -> None:
    live = felt.live
    felt.place.close()
    assert is_let_go(live)


def test_what_is_edited_is_presented_and_what_is_refused_is_said(felt: LabController, qtbot: Any) -> None:
    assert felt.live is not None
    telemetry = felt.live.servo.telemetry
    before = telemetry.latest().scene
    for k in range(5):
        felt.place.changed.emit("liquid.density_kg_m3", 1300.0 - k, True)
    felt.place.changed.emit("liquid.density_kg_m3", 1200.0, False)
    qtbot.waitUntil(lambda: felt.live.due_in_s is None and telemetry.latest().scene > before, timeout=SOON_MS)
    assert felt.live._felt is not None
    assert felt.live._felt.a.scene.liquids[0].density_kg_m3 == 1200.0
    felt.place.changed.emit("liquid.density_kg_m3", -5.0, False)
    refused = felt.view().refused
    assert refused is not None
    assert refused[0] == "liquid.density_kg_m3"
    assert "must be 1 kg/m³ to 25000 kg/m³" in refused[1]
    felt.place.undo_asked.emit()
    assert felt.view().refused is None
    assert felt.bench.a.scene.liquids[0].density_kg_m3 == 1400.0
    felt.place.redo_asked.emit()
    assert felt.bench.a.scene.liquids[0].density_kg_m3 == 1200.0
    assert felt.live is not None


def test_switching_choosing_and_copying(felt: LabController, qtbot: Any) -> None:
    felt.place.switched.emit()
    assert felt.view().felt == "B"
    felt.place.liquid_chosen.emit("B", Choice("rek2024", "syrup", "Syrup"))
    assert felt.bench.b.name == "Syrup"
    felt.place.copied.emit()
    assert felt.bench.a == felt.bench.b
    felt.place.liquid_chosen.emit("B", Choice("rek2024", "treacle", "Treacle"))
    assert "there is no liquid" in felt.view().trouble
    assert felt.live is not None  # nothing was changed


def test_the_force_stops_at_once_and_fades_in_again(felt: LabController, qtbot: Any) -> None:
    felt.place.stop_asked.emit()
    qtbot.waitUntil(lambda: force_n(felt) == 0.0, timeout=SOON_MS)
    assert not felt.view().force_on
    felt.place.switched.emit()
    felt.place.switched.emit()
    assert not felt.view().force_on
    felt.place.fade_in_asked.emit()
    qtbot.waitUntil(lambda: force_n(felt) > 0.3, timeout=SOON_MS)


def test_an_exception_in_a_slot_ends_in_zero_force_and_words(felt: LabController, qtbot: Any, caplog: Any) -> None:
    live = felt.live
    assert live is not None

    def broken() -> None:
        raise RuntimeError("out of ideas")

    live.poll = broken  # type: ignore[method-assign]
    qtbot.waitUntil(lambda: felt.live is None, timeout=SOON_MS)
    assert is_let_go(live)
    view = felt.view()
    assert view.trouble == "RuntimeError: out of ideas; the force is off"
    assert not view.force_on
    assert view.may_fade_in
    caplog.clear()  # it is written down once, with its trace
    felt.place.fade_in_asked.emit()
    qtbot.waitUntil(lambda: felt.live is not None, timeout=OPENS_MS)
    assert felt.view().trouble == ""


def test_an_exception_in_painting_ends_in_zero_force(felt: LabController, caplog: Any) -> None:
    live, seen = felt.live, []
    felt.uncaught.previous = lambda *told: seen.append(told)
    sys.excepthook(RuntimeError, RuntimeError("in a paint event"), None)
    assert is_let_go(live)
    assert len(seen) == 1
    caplog.clear()
    felt.uncaught.previous = sys.__excepthook__


def test_a_painter_that_an_exception_leaves_at_work_is_ended(felt: LabController, qtbot: Any, caplog: Any) -> None:
    """Else Qt paints no window any more: what failed could not even be read."""
    window = QMainWindow()  # Qt paints it without a detour through Python, as it does the operator's
    window.setCentralWidget(felt.place)
    window.show()
    qtbot.waitUntil(lambda: felt.live is not None, timeout=OPENS_MS)
    live, left, told = felt.live, [], []
    felt.uncaught.previous = lambda kind, error, trace: told.append((kind, error, trace))

    def broken(painter: Any, _places: Any) -> None:
        left.append(weakref.ref(painter))
        raise RuntimeError("in a paint event")

    felt.place.tank._paint_words = broken  # type: ignore[method-assign]
    qtbot.waitUntil(lambda: bool(told), timeout=SOON_MS)
    del felt.place.tank._paint_words
    assert is_let_go(live)
    assert told[0][0] is RuntimeError
    assert [painter() for painter in left] == [None] * len(left)
    caplog.clear()
    felt.uncaught.previous = sys.__excepthook__
    felt.place.setParent(None)
    window.close()


def test_a_lost_device_is_told_and_can_be_opened_again(felt: LabController, qtbot: Any) -> None:
    live = felt.live
    assert live is not None
    live.device.unplug()  # type: ignore[attr-defined]
    qtbot.waitUntil(lambda: "stopped answering" in felt.view().trouble, timeout=SOON_MS)
    assert not felt.view().force_on
    felt.place.fade_in_asked.emit()
    qtbot.waitUntil(lambda: felt.live is not None and felt.live is not live, timeout=OPENS_MS)
    assert is_let_go(live)
    assert felt.view().trouble == ""


def test_while_blind_nothing_tells_one_from_the_other(felt: LabController, qtbot: Any, tmp_path: Path) -> None:
    """Though nothing is exchanged, what is felt begins anew: a hand that felt no fade would know."""
    felt._chance = Stays()
    small = felt.bench.change("body.diameter_m", 0.02)
    felt._feel(small)
    assert felt.live is not None
    assert felt.view().body_radius_m == pytest.approx(0.001)
    qtbot.waitUntil(lambda: felt.live.due_in_s is None, timeout=SOON_MS)
    before = felt.live.servo._serial  # the scene that was asked for last, though no tick may have taken it yet
    felt.place.blind_asked.emit(True)
    qtbot.waitUntil(lambda: felt.live.servo.telemetry.latest().scene > before, timeout=SOON_MS)
    view = felt.view()
    assert view.workbench.blind
    assert view.felt == "A"
    assert view.body_radius_m == pytest.approx(0.0034)
    felt.place.switched.emit()
    felt.place.save_asked.emit(tmp_path / "told.toml", felt.bench.a)
    assert "blind" in felt.view().trouble
    assert not list(tmp_path.iterdir())
    felt.place.blind_asked.emit(False)
    assert not felt.view().workbench.blind


def test_a_setting_is_saved_as_a_preset_that_is_at_hand_from_then_on(
    felt: LabController, qtbot: Any, tmp_path: Path
) -> None:
    felt.place.changed.emit("liquid.density_kg_m3", 1234.5, False)
    path = tmp_path / "mine.toml"
    asked = felt.bench.in_hand
    felt.place.switched.emit()
    felt.place.save_asked.emit(path, asked)
    qtbot.waitUntil(lambda: any(it.source == str(path) for it in felt.liquids), timeout=SOON_MS)
    assert load_scene(path, "honey") == felt.bench.a.scene
    felt.place.save_asked.emit(tmp_path / "nowhere" / "mine.toml", asked)
    qtbot.waitUntil(lambda: "cannot be written" in felt.view().trouble, timeout=SOON_MS)
    assert felt.live is not None


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
    felt.place.use_asked.emit(study, felt.bench.in_hand)
    qtbot.waitUntil(lambda: felt.view().said.startswith("Added to study.toml as [liquids.syrup]"), timeout=SOON_MS)
    assert load(study).scene_of("syrup").liquids[0].density_kg_m3 == 1234.5
    assert sorted(path.name for path in tmp_path.glob("*.toml")) == ["study.toml", "syrup.toml"]
    (tmp_path / "broken.toml").write_text("format = 1")
    felt.place.preset_opened.emit(tmp_path / "broken.toml")
    assert "broken.toml" in felt.view().trouble
    assert felt.live is not None


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
    visit.end()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.toml", "two.toml"]
    assert str(tmp_path / "two.toml") in [it.source for it in visit.liquids]


def test_an_appraiser_that_died_is_not_waited_for(felt: LabController, prices: Prices, qtbot: Any) -> None:
    qtbot.waitUntil(lambda: bool(prices.asked), timeout=SOON_MS)
    assert felt.view().measuring
    prices.works = False
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


def test_no_price_is_no_reason_to_stop(visit: LabController, qtbot: Any) -> None:
    def nobody() -> Prices:
        raise OSError("no more processes")

    visit._prices._make = nobody
    visit.place.show()
    qtbot.waitUntil(lambda: visit.live is not None, timeout=OPENS_MS)
    qtbot.waitUntil(lambda: not visit._price_due.isActive(), timeout=SOON_MS)
    assert visit.live is not None
    assert visit.view().trouble == ""


class SlowDevices:
    """Opens nothing before it is let."""

    def __init__(self) -> None:
        self.open, self.closed, self.asked = 0, 0, []
        self.most = 0
        self.gate = threading.Event()

    def __call__(self, name: str, *, tell: Any, cancelled: Any) -> Any:
        self.asked.append(name)
        self.open += 1
        self.most = max(self.most, self.open)
        tell(f"switch {name} on")
        self.gate.wait(30.0)
        return self

    def close(self) -> None:
        self.open -= 1
        self.closed += 1


def test_what_is_being_opened_can_be_cancelled_and_is_let_go_of(qtbot: Any) -> None:
    devices = SlowDevices()
    opening = LabOpening(devices)
    said: list[str] = []
    opening.said.connect(said.append)
    opening.want("falcon")
    qtbot.waitUntil(lambda: said == ["switch falcon on"], timeout=SOON_MS)
    assert opening.busy_with == "falcon"
    opening.cancel()
    assert opening.busy_with is None
    devices.gate.set()
    opening.wait()
    assert (devices.open, devices.closed) == (0, 1)


def test_two_devices_are_never_opened_at_a_time(qtbot: Any) -> None:
    devices = SlowDevices()
    opening = LabOpening(devices)
    opened: list[Any] = []
    opening.opened.connect(opened.append)
    opening.want("falcon")
    qtbot.waitUntil(lambda: devices.asked == ["falcon"], timeout=SOON_MS)
    opening.want("spacemouse")
    opening.want("mouse")
    devices.gate.set()
    qtbot.waitUntil(lambda: bool(opened), timeout=SOON_MS)
    assert devices.asked == ["falcon", "mouse"]
    assert (devices.most, devices.open, devices.closed) == (1, 1, 1)


def test_leaving_while_a_device_is_being_opened_lets_go_of_it(visit: LabController, qtbot: Any) -> None:
    devices = SlowDevices()
    visit._opening._open_live = devices
    visit.place.show()
    qtbot.waitUntil(lambda: devices.asked == ["scripted"], timeout=SOON_MS)
    qtbot.waitUntil(lambda: visit.view().busy == "switch scripted on", timeout=SOON_MS)
    visit.place.hide()
    devices.gate.set()
    visit.end()
    assert (devices.open, devices.closed) == (0, 1)
    assert visit.live is None


def test_a_force_that_was_stopped_does_not_come_with_a_device_that_is_being_opened(
    visit: LabController, qtbot: Any
) -> None:
    devices = SlowDevices()
    visit._opening._open_live = devices
    visit.place.show()
    qtbot.waitUntil(lambda: devices.asked == ["scripted"], timeout=SOON_MS)
    visit.place.stop_asked.emit()
    devices.gate.set()
    qtbot.waitUntil(lambda: devices.closed == 1, timeout=SOON_MS)
    assert visit.live is None
    view = visit.view()
    assert (view.busy, view.trouble, view.may_fade_in) == ("", "No device is open", True)
    visit.place.changed.emit("liquid.density_kg_m3", 900.0, False)
    assert visit.view().trouble == "No device is open"  # an edit opens none


def test_a_failure_gives_up_the_device_that_is_being_opened(visit: LabController, qtbot: Any, caplog: Any) -> None:
    devices = SlowDevices()
    visit._opening._open_live = devices
    visit.place.show()
    qtbot.waitUntil(lambda: devices.asked == ["scripted"], timeout=SOON_MS)
    visit.fail(RuntimeError("out of ideas"))
    caplog.clear()
    devices.gate.set()
    qtbot.waitUntil(lambda: devices.closed == 1, timeout=SOON_MS)
    assert visit.live is None
    assert "the force is off" in visit.view().trouble


def test_a_device_that_cannot_be_closed_is_told_of_and_holds_nobody_up(qtbot: Any) -> None:
    class Stuck(SlowDevices):
        def close(self) -> None:
            super().close()
            raise ServoFault("the servo is stuck: switch it off")

    devices = Stuck()
    opening = LabOpening(devices)
    failed: list[Exception] = []
    opened: list[Any] = []
    opening.failed.connect(failed.append)
    opening.opened.connect(opened.append)
    opening.want("falcon")
    opening.want("mouse")
    devices.gate.set()
    qtbot.waitUntil(lambda: bool(opened), timeout=SOON_MS)
    assert [str(error) for error in failed] == ["the servo is stuck: switch it off"]


def test_a_device_that_is_not_there_is_told(visit: LabController, qtbot: Any) -> None:
    def nothing(name: str, **_: Any) -> Any:
        raise DeviceNotFound(f"no {name} is plugged in")

    visit._opening._open_live = nothing
    visit.place.show()
    qtbot.waitUntil(lambda: visit.view().trouble == "no scripted is plugged in", timeout=SOON_MS)
    view = visit.view()
    assert not view.force_on
    assert not view.device.ready


def test_the_pointer_moves_the_ball(visit: LabController, qtbot: Any) -> None:
    visit.device = "mouse"
    visit.place.show()
    qtbot.waitUntil(lambda: visit.live is not None, timeout=OPENS_MS)
    visit.place.hand_moved.emit(0.02, 0.01, -0.01)
    visit.place.hand_pressed.emit(1)

    def is_there() -> bool:
        now = visit.view().now
        return now is not None and now.position_m == pytest.approx((0.02, 0.01, -0.01), abs=2e-3)

    qtbot.waitUntil(is_there, timeout=SOON_MS)
    assert visit.live is not None
    assert visit.live.servo.telemetry.latest().buttons == 1


def test_composing_begins_with_the_thesis_liquids(qtbot: Any) -> None:
    place = LabPlace()
    qtbot.addWidget(place)
    made = compose_lab(place)
    assert (made.bench.a.name, made.bench.b.name) == ("Water", "Light oil")
    assert made.live is None
