"""Device and servo of the lab: presents edited scenes, moves the hand along programmed paths, and reads the results.

`Live` has no thread: its owner calls `poll` about thirty times per second. The servo only receives complete scenes and
provides telemetry. At the end of the lab, `close` sends zero force before it closes the device.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from study_app.devices.hand import hand_of
from study_app.devices.registry import descriptor_of
from study_app.devices.rig import Rig, RigSettings, open_rig
from study_app.haptics.model.layout import LIMITER_NORM, LIMITER_SLEW, LIMITERS, SAMPLE, records
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import slew_limit_n
from study_app.lab.ab_comparison import Side, Workbench, other_side
from study_app.lab.programmed_paths import lead_to_path, programmed_path
from study_app.lab.shadow import Shadow, Tail, Trace
from study_app.protocol.randomization import stream

if TYPE_CHECKING:
    from study_app.haptics.model.motion import Motion


_COUNTED_NS: Final = 10_000_000_000
_NOW_NS: Final = 150_000_000


@dataclass(frozen=True, slots=True)
class LimiterCount:
    """A limiter, the number of ticks in the last 10 s in which it acted, and whether it acts now."""

    name: str
    ticks: int
    acting: bool


class LimiterCounts:
    """Counts how often the limiters acted in the last 10 s, in batches of samples."""

    def __init__(self) -> None:
        self._batches: deque[tuple[int, Any]] = deque()

    def add(self, samples: Any) -> None:
        if len(samples) == 0:
            return
        newest_ns = int(samples.time_ns[-1])
        counts = np.array([np.count_nonzero(samples.limiters & limiter.bit) for limiter in LIMITERS])
        self._batches.append((newest_ns, counts))
        while self._batches[0][0] <= newest_ns - _COUNTED_NS:
            self._batches.popleft()

    def rows(self, force_limit_n: float, slew_n: float) -> tuple[LimiterCount, ...]:
        """Return the counts of every limiter; names contain the limits of the force and of its change per tick."""
        newest_ns = self._batches[-1][0] if self._batches else 0
        zeros = np.zeros(len(LIMITERS), np.int64)
        counts = sum((batch for _, batch in self._batches), zeros)
        acting = sum((batch for end_ns, batch in self._batches if end_ns > newest_ns - _NOW_NS), zeros)
        limits = {LIMITER_SLEW: f", {slew_n:g} N per tick", LIMITER_NORM: f", {force_limit_n:g} N"}
        return tuple(
            LimiterCount(limiter.label + limits.get(limiter.bit, ""), int(ticks), bool(now))
            for limiter, ticks, now in zip(LIMITERS, counts, acting, strict=True)
        )


_Vector = tuple[float, float, float]

WORKSPACE_M: Final[_Vector] = (0.1, 0.06, 0.06)
_FORCE_LIMIT_N: Final = 8.0
_ELEMENTS: Final = 100_000  # maximum length of a wake
_FADE_NS: Final = 50_000_000  # duration of a fade; a new scene waits for its end, so that each one can be felt
_LONGEST_GAP_NS: Final = 200_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Hand position [m, hand frame], force on the hand [N], wake at the body [m/s, scene], and state of the servo.

    ``fault`` is a sentence with the reason why the servo stopped itself, "" while it runs.
    """

    position_m: _Vector
    force_n: _Vector
    wake_mps: _Vector
    force_on: bool
    fault: str


