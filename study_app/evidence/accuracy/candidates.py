"""The wake as a list that is processed entirely at every tick, the naive implementation: compiled, numpy, Python.

They are alternatives to ``haptics.kernels.effects.wake`` whose computation time grows with the length of the
list. Each keeps the elements in a ring and answers two questions a tick: `wake` and, after the force, `follow`.

The candidates: methods to compute a force from a motion, each measured for error and time.

A rung takes ticks, one after another: `Rung.forces` takes a whole motion at once, `Rung.begin` and `Rung.take` let the
ticks be timed in batches. Compiled rungs all run the servo's own tick, door and safety included, so that what differs
between their times is the model alone.

The candidates to compare: from the most to the least expensive, and from the most accurate to the cheapest.
"""

import math
import sys
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal, TypeAlias

import numpy as np

from study_app.evidence.reference_model import lowered
from study_app.evidence.reference_solutions import COUNT_M, Truth
from study_app.evidence.scene_variants import _only, with_effects, with_wake
from study_app.evidence.unsteady_law import unsteady_n
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.effects.drag import resistance
from study_app.haptics.kernels.effects.wake import REST_MPS, response
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.kernels.tick import tick
from study_app.haptics.kernels.vector import norm, subtract
from study_app.haptics.model.effects.drag import REFERENCE, resistance_n
from study_app.haptics.model.estimators.given import CODE as GIVEN
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.laws.drag_laws import Law
from study_app.haptics.model.layout import SAMPLE, Record, records
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Effect, Estimator, Ewma, Foaw, Given, Line, Raw, Scene
from study_app.haptics.model.slope_limits import DampingLimits
from study_app.haptics.runtime.pack import Model, pack

TAIL: Final = np.dtype(
    [
        ("held", np.int64),
        ("newest", np.int64),  # row of the newest element
        ("segment", np.int64),  # number of the newest segment
        ("stored", np.int64),  # 1 once an element was stored
        ("arc_m", np.float64),
        ("stored_at_m", np.float64, (3,)),
        ("wake_mps", np.float64, (3,)),
        ("relative_mps", np.float64, (3,)),
    ],
    align=True,
)


def new_list(length: int, dtype: type[np.floating[Any]]) -> tuple[Any, Any, Any, Any]:
    """Return an empty list for compiled code: TAIL, elements (N, 3), arcs (N,), segments (N,); -1 is no segment."""
    tail = records(TAIL, 1)
    tail[0].newest = length - 1
    return tail, np.zeros((length, 3), dtype), np.zeros(length), np.full(length, -1)


@kernel
def list_wake(wake: Record, tail: Record, element: Any, segment: Any) -> None:
    """Set ``tail.wake_mps`` from all elements, newest first, in sums of the elements' own precision."""
    zero = element[0, 0] - element[0, 0]
    tx = ty = tz = dx = dy = dz = summed = speeds = squares = zero
    inside, row = -1, tail.newest
    for _ in range(tail.held):
        if segment[row] >= 0:
            x, y, z = element[row, 0], element[row, 1], element[row, 2]
            speed = math.sqrt(x * x + y * y + z * z)
            if segment[row] != inside:
                tx, ty, tz = tx + dx * summed, ty + dy * summed, tz + dz * summed
                dx, dy, dz = x / speed, y / speed, z / speed
                summed, inside = zero, segment[row]
            summed += speed
            speeds += speed
            squares += speed * speed
        row = row - 1 if row > 0 else len(segment) - 1
    tx, ty, tz = tx + dx * summed, ty + dy * summed, tz + dz * summed
    gain = 0.0
    if speeds > 0.0:
        size = math.sqrt(tx * tx + ty * ty + tz * tz) / wake.scaling
        gain = response(size * speeds / squares, wake.exponent) / wake.scaling if size > 0.0 else 0.0
    tail.wake_mps[0], tail.wake_mps[1], tail.wake_mps[2] = gain * tx, gain * ty, gain * tz


