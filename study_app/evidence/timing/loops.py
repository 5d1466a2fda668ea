"""The loops that are timed: each takes a tick every millisecond for a while, and says how late each began.

All count alike: a deadline every millisecond; one that a tick ran past is passed over and counted, never made up for.
"""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.evidence.timing.timed_scene import FULL, PlayedHand
from study_app.haptics.kernels.c_functions import SLEEP, Driver, call_at
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.runtime.clocks.clock import Clock, SystemClock, VirtualClock, raise_priority
from study_app.haptics.runtime.clocks.grants import Grant
from study_app.haptics.runtime.pack import elements_needed
from study_app.haptics.runtime.servo import Servo

Kind: TypeAlias = Literal["servo", "bare", "thread", "qt"]
Whole: TypeAlias = NDArray[np.int64]

PERIOD_NS: Final = 1_000_000
LEAD_IN: Final = 50  # ticks at the start of each while that are not counted: threads begin, scenes are loaded
NAMES: Final[dict[Kind, str]] = {
    "servo": "this servo",
    "bare": "bare compiled loop",
    "thread": "Python thread",
    "qt": "Qt timer",
}

_sleep = call_at(SLEEP)


class Taken(NamedTuple):
    """What a loop did: how late each tick began, how long it took [ns] (n,), and how many deadlines it passed over."""

    lateness_ns: Whole
    busy_ns: Whole
    overruns: int


class Timer(Protocol):
    """A timer of the windows' thread: calls ``fire`` every ``period_ms`` until it has done so ``count`` times.

    Returns the time at which it was started, by ``time.monotonic_ns``.
    """

    def __call__(self, period_ms: int, count: int, fire: Callable[[], object]) -> int: ...  # noqa: D102


class Loop(Protocol):
    """One of the loops: of a kind, in a priority class."""

    kind: Kind
    grant: Grant

    def run(self, ticks: int) -> Taken: ...  # noqa: D102


class ServoLoop:
    """The product: the servo with a full scene, in a thread of its own; on ``device``, None: one that costs nothing."""

    kind: Kind = "servo"

    def __init__(self, grant: Grant, *, real_time: bool, spin_us: float | None, device: Driver | None = None) -> None:
        self.grant = grant
        self.clock = SystemClock(spin_us)
        driver = PlayedHand() if device is None else device
        self.servo = Servo(driver, clock=self.clock, elements=elements_needed(FULL), real_time=real_time)
        self.servo.prepare()

    def run(self, ticks: int) -> Taken:
        """Take at least so many ticks."""
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
        return Taken(samples.lateness_ns.copy(), samples.busy_ns.copy(), overruns)


class BareLoop:
    """The limit of this machine: compiled like the servo, sleeping by the same C function on a clock like its own."""

    kind: Kind = "bare"

    def __init__(self, grant: Grant, *, real_time: bool, clock: Clock) -> None:
        self.grant = grant
        self._real_time = real_time
        self._clock = clock
        _sleep_on(self._clock.sleep.address, self._clock.context, 0, np.zeros(0, np.int64), np.zeros(1, np.int64))

    def run(self, ticks: int) -> Taken:
        """Take so many ticks."""
        lateness_ns, overruns = np.zeros(ticks + LEAD_IN, np.int64), np.zeros(1, np.int64)

        def take() -> None:
            raise_priority(real_time=self._real_time)
            clock = self._clock
            _sleep_on(clock.sleep.address, clock.context, clock.now_ns(), lateness_ns, overruns)

        _in_a_thread(take)
        return Taken(lateness_ns[LEAD_IN:], np.zeros(0, np.int64), int(overruns[0]))


