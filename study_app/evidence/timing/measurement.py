"""Lateness of ticks: loops that run a tick every millisecond, one loop after another, and their results.

All loops count in the same way: there is a deadline every millisecond, and one that a tick overran is skipped and
counted, never made up for. A tick computes a scene with every effect, for a hand that takes no time itself.
"""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.devices.simulated import PlayedHand
from study_app.evidence.computer import LoadName, Windows, machine, under_load
from study_app.evidence.cost import hand_motion
from study_app.evidence.table import TURN_S, check_seconds, take_turns
from study_app.haptics.kernels import Driver
from study_app.haptics.model.effects import Drag, Vortex, Wake
from study_app.haptics.model.scene import Cylinder, Liquid, Scene
from study_app.haptics.runtime.clocks import SystemClock, VirtualClock, raise_priority, sleep_repeatedly
from study_app.haptics.runtime.grants import Grant, Level
from study_app.haptics.runtime.pack import elements_needed
from study_app.haptics.runtime.servo import Servo

FULL: Final = Scene(
    liquids=(
        Liquid(
            id="everything",
            density_kg_m3=1400,
            viscosity_pa_s=2.0,
            region=Cylinder(centre_m=(0.0, -0.45, 0.0), radius_m=1.0, height_m=1.0),
            effects=("drag", "wake", "current", "buoyancy", "surface", "added_mass", "history"),
            drag=Drag(law="brown-lawler"),
            wake=Wake(length=1700, scaling=1700, exponent=0.75),
            current=Vortex(core_m=0.2, peak_mps=0.5),
        ),
    )
)
"""A scene with all effects that can act at once, in which the hand leaves and re-enters the liquid."""

Kind: TypeAlias = Literal["servo", "bare", "thread", "qt"]
_Nanoseconds: TypeAlias = NDArray[np.int64]

PERIOD_NS: Final = 1_000_000
LEAD_IN: Final = 50  # ticks at the start of each turn that are not counted, while threads start and scenes are loaded
NAMES: Final[dict[Kind, str]] = {
    "servo": "this servo",
    "bare": "bare compiled loop",
    "thread": "Python thread",
    "qt": "Qt timer",
}


class Ticks(NamedTuple):
    """The timing of a loop: the lateness and duration of each tick [ns] (n,), and the number of skipped deadlines."""

    lateness_ns: _Nanoseconds
    busy_ns: _Nanoseconds
    overruns: int


_Timer: TypeAlias = Callable[[int, int, Callable[[], object]], int]
"""Call a function with a period [ms] for a number of times; return the start by ``time.perf_counter_ns``."""


class Loop(Protocol):
    """A loop to be timed, of one kind and in one priority class."""

    kind: Kind
    grant: Grant

    def run(self, ticks: int) -> Ticks: ...


