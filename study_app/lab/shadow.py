"""Recomputes the presented setting outside the servo, and the other setting for the same motion.

Batches of telemetry are processed with the servo's tick (``haptics.runtime.offline``), for A and for B, each with a
separate state. The presented side has the persistent state of the servo's safety layer, so that its forces are equal to
the servo's to the last bit; the other side continues with a copy of this state. Both velocity filters use the force
that was sent, since this force moved the hand. Nothing here can delay the servo.
"""

from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.kernels import begin_scene, new_safety
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.effects import scaled_length
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.offline import new_wake_places, recompute_sample
from study_app.haptics.runtime.pack import adjust_into, pack, pack_into
from study_app.lab.ab_comparison import Side, other_side

Floats: TypeAlias = NDArray[np.float64]

_MAX_POINTS: Final = 400


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Tail:
    """Positions of the moving elements of a wake, from the oldest to the newest; at most 400 of them.

    ``positions_m`` is (n, 3) [m, hand frame]; ``breaks`` (n,) is true where a segment begins; ``ages`` (n,) are from 0,
    the newest possible element, to 1, the oldest. The wake stores ``alive`` elements now, including those at rest, and
    at most ``elements``, in ``segments`` segments (cells of a local wake).
    """

    positions_m: Floats
    breaks: NDArray[np.bool_]
    ages: Floats
    elements: int
    alive: int
    segments: int


def _tail_of(trail: Any, places: Any, elements: int) -> Tail:
    """Return the tail of a trail (``haptics.runtime.offline``) of at most ``elements`` elements."""
    left, stored = int(trail.left), int(trail.held)
    numbers = np.arange(left - stored, left)
    samples = places[numbers % len(places)]
    moving = samples.moving != 0
    numbers, samples = numbers[moving], samples[moving]
    breaks = np.ones(len(samples), bool)
    breaks[1:] = samples.segment[1:] != samples.segment[:-1]
    kept = _rows_to_draw(breaks)
    ages = (left - 1 - numbers[kept]) / max(elements - 1, 1)
    return Tail(
        positions_m=np.array(samples.hand_m[kept], np.float64).reshape(-1, 3),
        breaks=breaks[kept],
        ages=np.clip(ages, 0.0, 1.0),
        elements=elements,
        alive=stored,
        segments=int(trail.segments),
    )


