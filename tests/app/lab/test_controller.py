"""The liquid lab with its real page, servo and device: presented, blinded, and never left with a force."""

import subprocess
import sys
import threading
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtWidgets import QMainWindow

from study_app.app.lab_controller import LabController
from study_app.lab.presets import save_preset
from tests.app.lab.worlds import OPENS_MS, PATIENCE, SOON_MS, Prices, Stays, is_let_go
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp")]


def test_entering_opens_and_feels_and_leaving_lets_go_of_everything(
    running_lab: LabController, prices: Prices, qtbot: Any
) -> None:
    live = running_lab.live
    assert live is not None
    assert sys.excepthook == running_lab.uncaught.handle_exception
    qtbot.waitUntil(lambda: bool(prices.requests), timeout=SOON_MS)
    view = running_lab.view()
    assert (view.busy, view.trouble, view.force_on, view.path) == ("", "", True, "circle")
    assert view.trace is not None
    assert view.now is not None
    assert live.shadow.differing == 0
    running_lab.place.hide()
    assert is_let_go(live)
    assert running_lab.live is None
    assert prices.closed
    assert sys.excepthook != running_lab.uncaught.handle_exception
    assert not running_lab.frames.isActive()
    running_lab.place.show()
    qtbot.waitUntil(lambda: running_lab.live is not None and running_lab.live.trace() is not None, timeout=OPENS_MS)
    assert running_lab.view().workbench.a.name == "Honey"


def test_closing_the_window_ends_in_zero_force(running_lab: LabController) -> None:
    live = running_lab.live
    running_lab.place.close()
    assert is_let_go(live)


def test_an_exception_in_a_slot_ends_in_zero_force_and_words(
    running_lab: LabController, qtbot: Any, caplog: Any
) -> None:
    live = running_lab.live
    assert live is not None

    def broken() -> None:
        raise RuntimeError("out of ideas")

    live.poll = broken  # type: ignore[method-assign]
    qtbot.waitUntil(lambda: running_lab.live is None, timeout=SOON_MS)
    assert is_let_go(live)
    view = running_lab.view()
    assert view.trouble == "RuntimeError: out of ideas; the force is off"
    assert not view.force_on
    assert view.may_fade_in
    caplog.clear()  # it is written down once, with its trace
    running_lab.place.ask("fade in")
    qtbot.waitUntil(lambda: running_lab.live is not None, timeout=OPENS_MS)
    assert running_lab.view().trouble == ""


def test_a_painter_that_an_exception_leaves_at_work_is_ended(
    running_lab: LabController, qtbot: Any, caplog: Any, monkeypatch: Any
) -> None:
    """Otherwise Qt paints no window any more, and the error could not be read."""
    window = QMainWindow()  # Qt paints it without a detour through Python, as it does the operator's
    window.setCentralWidget(running_lab.place)
    window.show()
    qtbot.waitUntil(lambda: running_lab.live is not None, timeout=OPENS_MS)
    live, painters, exceptions = running_lab.live, [], []
    running_lab.uncaught.previous = lambda kind, error, trace: exceptions.append((kind, error, trace))

    def broken(painter: Any, *_arguments: Any, **_named: Any) -> None:
        painters.append(weakref.ref(painter))
        raise RuntimeError("in a paint event")

    with monkeypatch.context() as patched:
        patched.setattr("study_app.gui.lab.lab_tank.sprites.draw_sprite", broken)
        qtbot.waitUntil(lambda: bool(exceptions), timeout=SOON_MS)
    assert is_let_go(live)
    assert exceptions[0][0] is RuntimeError
    assert [painter() for painter in painters] == [None] * len(painters)
    caplog.clear()
    running_lab.uncaught.previous = sys.__excepthook__
    running_lab.place.setParent(None)
    window.close()


def test_a_lost_device_is_reported_and_can_be_reopened(running_lab: LabController, qtbot: Any) -> None:
    live = running_lab.live
    assert live is not None
    live.device.unplug()  # type: ignore[attr-defined]
    qtbot.waitUntil(lambda: "stopped responding" in running_lab.view().trouble, timeout=SOON_MS)
    assert not running_lab.view().force_on
    running_lab.place.ask("diagnose")
    assert (running_lab.live, is_let_go(live)) == (None, True), "the diagnosis needs the device"
    assert running_lab.view().device.state == "stopped"
    assert "stopped responding" in running_lab.view().trouble
    running_lab.place.ask("fade in")
    qtbot.waitUntil(lambda: running_lab.live is not None and running_lab.live is not live, timeout=OPENS_MS)
    assert running_lab.view().trouble == ""


NEVER_ANSWERS = """
import sys, threading
from pathlib import Path
from PySide6.QtCore import QCoreApplication
from study_app.app import lab_controller
from study_app.lab.ab_comparison import Setting
from study_app.protocol.load import load_scene

application, writing = QCoreApplication(), threading.Event()
lab_controller.save_preset = lambda *_written: (writing.set(), threading.Event().wait())
saving, scene = lab_controller._LabSaving(()), load_scene("rek2024", "water")
saving.save_preset(Path("never.toml"), Setting("Water", scene, scene))
assert writing.wait(20)
saving.wait(0.1)
print("ends")
"""


def test_a_preset_for_a_drive_that_never_answers_does_not_keep_the_program_from_ending() -> None:
    program = [sys.executable, "-c", NEVER_ANSWERS]
    ended = subprocess.run(program, capture_output=True, text=True, timeout=30, check=False)
    assert (ended.returncode, ended.stdout) == (0, "ends\n"), ended.stderr


def test_while_blind_nothing_tells_one_from_the_other(running_lab: LabController, qtbot: Any, tmp_path: Path) -> None:
    """The force fades in again even without an exchange; otherwise the hand would notice the difference."""
    running_lab.chance = Stays()
    small = running_lab.bench.change("body.diameter_m", 0.02)
    running_lab.feel_workbench(small)
    assert running_lab.live is not None
    assert running_lab.view().body_radius_m == pytest.approx(0.001)
    qtbot.waitUntil(lambda: running_lab.live.due_in_s is None, timeout=SOON_MS)
    before = running_lab.live.servo.serial  # the scene that was asked for last, though no tick may have taken it yet
    running_lab.place.ask("blind", True)
    qtbot.waitUntil(lambda: running_lab.live.servo.telemetry.latest().scene > before, timeout=SOON_MS)
    view = running_lab.view()
    assert view.workbench.blind
    assert view.felt == "A"
    assert view.body_radius_m == pytest.approx(0.0034)
    running_lab.place.ask("switch")
    running_lab.place.ask("save", tmp_path / "told.toml", running_lab.bench.a)
    assert "blind" in running_lab.view().trouble
    assert not list(tmp_path.iterdir())
    running_lab.place.ask("blind", False)
    assert not running_lab.view().workbench.blind


def test_a_missing_cost_measurement_does_not_stop_the_lab(make_lab: Callable[..., LabController], qtbot: Any) -> None:
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
        save_preset(path, text)
        written.append(path.name)

    monkeypatch.setattr("study_app.app.lab_controller.save_preset", slowly)
    for name in ("one.toml", "two.toml"):
        visit.place.ask("save", tmp_path / name, visit.bench.a)
    assert not list(tmp_path.iterdir())
    threading.Timer(0.05, ended.set).start()
    visit.end(PATIENCE)
    assert written == ["one.toml", "two.toml"], "in the order in which they were saved"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.toml", "two.toml"]
    assert str(tmp_path / "two.toml") in [it.source for it in visit.liquids]
