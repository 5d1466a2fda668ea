"""Levels set on the real servo and simulated devices, on a virtual clock: forces, device buttons, the time limit."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from study_app.devices.rig import Rig, open_rig, study_settings
from study_app.haptics.model.layout import LIMITER_FADE
from study_app.haptics.model.slope_limits import SLEW_N
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.protocol.orders.schedule import stream
from study_app.session.device_buttons import ANSWERS
from study_app.session.transitions.events import Stepped
from tests.compiled import needs_servo
from tests.protocol.trials.matching import ALONE, DELAY, matching
from tests.session.runner.bench import Bench, setting

pytestmark = needs_servo

LESS, MORE = ANSWERS


@pytest.fixture(params=["scripted", pytest.param("falcon-emulated", marks=pytest.mark.slow)])
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    settings = study_settings(matching(), stream(1, "hand"))
    with open_rig(request.param, settings, clock=VirtualClock()) as opened_rig:
        yield opened_rig


def at_setting(rig: Rig, *edits: tuple[str, str]) -> Bench:
    """Return a session whose first level is being set, its hand in motion."""
    bench = Bench(rig, setting(*edits))
    bench.swing()
    assert ALONE in edits or bench.state.adjusting is None, "the interval of the standard is not set"
    bench.to_setting()
    return bench


def samples_of(bench: Bench, seconds: float) -> Any:
    """Let time pass and return the samples."""
    bench.reader.read()
    sample_batches = []
    for _ in range(round(seconds * 50)):
        bench.servo.advance(20)
        bench.runner.poll()
        sample_batches.append(bench.reader.read().copy())
    return np.concatenate(sample_batches)


def damping(samples: Any) -> float:
    """Return b of F = −b v, by least squares [N·s/m]; the device moves a tenth as fast as the scene."""
    v = samples["velocity_mps"] / 10
    return float(-(samples["device_force_n"] * v).sum() / (v * v).sum())


def test_steps_change_the_damping_without_interrupting_the_force(rig: Rig) -> None:
    bench = at_setting(rig)
    samples_of(bench, 0.5)
    level = bench.state.adjusting
    assert level is not None
    before = samples_of(bench, 0.3)
    assert damping(before) == pytest.approx(level.comparison(0), rel=0.03)
    way = -1 if level.comparison(0) > 6 else 1
    bench.runner.post(Stepped(bench.clock(), 10 * way))
    after = samples_of(bench, 0.3)
    assert damping(after[100:]) == pytest.approx(level.comparison(10 * way), rel=0.03)
    assert {*after["scene"]} == {before["scene"][-1] + 1}
    whole = np.concatenate([before, after])
    assert np.linalg.norm(np.diff(whole["device_force_n"], axis=0), axis=1).max() < 2 * SLEW_N
    assert not (after["limiters"] & LIMITER_FADE).any()
    (line,) = bench.journal.of("stepped")
    assert (line["steps"], line["scene"]) == (10 * way, int(after["scene"][0]))


def test_every_step_sets_a_new_scene_even_at_the_ends(rig: Rig) -> None:
    bench = at_setting(rig)
    samples_of(bench, 0.1)
    for steps in (500, 3, -500, -3):
        bench.runner.post(Stepped(bench.clock(), steps))
        samples_of(bench, 0.02)
    scenes = [line["scene"] for line in bench.journal.of("stepped")]
    assert scenes == [*range(scenes[0], scenes[0] + 4)]


def test_setting_a_delay_changes_the_picture_but_not_the_scene(rig: Rig) -> None:
    bench = at_setting(rig, ALONE, DELAY)
    samples_of(bench, 0.3)
    level = bench.state.adjusting
    assert level is not None

    def age_ms() -> float:
        view = bench.runner.view(bench.servo.now_ns())
        assert view is not None
        return (bench.servo.now_ns() - view.sample_time_ns) / 1e6 - 2

    assert age_ms() == pytest.approx(level.comparison(0), abs=0.01)
    way = 12 if level.comparison(0) < 60 else -12
    bench.runner.post(Stepped(bench.clock(), way))
    assert age_ms() == pytest.approx(level.comparison(way), abs=0.01)
    assert bench.journal.of("stepped")[0]["scene"] is None
    assert len({*samples_of(bench, 0.1)["scene"]}) == 1
