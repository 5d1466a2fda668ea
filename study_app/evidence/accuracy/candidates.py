"""The candidates: methods to compute a force from a motion, each measured for error and time.

A rung takes ticks, one after another: `Rung.forces` takes a whole motion at once, `Rung.begin` and `Rung.take` let the
ticks be timed in batches. Compiled rungs all run the servo's own tick, door and safety included, so that what differs
between their times is the model alone.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal, TypeAlias

import numpy as np

from study_app.evidence.accuracy.naive_wake import NumpyTail, PlainTail, list_follow, list_wake, new_list
from study_app.evidence.hand_motions import COUNT_M
from study_app.evidence.reference_model import lowered
from study_app.evidence.reference_solutions import Truth
from study_app.evidence.unsteady_law import unsteady_n
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.effects.drag import resistance
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.kernels.tick import tick
from study_app.haptics.kernels.vector import norm, subtract
from study_app.haptics.model.effects.drag import resistance_n
from study_app.haptics.model.estimators.given import CODE as GIVEN
from study_app.haptics.model.layout import SAMPLE, Record, records
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Given, Scene
from study_app.haptics.model.slope_limits import DampingLimits
from study_app.haptics.runtime.pack import Model, pack

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