@kernel
def list_follow(
    wake: Record, tail: Record, element: Any, arc: Any, segment: Any, h: Any, place_m: Any, interval_s: float
) -> None:
    """Let every element decay, and store the tick's velocity if the rules require it."""
    keep = math.exp(wake.log_decay_per_s * interval_s)
    rows = len(segment)
    for row in range(tail.held):
        for axis in range(3):
            element[row, axis] *= keep
    hx, hy, hz = h[0], h[1] * wake.vertical, h[2]
    speed = math.sqrt(hx * hx + hy * hy + hz * hz)
    tail.arc_m += speed * interval_s
    px, py, pz = place_m[0] - tail.stored_at_m[0], place_m[1] - tail.stored_at_m[1], place_m[2] - tail.stored_at_m[2]
    rests = speed < REST_MPS
    if not rests and tail.stored == 1 and math.sqrt(px * px + py * py + pz * pz) < wake.resolution_m:
        return
    if not rests:
        reference, row = -1, tail.newest
        for _ in range(tail.held):
            if segment[row] == tail.segment:
                reference = row
                if tail.arc_m - arc[row] >= wake.breaking_span_m:
                    break
            row = row - 1 if row > 0 else rows - 1
        if reference < 0:
            tail.segment += 1
        else:
            x, y, z = element[reference, 0], element[reference, 1], element[reference, 2]
            least = (wake.breaking_cosine - 1e-12) * speed * math.sqrt(x * x + y * y + z * z)
            if hx * x + hy * y + hz * z < least:
                tail.segment += 1
    tail.newest = tail.newest + 1 if tail.newest + 1 < rows else 0
    tail.held = min(tail.held + 1, rows)
    tail.stored = 1
    element[tail.newest, 0], element[tail.newest, 1], element[tail.newest, 2] = hx, hy, hz
    arc[tail.newest] = tail.arc_m
    segment[tail.newest] = -1 if rests else tail.segment
    for axis in range(3):
        tail.stored_at_m[axis] = place_m[axis]


class NumpyTail:
    """The list as numpy arrays, newest first; every tick moves all of it on by one."""

    def __init__(self, wake: Record) -> None:
        rows = int(wake.length)
        self._constants = wake
        self._element, self._arc, self._segment = np.zeros((rows, 3)), np.zeros(rows), np.full(rows, -1)
        self._held = self._current = 0
        self._arc_m = 0.0
        self._stored_at_m: Floats | None = None

    @property
    def memory_bytes(self) -> int:
        """Size of the arrays."""
        return self._element.nbytes + self._arc.nbytes + self._segment.nbytes

    def wake(self) -> Floats:
        """Return v_wake (3,)."""
        moving = self._segment >= 0
        if not moving.any():
            return np.zeros(3)
        element, segment = self._element[moving], self._segment[moving]
        speed = np.sqrt((element**2).sum(axis=1))
        starts = np.flatnonzero(np.diff(segment, prepend=-1))
        directions = element[starts] / speed[starts, np.newaxis]
        tail = np.add.reduceat(speed, starts) @ directions / float(self._constants.scaling)
        fill = float(np.sqrt(tail @ tail)) * float(speed.sum()) / float((speed**2).sum())
        felt: Floats = tail * (_response(fill, float(self._constants.exponent)) if fill > 0 else 0.0)
        return felt

    def follow(self, h: Floats, place_m: Floats, interval_s: float) -> None:
        """Take one tick in."""
        constants = self._constants
        self._element *= math.exp(constants.log_decay_per_s * interval_s)
        h = h * np.array([1.0, constants.vertical, 1.0])
        speed = float(np.sqrt(h @ h))
        self._arc_m += speed * interval_s
        rests = speed < REST_MPS
        if not rests and self._stored_at_m is not None:
            way_m = place_m - self._stored_at_m
            if float(np.sqrt(way_m @ way_m)) < constants.resolution_m:
                return
        if not rests and self._breaks(h, speed):
            self._current += 1
        for rows in (self._element, self._arc, self._segment):
            rows[1:] = rows[:-1].copy()
        self._element[0], self._arc[0], self._segment[0] = h, self._arc_m, -1 if rests else self._current
        self._stored_at_m = place_m

    def _breaks(self, h: Floats, speed: float) -> bool:
        same = np.flatnonzero(self._segment == self._current)
        if len(same) == 0:
            return True
        far = same[self._arc_m - self._arc[same] >= self._constants.breaking_span_m]
        reference = self._element[far[0] if len(far) else same[-1]]
        least = (self._constants.breaking_cosine - 1e-12) * speed * math.sqrt(reference @ reference)
        return bool(h @ reference < least)


