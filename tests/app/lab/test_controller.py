"""The liquid lab with its real page, servo and device: felt, blinded, and never left with a force on."""

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
    felt: LabController, prices: Prices, qtbot: Any
) -> None:
    live = felt.live
    assert live is not None
    assert sys.excepthook == felt.uncaught.handle_exception
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
    assert sys.excepthook != felt.uncaught.handle_exception
    assert not felt.frames.isActive()
    felt.place.show()
    qtbot.waitUntil(lambda: felt.live is not None and felt.live.trace() is not None, timeout=OPENS_MS)
    assert felt.view().workbench.a.name == "Honey"


def test_closing_the_window_ends_in_zero_force(felt: LabController) -> None:
    live = felt.live
    felt.place.close()
    assert is_let_go(live)


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
    felt.place.ask("fade in")
    qtbot.waitUntil(lambda: felt.live is not None, timeout=OPENS_MS)
    assert felt.view().trouble == ""


def test_a_painter_that_an_exception_leaves_at_work_is_ended(
    felt: LabController, qtbot: Any, caplog: Any, monkeypatch: Any
) -> None:
    """Else Qt paints no window any more: what failed could not even be read."""
    window = QMainWindow()  # Qt paints it without a detour through Python, as it does the operator's
    window.setCentralWidget(felt.place)
    window.show()
    qtbot.waitUntil(lambda: felt.live is not None, timeout=OPENS_MS)
    live, left, told = felt.live, [], []
    felt.uncaught.previous = lambda kind, error, trace: told.append((kind, error, trace))

    def broken(painter: Any, *_arguments: Any, **_named: Any) -> None:
        left.append(weakref.ref(painter))
        raise RuntimeError("in a paint event")

    with monkeypatch.context() as patched:
        patched.setattr("study_app.gui.lab.lab_tank.sprites.draw_sprite", broken)
        qtbot.waitUntil(lambda: bool(told), timeout=SOON_MS)
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
    qtbot.waitUntil(lambda: "stopped responding" in felt.view().trouble, timeout=SOON_MS)
    assert not felt.view().force_on
    felt.place.ask("diagnose")
    assert (felt.live, is_let_go(live)) == (None, True), "the diagnosis needs the device"
    assert felt.view().device.state == "stopped"
    assert "stopped responding" in felt.view().trouble
    felt.place.ask("fade in")
    qtbot.waitUntil(lambda: felt.live is not None and felt.live is not live, timeout=OPENS_MS)
    assert felt.view().trouble == ""


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


def test_while_blind_nothing_tells_one_from_the_other(felt: LabController, qtbot: Any, tmp_path: Path) -> None:
    """Though nothing is exchanged, what is felt begins anew: a hand that felt no fade would know."""
    felt.chance = Stays()
    small = felt.bench.change("body.diameter_m", 0.02)
    felt.feel_workbench(small)
    assert felt.live is not None
    assert felt.view().body_radius_m == pytest.approx(0.001)
    qtbot.waitUntil(lambda: felt.live.due_in_s is None, timeout=SOON_MS)
    before = felt.live.servo.serial  # the scene that was asked for last, though no tick may have taken it yet
    felt.place.ask("blind", True)
    qtbot.waitUntil(lambda: felt.live.servo.telemetry.latest().scene > before, timeout=SOON_MS)
    view = felt.view()
    assert view.workbench.blind
    assert view.felt == "A"
    assert view.body_radius_m == pytest.approx(0.0034)
    felt.place.ask("switch")
    felt.place.ask("save", tmp_path / "told.toml", felt.bench.a)
    assert "blind" in felt.view().trouble
    assert not list(tmp_path.iterdir())
    felt.place.ask("blind", False)
    assert not felt.view().workbench.blind


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
