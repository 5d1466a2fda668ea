"""Candidates: models and methods to compute a force from a motion, each measured for error and time.

All run the servo's own tick, including sample validation and safety layer, so that their times differ only by the
model. The naive implementation of the wake is a list that is processed entirely at every tick; its computation time
grows with its length.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal, TypeAlias

import numpy as np

from study_app.evidence.reference_model import unsteady_n
from study_app.evidence.reference_solutions import COUNT_M, Truth, with_effects
from study_app.haptics.kernels import REST_MPS, kernel, norm, resistance, response
from study_app.haptics.model.effects import REFERENCE
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.laws import Law
from study_app.haptics.model.layout import records
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Effect, Everywhere, Ewma, Given, Raw, Scene
from study_app.haptics.model.slope_limits import DampingLimits
from study_app.haptics.runtime.offline import BatchedTicks
from study_app.haptics.runtime.pack import pack

_TAIL: Final = np.dtype(
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


def _new_list(length: int, dtype: type[np.floating[Any]]) -> tuple[Any, Any, Any, Any]:
    """Return an empty wake list for compiled code: TAIL, elements (N, 3), arcs (N,) and segments (N,; -1 for none)."""
    tail = records(_TAIL, 1)
    tail[0].newest = length - 1
    return tail, np.zeros((length, 3), dtype), np.zeros(length), np.full(length, -1)


@kernel
def list_wake(wake: Any, tail: Any, element: Any, segment: Any) -> None:
    """Set ``tail.wake_mps`` to the sum over all elements, newest first, in the precision of the elements."""
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
    wake: Any, tail: Any, element: Any, arc: Any, segment: Any, h: Any, place_m: Any, interval_s: float
) -> None:
    """Let all elements decay, and store the velocity of this tick if the rules require it."""
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
            breaking_product = (wake.breaking_cosine - 1e-12) * speed * math.sqrt(x * x + y * y + z * z)
            if hx * x + hy * y + hz * z < breaking_product:
                tail.segment += 1
    tail.newest = tail.newest + 1 if tail.newest + 1 < rows else 0
    tail.held = min(tail.held + 1, rows)
    tail.stored = 1
    element[tail.newest, 0], element[tail.newest, 1], element[tail.newest, 2] = hx, hy, hz
    arc[tail.newest] = tail.arc_m
    segment[tail.newest] = -1 if rests else tail.segment
    for axis in range(3):
        tail.stored_at_m[axis] = place_m[axis]


_UNLIMITED: Final = DampingLimits(1e9, 1e9)
"""No limits: the table of slope limits has no entry for the slowest candidates."""
Family: TypeAlias = Literal["tick", "list", "rate", "estimator", "law", "effects"]


@dataclass(eq=False)
class Candidate:
    """A method that computes the force of one liquid; this base class uses the servo's tick.

    ``name`` appears in tables and ``label`` in figures. ``every`` runs the tick only at every n-th sample and holds the
    force in between; ``counted`` rounds positions to whole encoder counts.
    """

    name: str
    label: str
    family: Family
    scene: Scene
    every: int = 1
    counted: bool = False
    force_n: Floats = None  # type: ignore[assignment]  # (ticks, 3), filled as ticks are taken

    BATCH: ClassVar[int] = 1000
    HAS_LIQUIDS: ClassVar[bool] = True
    """Whether the servo's tick computes the force; otherwise, it runs without liquids."""

    def begin(self, motion: Motion) -> None:
        """Reset the state and prepare for a motion with known velocities."""
        rows = slice(None, None, self.every)
        places_m = motion.position_m[rows]
        velocity_mps = np.zeros_like(places_m) if motion.velocity_mps is None else motion.velocity_mps[rows]
        hand_m = (places_m - np.array(self.scene.origin_m)) / self.scene.scale
        self.velocity_mps = np.ascontiguousarray(velocity_mps)
        self._t_ns = np.rint(motion.t_s[rows] * 1e9).astype(np.int64)
        seen_m = np.rint(hand_m / COUNT_M) * COUNT_M if self.counted else hand_m
        self.force_n = np.zeros_like(places_m)
        self._run = BatchedTicks(self._run_scene, self._t_ns, seen_m, self.velocity_mps, limits=_UNLIMITED)

    @property
    def _run_scene(self) -> Scene:
        return self.scene if self.HAS_LIQUIDS else self.scene.model_copy(update={"liquids": ()})

    @property
    def ticks(self) -> int:
        return len(self.force_n)

    @property
    def rate_hz(self) -> float:
        return self.scene.rate_hz

    @property
    def memory_bytes(self) -> int:
        return sum(rows.nbytes for rows in pack(self._run_scene, limits=_UNLIMITED).arrays)

    def run_ticks(self, start: int, stop: int) -> None:
        """Run the ticks from ``start`` to ``stop`` and write their rows of ``force_n``."""
        self._run.run(start, stop)
        self.force_n[start:stop] = self._run.results.force_n[start:stop]

    def forces(self, motion: Motion) -> Floats:
        """Return the force at every row of the motion, (n, 3) [N]."""
        self.begin(motion)
        self.run_ticks(0, self.ticks)
        return np.repeat(self.force_n, self.every, axis=0)[: len(motion.t_s)]

    def forces_against(self, truth: Truth) -> list[Floats]:
        """Return the forces along the motions of a reference, each (n, 3) [N]."""
        return [self.forces(case.motion) for case in truth.cases]