class PlainTail:
    """The list as a list of tuples (x, y, z, arc, segment), newest first: no library at all."""

    def __init__(self, wake: Record) -> None:
        self._length, self._scaling, self._exponent = int(wake.length), float(wake.scaling), float(wake.exponent)
        self._cosine, self._span_m = float(wake.breaking_cosine) - 1e-12, float(wake.breaking_span_m)
        self._log_decay, self._resolution_m = float(wake.log_decay_per_s), float(wake.resolution_m)
        self._vertical = float(wake.vertical)
        self._tail: list[tuple[float, float, float, float, int]] = []
        self._current, self._arc_m = 0, 0.0
        self._stored_at_m: tuple[float, ...] | None = None

    @property
    def memory_bytes(self) -> int:
        """Size of a full list: a row is a tuple of five, of which four are number objects."""
        row = (0.0, 0.0, 0.0, 0.0, 0)
        return sys.getsizeof([row] * self._length) + self._length * (sys.getsizeof(row) + 4 * sys.getsizeof(0.0))

    def wake(self) -> tuple[float, float, float]:
        """Return v_wake."""
        tx = ty = tz = dx = dy = dz = summed = speeds = squares = 0.0
        inside = -1
        for x, y, z, _, segment in self._tail:
            if segment < 0:
                continue
            speed = math.sqrt(x * x + y * y + z * z)
            if segment != inside:
                tx, ty, tz = tx + dx * summed, ty + dy * summed, tz + dz * summed
                dx, dy, dz = x / speed, y / speed, z / speed
                summed, inside = 0.0, segment
            summed += speed
            speeds += speed
            squares += speed * speed
        tx, ty, tz = tx + dx * summed, ty + dy * summed, tz + dz * summed
        size = math.sqrt(tx * tx + ty * ty + tz * tz) / self._scaling
        if size == 0.0:
            return 0.0, 0.0, 0.0
        gain = _response(size * speeds / squares, self._exponent) / self._scaling
        return gain * tx, gain * ty, gain * tz

    def follow(self, h: Floats, place_m: Floats, interval_s: float) -> None:
        """Take one tick in."""
        keep = math.exp(self._log_decay * interval_s)
        self._tail = [(keep * x, keep * y, keep * z, arc, segment) for x, y, z, arc, segment in self._tail]
        hx, hy, hz = float(h[0]), float(h[1]) * self._vertical, float(h[2])
        at = tuple(place_m.tolist())
        speed = math.sqrt(hx * hx + hy * hy + hz * hz)
        self._arc_m += speed * interval_s
        rests = speed < REST_MPS
        if not rests and self._stored_at_m is not None and math.dist(at, self._stored_at_m) < self._resolution_m:
            return
        if not rests and self._breaks(hx, hy, hz, speed):
            self._current += 1
        self._tail.insert(0, (hx, hy, hz, self._arc_m, -1 if rests else self._current))
        del self._tail[self._length :]
        self._stored_at_m = at

    def _breaks(self, hx: float, hy: float, hz: float, speed: float) -> bool:
        reference = None
        for element in self._tail:
            if element[4] == self._current:
                reference = element
                if self._arc_m - element[3] >= self._span_m:
                    break
        if reference is None:
            return True
        x, y, z = reference[:3]
        return hx * x + hy * y + hz * z < self._cosine * speed * math.sqrt(x * x + y * y + z * z)