@kernel
def _sleep_on(sleep: int, context: int, start_ns: int, lateness_ns: Any, overruns: Any) -> None:
    """Sleep from deadline to deadline and do nothing else."""
    deadline_ns = start_ns + PERIOD_NS
    for i in range(lateness_ns.shape[0]):
        began_ns = _sleep(sleep, context, deadline_ns)
        lateness_ns[i] = began_ns - deadline_ns
        passed = max(lateness_ns[i] // PERIOD_NS, 1)
        if i >= LEAD_IN:
            overruns[0] += passed - 1
        deadline_ns += passed * PERIOD_NS


class _SameTick:
    """The servo's tick as Python calls it: one tick of the same compiled loop, its time passed by hand."""

    def __init__(self) -> None:
        self.servo = Servo(PlayedHand(), clock=VirtualClock(), elements=elements_needed(FULL))
        self.servo.load(FULL)
        self.servo.advance(1)

    def __call__(self) -> None:
        self.servo.advance(1)


class ThreadLoop:
    """What is usual: a thread of Python that sleeps until its deadline and calls the same tick."""

    kind: Kind = "thread"

    def __init__(self, grant: Grant, *, real_time: bool) -> None:
        self.grant = grant
        self._real_time = real_time
        self.tick = _SameTick()

    def run(self, ticks: int) -> Taken:
        """Take so many ticks."""
        times: list[tuple[int, int]] = []
        start_ns = 0

        def take() -> None:
            nonlocal start_ns
            raise_priority(real_time=self._real_time)
            start_ns = time.monotonic_ns()
            deadline_ns = start_ns + PERIOD_NS
            for _ in range(ticks + LEAD_IN):
                pause_ns = deadline_ns - time.monotonic_ns()
                if pause_ns > 0:
                    time.sleep(pause_ns * 1e-9)
                began_ns = time.monotonic_ns()
                self.tick()
                ended_ns = time.monotonic_ns()
                times.append((began_ns, ended_ns))
                deadline_ns += PERIOD_NS * max(1, (ended_ns - deadline_ns) // PERIOD_NS)

        _in_a_thread(take)
        return taken(start_ns, times)


class QtLoop:
    """What a program of windows offers: a precise timer of Qt, in their thread, that calls the same tick."""

    kind: Kind = "qt"

    def __init__(self, grant: Grant, timer: Timer) -> None:
        self.grant = grant
        self._timer = timer
        self.tick = _SameTick()

    def run(self, ticks: int) -> Taken:
        """Take so many ticks."""
        times: list[tuple[int, int]] = []

        def fire() -> None:
            began_ns = time.monotonic_ns()
            self.tick()
            times.append((began_ns, time.monotonic_ns()))

        return taken(self._timer(PERIOD_NS // 1_000_000, ticks + LEAD_IN, fire), times)


def taken(start_ns: int, times: Sequence[tuple[int, int]]) -> Taken:
    """Return the lateness of ticks that began and ended at ``times`` [ns], a deadline every millisecond from a start.

    After each tick the deadlines that it ran past are passed over, but for the last; one that comes early is not late.
    """
    began, ended = np.array(times, np.int64).reshape(-1, 2).T
    lateness_ns = np.zeros(len(began), np.int64)
    overruns, due_ns = 0, start_ns + PERIOD_NS
    for i in range(len(began)):
        lateness_ns[i] = max(0, int(began[i]) - due_ns)
        passed = max(1, (int(ended[i]) - due_ns) // PERIOD_NS)
        overruns += passed - 1 if i >= LEAD_IN else 0
        due_ns += passed * PERIOD_NS
    return Taken(lateness_ns[LEAD_IN:], (ended - began)[LEAD_IN:], overruns)


def _in_a_thread(take: Callable[[], None]) -> None:
    thread = threading.Thread(target=take, name="timed")
    thread.start()
    thread.join()


@dataclass(frozen=True, slots=True)
class Classes:
    """What this system grants: its best priority class, and the ordinary one."""

    normal: Grant
    best: Grant | None


def granted() -> Classes:
    """Return the priority classes there are to be timed; the best is None where it is the ordinary one."""
    grants: list[Grant] = []

    def ask() -> None:
        grants.append(raise_priority(real_time=False))
        grants.append(raise_priority())

    _in_a_thread(ask)
    normal, best = grants
    return Classes(normal, None if best.level == "normal" else best)