class _UnsteadyDrag(Candidate):
    """Unsteady drag; a solved motion is compared using constants that were fitted without that motion."""

    def forces_against(self, truth: Truth) -> list[Floats]:
        if truth.left_out is None:
            return super().forces_against(truth)
        forces = []
        for case in truth.cases:
            self.begin(case.motion)
            w, interval_s = self.velocity_mps, np.full(self.ticks, 1 / self.rate_hz)
            dw = np.diff(w, axis=0, prepend=w[:1]) * self.rate_hz
            forces.append(unsteady_n(self.scene, w, dw, interval_s, truth.left_out))
        return forces


class _LinearViscosity(Candidate):
    """Linear viscosity, F = −6πµR v, the only law in general-purpose haptics libraries.

    This is ``HapticViscosity`` of HAPI and H3D; CHAI3D's ``cEffectViscosity`` leaves the factor to the user.
    """

    HAS_LIQUIDS: ClassVar[bool] = False

    def run_ticks(self, start: int, stop: int) -> None:
        damping_nspm = 3 * math.pi * (self.scene.liquids[0].viscosity_pa_s or math.nan) * self.scene.body.diameter_m
        self._run.run(start, stop)
        self.force_n[start:stop] = -damping_nspm * self._run.results.velocity_mps[start:stop]


@dataclass(eq=False)
class _WakeList(Candidate):
    """The wake stored as a list of elements in float64 or float32."""

    HAS_LIQUIDS: ClassVar[bool] = False
    precision: type[np.floating[Any]] = np.float64

    def begin(self, motion: Motion) -> None:
        super().begin(motion)
        self._liquid = pack(self.scene, limits=_UNLIMITED).liquids[0]
        self._list = self._new_list()

    def _new_list(self) -> tuple[Any, Any, Any, Any]:
        return _new_list(int(pack(self.scene, limits=_UNLIMITED).liquids[0].wake.length), self.precision)

    @property
    def memory_bytes(self) -> int:
        return sum(rows.nbytes for rows in self._new_list())

    def run_ticks(self, start: int, stop: int) -> None:
        self._run.run(start, stop)
        period_s = 1 / self.scene.rate_hz
        _run_wake_list(self._liquid, self._list, self._t_ns, period_s, self._run.results, self.force_n, start, stop)


def with_given_velocity(scene: Scene) -> Scene:
    """Return the scene with the velocity taken from the motion instead of an estimator."""
    return scene.model_copy(update={"velocity": Given()})


@kernel
def _run_wake_list(
    liquid: Any, listed: Any, t_ns: Any, period_s: float, results: Any, force_n: Any, start: int, stop: int
) -> None:
    tails, element, arc, segment = listed
    tail = tails[0]
    w = tail.relative_mps
    for k in range(start, stop):
        v = results[k].velocity_mps
        list_wake(liquid.wake, tail, element, segment)
        for axis in range(3):
            w[axis] = v[axis] - tail.wake_mps[axis]
        resistance_nspm = resistance(liquid.drag, norm(w))
        for axis in range(3):
            force_n[k, axis] = -resistance_nspm * w[axis]
        interval_s = (t_ns[k] - t_ns[k - 1]) * 1e-9 if k > 0 else period_s
        list_follow(liquid.wake, tail, element, arc, segment, v, results[k].position_m, interval_s)


SLOWER = (2, 4, 10)
_RESOLUTIONS_M = (0.005, 0.02)
_MIN_RATE_HZ = 50.0
_EFFECT_NAMES: dict[Effect, str] = {"added_mass": "added mass", "history": "history"}
_LAWS: dict[Law, tuple[str, str]] = {
    "constant": ("constant C_d", "constant C$_d$"),
    "schiller-naumann": ("Schiller–Naumann", "SN"),
    "haider-levenspiel": ("Haider–Levenspiel", "HL"),
    "brown-lawler": ("Brown–Lawler", "BL"),
}
"""The name and the label of each drag law."""


def _with_wake(scene: Scene, **changes: Any) -> Scene:
    wake = scene.liquids[0].wake.model_copy(update=changes)
    return scene.model_copy(update={"liquids": (scene.liquids[0].model_copy(update={"wake": wake}),)})


def _with_single_liquid(scene: Scene, liquid: Any) -> Scene:
    single = liquid.model_copy(update={"region": Everywhere(), "current": None})
    return scene.model_copy(update={"liquids": (single,)})