class ServoLoop:
    """The program's servo with a full scene in its own thread, on ``device``, by default one that takes no time."""

    kind: Kind = "servo"

    def __init__(self, grant: Grant, *, real_time: bool, spin_us: float | None, device: Driver | None = None) -> None:
        self.grant = grant
        self.clock = SystemClock(spin_us)
        driver = PlayedHand(hand_motion()) if device is None else device
        self.servo = Servo(driver, clock=self.clock, elements=elements_needed(FULL), real_time=real_time)
        self.servo.prepare()

    def run(self, ticks: int) -> Ticks:
        """Run the servo for at least ``ticks`` ticks and return their timing."""
        servo = self.servo
        reader = servo.telemetry.reader()
        began = int(servo.telemetry.written[0])
        servo.start()
        try:
            servo.load(FULL)
            time.sleep((ticks + LEAD_IN) * PERIOD_NS * 1e-9)
            while int(servo.telemetry.written[0]) - began < ticks + LEAD_IN:
                servo.check()
                time.sleep(0.005)
        finally:
            servo.stop()
        samples = reader.read()[LEAD_IN : LEAD_IN + ticks]
        deadlines_ns = samples.time_ns - samples.lateness_ns
        overruns = int((np.diff(deadlines_ns) // PERIOD_NS - 1).sum())
        return Ticks(samples.lateness_ns.copy(), samples.busy_ns.copy(), overruns)


class _BareLoop:
    """The limit of this machine: a compiled loop that only sleeps, with the servo's C function and clock."""

    kind: Kind = "bare"

    def __init__(self, grant: Grant, *, real_time: bool, clock: SystemClock) -> None:
        self.grant = grant
        self._real_time = real_time
        self._clock = clock
        sleep_repeatedly(clock, PERIOD_NS, 0)  # compiles it

    def run(self, ticks: int) -> Ticks:
        lateness_ns = np.zeros(0, np.int64)

        def time_ticks() -> None:
            nonlocal lateness_ns
            raise_priority(real_time=self._real_time)
            lateness_ns = sleep_repeatedly(self._clock, PERIOD_NS, ticks + LEAD_IN)[LEAD_IN:]

        _run_in_thread(time_ticks)
        skipped = np.maximum(lateness_ns // PERIOD_NS, 1) - 1
        return Ticks(lateness_ns, np.zeros(0, np.int64), int(skipped.sum()))


def _new_servo_tick() -> Callable[[], object]:
    """Return a function that runs one tick of a new servo, with the same compiled loop."""
    servo = Servo(PlayedHand(hand_motion()), clock=VirtualClock(), elements=elements_needed(FULL))
    servo.load(FULL)
    servo.advance(1)
    return partial(servo.advance, 1)


class _ThreadLoop:
    """The usual approach: a Python thread that sleeps until its deadline and calls the same tick."""

    kind: Kind = "thread"

    def __init__(self, grant: Grant, *, real_time: bool) -> None:
        self.grant = grant
        self._real_time = real_time
        self.tick = _new_servo_tick()

    def run(self, ticks: int) -> Ticks:
        times: list[tuple[int, int]] = []
        start_ns = 0

        def time_ticks() -> None:
            nonlocal start_ns
            raise_priority(real_time=self._real_time)
            start_ns = time.perf_counter_ns()
            deadline_ns = start_ns + PERIOD_NS
            for _ in range(ticks + LEAD_IN):
                pause_ns = deadline_ns - time.perf_counter_ns()
                if pause_ns > 0:
                    time.sleep(pause_ns * 1e-9)
                began_ns = time.perf_counter_ns()
                self.tick()
                ended_ns = time.perf_counter_ns()
                times.append((began_ns, ended_ns))
                deadline_ns += PERIOD_NS * max(1, (ended_ns - deadline_ns) // PERIOD_NS)

        _run_in_thread(time_ticks)
        return ticks_at(start_ns, times)


class _QtLoop:
    """The usual approach in a GUI: a precise Qt timer in the GUI thread that calls the same tick."""

    kind: Kind = "qt"

    def __init__(self, grant: Grant, timer: _Timer) -> None:
        self.grant = grant
        self._timer = timer
        self.tick = _new_servo_tick()

    def run(self, ticks: int) -> Ticks:
        times: list[tuple[int, int]] = []

        def fire() -> None:
            began_ns = time.perf_counter_ns()
            self.tick()
            times.append((began_ns, time.perf_counter_ns()))

        return ticks_at(self._timer(PERIOD_NS // 1_000_000, ticks + LEAD_IN, fire), times)


def ticks_at(start_ns: int, times: Sequence[tuple[int, int]]) -> Ticks:
    """Return the lateness of ticks that began and ended at ``times`` [ns], with a deadline every millisecond.

    After each tick, missed deadlines are skipped except the last; a tick that is early counts as on time.
    """
    began, ended = np.array(times, np.int64).reshape(-1, 2).T
    lateness_ns = np.zeros(len(began), np.int64)
    overruns, due_ns = 0, start_ns + PERIOD_NS
    for i in range(len(began)):
        lateness_ns[i] = max(0, int(began[i]) - due_ns)
        period_count = max(1, (int(ended[i]) - due_ns) // PERIOD_NS)
        overruns += period_count - 1 if i >= LEAD_IN else 0
        due_ns += period_count * PERIOD_NS
    return Ticks(lateness_ns[LEAD_IN:], (ended - began)[LEAD_IN:], overruns)


def _run_in_thread(function: Callable[[], None]) -> None:
    thread = threading.Thread(target=function, name="timed")
    thread.start()
    thread.join()


@dataclass(frozen=True, slots=True)
class Classes:
    """The priority classes that this system grants: the best one, and the ordinary one."""

    normal: Grant
    best: Grant | None


def granted_classes() -> Classes:
    """Return the priority classes to be timed; the best is None if it is the ordinary one."""
    grants: list[Grant] = []

    def raise_priorities() -> None:
        grants.append(raise_priority(real_time=False))
        grants.append(raise_priority())

    _run_in_thread(raise_priorities)
    normal, best = grants
    return Classes(normal, None if best.level == "normal" else best)


LATE_NS: Final = 1_000_000
PERCENTILES: Final = (50.0, 90.0, 99.0, 99.9)

_MEDIAN_US: Final = 15.0
_TAIL_RATIO: Final = 2.5
_FEWER_LATE: Final = 5.0
_BUSY_US: Final = 5.0


@dataclass(frozen=True, slots=True)
class LoopTiming:
    """One loop in one priority class: its lateness and its tick durations [ns] (empty if it does no work)."""

    kind: Kind
    grant: Grant
    lateness_ns: _Nanoseconds
    busy_ns: _Nanoseconds
    overruns: int

    @property
    def name(self) -> str:
        return NAMES[self.kind]

    @property
    def ticks(self) -> int:
        return len(self.lateness_ns)

    def late_us(self, percent: float) -> float:
        """Return a percentile of the lateness [µs]; 100 is the maximum."""
        return float(np.percentile(self.lateness_ns, percent)) * 1e-3

    def busy_us(self, percent: float) -> float:
        return float(np.percentile(self.busy_ns, percent)) * 1e-3

    @property
    def late(self) -> int:
        """The number of ticks that began more than 1 ms late, including skipped deadlines."""
        return int((self.lateness_ns > LATE_NS).sum()) + self.overruns

    @property
    def late_share(self) -> float:
        """The proportion of deadlines that were missed by more than 1 ms."""
        return self.late / max(self.ticks + self.overruns, 1)


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit for the servo in a priority class, and the measured value; ``said`` states both."""

    level: Level
    said: str
    held: bool

    def __str__(self) -> str:
        return f"{self.level}: {self.said}: {'met' if self.held else 'missed'}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Timed:
    """The results of one run; ``loops`` are ordered by priority class, the best last, the servo first in each."""

    machine: str
    load: LoadName
    seconds: float
    spin_us: float
    spun_share: float
    frames_hz: float | None
    loops: tuple[LoopTiming, ...]
    notes: tuple[str, ...]

    @property
    def levels(self) -> tuple[Level, ...]:
        return tuple(dict.fromkeys(loop.grant.level for loop in self.loops))

    def loop(self, kind: Kind, level: Level) -> LoopTiming | None:
        return next((loop for loop in self.loops if (loop.kind, loop.grant.level) == (kind, level)), None)

    def ratio(self, loop: LoopTiming, percent: float) -> float:
        """Return the ratio of a loop's lateness percentile to that of the bare loop in its class."""
        bare = self.loop("bare", loop.grant.level)
        return loop.late_us(percent) / max(bare.late_us(percent), 1e-3) if bare is not None else float("nan")

    def limits(self) -> tuple[Limit, ...]:
        return tuple(limit for level in self.levels for limit in self._limits_at(level))

    def _limits_at(self, level: Level) -> Sequence[Limit]:
        servo, bare, thread = (self.loop(kind, level) for kind in ("servo", "bare", "thread"))
        if servo is None or bare is None or thread is None:
            return ()
        above_us = servo.late_us(50) - bare.late_us(50)
        ratio = self.ratio(servo, 99)
        busy_us = servo.busy_us(99)
        late = (
            f"{servo.late:,} {'tick' if servo.late == 1 else 'ticks'} more than 1 ms late, "
            f"{_ratio_phrase(thread, servo)} than with a Python thread (at least {_FEWER_LATE:g} times fewer; the bare "
            f"loop: {_ratio_phrase(thread, bare)})"
        )
        return tuple(
            Limit(level, text, held)
            for text, held in (
                (
                    f"median {above_us:+.1f} µs relative to the bare loop (at most +{_MEDIAN_US:g} µs)",
                    above_us <= _MEDIAN_US,
                ),
                (f"p99 {ratio:.2f} times the bare loop's (at most {_TAIL_RATIO:g})", ratio <= _TAIL_RATIO),
                (late, thread.late_share >= _FEWER_LATE * servo.late_share),
                (f"a tick took {busy_us:.1f} µs at p99 (at most {_BUSY_US:g} µs)", busy_us <= _BUSY_US),
            )
        )


def _ratio_phrase(thread: LoopTiming, other: LoopTiming) -> str:
    """Return a phrase for the ratio of a Python thread's ticks over 1 ms late to those of another loop."""
    if other.late == 0:
        return f"{thread.late:,} fewer"
    return f"{thread.late_share / other.late_share:.1f} times fewer"


def _loop_timing(kind: Kind, grant: Grant, parts: Sequence[Ticks]) -> LoopTiming:
    """Return the pooled timing of a loop over all its turns."""
    return LoopTiming(
        kind,
        grant,
        np.concatenate([part.lateness_ns for part in parts]),
        np.concatenate([part.busy_ns for part in parts]),
        sum(part.overruns for part in parts),
    )


def _run_loop(loop: Loop, ticks: int, _round: int) -> Ticks:
    return loop.run(ticks)


def measure_timing(
    seconds: float,
    load: LoadName,
    windows: Windows | None,
    *,
    spin_us: float | None = None,
    ending: threading.Event | None = None,
    progress: Callable[[str], object] = lambda _line: None,
) -> Timed:
    """Time all loops for ``seconds`` each, in turn, and return the results.

    ``windows`` gives access to the GUI thread, None without Qt. Servo and bare loop poll the clock for ``spin_us``
    before a deadline; default: the system's own. Setting ``ending`` from another thread ends the measurement.

    Raises
    ------
    StudyError
        The seconds or the spin are out of range.
    ServoFault
        The servo stopped itself.
    """
    check_seconds(seconds, "each loop is timed")
    classes = granted_classes()
    servos: list[ServoLoop] = []
    loops: list[Loop] = []
    for grant in (classes.normal, *([classes.best] if classes.best else [])):
        real_time = grant is classes.best
        servos.append(ServoLoop(grant, real_time=real_time, spin_us=spin_us))
        bare = _BareLoop(grant, real_time=real_time, clock=SystemClock(spin_us))
        loops += [servos[-1], bare, _ThreadLoop(grant, real_time=real_time)]
        if windows is not None and not real_time:
            loops.append(_QtLoop(grant, windows.timer))
    notes = [f"priority: {classes.best or classes.normal}", *(() if classes.best else classes.normal.advice)]
    if windows is None:
        notes.append("Qt is not available: its timer was not measured")
    rounds = max(1, round(seconds / TURN_S))
    ticks = round(seconds / rounds * 1e9) // PERIOD_NS

    def measure_loops() -> Timed:
        frames, began_s = windows.frames if windows else 0, time.perf_counter()
        arms = {loop: partial(_run_loop, loop, ticks) for loop in loops}
        ticks_by_loop = take_turns(arms, rounds, ending=ending or threading.Event(), progress=progress)
        frames_hz = ((windows.frames if windows else 0) - frames) / (time.perf_counter() - began_s)
        loop_ns = rounds * ticks * PERIOD_NS
        return Timed(
            machine=machine(),
            load=load,
            seconds=loop_ns * 1e-9,
            spin_us=servos[0].clock.spin_us,
            spun_share=sum(servo.clock.spun_ns for servo in servos) / (len(servos) * loop_ns),
            frames_hz=frames_hz if load != "none" else None,
            loops=tuple(_loop_timing(loop.kind, loop.grant, parts) for loop, parts in ticks_by_loop.items()),
            notes=tuple(notes),
        )

    return under_load(load, windows, measure_loops)