class Live:
    """An open device and its servo in the lab; all scenes run at the servo's ``rate_hz``."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self.device = device = rig.device
        self.servo = servo = rig.servo
        self.path: str | None = None
        rest = Scene(rate_hz=servo.rate_hz)
        self.shadow = Shadow(rest, servo.elements, device.force_limit_n, device.dynamics)
        self._simulated_hand: _SimulatedHand | None = None
        self._reader = servo.telemetry.reader()
        self._dropped = 0
        self.hand = hand_of(device)
        self._counts = LimiterCounts()
        self.workbench: Workbench | None = None
        self._waiting: Workbench | None = None
        self._loaded_ns: int | None = None
        self._closed = False

    def prepare(self) -> None:
        """Compile all functions that run later, or load them from the cache; takes seconds after a change."""
        self.servo.prepare()
        self.shadow.prepare()

    def feel(self, bench: Workbench, *, anew: bool = False) -> None:
        """Present the selected setting of ``bench`` from the next tick, and compute the other setting in parallel.

        Changes of parameters keep the wake (`Servo.adjust`). Other changes begin with a fade of 50 ms; during a fade,
        the latest change waits for its end. A setting that is already presented continues unchanged, unless ``anew``
        restarts it for a blind comparison.

        Raises
        ------
        StudyError
            The servo cannot present it, or has stopped itself.
        """
        before = self.workbench
        continues = self._waiting is None and before is not None and before.presented == bench.presented and not anew
        if continues and before is not None and before.in_hand.scene == bench.in_hand.scene:
            self.servo.check()
            side = other_side(bench.presented)
            self.workbench = bench
            for shadow in (self.shadow, *([self._simulated_hand.shadow] if self._simulated_hand is not None else ())):
                shadow.set_other(side, self._presentable(bench.setting(side).scene))
            return
        if continues and self.servo.may_adjust(self._presentable(bench.in_hand.scene)):
            self._present(bench, continues=True)
            return
        self._waiting = bench
        self._load_waiting_scene()

    @property
    def due_in_s(self) -> float | None:
        """Time until `poll` may load the waiting scene [s]; None if no scene waits."""
        if self._waiting is None or self._loaded_ns is None:
            return None
        return max(self._loaded_ns + _FADE_NS - self.servo.now_ns(), 0) * 1e-9

    def poll(self) -> None:
        """Process new telemetry, load a waiting scene, and restart a path that has ended.

        Raises
        ------
        StudyError
            A waiting scene cannot be presented.
        """
        samples = self._reader.read()
        lost, self._dropped = self._reader.dropped != self._dropped, self._reader.dropped
        if len(samples):
            self._counts.add(samples)
            self.shadow.process_samples(samples, lost=lost)
        if self._simulated_hand is not None:
            self._simulated_hand.follow(self.servo.now_ns())
        self._load_waiting_scene()
        if self.path is not None and self.hand is not None and not self.hand.moving:
            self._start_path()

    def play(self, name: str | None) -> None:
        """Move the hand along a programmed path repeatedly; with None stop.

        A device that a person holds is not moved; then the path is only computed and drawn.

        Raises
        ------
        StudyError
            There is no such path, or no setting is presented yet.
        """
        self.path, self._simulated_hand = None, None
        if name is None:
            if self.hand is not None:
                self.hand.rest()
            return
        motion = self._programmed_motion(name)
        self.path = name
        if self.hand is not None:
            self._start_path()
        else:
            self._simulated_hand = _SimulatedHand(
                motion, self.servo.rate_hz, self.device.force_limit_n, self.servo.now_ns()
            )
            if self.workbench is not None:
                a, b = (self._presentable(setting.scene) for setting in (self.workbench.a, self.workbench.b))
                self._simulated_hand.begin(self.workbench.presented, a, b)

    def point_to(self, x_m: float, y_m: float, z_m: float) -> None:
        """Move the pointer [m, hand frame] of a device that has one, unless a path moves it."""
        point_to: Callable[[float, float, float], None] | None = getattr(self.device, "point_to", None)
        if point_to is not None and self.path is None:
            point_to(x_m, y_m, z_m)

    def press(self, buttons: int) -> None:
        """Press exactly these buttons of a device that has a pointer; button 1 is bit 0."""
        if self.hand is not None and hasattr(self.device, "point_to"):
            self.hand.press(buttons)

    def stop_force(self) -> None:
        """Send zero force from the next tick on, until `fade_in`."""
        self.servo.stop_force()

    def fade_in(self) -> None:
        """Fade the force in after `stop_force`, as slowly as at a start."""
        self.servo.fade_in()

    def limiters(self) -> tuple[LimiterCount, ...]:
        scene = Scene() if self.workbench is None else self.workbench.in_hand.scene
        limit_n = min(self.device.force_limit_n, scene.force_limit_n)
        slew_n = slew_limit_n(1 / self.servo.rate_hz, self.device.dynamics, scene.velocity)
        return self._counts.rows(limit_n, slew_n)

    def trace(self) -> Trace | None:
        """Return the last 2.5 s for A and for B."""
        return self._active_shadow.trace()

    def tail(self, side: Side) -> Tail | None:
        return self._active_shadow.tail(side)

    def reading(self) -> Reading | None:
        """Return the current state; None before the first tick."""
        latest = self.servo.telemetry.latest()
        if latest is None:
            return None
        return Reading(
            position_m=_vector(latest.position_m),
            force_n=_vector(latest.device_force_n),
            wake_mps=_vector(latest.wake_mps),
            force_on=self.servo.force_is_on,
            fault=self.servo.fault or "",
        )

    def close(self) -> None:
        """Send zero force, stop the servo and close the device, in this safe order; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        self.servo.stop_force()
        self._rig.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def _active_shadow(self) -> Shadow:
        return self.shadow if self._simulated_hand is None else self._simulated_hand.shadow

    def _load_waiting_scene(self) -> None:
        now_ns = self.servo.now_ns()
        if self._waiting is None or (self._loaded_ns is not None and now_ns < self._loaded_ns + _FADE_NS):
            return
        bench, self._waiting = self._waiting, None
        self._loaded_ns = now_ns
        self._present(bench, continues=False)

    def _present(self, bench: Workbench, *, continues: bool) -> None:
        """Present the selected setting with the servo, and update the shadows."""
        a, b = (self._presentable(setting.scene) for setting in (bench.a, bench.b))
        serial = (self.servo.adjust if continues else self.servo.load)(a if bench.presented == "A" else b)
        self.workbench = bench
        self.shadow.expect(serial, bench.presented, a, b, continues=continues)
        if self._simulated_hand is not None:
            self._simulated_hand.begin(bench.presented, a, b, continues=continues)

    def _presentable(self, scene: Scene) -> Scene:
        """Return a scene with the servo's rate."""
        if scene.rate_hz == self.servo.rate_hz:
            return scene
        return Scene(**(dict(scene) | {"rate_hz": self.servo.rate_hz}))

    def _programmed_motion(self, name: str) -> Motion:
        scene = Scene() if self.workbench is None else self.workbench.in_hand.scene
        return programmed_path(name, scene, self.device.workspace_m)

    def _start_path(self) -> None:
        """Move the hand from its current position to the path, and along it."""
        assert self.path is not None and self.hand is not None  # noqa: S101, PT018 - called for a path and a hand
        motion = lead_to_path(self._programmed_motion(self.path), self.hand.aim_m)
        self.hand.follow(motion.t_s, motion.position_m)


