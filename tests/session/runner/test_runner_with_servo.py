"""The runner on the real servo and a scripted device, on a virtual clock: what the hand feels when things happen."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.devices.simulated import ScriptedDevice
from study_app.haptics.model.layout import BUTTON_STOP
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.session.pages import PausePage, TaskPage
from study_app.session.ports import Ports
from study_app.session.runner import Runner
from study_app.session.transitions.events import (
    Begin,
    Continue,
    EndRequested,
    ForceStopped,
    PauseRequested,
    RepeatRequested,
    ResumeRequested,
)
from study_app.session.transitions.state import Phase
from study_app.session.trial import SETTLED_S
from study_app.store.blinded.blinding import opened
from study_app.store.journals.journal import SessionClock
from study_app.store.sessions.begin import SessionStart, begin
from study_app.store.tables.session_tables import SessionRows
from tests.compiled import needs_servo
from tests.session import small
from tests.session.fakes import FakeJournal

pytestmark = needs_servo


class Bench:
    """A session of the small study at its practice, with a hand that goes to and fro through a thick liquid."""

    def __init__(self, servo: Servo, device: ScriptedDevice) -> None:
        self.servo, self.device = servo, device
        self.journal = FakeJournal([])
        self.pages: list[Any] = []
        self.paints = True
        plan = small.opened().plan
        ports = Ports(servo, self.journal, self.present, self.clock, paints=False)
        self.runner = Runner(plan.protocol, plan.schedule, plan.key, ports, plan.language)
        t_s = np.arange(0, 20, 0.005)
        device.follow(t_s, np.column_stack((0.03 * np.sin(6 * t_s), 0 * t_s, 0 * t_s)))
        self.runner.post(Begin(self.clock()))
        self.runner.post(Continue(self.clock()))

    def present(self, page: Any) -> None:
        """Paint a tank's first frame at once."""
        self.pages.append(page)
        if isinstance(page, TaskPage) and self.paints:
            self.runner.frame_shown(self.servo.now_ns(), self.servo.now_ns())

    def clock(self) -> float:
        return self.servo.now_ns() / 1e9

    def run(self, ticks: int) -> Any:
        """Let ticks pass, look once, and return the force at each tick [N] (n,)."""
        reader = self.servo.telemetry.reader()
        self.servo.advance(ticks)
        self.runner.poll()
        return np.linalg.norm(reader.read().device_force_n, axis=1)


@pytest.fixture
def bench() -> Iterator[Bench]:
    device = ScriptedDevice()
    with device, Servo(device, clock=VirtualClock(), elements=100) as servo:
        yield Bench(servo, device)


def test_there_is_no_force_before_the_first_painted_frame_and_then_it_fades_in(bench: Bench) -> None:
    bench.run(800)
    bench.paints = False
    bench.runner.post(RepeatRequested(bench.clock(), "the window was hidden"))
    bench.run(60)
    assert (bench.run(500) == 0).all()
    assert bench.runner.task is not None
    assert bench.runner.task.elapsed_s == 0
    bench.runner.frame_shown(bench.servo.now_ns(), bench.servo.now_ns())
    force_n = bench.run(500)
    assert force_n[0] < 0.1
    assert force_n.max() > 0.5
    assert bench.runner.task.elapsed_s == pytest.approx(0.499, abs=0.002)


def test_a_force_stop_is_zero_force_with_the_next_tick_and_until_it_is_faded_in(bench: Bench) -> None:
    bench.run(800)
    bench.runner.post(ForceStopped(bench.clock(), "participant"))
    assert (bench.run(500) == 0).all()
    assert bench.pages[-1] == PausePage(force_off=True)
    bench.runner.post(ResumeRequested(bench.clock(), "operator"))
    force_n = bench.run(900)
    assert force_n.max() > 0.5
    assert force_n[:50].max() < 0.15 * force_n.max()  # the start's fade takes half a second
    assert bench.runner.state.attempt == 2


def test_button_four_of_the_device_stops_the_force(bench: Bench) -> None:
    bench.run(800)
    bench.device.press(BUTTON_STOP)
    bench.run(16)
    assert (bench.run(100) == 0).all()
    assert bench.journal.of("force_stopped")[0]["by"] == "device"


