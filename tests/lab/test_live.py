"""Device and servo of the lab: edits are felt at once, and every way out ends in zero force."""

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.devices.rig import Rig
from study_app.devices.simulated import MouseDevice
from study_app.errors import ServoFault, StudyError
from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_FADE, SAMPLE, records
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.lab.live import Live, open_live
from study_app.lab.programmed_paths import REACHED, TITLES, lead_to_path, programmed_path
from study_app.lab.shadow import Shadow
from tests.lab.benches import SCENES, bench, live_with, run, scripted


def sent_n(live: Live, ticks: int) -> np.ndarray:
    """Return the sizes of the forces sent in the last ticks [N]."""
    written = int(live.servo.telemetry.written[0])
    ring = live.servo.telemetry.ring
    return np.linalg.norm(ring.device_force_n[written - ticks : written], axis=1)


def test_a_scene_is_presented_by_the_next_tick_and_felt_whole_within_fifty() -> None:
    live = live_with(scripted())
    honey = SCENES["honey"].model_copy(update={"rate_hz": 500.0})  # the servo's rate counts
    sides = bench("honey", "honey").choose("B", "honey", honey)
    live.feel(sides)
    live.play("circle")
    run(live, 1500)
    live.feel(sides.switch())
    run(live, 60, batch=1)
    ring = live.servo.telemetry.ring
    assert ring.scene[1499] == 1
    assert ring.scene[1500] == 2
    sent, whole = (np.linalg.norm(it[1500:1560], axis=1) for it in (ring.device_force_n, ring.force_n))
    assert whole[50:].min() > 0.2
    assert sent[50:] == pytest.approx(whole[50:])
    live.close()


def test_exchanging_the_other_side_leaves_the_servo_unchanged() -> None:
    live = live_with(scripted())
    sides = bench()
    live.feel(sides)
    live.play("circle")
    run(live, 1500)
    live.feel(sides := sides.choose("B", "honey", SCENES["honey"]))
    run(live, 300)
    assert set(live.servo.telemetry.ring.scene[:1800]) == {1}
    assert live.tail("B") is None
    trace = live.trace()
    assert trace is not None
    assert np.linalg.norm(trace.force_b_n[-1]) > 3 * np.linalg.norm(trace.force_a_n[-1])
    live.feel(sides, anew=True)
    run(live, 1)
    assert live.servo.telemetry.ring.scene[1800] == 2
    live.close()


@pytest.mark.slow
def test_a_number_that_is_dragged_is_felt_by_the_next_tick_with_the_wake_going_on() -> None:
    live = live_with(scripted())
    sides = bench()
    live.feel(sides)
    live.play("circle")
    run(live, 3000)
    for k in range(60):  # a value every 8 ms, from 1000 down to 500 kg/m³
        live.feel(sides := sides.change("liquid.density_kg_m3", 1000.0 * 0.5 ** ((k + 1) / 60), held=True))
        run(live, 8, batch=2)
    ring = live.servo.telemetry.ring
    assert list(ring.scene[3000:3480:8]) == list(range(2, 62))
    dragged, wake_mps = ring[3000:3480], np.linalg.norm(ring.wake_mps[2990:3480], axis=1)
    assert wake_mps.min() > 0.7
    assert np.abs(np.diff(wake_mps)).max() < 0.01
    assert not (dragged.limiters & (LIMITER_FADE | LIMITER_ENERGY)).any()
    assert np.linalg.norm(np.diff(ring.device_force_n[2990:3480], axis=0), axis=1).max() < 0.05
    assert live.shadow.differing == 0
    tail = live.tail("A")
    assert tail is not None
    assert tail.alive == 1700
    live.close()


def test_a_number_set_while_another_scene_waits_goes_with_it() -> None:
    live = live_with(scripted())
    sides = bench()
    live.feel(sides)
    run(live, 10)
    live.feel(sides := sides.switch())  # waits until the fade of the first is over
    live.feel(sides := sides.change("liquid.density_kg_m3", 3000.0))
    run(live, 100)
    assert set(live.servo.telemetry.ring.scene[:110]) == {1, 2}
    live.feel(sides := sides.switch())
    live.feel(sides.change("liquid.density_kg_m3", 900.0))  # before a turn took the switch
    run(live, 900)
    assert live.shadow.differing == 0
    live.close()


def test_stopping_the_force_is_zero_from_the_next_tick_whatever_is_chosen_until_it_fades_in() -> None:
    live = live_with(scripted())
    sides = bench("honey", "honey")
    live.feel(sides)
    live.play("circle")
    run(live, 1500)
    assert sent_n(live, 100).min() > 0.5
    live.stop_force()
    run(live, 1)
    assert sent_n(live, 1)[0] == 0.0
    live.feel(sides.switch())
    run(live, 300)
    assert sent_n(live, 301).max() == 0.0
    reading = live.reading()
    assert reading is not None
    assert not reading.force_on
    live.fade_in()
    run(live, 50)
    assert 0.0 < sent_n(live, 1)[0] < 0.5
    run(live, 2500)
    assert sent_n(live, 2000).max() > 0.5
    live.close()


