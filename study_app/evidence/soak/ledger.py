"""The deviation of the servo's wakes from their definition (`evidence.reference_model`), from scene to scene.

The servo updates running sums. This module sums the whole list of elements at intervals, from the samples in telemetry
alone.
"""

import math
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from study_app.evidence.reference_model import new_wake_list, store_element, sum_elements
from study_app.haptics.kernels import copy, distance, kernel, norm
from study_app.haptics.model.effects import Wake
from study_app.haptics.model.force_rules import CURRENT
from study_app.haptics.model.layout import records
from study_app.haptics.model.scene import Everywhere, Liquid, Scene

_MAX_REFUSALS: Final = 5
_SHORTEST_NS: Final = 200_000
_LONGEST_NS: Final = 20_000_000

_LEDGER = np.dtype(
    [
        ("vertical", np.float64),
        ("scale", np.float64),
        ("period_ns", np.int64),
        ("tracking", np.int64),  # 1 once a position was accepted
        ("gap_ns", np.float64),  # longer without a sample is a gap
        ("accepted_m", np.float64, (3,)),  # the last accepted position
        ("rejected", np.int64),  # consecutive rejected readings
        ("accepted_ns", np.int64),
        ("h_mps", np.float64, (3,)),
        ("position_m", np.float64, (3,)),  # in the scene, relative to the origin
    ],
    align=True,
)


def wake_of(scene: Scene) -> Wake | None:
    """Return the wake of a single liquid that fills the scene without a current; None for other scenes."""
    if len(scene.liquids) != 1:
        return None
    liquid: Liquid = scene.liquids[0]
    if "wake" not in liquid.effects or "current" in liquid.effects or not isinstance(liquid.region, Everywhere):
        return None
    wake: Wake | None = liquid.wake
    return wake


class _Ledger:
    """An independent record of the wake of a scene, from its first sample onwards."""

    def __init__(self, scene: Scene) -> None:
        wake = wake_of(scene)
        if wake is None:
            raise ValueError("the exact definition does not support this scene's wake")
        self._wake, self._elements = new_wake_list(wake, scene.rate_hz)
        self._ledger = records(_LEDGER, 1)
        ledger = self._ledger[0]
        ledger.vertical = 1.0 if wake.axes == "xyz" else 0.0
        ledger.scale = scene.scale
        ledger.period_ns = round(1e9 / scene.rate_hz)
        ledger.gap_ns = CURRENT.gap_ticks * ledger.period_ns

    def record(self, samples: Any) -> float | None:
        """Record ``samples`` (`Samples`, all of this scene, none missing), and compare at the last one.

        Returns
        -------
        |wake - definition| at the last accepted sample, in units of Σ|e|/S; infinite if that is not finite, None
            if there is nothing to compare
        """
        state = self._ledger[0], self._wake[0], self._elements
        rejected = samples.limited_by("glitch")
        accepted = np.flatnonzero((samples.fresh != 0) & ~rejected)
        if accepted.size == 0:
            record_samples(*state, samples, rejected, 0, len(samples))
            return None
        last = int(accepted[-1])
        record_samples(*state, samples, rejected, 0, last)
        defined, size_mps = np.zeros(3), 0.0
        if self._ledger[0].tracking and not _is_reset_in_gap(self._ledger[0], samples[last]):
            size_mps = sum_elements(self._wake[0], self._elements, defined)
        record_samples(*state, samples, rejected, last, len(samples))
        error_mps = float(np.linalg.norm(samples.wake_mps[last] - defined))
        if size_mps == 0.0:
            return None if error_mps == 0.0 else math.inf
        return error_mps / size_mps if math.isfinite(error_mps) else math.inf

    @property
    def age_s(self) -> float:
        """The time since the wake was last empty [s]."""
        return float(self._wake[0].age_ns) * 1e-9


@kernel
def _is_reset_in_gap(ledger: Any, sample: Any) -> bool:
    """Return whether the body was reset in a gap: its position has changed, but its velocity is exactly 0."""
    moved = distance(sample.position_m, ledger.accepted_m) > 0.0
    return bool(sample.time_ns - ledger.accepted_ns > ledger.gap_ns and moved and norm(sample.velocity_mps) == 0.0)


@kernel
def record_samples(ledger: Any, wake: Any, elements: Any, samples: Any, rejected: Any, first: int, end: int) -> None:
    """Record samples ``first`` to ``end`` in the list according to the definition, without ``rejected`` (n,) ones."""
    for i in range(first, end):
        sample = samples[i]
        if sample.fresh == 0:
            continue
        if rejected[i]:
            ledger.rejected += 1
            if ledger.rejected == _MAX_REFUSALS:
                ledger.tracking = 0
            continue
        interval_ns = ledger.period_ns
        if ledger.tracking != 0 and not _is_reset_in_gap(ledger, sample):
            interval_ns = min(max(sample.time_ns - ledger.accepted_ns, _SHORTEST_NS), _LONGEST_NS)
        else:
            ledger.tracking = 1
            wake.stored = wake.held = wake.segment = wake.age_ns = 0
            wake.arc_m = 0.0
        ledger.rejected = 0
        ledger.accepted_ns = sample.time_ns
        copy(sample.position_m, ledger.accepted_m)
        copy(sample.velocity_mps, ledger.h_mps)
        ledger.h_mps[1] *= ledger.vertical
        for axis in range(3):
            ledger.position_m[axis] = ledger.scale * sample.position_m[axis]
        store_element(wake, elements, ledger.h_mps, ledger.position_m, interval_ns)


def compile_recording(samples: Any) -> None:
    """Compile the recording functions for ``samples``, or load them from the cache."""
    wake, elements = new_wake_list(Wake(length=1, scaling=1), 1000.0)
    sum_elements(wake[0], elements, np.zeros(3))
    record_samples(records(_LEDGER, 1)[0], wake[0], elements, samples, samples.fresh != 0, 0, 0)


@dataclass(slots=True, kw_only=True)
class Drift:
    """The greatest difference between the servo's wakes and their definition, in units of Σ|e|/S.

    ``longest_s`` is the longest time for which a wake was never empty.
    """

    comparisons: int = 0
    worst: float = 0.0
    longest_s: float = 0.0
    _scenes: dict[int, Scene] = field(default_factory=dict)  # not yet seen in samples, by serial
    _serial: int = 0
    _ledger: _Ledger | None = None
    _next_tick: int = -1

    def expect_scene(self, serial: int, scene: Scene) -> None:
        """Register the scene that has this serial number in the telemetry."""
        if wake_of(scene) is not None:
            self._scenes[serial] = scene

    def record(self, samples: Any) -> None:
        """Record the next ``samples`` (`Samples`); a scene with missing samples is not compared further."""
        for scene_samples in np.split(samples, np.flatnonzero(np.diff(samples.scene)) + 1):
            if len(scene_samples) > 0:
                self._record_part(scene_samples)

    def _record_part(self, samples: Any) -> None:
        serial = int(samples.scene[0])
        if serial != self._serial:
            scene = self._scenes.get(serial)
            self._scenes = {later: waiting for later, waiting in self._scenes.items() if later > serial}
            self._ledger = _Ledger(scene) if scene is not None else None
            self._serial = serial
        elif samples.tick[0] != self._next_tick:
            self._ledger = None
        self._next_tick = int(samples.tick[-1]) + 1
        if self._ledger is None:
            return
        if (np.diff(samples.tick) != 1).any():
            self._ledger = None
            return
        error = self._ledger.record(samples)
        self.longest_s = max(self.longest_s, self._ledger.age_s)
        if error is not None:
            self.comparisons += 1
            self.worst = max(self.worst, error)