def _response(fill: float, exponent: float) -> float:
    """Return the factor of the tail at a fill, by the definition."""
    return float(fill ** (exponent - 1) if exponent >= 1 else (fill**2 + 0.05**2) ** ((exponent - 1) / 2))


UNLIMITED: Final = DampingLimits(1e9, 1e9)
"""Forces are compared without slope limit, which the table lacks for the slowest candidates."""
Family: TypeAlias = Literal["tick", "list", "rate", "estimator", "law", "effects"]


@dataclass(eq=False)
class Rung(ABC):
    """One way to get the force: ``name`` on tables, ``label`` on figures, ``scene`` of one liquid, everywhere.

    ``every`` takes one tick where the motion has so many, and holds the force between; ``counted`` gives positions in
    whole counts of an encoder, in place of exact ones.
    """

    name: str
    label: str
    family: Family
    scene: Scene
    every: int = 1
    counted: bool = False
    force_n: Floats = None  # type: ignore[assignment]  # (ticks, 3), filled as ticks are taken

    BATCH: ClassVar[int] = 1000

    def begin(self, motion: Motion) -> None:
        """Reset, and prepare for the ticks of a motion with velocities."""
        rows = slice(None, None, self.every)
        self._t_ns = np.rint(motion.t_s[rows] * 1e9).astype(np.int64)
        self._place_m = motion.position_m[rows]
        self._velocity_mps = np.zeros_like(self._place_m)
        if motion.velocity_mps is not None:
            self._velocity_mps = np.ascontiguousarray(motion.velocity_mps[rows])
        hand_m = (self._place_m - np.array(self.scene.origin_m)) / self.scene.scale
        self._hand_m = np.rint(hand_m / COUNT_M) * COUNT_M if self.counted else hand_m
        self.force_n = np.zeros_like(self._place_m)
        self._begin()

    @property
    def ticks(self) -> int:
        """The number of ticks of the motion for this candidate."""
        return len(self._t_ns)

    @property
    def rate_hz(self) -> float:
        """Ticks per second of the motion."""
        return self.scene.rate_hz

    def forces(self, motion: Motion) -> Floats:
        """Return the force at every row of the motion, (n, 3) [N]."""
        self.begin(motion)
        self.take(0, self.ticks)
        return np.repeat(self.force_n, self.every, axis=0)[: len(motion.t_s)]

    def forces_against(self, truth: Truth) -> list[Floats]:
        """Return the forces along the motions of a reference, each (n, 3) [N]."""
        return [self.forces(case.motion) for case in truth.cases]

    @abstractmethod
    def _begin(self) -> None:
        """Allocate the memory of a run."""

    @abstractmethod
    def take(self, start: int, stop: int) -> None:
        """Run these ticks and set their rows of ``force_n``."""

    @property
    @abstractmethod
    def memory_bytes(self) -> int:
        """The size of the model's state between ticks."""


class TickRung(Rung):
    """The program itself: the scene computed by the servo's tick."""

    def _begin(self) -> None:
        self._model, self._safety, self._sample = _packed(self.scene), new_safety(), records(SAMPLE, 1)

    def take(self, start: int, stop: int) -> None:
        """Take ticks, as `Rung.take`."""
        motion = (self._t_ns, self._hand_m, self._velocity_mps)
        _by_the_tick(self._model, self._safety[0], self._sample[0], motion, self.force_n, start, stop)

    @property
    def memory_bytes(self) -> int:
        """Size of the model."""
        return sum(rows.nbytes for rows in _packed(self.scene).arrays)


class UnsteadyRung(TickRung):
    """Unsteady drag; against a solved motion of the fit, with constants that are fitted without that motion."""

    def forces_against(self, truth: Truth) -> list[Floats]:
        """Return the forces, as `Rung.forces_against`; by the equations where a motion is left out of the fit."""
        if truth.left_out is None:
            return super().forces_against(truth)
        found = []
        for case in truth.cases:
            self.begin(case.motion)
            w, interval_s = self._velocity_mps, np.full(self.ticks, 1 / self.rate_hz)
            dw = np.diff(w, axis=0, prepend=w[:1]) * self.rate_hz
            found.append(unsteady_n(self.scene, w, dw, interval_s, truth.left_out))
        return found