def test_a_pause_and_an_end_take_the_liquid_away(bench: Bench) -> None:
    bench.run(800)
    bench.runner.post(PauseRequested(bench.clock(), "operator"))
    bench.run(60)  # a change of scene fades
    assert (bench.run(500) == 0).all()
    bench.runner.post(ResumeRequested(bench.clock(), "operator"))
    assert bench.run(500).max() > 0.5
    bench.runner.post(EndRequested(bench.clock(), "withdrawn", ""))
    bench.run(60)
    assert (bench.run(500) == 0).all()


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
def test_a_freeze_within_a_trial_interrupts_it_and_it_comes_again(bench: Bench, freeze: Any) -> None:
    clock = bench.servo.loop.clock
    assert isinstance(clock, VirtualClock)
    bench.run(800)
    freeze(bench, clock)
    bench.run(16)
    assert bench.runner.state.phase is Phase.PAUSED
    assert bench.journal.of("paused")[-1]["by"] == "program"
    row = bench.journal.of("trial_ended")[-1]
    assert (row["trial"], row["outcome"]) == (1, "interrupted")
    assert row["worst_gap_ms"] == pytest.approx(5000, abs=2)
    bench.run(500)
    bench.runner.post(ResumeRequested(bench.clock(), "participant"))
    bench.run(3500)
    row = bench.journal.of("trial_ended")[-1]
    assert (row["trial"], row["attempt"], row["outcome"]) == (
        1,
        bench.journal.of("trial_started")[-2]["attempt"],
        "complete",
    )
    assert row["worst_gap_ms"] == pytest.approx(1)


def test_a_freeze_while_a_page_is_read_interrupts_nothing(bench: Bench) -> None:
    clock = bench.servo.loop.clock
    assert isinstance(clock, VirtualClock)
    bench.runner.post(PauseRequested(bench.clock(), "participant"))
    bench.run(100)
    clock.memory[0].now_ns += 5_000_000_000
    clock.suspension_ns += 5_000_000_000
    bench.run(100)
    bench.runner.post(ResumeRequested(bench.clock(), "participant"))
    bench.run(3500)
    assert bench.journal.of("trial_ended")[-1]["outcome"] == "complete"


def test_a_window_that_paints_nothing_for_the_rest_of_a_trial_has_it_interrupted(bench: Bench) -> None:
    for _ in range(20):
        bench.run(16)
        bench.runner.frame_shown(bench.servo.now_ns(), bench.servo.now_ns())
    bench.run(5000)  # the task's time is over meanwhile
    row = bench.journal.of("trial_ended")[-1]
    assert row["outcome"] == "interrupted"
    assert row["worst_frame_gap_ms"] == pytest.approx(3000 - 320, abs=20)
    assert row["worst_gap_ms"] == pytest.approx(1)


class Judged:
    """A whole practice trial on the real servo, kept in a real session: what its row says of it."""

    def __init__(self, folder: Path, *, late_ns: int = 0, opening_s: float = 0.0, stall_s: float = 0.0) -> None:
        study = small.protocol()
        device, clock = ScriptedDevice(), VirtualClock()
        with device, Servo(device, clock=clock, elements=100) as servo:
            session_clock = SessionClock(servo.now_ns)
            store = begin(
                folder,
                study,
                b"small",
                SessionStart(
                    "P001", seed=1, operator="", language="en", device=device.describe(), screens={}, simulated=True
                ),
                clock=session_clock,
            )
            with store:
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
                row for row in SessionRows(opened(store.lines, store.key)).trials if row["outcome"] == "complete"
            )


@pytest.mark.slow
def test_a_trial_without_incidents_is_valid(tmp_path: Path) -> None:
    row = Judged(tmp_path / "study").row
    assert row["valid"] is True
    assert row["worst_frame_gap_ms"] == pytest.approx(16)
    assert row["delay_error_mean_ms"] == pytest.approx(3 + 1000 * SETTLED_S)


def delay_error_ms(delay_ms: float) -> float:
    """Return the mean error of the delay in a trial whose samples come irregularly, and frames at any time between."""
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


def test_a_late_servo_makes_its_trial_invalid(tmp_path: Path) -> None:
    row = Judged(tmp_path / "study", late_ns=30_000_000).row
    assert row["worst_gap_ms"] == pytest.approx(31, abs=1)
    assert row["valid"] is False


def test_a_tank_that_appears_late_makes_its_trial_invalid(tmp_path: Path) -> None:
    row = Judged(tmp_path / "study", opening_s=0.4).row
    assert row["first_frame_gap_ms"] == pytest.approx(419, abs=1)
    assert row["worst_frame_gap_ms"] == pytest.approx(16)
    assert row["duration_s"] == pytest.approx(3)
    assert row["valid"] is False


def test_a_window_that_stood_still_makes_its_trial_invalid(tmp_path: Path) -> None:
    row = Judged(tmp_path / "study", stall_s=0.4).row
    assert row["worst_frame_gap_ms"] == pytest.approx(416, abs=1)
    assert row["worst_gap_ms"] == pytest.approx(1)
    assert row["delay_error_p95_ms"] < 25  # frames that never came have no age
    assert row["valid"] is False