class _SimulatedHand:
    """A simulated hand on a path, for devices that a person holds: its samples go to a separate shadow."""

    def __init__(self, motion: Motion, rate_hz: float, limit_n: float, now_ns: int) -> None:
        self.shadow = Shadow(Scene(rate_hz=rate_hz), _ELEMENTS, limit_n, without_servo=True)
        self._motion = lead_to_path(motion, motion.position_m[-1])
        self._period_ns = round(1e9 / rate_hz)
        self._started_ns = self._next_ns = now_ns
        self._serial = 0

    def begin(self, presented: Side, a: Scene, b: Scene, *, continues: bool = False) -> None:
        self._serial += 1
        self.shadow.expect(self._serial, presented, a, b, continues=continues)

    def follow(self, now_ns: int) -> None:
        """Compute the ticks that a servo would have run by now; skip those that are overdue for too long."""
        first_ns = max(self._next_ns, now_ns - _LONGEST_GAP_NS)
        times_ns = np.arange(first_ns, now_ns, self._period_ns)
        if len(times_ns) == 0:
            return
        self._next_ns = int(times_ns[-1]) + self._period_ns
        samples = records(SAMPLE, len(times_ns))
        samples.time_ns, samples.scene, samples.fresh = times_ns, self._serial, 1
        t_s = ((times_ns - self._started_ns) * 1e-9) % self._motion.t_s[-1]
        for axis in range(3):
            samples.position_m[:, axis] = np.interp(t_s, self._motion.t_s, self._motion.position_m[:, axis])
        self.shadow.process_samples(samples)


def open_live(
    name: str,
    *,
    options: Mapping[str, str | Path] | None = None,
    progress: Callable[[str], object] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Live:
    """Open a device and start its servo at rest; the first compilation takes a minute.

    Parameters
    ----------
    options : values of options by name; options of other devices are ignored
    progress : function that gets the device's requests while it is opened
    cancelled : function that returns whether to stop opening it

    Raises
    ------
    StudyError
        The device cannot be opened; nothing is left open.
    """
    known_options = {option.name for option in descriptor_of(name).options}
    settings = RigSettings(
        workspace_m=WORKSPACE_M,
        force_limit_n=_FORCE_LIMIT_N,
        elements=_ELEMENTS,
        random=stream(1, "lab/tremor"),
        options={option: value for option, value in (options or {}).items() if option in known_options},
    )
    rig = open_rig(name, settings, progress=progress, cancelled=cancelled)
    try:
        live = Live(rig)
        live.prepare()
    except BaseException:
        rig.stop()
        raise
    return live


def _vector(values: Any) -> _Vector:
    x, y, z = values
    return float(x), float(y), float(z)
