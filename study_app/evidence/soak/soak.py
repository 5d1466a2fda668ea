"""Soak test: run the real servo for hours or days with demanding motions and injected hardware faults.

Each round has three parts. *Rough*: all kinds of faults; the liquid changes every few seconds, the force is stopped and
restored, and the device is lost and reconnected. *Steady*: one liquid and only faults that its wake must survive, so
that its sums run for a long time. *Rest*: the hand keeps still for longer than the wake lasts. A round takes an hour,
or a quarter of a shorter soak test, but at least five seconds.

Every sample is checked (``sample_audit``), the wake is compared with its definition (``ledger``), and memory is read at
every tenth of the test. On a virtual clock the same loop runs as fast as it computes.
"""

import math
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from random import Random
from types import TracebackType
from typing import Final, Literal, NamedTuple, Self, TypeAlias

import numpy as np
import psutil

from study_app.devices.faulty import BUTTON, GLITCH, JUMP, LOST, LOST_AT_WRITE, NON_FINITE, SILENCE, FaultyDevice
from study_app.devices.simulated import TREMOR_M, ScriptedDevice
from study_app.errors import DeviceLost, ServoFault, StudyError
from study_app.evidence.soak import ledger
from study_app.evidence.soak.ledger import Drift, wake_of
from study_app.evidence.soak.result import PERCEPTIBLE_N, Rests, SoakResult
from study_app.evidence.soak.sample_audit import Audit
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.ranges import Vector
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import slew_limit_n
from study_app.haptics.runtime.clocks import SystemClock, VirtualClock
from study_app.haptics.runtime.pack import elements_needed
from study_app.haptics.runtime.servo import Servo

_REACH_M: Final = 0.04  # range of the hand to every side of the centre
_ROW_S: Final = 4e-3
_SLOWEST_MPS: Final = 0.02
_FASTEST_MPS: Final = 1.0


class _RandomHand(ScriptedDevice):
    """A hand that draws its next motion from its own random stream."""

    def __init__(self, random: Random, *, force_limit_n: float = 8.0) -> None:
        super().__init__(random, force_limit_n=force_limit_n)
        self._draw = random.random

    def start_motion(self) -> float:
        """Start a random motion and return its duration [s]."""
        self._set_tremor(TREMOR_M)
        kind = self._draw()
        if kind < 0.3:
            return self._reach()
        if kind < 0.4:
            self.rest()
            return 0.1 + self._draw()
        return self._circle() if kind < 0.7 else self._zigzag()

    def keep_still(self) -> None:
        """Stay at rest without tremor, so that the encoder counts are constant."""
        self._set_tremor(0.0)
        self.rest()

    def _set_tremor(self, amplitude_m: float) -> None:
        self.state.hand.tremor_m = amplitude_m

    def _reach(self) -> float:
        duration_s = 0.12 + 1.5 * self._draw() ** 2
        x_m, y_m, z_m = self._random_place_m()
        self.reach_to(x_m, y_m, z_m, duration_s)
        return duration_s + 0.3 * self._draw()

    def _random_speed_mps(self) -> float:
        return float(_SLOWEST_MPS * (_FASTEST_MPS / _SLOWEST_MPS) ** self._draw())

    def _random_place_m(self) -> Vector:
        x_m, y_m, z_m = (_REACH_M * (2 * self._draw() - 1) for _ in range(3))
        return x_m, y_m, z_m

    def _circle(self) -> float:
        """Move in circles at a constant speed, and up and down at the same time."""
        radius_m = _REACH_M * (0.1 + 0.9 * self._draw())
        duration_s = 1.0 + 5.0 * self._draw()
        t_s = np.arange(round(duration_s / _ROW_S) + 1) * _ROW_S
        angle = t_s * self._random_speed_mps() / radius_m + 2 * math.pi * self._draw()
        y_m = 0.3 * radius_m * np.sin(0.37 * angle)
        self.follow(t_s, np.column_stack([radius_m * np.cos(angle), y_m, radius_m * np.sin(angle)]))
        return duration_s

    def _zigzag(self) -> float:
        """Move along straight lines to random positions without slowing down at the corners."""
        legs = 4 + int(8 * self._draw())
        places_m = np.array([self._random_place_m() for _ in range(legs)])
        lengths_m = np.linalg.norm(np.diff(places_m, axis=0), axis=1)
        t_s = np.concatenate([[0.0], np.cumsum(np.maximum(lengths_m / self._random_speed_mps(), _ROW_S))])
        self.follow(t_s, places_m)
        return float(min(t_s[-1], 8.0))


