"""The lab's estimation on the servo's own telemetry: found, applied, and left alone where it must be."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.lab.ab_comparison import Setting, Workbench
from study_app.lab.estimation.fits import DRAG, NAMES
from study_app.lab.estimation.live_estimation import Chosen, LiveEstimation, set_values
from study_app.lab.live import Live
from tests.compiled import needs_servo
from tests.lab.benches import bench, live_with, scripted
from tests.lab.estimation.measured import WATER, begun, planted

pytestmark = [pytest.mark.slow, needs_servo]

FRAME = 33


@pytest.fixture
def live() -> Any:
    made = live_with(scripted())
    made.feel(pair())
    made.play("circle")
    yield made
    made.close()


def pair(b: Any = None) -> Workbench:
    """Return water selected, and a planted water as B."""
    other = planted(drag=0.42, length=1700, scaling=1700) if b is None else b
    return Workbench(Setting("water", WATER, WATER), Setting("planted", other, other))


def run(live: Live, estimation: LiveEstimation, at: Workbench, seconds: float) -> Workbench:
    """Let the lab run, as its frames do; return the workbench with what was applied."""
    for _ in range(round(seconds * 1000 / FRAME)):
        live.servo.advance(FRAME)
        live.poll()
        if values := estimation.poll(live, at):
            at = set_values(at, values, held=True)
            live.feel(at)
    return at


def test_a_simulated_sensor_finds_the_other_setting_and_a_click_applies_it(live: Live) -> None:
    estimation, at = LiveEstimation(), pair()
    estimation.choose(Chosen("other"))
    assert run(live, estimation, at, 6.0) == at  # nothing is applied unasked
    found = estimation.estimate
    assert found.identified, found.reason
    assert found.values[DRAG] == pytest.approx(0.42, rel=0.01)
    applied = estimation.applied(at)
    assert applied.in_hand.value("body.drag_coefficient") == found.values[DRAG]
    assert applied.undo().in_hand == at.in_hand


def test_continuous_application_converges_without_a_step_of_the_force(live: Live) -> None:
    estimation, at = LiveEstimation(), pair()
    estimation.choose(Chosen("other"))
    run(live, estimation, at, 1.0)
    reader = live.servo.telemetry.reader()
    estimation.follows = True
    at = run(live, estimation, at, 6.0)
    assert at.in_hand.value("body.drag_coefficient") == pytest.approx(0.42, rel=0.01)
    assert at.undo().in_hand.scene == WATER
    samples = reader.read()
    assert np.unique(samples.scene).size > 5  # it was adjusted in steps
    assert np.abs(np.diff(samples.device_force_n, axis=0)).max() < 0.2
    assert live.shadow.differing == 0


def test_the_force_of_the_device_is_that_of_the_setting_and_is_not_applied(live: Live) -> None:
    estimation, at = LiveEstimation(), pair()
    estimation.choose(Chosen("device"))
    estimation.follows = True
    assert run(live, estimation, at, 6.0) == at
    assert estimation.estimate.identified, estimation.estimate.reason
    assert estimation.estimate.values[DRAG] == pytest.approx(0.47, rel=1e-3)
    assert estimation.applied(at) == at


def test_nothing_is_known_of_a_blind_comparison(live: Live) -> None:
    estimation, at = LiveEstimation(), pair()
    estimation.choose(Chosen("other"))
    estimation.follows = True
    blind = dataclasses.replace(at, blind=True)
    assert run(live, estimation, blind, 3.0) == blind
    assert estimation.estimate.values == {}
    assert not estimation.follows


def test_a_changed_liquid_begins_again_and_an_applied_value_does_not(live: Live) -> None:
    estimation, at = LiveEstimation(), pair()
    estimation.choose(Chosen("other"))
    run(live, estimation, at, 3.0)
    seconds = estimation.estimate.seconds
    applied = estimation.applied(at)
    live.feel(applied)
    run(live, estimation, applied, 1.0)
    assert estimation.estimate.seconds > seconds
    denser = applied.change("liquid.density_kg_m3", 1100.0)
    live.feel(denser)
    run(live, estimation, denser, 0.5)
    assert estimation.estimate.seconds < 1.0


def test_trouble_ends_it_and_is_said(live: Live, tmp_path: Path) -> None:
    estimation = LiveEstimation()
    path = begun(tmp_path / "robot.csv")
    estimation.choose(Chosen("file", path=path))
    path.write_text(path.read_text("utf-8") + "0,0,0\n", "utf-8")
    assert estimation.poll(live, pair()) == {}
    assert "has 3 fields" in estimation.trouble
    assert estimation.chosen.source == "off"
    estimation.choose(Chosen("other", NAMES))
    estimation.poll(live, bench("honey"))
    assert "no effect wake" in estimation.trouble
    estimation.choose(Chosen("device"))
    estimation.poll(None, pair())
    assert estimation.trouble == "no device is open"