def test_closing_ends_with_zero_force_then_the_servo_then_the_device() -> None:
    device = scripted()
    live = live_with(device)
    live.feel(bench("honey", "water"))
    live.play("circle")
    run(live, 1500)
    handle = device.state.handle
    assert np.linalg.norm(handle.force_n) > 0.5
    order: list[str] = []
    stop, close = live.servo.stop, device.close

    def servo_stops() -> None:
        stop()
        order.append(f"servo, {np.linalg.norm(handle.force_n):g} N")

    def device_closes() -> None:
        order.append("device")
        close()

    live.servo.stop, device.close = servo_stops, device_closes  # type: ignore[method-assign]
    live.close()
    live.close()
    assert order == ["servo, 0 N", "device"]


def test_a_servo_that_does_not_end_does_not_keep_the_device_open() -> None:
    device = scripted()
    live = live_with(device)
    closed: list[bool] = []

    def stuck() -> None:
        raise ServoFault("stuck")

    live.servo.stop = stuck  # type: ignore[method-assign]
    device.close = lambda: closed.append(True)  # type: ignore[method-assign]
    with pytest.raises(ServoFault):
        live.close()
    assert closed == [True]
    assert not live.servo.force_is_on


def test_an_exception_on_the_way_ends_in_zero_force() -> None:
    device = scripted()

    def feels_and_fails() -> None:
        with live_with(device) as live:
            live.feel(bench("honey", "water"))
            live.play("circle")
            run(live, 1500)
            assert sent_n(live, 1)[0] > 0.5
            raise RuntimeError

    with pytest.raises(RuntimeError):
        feels_and_fails()
    assert np.linalg.norm(device.state.handle.force_n) == 0.0


def test_a_fault_is_reported_and_ends_the_presentation() -> None:
    device = scripted()
    live = live_with(device)
    live.feel(bench())
    run(live, 100)
    device.unplug()
    run(live, 5)
    reading = live.reading()
    assert reading is not None
    assert "stopped responding" in reading.fault
    assert not reading.force_on
    with pytest.raises(StudyError, match="stopped responding"):
        live.feel(bench())
    live.close()