class LinearRung(Rung):
    """Linear viscosity, F = −6πµR v: all that general libraries ship.

    HAPI's and H3D's ``HapticViscosity`` is this; CHAI3D's ``cEffectViscosity`` leaves the factor to the user.
    """

    def _begin(self) -> None:
        rest = self.scene.model_copy(update={"liquids": ()})
        self._model, self._safety, self._sample = _packed(rest), new_safety(), records(SAMPLE, 1)

    def take(self, start: int, stop: int) -> None:
        """Take ticks, as `Rung.take`."""
        viscosity_pa_s = self.scene.liquids[0].viscosity_pa_s or math.nan
        damping_nspm = 3 * math.pi * viscosity_pa_s * self.scene.body.diameter_m
        motion = (self._t_ns, self._hand_m, self._velocity_mps)
        _by_damping(self._model, self._safety[0], self._sample[0], motion, damping_nspm, self.force_n, start, stop)

    @property
    def memory_bytes(self) -> int:
        """Size of a model without liquids."""
        return sum(rows.nbytes for rows in _packed(self.scene.model_copy(update={"liquids": ()})).arrays)


@dataclass(eq=False)
class ListRung(Rung):
    """The wake as a compiled list, float64 or float32."""

    precision: type[np.floating[Any]] = np.float64

    def _begin(self) -> None:
        rest = self.scene.model_copy(update={"liquids": ()})
        self._model, self._safety, self._sample = _packed(rest), new_safety(), records(SAMPLE, 1)
        self._liquid = _packed(self.scene).liquids[0]
        self._list = new_list(int(self._liquid.wake.length), self.precision)

    def take(self, start: int, stop: int) -> None:
        """Take ticks, as `Rung.take`."""
        motion = (self._t_ns, self._hand_m, self._velocity_mps)
        tail, element, arc, segment = self._list
        tick = (self._model, self._safety[0], self._sample[0], motion)
        _by_the_list(tick, self._liquid, (tail[0], element, arc, segment), self.force_n, start, stop)

    @property
    def memory_bytes(self) -> int:
        """Size of the list."""
        return sum(rows.nbytes for rows in new_list(int(_packed(self.scene).liquids[0].wake.length), self.precision))


@dataclass(eq=False)
class InterpretedRung(Rung):
    """The wake as a list without the compiler, with numpy or in plain Python; no sample validation, no safety layer."""

    tail: type[NumpyTail] | type[PlainTail] = PlainTail

    def _begin(self) -> None:
        self._tail = self.tail(_packed(self.scene).liquids[0].wake)

    def take(self, start: int, stop: int) -> None:
        """Take ticks, as `Rung.take`."""
        liquid = self.scene.liquids[0]
        period_s = 1 / self.scene.rate_hz
        for k in range(start, stop):
            v = lowered(self._velocity_mps[k], self.scene.knee)
            w = v - np.array(self._tail.wake())
            speed = float(np.sqrt(w @ w))
            if speed > 0:
                self.force_n[k] = -resistance_n(self.scene, liquid, speed, liquid.drag.law) / speed * w
            interval_s = (self._t_ns[k] - self._t_ns[k - 1]) * 1e-9 if k > 0 else period_s
            self._tail.follow(v, self._place_m[k], interval_s)

    @property
    def memory_bytes(self) -> int:
        """Size of the list."""
        return self.tail(_packed(self.scene).liquids[0].wake).memory_bytes


def _packed(scene: Scene) -> Model:
    return pack(scene, limits=UNLIMITED)


def given(scene: Scene) -> Scene:
    """Return the scene with the velocity given with the motion."""
    return scene.model_copy(update={"velocity": Given()})