def drag_and_wake(scene: Scene) -> Scene:
    """Return the scene with its first liquid everywhere, and only its drag law and, if selected, its wake."""
    liquid = resolve(scene).liquids[0]
    effects = ("drag", "wake") if "wake" in liquid.effects else ("drag",)
    return _with_single_liquid(scene, liquid.model_copy(update={"effects": effects}))


def numerical_candidates(scene: Scene) -> tuple[tuple[Candidate, ...], Candidate]:
    """Return implementations of the same definition, or of parts of it, and the one that the program uses.

    ``scene`` has one liquid, as returned by `drag_and_wake`. Without a wake, the candidates for the wake are omitted.
    """
    exact = with_given_velocity(scene)
    name = "O(1) wake" if _has_wake(scene) else "drag"
    program = Candidate(name, name, "tick", exact)
    candidates: list[Candidate] = [program]
    if _has_wake(scene):
        candidates += _lists(exact)
    for every in SLOWER:
        if scene.rate_hz / every >= _MIN_RATE_HZ:
            slower = exact.model_copy(update={"rate_hz": scene.rate_hz / every})
            hertz = f"{slower.rate_hz:g} Hz"
            candidates.append(Candidate(f"{program.name}, {hertz}", hertz, "rate", slower, every=every))
    scene_estimator = scene.velocity
    for kind in (Ewma(), Raw()):
        estimator = (
            scene_estimator if not isinstance(scene_estimator, Given) and scene_estimator.kind == kind.kind else kind
        )
        name = f"{program.name}, velocity by {estimator.kind} from encoder counts"
        noisy = scene.model_copy(update={"velocity": estimator})
        candidates.append(Candidate(name, f"velocity: {estimator.kind}", "estimator", noisy, counted=True))
    return tuple(candidates), program


def _lists(exact: Scene) -> list[Candidate]:
    length = exact.liquids[0].wake.length
    half, quarter = max(1, length // 2), max(1, length // 4)
    candidates: list[Candidate] = [
        _WakeList("O(N) compiled", "O(N) compiled", "list", exact),
        _WakeList("O(N) compiled, float32", "O(N) float32", "list", exact, precision=np.float32),
        _WakeList("O(N) compiled, tail N/2", "O(N), N/2", "list", _with_wake(exact, length=half)),
        _WakeList("O(N) compiled, tail N/4", "O(N), N/4", "list", _with_wake(exact, length=quarter)),
        Candidate("O(1) wake, tail N/4", "tail N/4", "tick", _with_wake(exact, length=quarter)),
    ]
    for step_m in _RESOLUTIONS_M:
        step = f"{1e3 * step_m:g} mm"
        coarse = _with_wake(exact, resolution_m=step_m)
        candidates.append(Candidate(f"O(1) wake, resolution {step}", f"resolution {step}", "tick", coarse))
    candidates.append(Candidate("drag alone", "drag alone", "tick", with_effects(exact, "drag")))
    return candidates


def physical_candidates(scene: Scene) -> tuple[tuple[Candidate, ...], Candidate]:
    """Return models of a viscous liquid in order of accuracy, and the one that the program would select."""
    exact = with_given_velocity(_with_single_liquid(scene, scene.liquids[0]))
    candidates: list[Candidate] = [_LinearViscosity("linear viscosity", "linear viscosity", "law", exact)]
    candidates += [
        Candidate(name, f"{name} ({short})" if len(short) == 2 else short, "law", with_effects(exact, "drag", law=law))
        for law, (name, short) in _LAWS.items()
    ]
    carried: tuple[Effect, ...] = ()
    for effect in ("added_mass", "history"):
        carried = (*carried, effect)
        candidates.append(_effects_candidate(exact, REFERENCE, carried))
    candidates.append(_UnsteadyDrag("unsteady drag", "unsteady drag", "effects", with_effects(exact, "unsteady_drag")))
    gated = resolve(_with_single_liquid(scene, scene.liquids[0].model_copy(update={"effects": "auto"}))).liquids[0]
    carried = tuple(effect for effect in _EFFECT_NAMES if effect in gated.effects)
    if "unsteady_drag" in gated.effects:
        return tuple(candidates), candidates[-1]
    if "drag" not in gated.effects:
        choice: Candidate = Candidate("no resistance", "no resistance", "effects", with_effects(exact, *carried))
    else:
        choice = _effects_candidate(exact, gated.drag.law, carried)
    equal = next(
        (candidate for candidate in candidates if type(candidate) is Candidate and candidate.scene == choice.scene),
        None,
    )
    return (tuple(candidates), equal) if equal is not None else ((*candidates, choice), choice)


def _effects_candidate(exact: Scene, law: Law, carried: tuple[Effect, ...]) -> Candidate:
    effect_names, (name, short) = [_EFFECT_NAMES[effect] for effect in carried], _LAWS[law]
    scene = with_effects(exact, "drag", *carried, law=law)
    return Candidate(" + ".join([name, *effect_names]), " + ".join([short, *effect_names]), "effects", scene)


def _has_wake(scene: Scene) -> bool:
    return "wake" in scene.liquids[0].effects
