"""The felt force recomputed outside the servo, exactly, and the other liquid on the same motion."""

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.haptics.model.estimators import Kalman
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.model.scene import Scene
from study_app.lab import shadow as module
from study_app.lab.ab_comparison import Setting, Workbench
from study_app.lab.parameters import with_parameter
from study_app.lab.shadow import Shadow
from tests.haptics.scenes import EVERYTHING
from tests.lab.benches import SCENES, bench, live_with, run, scripted


def test_the_felt_sides_forces_are_the_servos_to_the_last_bit_through_switches_edits_and_stops() -> None:
    live = live_with(scripted())
    sides = bench()
    live.feel(sides)
    live.play("reverse")
    run(live, 900)
    live.feel(sides := sides.switch())
    run(live, 500)
    live.stop_force()
    run(live, 100)
    live.fade_in()
    run(live, 700)
    live.feel(sides := sides.change("wake.exponent", 2.0))
    run(live, 10, batch=10)
    live.feel(sides := sides.change("wake.length", 100.0))
    run(live, 200)
    live.feel(sides.switch())
    run(live, 900)
    assert live.shadow.compared == 3310
    assert live.shadow.differing == 0
    trace = live.trace()
    assert trace is not None
    assert np.linalg.norm(trace.force_a_n, axis=1).max() > 0.5
    live.close()


@pytest.mark.parametrize("name", ["tail", "places"])
def test_so_they_are_with_every_effect(name: str) -> None:
    scene = EVERYTHING[name]
    live = live_with(scripted())
    live.feel(Workbench(Setting("all", scene, scene), bench().b))
    live.play("reach")
    run(live, 2500)
    assert live.shadow.differing == 0
    live.close()


def test_the_other_sides_kalman_filter_knows_the_force_that_was_sent() -> None:
    """Both sides fill a wake by the same velocity, although their forces differ."""
    device = scripted()
    device.state.handle.mass_kg = 0.05
    live = live_with(device)
    thin = SCENES["water"].model_copy(update={"velocity": Kalman()})
    thick = with_parameter(thin, "liquid.density_kg_m3", 4000.0)
    live.feel(Workbench(Setting("thin", thin, thin), Setting("thick", thick, thick)))
    live.play("reach")
    run(live, 1500)
    trace = live.trace()
    assert trace is not None
    assert np.abs(trace.force_a_n - trace.force_b_n).max() > 0.2
    assert trace.wake_a_mps.max() > 0.01
    assert np.array_equal(trace.wake_a_mps, trace.wake_b_mps)
    live.close()


def test_the_other_side_equals_its_force_if_presented() -> None:
    beside = live_with(scripted())
    quiet = with_parameter(SCENES["water"], "liquid.density_kg_m3", 1.0)
    beside.feel(Workbench(Setting("hardly there", quiet, quiet), bench().b))
    beside.play("reverse")
    run(beside, 2000)
    recorded = beside.servo.telemetry.ring[:2000].copy()
    alone = Shadow(Scene(), 10_000, 8.0, without_servo=True)
    alone.expect(1, "B", quiet, SCENES["light_oil"])
    alone.process_samples(recorded)
    beside_trace, alone_trace = beside.trace(), alone.trace()
    assert beside_trace is not None
    assert alone_trace is not None
    assert np.array_equal(beside_trace.force_b_n, alone_trace.force_b_n)
    assert np.array_equal(beside_trace.wake_b_mps, alone_trace.wake_b_mps)
    assert np.abs(beside_trace.force_b_n - beside_trace.force_a_n).max() > 1.0
    beside.close()