@kernel
def _tick(model: Any, safety: Record, sample: Record, motion: Any, k: int) -> None:
    """Run one tick of a motion."""
    t_ns, hand_m, velocity_mps = motion
    state = model.state[0]
    sample.time_ns = t_ns[k]
    sample.fresh = 1
    for axis in range(3):
        sample.position_m[axis] = hand_m[k, axis]
    if model.parameters[0].estimator == GIVEN:
        for axis in range(3):
            state.estimate_mps[axis] = velocity_mps[k, axis]
    tick(model, safety, sample)


@kernel
def _by_the_tick(model: Any, safety: Record, sample: Record, motion: Any, force_n: Any, start: int, stop: int) -> None:
    for k in range(start, stop):
        _tick(model, safety, sample, motion, k)
        for axis in range(3):
            force_n[k, axis] = sample.force_n[axis]


@kernel
def _by_damping(
    model: Any, safety: Record, sample: Record, motion: Any, damping: float, force_n: Any, start: int, stop: int
) -> None:
    for k in range(start, stop):
        _tick(model, safety, sample, motion, k)
        for axis in range(3):
            force_n[k, axis] = -damping * sample.velocity_mps[axis]


@kernel
def _by_the_list(tick: Any, liquid: Record, listed: Any, force_n: Any, start: int, stop: int) -> None:
    model, safety, sample, motion = tick
    tail, element, arc, segment = listed
    v, w = sample.velocity_mps, tail.relative_mps
    for k in range(start, stop):
        _tick(model, safety, sample, motion, k)
        list_wake(liquid.wake, tail, element, segment)
        subtract(v, tail.wake_mps, w)
        resistance_nspm = resistance(liquid.drag, norm(w))
        for axis in range(3):
            force_n[k, axis] = -resistance_nspm * w[axis]
        interval_s = (motion[0][k] - motion[0][k - 1]) * 1e-9 if k > 0 else model.parameters[0].period_s
        list_follow(liquid.wake, tail, element, arc, segment, v, model.state[0].position_m, interval_s)


SLOWER = (2, 4, 10)
RESOLUTIONS_M = (0.005, 0.02)
LEAST_RATE_HZ = 50.0
_WORDS: dict[Effect, str] = {"added_mass": "added mass", "history": "history"}
_SHORT: dict[Law, str] = {
    "constant": "constant C$_d$",
    "schiller-naumann": "Schiller–Naumann (SN)",
    "haider-levenspiel": "Haider–Levenspiel (HL)",
    "brown-lawler": "Brown–Lawler (BL)",
}
_PLAIN: dict[Law, str] = {
    "constant": "constant C_d",
    "schiller-naumann": "Schiller–Naumann",
    "haider-levenspiel": "Haider–Levenspiel",
    "brown-lawler": "Brown–Lawler",
}
_INITIALS: dict[Law, str] = {
    "constant": _SHORT["constant"],
    "schiller-naumann": "SN",
    "haider-levenspiel": "HL",
    "brown-lawler": "BL",
}


def drag_and_wake(scene: Scene) -> Scene:
    """Return the scene's first liquid everywhere, with only its law of drag and its wake, if selected."""
    liquid = resolve(scene).liquids[0]
    effects = ("drag", "wake") if "wake" in liquid.effects else ("drag",)
    return _only(scene, liquid.model_copy(update={"effects": effects}))


def numerical(scene: Scene) -> tuple[tuple[Rung, ...], Rung]:
    """Return implementations of one definition, or of parts of it; and the one used in the program.

    ``scene`` is of one liquid, by `drag_and_wake`. What is about the wake is left out where there is none.
    """
    exact = given(scene)
    name = "O(1) wake" if _has_wake(scene) else "drag"
    program = TickRung(name, name, "tick", exact)
    rungs: list[Rung] = [program]
    if _has_wake(scene):
        rungs += _lists(exact)
    for every in SLOWER:
        if scene.rate_hz / every >= LEAST_RATE_HZ:
            slower = exact.model_copy(update={"rate_hz": scene.rate_hz / every})
            hertz = f"{slower.rate_hz:g} Hz"
            rungs.append(TickRung(f"{program.name}, {hertz}", hertz, "rate", slower, every=every))
    for estimator in _estimators(scene):
        name = f"{program.name}, velocity by {estimator.kind} from encoder counts"
        noisy = scene.model_copy(update={"velocity": estimator})
        rungs.append(TickRung(name, f"velocity: {estimator.kind}", "estimator", noisy, counted=True))
    return tuple(rungs), program


