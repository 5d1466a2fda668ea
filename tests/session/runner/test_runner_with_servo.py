"""The runner on the real servo and a scripted device, on a virtual clock: what the hand feels when things happen."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.devices.rig import open_rig, study_settings
from study_app.devices.simulated import ScriptedDevice
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.session.ports import Ports
from study_app.session.runner import Runner
from study_app.session.transitions.events import Begin, Continue, PauseRequested, RepeatRequested, ResumeRequested
from study_app.session.transitions.state import Phase
from study_app.session.trial import SETTLED_S
from study_app.store.blinded.blinding import open_events
from study_app.store.journals.journal import SessionClock
from study_app.store.tables.session_tables import SessionRows
from tests.compiled import needs_servo
from tests.protocol.edited_studies import text_of
from tests.session import small
from tests.session.fakes import FakeJournal
from tests.session.runner.bench import Bench, small_bench
from tests.studies import begun

pytestmark = needs_servo


@pytest.fixture
def bench() -> Iterator[Bench]:
    with small_bench() as new_bench:
        yield new_bench


def late(bench: Bench, clock: VirtualClock) -> None:
    clock.memory[0].now_ns += 5_000_000_000  # the process was stopped


def late_before_the_first_tick(bench: Bench, clock: VirtualClock) -> None:
    bench.runner.post(RepeatRequested(bench.clock(), "once more"))
    clock.memory[0].now_ns += 5_000_000_000  # between the first painted frame and the first tick of the scene


def late_where_nobody_reads(bench: Bench, clock: VirtualClock) -> None:
    bench.servo.advance(10)
    clock.memory[0].now_ns += 5_000_000_000
    bench.servo.advance(40_000)  # all that telemetry held of it is overwritten


def suspended(bench: Bench, clock: VirtualClock) -> None:
    clock.suspension_ns += 5_000_000_000  # the loop's own clock stood still meanwhile


@pytest.mark.parametrize("freeze", [late, late_before_the_first_tick, late_where_nobody_reads, suspended])
def test_a_freeze_during_a_trial_interrupts_and_repeats_it(bench: Bench, freeze: Any) -> None:
    clock = bench.servo.loop.clock
    assert isinstance(clock, VirtualClock)
    bench.look(800)
    freeze(bench, clock)
    bench.look(16)
    assert bench.runner.state.phase is Phase.PAUSED
    assert bench.journal.of("paused")[-1]["by"] == "program"
    row = bench.journal.of("trial_ended")[-1]
    assert (row["trial"], row["outcome"]) == (1, "interrupted")
    assert row["worst_gap_ms"] == pytest.approx(5000, abs=2)
    bench.look(500)
    bench.runner.post(ResumeRequested(bench.clock(), "participant"))
    bench.look(3500)
    row = bench.journal.of("trial_ended")[-1]
    assert (row["trial"], row["attempt"], row["outcome"]) == (
        1,
        bench.journal.of("trial_started")[-2]["attempt"],
        "complete",
    )
    assert row["worst_gap_ms"] == pytest.approx(1)


def test_a_freeze_during_a_page_does_not_interrupt_the_session(bench: Bench) -> None:
    clock = bench.servo.loop.clock
    assert isinstance(clock, VirtualClock)
    bench.runner.post(PauseRequested(bench.clock(), "participant"))
    bench.look(100)
    clock.memory[0].now_ns += 5_000_000_000
    clock.suspension_ns += 5_000_000_000
    bench.look(100)
    bench.runner.post(ResumeRequested(bench.clock(), "participant"))
    bench.look(3500)
    assert bench.journal.of("trial_ended")[-1]["outcome"] == "complete"


def test_a_window_that_stops_painting_interrupts_the_trial(bench: Bench) -> None:
    for _ in range(20):
        bench.look(16)
        bench.runner.frame_shown(bench.servo.now_ns(), bench.servo.now_ns())
    bench.look(5000)  # the task's time is over meanwhile
    row = bench.journal.of("trial_ended")[-1]
    assert row["outcome"] == "interrupted"
    assert row["worst_frame_gap_ms"] == pytest.approx(3000 - 320, abs=20)
    assert row["worst_gap_ms"] == pytest.approx(1)


class Judged:
    """The row of a whole practice trial on the real servo in a real session."""

    def __init__(self, folder: Path, *, late_ns: int = 0, opening_s: float = 0.0, stall_s: float = 0.0) -> None:
        study = small.protocol()
        device, clock = ScriptedDevice(), VirtualClock()
        with device, Servo(device, clock=clock, elements=100) as servo:
            session_clock = SessionClock(servo.now_ns)
            who = {"device": device.describe(), "simulated": True}
            with begun(folder, "P001", study, b"small", clock=session_clock, **who) as store:
                ports = Ports(servo, store, lambda _page: None, session_clock.seconds)
                runner = Runner(study, build_schedule(study, "P001", 1), store.key.codes, ports, "en")
                runner.post(Begin(0.0))
                runner.post(Continue(0.0))
                servo.advance(round(opening_s * 1000))  # the tank is not on the screen yet
                for frame in range(200):
                    if frame == 60:
                        clock.memory[0].now_ns += late_ns  # the system gave the servo no time
                    if frame == 90:
                        servo.advance(round(stall_s * 1000))  # the window draws nothing meanwhile
                    servo.advance(16)
                    view = runner.view(servo.now_ns())
                    if view is not None:
                        runner.frame_shown(servo.now_ns() + 3_000_000, view.sample_time_ns)
                    runner.poll()
            self.row = next(
                row for row in SessionRows(open_events(store.lines, store.key)).trials if row["outcome"] == "complete"
            )


def delay_error_ms(delay_ms: float) -> float:
    """Return the mean error of the delay in a trial with irregular samples and frames at any time between."""
    blocks = small.TABLES["blocks"] | {"practice": small.TABLES["blocks"]["practice"] | {"conditions": ["on_time"]}}
    conditions = small.TABLES["conditions"] | {"on_time": {"liquid": "thin", "delay_ms": delay_ms}}
    study = Protocol.model_validate(small.TABLES | {"blocks": blocks, "conditions": conditions})
    clock, draw, journal = VirtualClock(), np.random.default_rng(1), FakeJournal([])
    device = ScriptedDevice()
    with device, Servo(device, clock=clock, elements=100) as servo:
        ports = Ports(servo, journal, lambda _page: None, lambda: servo.now_ns() / 1e9)
        key = draw_key(study, stream(1, "key").random)
        runner = Runner(study, build_schedule(study, "P001", 1), key, ports, "en")
        runner.post(Begin(0.0))
        runner.post(Continue(0.0))
        servo.advance(200)  # as much history as any delay asks for
        while not journal.of("trial_ended"):
            for _ in range(16):
                clock.memory[0].now_ns += int(draw.integers(600_000))  # the system is late
                servo.advance(1)
            view = runner.view(servo.now_ns() + int(draw.integers(400_000)))
            if view is not None:
                runner.frame_shown(servo.now_ns() + 3_000_000, view.sample_time_ns)
            runner.poll()
    (row,) = journal.of("trial_ended")
    assert row["frames"] > 100
    return float(row["delay_error_mean_ms"])


@pytest.mark.slow
def test_the_error_of_the_delay_does_not_tell_whether_there_is_one() -> None:
    assert delay_error_ms(0) == pytest.approx(delay_error_ms(50), abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("incident", "valid", "gaps_ms"),
    [
        ({}, True, (1, 19, 16)),
        ({"late_ns": 30_000_000}, False, (31, 19, 44)),
        ({"opening_s": 0.4}, False, (1, 419, 16)),
        ({"stall_s": 0.4}, False, (1, 19, 416)),
    ],
    ids=["nothing happens", "a late servo", "a tank that appears late", "a window that stands still"],
)
def test_incidents_make_a_trial_invalid(
    tmp_path: Path, incident: dict[str, Any], valid: bool, gaps_ms: tuple[float, ...]
) -> None:
    row = Judged(tmp_path / "study", **incident).row
    worst_gaps = [row[name] for name in ("worst_gap_ms", "first_frame_gap_ms", "worst_frame_gap_ms")]
    assert (row["valid"], worst_gaps) == (valid, pytest.approx(list(gaps_ms), abs=1))
    assert row["duration_s"] == pytest.approx(3)
    assert row["delay_error_mean_ms"] == pytest.approx(3 + 1000 * SETTLED_S)
    assert row["delay_error_p95_ms"] < 25  # frames that never came have no age


@pytest.mark.slow
@pytest.mark.parametrize(("delay", "ticks"), [(0, None), (3, 3)])
def test_a_delay_that_a_device_does_not_report_is_in_the_row_of_a_trial(delay: int, ticks: int | None) -> None:
    """The device reports that it answers at once; a light handle then oscillates in honey if it does not."""
    honey = tomllib.loads(text_of("physical2"))
    liquids = small.TABLES["liquids"] | {"thick": honey["liquids"]["honey"]}
    study = Protocol.model_validate(small.TABLES | {"scene": honey["scene"], "liquids": liquids})
    with open_rig("force-dimension-emulated", study_settings(study, stream(1, "hand")), clock=VirtualClock()) as rig:
        device: Any = rig.device
        handle = device.hand.state.handle
        handle.mass_kg = handle.hand_kg = 0.1
        handle.stiffness_npm, handle.damping_nspm, handle.coulomb_n = 100.0, 2.0, 0.0
        handle.delay = delay
        bench = Bench(rig, study)
        bench.swing()
        bench.runner.post(Continue(bench.clock()))
        bench.look(3500)
    row = bench.journal.of("trial_ended")[-1]
    assert (row["outcome"], row["loop_delay_ticks"], row["device_delay_ticks"]) == ("complete", 0, ticks)