def test_paths_begin_on_the_left_and_a_zigzag_turns_by_90_degrees_on_its_way_to_the_right() -> None:
    """A workspace of 0.5 m by 0.4 m in the scene: five legs of 0.085 m / sin 45° along x, each at ±45°."""
    half_m, filled = (0.025, 0.02, 0.02), REACHED * 10 * 0.025
    ways_m = {name: 10 * programmed_path(name, SCENES["water"], half_m).position_m for name in TITLES}
    for name in ("line", "stop"):
        assert ways_m[name][[0, -1]] == pytest.approx(np.array([[-filled, 0, 0], [filled, 0, 0]]), abs=1e-3)
    assert ways_m["reach"][[0, 800]] == pytest.approx(np.array([[-filled, 0, 0], [filled, 0, 0]]), abs=1e-3)
    way_m = ways_m["zigzag"]
    corners = np.round(np.linspace(0, len(way_m) - 1, 6)).astype(int)
    leg_m = 2 * filled / 5
    zs_m = leg_m / 2 * np.array([-1, 1, -1, 1, -1, 1])
    expected_m = np.column_stack([np.linspace(-filled, filled, 6), np.zeros(6), zs_m])
    assert way_m[corners] == pytest.approx(expected_m, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", TITLES)
def test_programmed_paths_fit_the_workspace_and_the_hand_goes_along_them(name: str) -> None:
    live = live_with(scripted())
    live.feel(bench("water", "water"))
    run(live, 60)
    motion = programmed_path(name, SCENES["water"], live.device.workspace_m)
    for axis, half_m in enumerate(live.device.workspace_m):
        assert np.abs(motion.position_m[:, axis]).max() <= REACHED * half_m + 1e-9
    steps_mps = np.linalg.norm(np.diff(motion.position_m, axis=0), axis=1) * 1000
    assert steps_mps.max() < 0.15 + 0.01
    live.play(name)
    whole = lead_to_path(motion, live.hand.aim_m)  # type: ignore[union-attr]
    lasts = round(whole.t_s[-1] * 1000)
    run(live, lasts)
    places_m = live.servo.telemetry.ring.position_m[60 : 60 + lasts]
    assert np.abs(places_m - whole.position_m[:lasts]).max() < 0.02  # the hand is a spring against the liquid
    run(live, 200)
    assert live.path == name
    assert live.hand is not None and live.hand.moving  # noqa: PT018 - again from the start
    live.play(None)
    run(live, 50)
    assert not live.hand.moving
    live.close()


@pytest.mark.slow
def test_a_hand_that_a_person_holds_is_not_moved_but_both_sides_are_computed_along_the_path() -> None:
    live = live_with(scripted())
    live.hand = None
    live.feel(sides := bench())
    run(live, 100)
    live.play("line")
    run(live, 1000)
    assert live.path == "line"
    assert np.abs(live.servo.telemetry.ring.position_m[:1100]).max() < 2e-3
    path = programmed_path("line", SCENES["water"], live.device.workspace_m)
    lead = lead_to_path(path, path.position_m[-1])
    samples = records(SAMPLE, 1000)
    samples.time_ns, samples.scene, samples.fresh = np.arange(1000) * 1_000_000, 1, 1
    samples.position_m = lead.position_m[:1000]
    alone = Shadow(Scene(), 10_000, live.device.force_limit_n, without_servo=True)
    alone.expect(1, "A", SCENES["water"], SCENES["light_oil"])
    alone.process_samples(samples)
    trace, expected = live.trace(), alone.trace()
    assert trace is not None
    assert expected is not None
    assert trace.t_s == pytest.approx(np.arange(-999, 1) * 1e-3)
    for column in ("force_a_n", "force_b_n", "body_mps", "wake_a_mps", "wake_b_mps"):
        assert getattr(trace, column) == pytest.approx(getattr(expected, column), abs=1e-6), column
    steps_mps = 1000 * SCENES["water"].scale * np.linalg.norm(np.diff(samples.position_m, axis=0), axis=1)
    assert trace.body_mps.max() == pytest.approx(steps_mps.max(), rel=0.05)
    assert np.abs(trace.force_b_n - trace.force_a_n).max() > 0.1

    live.feel(sides := sides.choose("B", "honey", SCENES["honey"]))
    assert live.tail("B") is None, "the other side is exchanged at once"
    before = live.tail("A")
    live.feel(sides := sides.change("liquid.density_kg_m3", 2000.0))
    run(live, 100)
    changed = live.tail("A")
    assert before is not None
    assert changed is not None
    assert changed.alive == before.alive + 100, "the wake goes on while a number is dragged"
    assert changed.positions_m[-1] == pytest.approx(lead.position_m[1099], abs=2e-4)

    live.feel(sides.choose("A", "light_oil", SCENES["light_oil"]))
    run(live, 20)
    begun_again = live.tail("A")
    assert begun_again is not None
    assert begun_again.alive == 20, "another liquid begins without a wake"
    live.servo.advance(3000)
    live.poll()
    trace = live.trace()
    assert trace is not None
    assert trace.t_s == pytest.approx(np.arange(-199, 1) * 1e-3), "overdue ticks are left out"

    live.play(None)
    trace = live.trace()
    assert live.path is None
    assert trace is not None
    assert trace.t_s[0] == pytest.approx(-2.499), "the servo's own samples"
    live.close()


def test_the_pointer_moves_the_mouse_unless_a_path_does() -> None:
    device = MouseDevice(workspace_m=(0.05, 0.03, 0.03))
    live = Live(Rig(device, Servo(device, clock=VirtualClock(), elements=10_000)))
    live.feel(bench())
    live.point_to(0.02, 0.01, 0.0)
    run(live, 600)
    reading = live.reading()
    assert reading is not None
    assert reading.position_m == pytest.approx((0.02, 0.01, 0.0), abs=2e-3)
    live.play("circle")
    live.point_to(-0.04, 0.0, 0.0)
    run(live, 1500)
    places_m = live.servo.telemetry.ring.position_m[1600:2100]
    assert np.linalg.norm(places_m[:, ::2], axis=1) == pytest.approx(0.0255, abs=0.01)
    live.play(None)
    live.point_to(-0.04, 0.0, 0.0)
    run(live, 1500)
    reading = live.reading()
    assert reading is not None
    assert reading.position_m[0] == pytest.approx(-0.04, abs=2e-3)
    live.close()


@pytest.mark.slow
def test_the_lab_beside_a_servo_in_its_own_thread_sees_every_tick_of_it() -> None:
    live = open_live("scripted")
    try:
        sides = bench()
        live.feel(sides)
        live.play("reverse")
        while live.shadow.compared < 1500:
            live.poll()
            if live.shadow.compared > 700 and sides.presented == "A":
                live.feel(sides := sides.switch())
        assert live.shadow.differing == 0
        assert live.servo.fault is None
    finally:
        live.close()
    assert np.linalg.norm(live.device.state.handle.force_n) == 0.0  # type: ignore[attr-defined]