_MAX_HOURS: Final = 10_000.0
_MIN_TICKS: Final = 1_000
_MAX_ROUND_S: Final = 3600.0
_MIN_ROUND_S: Final = 5.0
_ROUGH_SHARE: Final = 0.35  # proportion of a round
_SETTLING_S: Final = 2.0  # time for a hand at rest, and its velocity estimate, to settle
_MAX_REST_SHARE: Final = 0.4  # greatest proportion of a round for a rest; longer rests are omitted
_CHECK_TICKS: Final = 1000  # at most between two checks; a wake has more elements, so that no error is evicted unseen
_POLL_S: Final = 0.25  # longest time between two checks on a real clock [s]
PATIENCE_S: Final = 10.0  # while the servo runs no tick

# kind: proportion of all faults, fewest and most readings
_ROUGH_FAULTS: Final = {
    NON_FINITE: (4.0, 1, 8),
    GLITCH: (4.0, 1, 8),
    SILENCE: (4.0, 3, 60),
    JUMP: (2.0, 1, 1),
    BUTTON: (1.0, 1, 50),
    LOST: (1.0, 1, 1),
    LOST_AT_WRITE: (1.0, 1, 1),
}
_STEADY_FAULTS: Final = {NON_FINITE: (1.0, 1, 4), GLITCH: (1.0, 1, 4), SILENCE: (1.0, 3, 40), JUMP: (0.5, 1, 1)}
_ROUGH_GAP: Final = (20, 600)
_STEADY_GAP: Final = (50, 4000)

Part: TypeAlias = Literal["rough", "steady", "rest"]


class _RoundPart(NamedTuple):
    """A part of a round; ``end`` is the tick before which it ends."""

    part: Part
    round: int
    end: int


@dataclass(slots=True, kw_only=True)
class _Due:
    """The ticks at which the host acts next; a negative tick means never."""

    motion: int = 0
    scene: int = -1
    stop: int = -1
    fade: int = -1