def _rows_to_draw(breaks: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the rows to draw: starts of segments (the newest ones if there are too many), and evenly spaced rows."""
    count = len(breaks)
    if count <= _MAX_POINTS:
        return np.arange(count)
    begins = np.flatnonzero(breaks)
    if len(begins) > _MAX_POINTS // 2:
        begins = begins[-(_MAX_POINTS // 2) :]
    even = np.linspace(0, count - 1, _MAX_POINTS - len(begins)).round().astype(np.int64)
    return np.unique(np.concatenate([begins, even]))


_TRACE_S: Final = 2.5
_SIDES: Final[tuple[Side, Side]] = ("A", "B")

_ROW: Final = np.dtype(
    [
        ("time_ns", np.int64),
        ("force_a_n", np.float64, (3,)),
        ("force_b_n", np.float64, (3,)),
        ("body_mps", np.float64),
        ("wake_a_mps", np.float64),
        ("wake_b_mps", np.float64),
        ("presented_a", np.bool_),
    ]
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Trace:
    """The last 2.5 s of a motion, for A and for B; ``t_s`` (n,) ends at 0, the newest sample.

    ``force_a_n``, ``force_b_n`` (n, 3) are the forces on the hand, sent by the servo or, for the other side, as they
    would have been sent; ``body_mps``, ``wake_a_mps`` and ``wake_b_mps`` (n,) are speeds in the scene; ``presented_a``
    (n,) is true where A was presented.
    """

    t_s: Floats
    force_a_n: Floats
    force_b_n: Floats
    body_mps: Floats
    wake_a_mps: Floats
    wake_b_mps: Floats
    presented_a: NDArray[np.bool_]


@dataclass(slots=True)
class _Presented:
    """What the servo presents from the first sample of a scene on; ``continues`` if it only adjusted parameters."""

    side: Side
    scenes: dict[Side, Scene]
    continues: bool


class Shadow:
    """Recomputes both settings outside the servo, with the device's own force limit [N] and dynamics.

    ``rest`` is the servo's initial scene without liquids, ``elements`` the capacity of a wake. ``without_servo`` means
    that the samples do not have a servo's forces, so the results of both sides are recomputed.
    """

    def __init__(
        self, rest: Scene, elements: int, limit_n: float, dynamics: Dynamics = UNKNOWN, *, without_servo: bool = False
    ) -> None:
        self._without_servo = without_servo
        self._sides = {side: _Simulation(rest, elements, limit_n, dynamics) for side in _SIDES}
        self._presented_side: Side = "A"
        self._serial = 0
        self._expected: dict[int, _Presented] = {}
        self._recent = _RecentSamples()
        self.differing = 0  # number of ticks in which the recomputed force differed from the servo's in any bit
        self.compared = 0  # number of compared ticks

    def prepare(self) -> None:
        """Compile all functions that run later, or load them from the cache."""
        for simulation in self._sides.values():
            simulation.begin(simulation.scene)
            simulation.recompute(records(SAMPLE, 0), sent=True)
            simulation.restart()

    def expect(self, serial: int, side: Side, a: Scene, b: Scene, *, continues: bool = False) -> None:
        """Register what the servo will present as scene ``serial``; ``continues`` if it only adjusts parameters."""
        self._expected[serial] = _Presented(side, {"A": a, "B": b}, continues)

    def set_other(self, side: Side, scene: Scene) -> None:
        """Set the scene of the side that is not presented; restart that side if the scene differs."""
        for presented in self._expected.values():
            presented.scenes[side] = scene
        if self._sides[side].scene != scene:
            self._sides[side].begin(scene)

    def process_samples(self, samples: Any, *, lost: bool = False) -> None:
        """Process the servo's next samples (recarray of ``SAMPLE``); ``lost`` if samples before them were dropped."""
        if lost:
            for simulation in self._sides.values():
                simulation.begin(simulation.scene)
        borders = np.flatnonzero(np.diff(samples.scene, prepend=self._serial))
        for first, end in zip((0, *borders), (*borders, len(samples)), strict=True):
            part = samples[first:end]
            if len(part):
                self._change_scene(int(part.scene[0]))
                self._recompute_sides(part)

    def trace(self) -> Trace | None:
        return self._recent.trace()

    def tail(self, side: Side) -> Tail | None:
        return self._sides[side].tail()

    def _change_scene(self, serial: int) -> None:
        """Change to the servo's scene: restart or adjust the presented side; restart the other side if it changed."""
        if serial == self._serial:
            return
        self._serial = serial
        begun = [
            scenes for number, scenes in self._expected.items() if number <= serial
        ]  # some scenes may have no sample
        presented = self._expected.get(serial)
        if presented is None:  # the servo is ending or presents no setting
            return
        self._expected = {number: scenes for number, scenes in self._expected.items() if number > serial}
        side, other = self._sides[presented.side], self._sides[other_side(presented.side)]
        if self._presented_side != presented.side:  # the presented side has the state of the servo's safety layer
            side.safety, other.safety = (other.safety, other.safety.copy())
        continues = all(scenes.continues for scenes in begun)
        (side.adjust if continues else side.begin)(presented.scenes[presented.side])
        if other.scene != presented.scenes[other_side(presented.side)]:
            other.begin(presented.scenes[other_side(presented.side)])
        self._presented_side = presented.side

    def _recompute_sides(self, samples: Any) -> None:
        """Recompute both sides for samples of one scene; the forces of the presented side are the servo's."""
        out = {
            side: simulation.recompute(samples, sent=side == self._presented_side)
            for side, simulation in self._sides.items()
        }
        if not self._without_servo:
            recomputed, out[self._presented_side] = out[self._presented_side], samples
            differs = (recomputed.device_force_n != samples.device_force_n).any(axis=1)
            self.compared += len(samples)
            self.differing += int(np.count_nonzero(differs))
        self._recent.add(samples.time_ns, out["A"], out["B"], presented_a=self._presented_side == "A")


class _Simulation:
    """The simulation of a side: its scene, packed model and safety layer."""

    def __init__(self, rest: Scene, elements: int, limit_n: float, dynamics: Dynamics) -> None:
        self.scene = rest
        self._dynamics = dynamics
        self.safety = new_safety(limit_n)
        self._model = pack(rest, capacity=elements, dynamics=dynamics)
        self._trail, self._places = new_wake_places(elements)

    def restart(self) -> None:
        self.safety = new_safety(self.safety[0].device_limit_n)

    def begin(self, scene: Scene) -> None:
        """Start a scene as the servo does: reset the state and fade the force in."""
        self.scene = scene
        pack_into(self._model, scene, dynamics=self._dynamics)
        begin_scene(self.safety[0])
        self._trail.view(np.uint8)[:] = 0

    def adjust(self, scene: Scene) -> None:
        """Use a scene's parameters from now on, as `Servo.adjust` does: keep state and force."""
        self.scene = scene
        adjust_into(self._model, scene, dynamics=self._dynamics)

    def recompute(self, samples: Any, *, sent: bool) -> Any:
        """Return the samples with recomputed results; ``sent`` if the device got this side's force."""
        out = samples.copy()
        recompute_sample(self._model, self.safety[0], out, self._trail[0], self._places, sent)
        return out

    def tail(self) -> Tail | None:
        scene = resolve(self.scene)
        if not scene.liquids:
            return None
        liquid = scene.liquids[0]
        local_wake = liquid.local_wake if "local_wake" in liquid.effects else None
        wake = liquid.wake if "wake" in liquid.effects else local_wake
        return None if wake is None else _tail_of(self._trail[0], self._places, scaled_length(wake, scene.rate_hz))


class _RecentSamples:
    """The latest samples of both sides, for a trace."""

    def __init__(self) -> None:
        self._rows: Any = records(_ROW, 0)

    def add(self, time_ns: Any, a: Any, b: Any, *, presented_a: bool) -> None:
        rows = records(_ROW, len(time_ns))
        rows.time_ns, rows.force_a_n, rows.force_b_n = time_ns, a.device_force_n, b.device_force_n
        rows.body_mps = np.linalg.norm((a if presented_a else b).velocity_mps, axis=1)
        rows.wake_a_mps = np.linalg.norm(a.wake_mps, axis=1)
        rows.wake_b_mps = np.linalg.norm(b.wake_mps, axis=1)
        rows.presented_a = presented_a
        joined = np.concatenate([self._rows, rows])
        self._rows = joined[joined["time_ns"] > time_ns[-1] - round(_TRACE_S * 1e9)].view(np.recarray)

    def trace(self) -> Trace | None:
        rows = self._rows
        if len(rows) == 0:
            return None
        return Trace(
            t_s=(rows.time_ns - rows.time_ns[-1]) * 1e-9,
            force_a_n=rows.force_a_n,
            force_b_n=rows.force_b_n,
            body_mps=rows.body_mps,
            wake_a_mps=rows.wake_a_mps,
            wake_b_mps=rows.wake_b_mps,
            presented_a=rows.presented_a,
        )