def _lists(exact: Scene) -> list[Rung]:
    """Return alternatives to the wake: lists, shorter or coarser ones, none."""
    length = exact.liquids[0].wake.length
    half, quarter = max(1, length // 2), max(1, length // 4)
    rungs: list[Rung] = [
        ListRung("O(N) compiled", "O(N) compiled", "list", exact),
        ListRung("O(N) compiled, float32", "O(N) float32", "list", exact, precision=np.float32),
        InterpretedRung("O(N) numpy", "numpy", "list", exact, tail=NumpyTail),
        InterpretedRung("O(N) plain Python", "Python", "list", exact, tail=PlainTail),
        ListRung("O(N) compiled, tail N/2", "O(N), N/2", "list", with_wake(exact, length=half)),
        ListRung("O(N) compiled, tail N/4", "O(N), N/4", "list", with_wake(exact, length=quarter)),
        TickRung("O(1) wake, tail N/4", "tail N/4", "tick", with_wake(exact, length=quarter)),
    ]
    for step_m in RESOLUTIONS_M:
        step = f"{1e3 * step_m:g} mm"
        coarse = with_wake(exact, resolution_m=step_m)
        rungs.append(TickRung(f"O(1) wake, resolution {step}", f"resolution {step}", "tick", coarse))
    rungs.append(TickRung("drag alone", "drag alone", "tick", with_effects(exact, "drag")))
    return rungs


def _estimators(scene: Scene) -> tuple[Estimator, ...]:
    """Return one of each kind, the scene's own unchanged."""
    own = scene.velocity
    kinds: tuple[Estimator, ...] = (Ewma(), Line(), Foaw(), Raw())
    return tuple(own if not isinstance(own, Given) and own.kind == it.kind else it for it in kinds)


def physical(scene: Scene) -> tuple[tuple[Rung, ...], Rung]:
    """Return models of a liquid with a viscosity, in order of accuracy; and the one that the gate would choose."""
    exact = given(_only(scene, scene.liquids[0]))
    rungs: list[Rung] = [LinearRung("linear viscosity", "linear viscosity", "law", exact)]
    rungs += [
        TickRung(_PLAIN[law], label, "law", with_effects(exact, "drag", law=law)) for law, label in _SHORT.items()
    ]
    carried: tuple[Effect, ...] = ()
    for effect in ("added_mass", "history"):
        carried = (*carried, effect)
        rungs.append(_carrying(exact, REFERENCE, carried))
    rungs.append(UnsteadyRung("unsteady drag", "unsteady drag", "effects", with_effects(exact, "unsteady_drag")))
    gated = resolve(_only(scene, scene.liquids[0].model_copy(update={"effects": "auto"}))).liquids[0]
    carried = tuple(it for it in _WORDS if it in gated.effects)
    if "unsteady_drag" in gated.effects:
        return tuple(rungs), rungs[-1]
    if "drag" not in gated.effects:
        choice: Rung = TickRung("no resistance", "no resistance", "effects", with_effects(exact, *carried))
    else:
        choice = _carrying(exact, gated.drag.law, carried)
    same = next((rung for rung in rungs if type(rung) is TickRung and rung.scene == choice.scene), None)
    return (tuple(rungs), same) if same is not None else ((*rungs, choice), choice)


def _carrying(exact: Scene, law: Law, carried: tuple[Effect, ...]) -> Rung:
    """Return drag with added mass and history as applicable."""
    words = [_WORDS[it] for it in carried]
    of = with_effects(exact, "drag", *carried, law=law)
    return TickRung(" + ".join([_PLAIN[law], *words]), " + ".join([_INITIALS[law], *words]), "effects", of)


def _has_wake(scene: Scene) -> bool:
    return "wake" in scene.liquids[0].effects