class Soak:
    """One soak test: call `step` until it is over, then `report`; leaving the context stops the servo.

    All scenes have the same rate; ``hours`` are on the servo's clock. ``virtual`` uses a virtual clock, which runs as
    fast as possible. Motions, scenes and faults follow from ``seed``.
    """

    def __init__(self, scenes: Mapping[str, Scene], hours: float, *, virtual: bool, seed: int = 1) -> None:
        self._scenes = {name: resolve(scene) for name, scene in scenes.items()}
        self._names = list(self._scenes)
        self._lasting = [name for name in self._names if wake_of(self._scenes[name])] or self._names
        self._rate_hz = next(iter(self._scenes.values())).rate_hz
        self.hours, self.virtual, self.seed = hours, virtual, seed
        fewest = _MIN_TICKS / self._rate_hz / 3600
        if not fewest <= hours <= _MAX_HOURS:
            raise StudyError(f"a soak test lasts {fewest:.2g} to {_MAX_HOURS:g} hours, not {hours:g}")
        self.ticks = round(hours * 3600 * self._rate_hz)
        self._draw = Random(seed).random  # noqa: S311 - simulated faults, not secrets
        clock = VirtualClock() if virtual else SystemClock()
        hand = _RandomHand(Random(seed + 1))  # noqa: S311
        self.hand = hand
        self.device = FaultyDevice(hand, clock, seed)
        self._longest_wake = max(elements_needed(scene) for scene in self._scenes.values())
        self.servo = Servo(self.device, clock=clock, rate_hz=self._rate_hz, elements=self._longest_wake)
        limit_n = min(hand.force_limit_n, max(scene.force_limit_n for scene in self._scenes.values()))
        slew_n = max(slew_limit_n(1 / self._rate_hz, hand.dynamics, scene.velocity) for scene in self._scenes.values())
        self.audit = Audit(limit_n, slew_n, round(1e9 / self._rate_hz), max(hand.workspace_m))
        self.drift = Drift()
        self.reader = self.servo.telemetry.reader()
        self._due, self._rests = _Due(), Rests()
        self._recoveries, self._loads, self._stops = 0, 0, 0
        self._presented = self._names[0]
        self.stretch: _RoundPart | None = None
        self._still_from = 0
        self._memory: list[int] = []
        self._began_s = self._ticked_s = 0.0

    @property
    def done(self) -> int:
        return int(self.servo.telemetry.written[0])

    def __enter__(self) -> Self:
        ledger.compile_recording(self.reader.read())
        self.servo.prepare()
        for _ in range(2):
            self.servo.telemetry.ring.copy()  # allocate the memory of a check now, so that it does not count as growth
        self._began_s = time.perf_counter()
        self._ticked_s = time.perf_counter()
        if not self.virtual:
            self.servo.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.servo.stop()

    def step(self, ending: threading.Event | None = None) -> None:
        """Carry out the due actions, let some ticks pass, and check them; setting ``ending`` ends the wait early."""
        tick = self.done
        stretch = self._part_at(tick)
        if self.stretch is None or (stretch.part, stretch.round) != (self.stretch.part, self.stretch.round):
            self._leave_part()
            self.stretch = stretch
            self._enter_part(stretch, tick)
        self._run_due_actions(stretch, tick)
        due = [
            due_tick
            for due_tick in (self._due.motion, self._due.scene, self._due.stop, self._due.fade)
            if due_tick > tick
        ]
        ticks = min(_CHECK_TICKS, self.ticks - tick, stretch.end - tick, *(due_tick - tick for due_tick in due))
        if self.virtual:
            self.servo.advance(ticks)
        else:
            (ending or threading.Event()).wait(min(ticks / self._rate_hz, _POLL_S))
        self._check_samples()
        if self.servo.fault is not None:
            self._restart_servo()
        self._check_progress(tick)

    def _check_progress(self, before: int) -> None:
        """Raise ``ServoFault`` if the ticks have stopped without a fault, to avoid waiting forever."""
        now_s = time.perf_counter()
        if self.done > before:
            self._ticked_s = now_s
        elif now_s - self._ticked_s > PATIENCE_S:
            raise ServoFault(f"the servo has not run a tick for {PATIENCE_S:g} s, after {before} of {self.ticks} ticks")

    def report(self) -> SoakResult:
        """Stop the servo, check the remaining samples, and return the result so far."""
        took_s = time.perf_counter() - self._began_s
        if self.done >= self.ticks:
            self._leave_part()
        self.servo.stop()
        self._check_samples()
        counts, device = self.audit.counts, self.device.state
        return SoakResult(
            hours=self.hours,
            virtual=self.virtual,
            seed=self.seed,
            rate_hz=self._rate_hz,
            scenes=tuple(self._names),
            planned=self.ticks,
            ticks=self.done,
            took_s=took_s,
            memory=(*self._memory, psutil.Process().memory_info().rss),
            drift=self.drift,
            rests=self._rests,
            counts=counts.copy(),
            device=device.copy(),
            overruns=self.servo.overruns,
            dropped=self.reader.dropped,
            recoveries=self._recoveries,
            loads=self._loads,
            stops=self._stops,
        )

    def _part_at(self, tick: int) -> _RoundPart:
        length = round(self._rate_hz * min(max(900 * self.hours, _MIN_ROUND_S), _MAX_ROUND_S))
        number = tick // length
        rest = round(_SETTLING_S * self._rate_hz) + self._longest_wake
        if rest > _MAX_REST_SHARE * length:
            rest = 0
        first = number * length
        ends: tuple[tuple[Part, int], ...] = (
            ("rough", first + round(_ROUGH_SHARE * length)),
            ("steady", first + length - rest),
            ("rest", first + length),
        )
        part, end = next((part, end) for part, end in ends if tick < end)
        return _RoundPart(part, number, end)

    def _enter_part(self, stretch: _RoundPart, tick: int) -> None:
        self._due = _Due(motion=tick)
        if stretch.part == "rest":
            self._still_from = tick
            self.device.allow({}, _ROUGH_GAP)
            self.servo.fade_in()
            self.hand.keep_still()
            self._due.motion = -1
        elif stretch.part == "steady":
            self.device.allow(_STEADY_FAULTS, _STEADY_GAP)
            self.servo.fade_in()
            self._present_liquid(self._lasting[stretch.round % len(self._lasting)])
        else:
            self.device.allow(_ROUGH_FAULTS, _ROUGH_GAP)
            self._due.scene = tick
            self._due.stop = self._random_later_tick(tick, 1.0, 10.0)

    def _leave_part(self) -> None:
        sample = self.servo.telemetry.latest()
        if self._is_left_alone and sample is not None:
            self._rests.count += 1
            self._rests.wake_mps = max(self._rests.wake_mps, _vector_length(sample.wake_mps))
            self._rests.force_n = max(self._rests.force_n, _vector_length(sample.force_n))

    @property
    def _is_left_alone(self) -> bool:
        """Whether the hand is at rest in a liquid that produces no force by itself."""
        effects = {effect for liquid in self._scenes[self._presented].liquids for effect in liquid.effects}
        return self.stretch is not None and self.stretch.part == "rest" and not effects - {"drag", "wake"}

    def _run_due_actions(self, stretch: _RoundPart, tick: int) -> None:
        """Carry out the due actions: change the motion or the liquid, stop the force, or release it again."""
        due = self._due
        if 0 <= due.motion <= tick:
            due.motion = tick + max(1, round(self.hand.start_motion() * self._rate_hz))
        if 0 <= due.scene <= tick:
            self._present_liquid(self._names[int(self._draw() * len(self._names))])
            due.scene = self._random_later_tick(tick, 0.2, 10.0)
        if 0 <= due.stop <= tick:
            self.servo.stop_force()
            self._stops += 1
            due.stop = self._random_later_tick(tick, 2.0, 20.0)
        if 0 <= due.fade <= tick:
            self.servo.fade_in()
            due.fade = -1
        elif due.fade < 0 and not self.servo.force_is_on and stretch.part != "rest":
            due.fade = self._random_later_tick(tick, 0.05, 1.0)

    def _random_later_tick(self, tick: int, least_s: float, most_s: float) -> int:
        return tick + max(1, round((least_s + (most_s - least_s) * self._draw()) * self._rate_hz))

    def _present_liquid(self, name: str) -> None:
        """Present a liquid; a servo that has stopped itself receives it after its recovery."""
        self._presented = name
        with suppress(DeviceLost, ServoFault):
            self.drift.expect_scene(self.servo.load(self._scenes[name]), self._scenes[name])
            self._loads += 1

    def _restart_servo(self) -> None:
        """Restart a servo that has stopped itself, as a host does once the cable is reconnected."""
        self.servo.stop()
        self._check_samples()
        self._recoveries += 1
        if not self.virtual:
            self.servo.start()
        self._present_liquid(self._presented)

    def _check_samples(self) -> None:
        """Check all new samples and, at every tenth of the test, the memory."""
        samples = self.reader.read()
        self.audit.check(samples)
        self.drift.record(samples)
        pushed = samples.tick[np.linalg.norm(samples.device_force_n, axis=1) > PERCEPTIBLE_N]
        if self._is_left_alone and pushed.size:
            self._rests.pushed_s = max(self._rests.pushed_s, (int(pushed[-1]) - self._still_from) / self._rate_hz)
        if len(self._memory) <= min(10 * self.done // self.ticks, 9) and self.done > 0:
            self._memory.append(psutil.Process().memory_info().rss)


def _vector_length(vector: Floats) -> float:
    """Return the length of a vector (3,); infinite if it is not finite."""
    return float(np.nan_to_num(np.linalg.norm(vector), nan=np.inf))


def soak_servo(
    scenes: Mapping[str, Scene],
    hours: float,
    *,
    virtual: bool,
    seed: int = 1,
    ending: threading.Event | None = None,
    progress: Callable[[str], None] = lambda _line: None,
) -> SoakResult:
    """Run a soak test of the servo in ``scenes`` and return its result, also if it is ended early.

    ``progress`` is called with one line at the start and at every tenth; setting ``ending`` ends the test.

    Raises
    ------
    StudyError
        The hours are out of range.
    """
    ending = ending or threading.Event()
    with Soak(scenes, hours, virtual=virtual, seed=seed) as run:
        progress(f"starting {run.ticks:,} ticks; Ctrl+C ends the run and prints the report so far")
        tenth = 0
        while run.done < run.ticks and not ending.is_set():
            run.step(ending)
            if 10 * run.done // run.ticks > tenth:
                tenth = 10 * run.done // run.ticks
                held_mib = psutil.Process().memory_info().rss / 2**20
                progress(f"{10 * tenth:3} %  {run.done:,} ticks, drift {run.drift.worst:.1e}, {held_mib:.1f} MiB")
        return run.report()