def test_a_tail_is_the_path_that_was_left_and_breaks_where_it_turns() -> None:
    """A path with a right angle: every point lies on it, and one segment begins at the corner."""
    scene = SCENES["water"]
    wake = scene.liquids[0].wake
    assert wake is not None
    shadow = Shadow(Scene(), 2000, 8.0, without_servo=True)
    shadow.expect(1, "A", scene, scene)
    samples = records(SAMPLE, 600)
    samples.time_ns, samples.scene, samples.fresh = np.arange(600) * 1_000_000, 1, 1
    way_m = np.arange(600) * 1e-4
    samples.position_m[:, 0] = np.minimum(way_m, 0.03)
    samples.position_m[:, 2] = np.maximum(way_m - 0.03, 0.0)
    shadow.process_samples(samples)
    tail = shadow.tail("A")
    assert tail is not None
    assert (tail.elements, tail.alive) == (1700, 600)
    assert tail.segments == tail.breaks.sum() == 2
    corner = tail.positions_m[np.flatnonzero(tail.breaks)[1]]
    assert corner == pytest.approx([0.03, 0.0, 0.0], abs=0.0075)  # a diameter of the ball, and the filter's lag
    on_first = np.abs(tail.positions_m[:, 2]) < 1e-12
    on_second = np.abs(tail.positions_m[:, 0] - 0.03) < 1e-12
    assert (on_first | on_second).all()
    assert (np.diff(tail.ages) < 0).all()
    assert tail.ages[-1] == 0.0
    assert tail.ages[0] == pytest.approx(598 / 1699, abs=2 / 1699)
    assert (np.diff(tail.positions_m.sum(axis=1)) > 0).all()


def test_a_long_tail_is_drawn_with_all_corners_or_the_newest_200_and_even_rows() -> None:
    breaks = np.zeros(1000, bool)
    breaks[[0, 5, 778]] = True
    rows = module._rows_to_draw(breaks)
    assert {0, 5, 778, 999} < {*rows}
    assert 397 <= len(rows) <= 400
    assert set(np.diff(rows)) == {1, 2, 3}, "999 / 396 = 2.5 rows apart, and the corners between them"
    breaks[:300] = True
    rows = module._rows_to_draw(breaks)
    assert {*range(100, 300)} < {*rows}
    assert list(rows[:4]) == [0, 5, 10, 15], "999 / 199 = 5.02 rows apart"
    assert (rows[-1], (np.diff(rows) > 0).all()) == (999, True)
    assert list(module._rows_to_draw(breaks[:400])) == [*range(400)]


def test_a_tail_drops_its_oldest_elements() -> None:
    scene = with_parameter(SCENES["water"], "wake.length", 100.0)
    shadow = Shadow(Scene(), 2000, 8.0, without_servo=True)
    shadow.expect(1, "A", scene, SCENES["honey"])
    samples = records(SAMPLE, 400)
    samples.time_ns, samples.scene, samples.fresh = np.arange(400) * 1_000_000, 1, 1
    samples.position_m[:, 0] = np.arange(400) * 1e-4
    shadow.process_samples(samples)
    tail = shadow.tail("A")
    assert tail is not None
    assert tail.alive == tail.elements == 100
    assert tail.positions_m[:, 0] == pytest.approx(np.arange(300, 400) * 1e-4)
    assert tail.ages[0] == 1.0
    assert shadow.tail("B") is None  # honey has no wake


def test_a_trace_holds_the_last_two_and_a_half_seconds_of_both_sides() -> None:
    recent = module._RecentSamples()
    assert recent.trace() is None
    for first_ms, presented_a in ((0, True), (2000, False)):
        a, b = records(SAMPLE, 2000), records(SAMPLE, 2000)
        a.device_force_n, b.device_force_n = [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]
        a.velocity_mps, b.velocity_mps = [3.0, 0.0, 4.0], [0.0, 5.0, 12.0]
        a.wake_mps, b.wake_mps = [0.0, 0.0, -7.0], [8.0, 0.0, 15.0]
        recent.add(np.arange(first_ms, first_ms + 2000) * 1_000_000, a, b, presented_a=presented_a)
    trace = recent.trace()
    assert trace is not None
    assert (len(trace.t_s), trace.t_s[-1], trace.t_s[0]) == (2500, 0.0, pytest.approx(-2.499))
    assert (trace.force_a_n == [1.0, 2.0, 3.0]).all()
    assert (trace.force_b_n == [4.0, 5.0, 6.0]).all()
    assert trace.presented_a.tolist() == [True] * 500 + [False] * 2000
    assert trace.body_mps.tolist() == [5.0] * 500 + [13.0] * 2000
    assert ({*trace.wake_a_mps}, {*trace.wake_b_mps}) == ({7.0}, {17.0})
