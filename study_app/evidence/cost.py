"""The computation time of a scene: nanoseconds per tick of the servo's own code, in total and per effect."""

import statistics
import time
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.effects import NAMED
from study_app.haptics.model.gate import describe_gate, effect_verdicts, resolve
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Effect, Liquid, Scene
from study_app.haptics.runtime.offline import BatchedTicks

_BATCH: Final = 1_000
_BATCHES: Final = 200
_WARM_UP: Final = 10_000


class Cost(NamedTuple):
    """Median times per tick [ns] over batches of 1,000 ticks: the scene, the scene without liquids, and each effect.

    The cost of an effect is the time that it adds to its liquid without other effects, or with the effect that it
    requires.
    """

    scene_ns: float
    rest_ns: float
    effects_ns: Mapping[tuple[str, Effect], float]


def measure(scene: Scene, *, batches: int = _BATCHES) -> Cost:
    """Measure a scene and its variants in alternating batches, so that other load affects all alike."""
    scene = resolve(scene)
    rest = scene.model_copy(update={"liquids": ()})
    pairs = _scene_pairs(scene)
    benches = {
        measured_scene: TickTimer(measured_scene)
        for measured_scene in dict.fromkeys(
            [scene, rest, *(measured_scene for pair in pairs.values() for measured_scene in pair)]
        )
    }
    for _ in range(batches):
        for bench in benches.values():
            bench.run_batch()
    cost_ns = {measured_scene: statistics.median(bench.costs_ns) for measured_scene, bench in benches.items()}
    effects_ns = {
        effect: cost_ns[with_effect] - cost_ns[without_effect]
        for effect, (with_effect, without_effect) in pairs.items()
    }
    return Cost(cost_ns[scene], cost_ns[rest], effects_ns)


def report(scene: Scene, *, batches: int = _BATCHES) -> str:
    """Return the effects of a scene, with reasons and computation times, as text."""
    cost = measure(scene, batches=batches)
    percent = 100 * cost.scene_ns * 1e-9 * scene.rate_hz
    total = f"one tick: {cost.scene_ns:.0f} ns, {percent:.2f} % of the tick period"
    return "\n".join((*describe_gate(scene, cost.effects_ns), "", f"{total}; without liquids, {cost.rest_ns:.0f} ns"))


def hand_motion(ticks: int = _WARM_UP) -> Floats:
    """Return hand positions (ticks, 3) [m] at 1 kHz: circles of 30 mm that slow down, reverse and stop."""
    t_s = np.arange(ticks) / 1000
    angle = 4 * np.sin(2 * np.pi * np.minimum(t_s % 10, 8.0) / 4)
    return 0.03 * np.column_stack([np.cos(angle), 0.2 * np.sin(3 * angle), np.sin(angle)])


class TickTimer:
    """One measured scene: its memory, and the time of every batch so far."""

    def __init__(self, scene: Scene, dynamics: Dynamics = UNKNOWN) -> None:
        hand_m = hand_motion()
        self._scene_ticks = BatchedTicks(scene, 1_000_000 * np.arange(len(hand_m)), hand_m, dynamics=dynamics)
        self._scene_ticks.results = self._scene_ticks.results[:0]  # storing them takes time
        self._ticks = 0
        self.costs_ns: list[float] = []
        self.run(_WARM_UP)

    def run_batch(self) -> None:
        began = time.perf_counter_ns()
        self.run(_BATCH)
        self.costs_ns.append((time.perf_counter_ns() - began) / _BATCH)

    def run(self, ticks: int) -> None:
        self._scene_ticks.run(self._ticks, self._ticks + ticks)
        self._ticks += ticks


def _scene_pairs(scene: Scene) -> dict[tuple[str, Effect], tuple[Scene, Scene]]:
    """Return, for each effect, a scene with it and one without it."""
    pairs: dict[tuple[str, Effect], tuple[Scene, Scene]] = {}
    liquids = {liquid.id: liquid for liquid in scene.liquids}
    for verdict in effect_verdicts(scene):
        effect, liquid = verdict.effect, liquids[verdict.liquid]
        others: tuple[Effect, ...] = NAMED[effect].through[:1]
        pairs[liquid.id, effect] = (
            _select_effects(scene, liquid, (*others, effect)),
            _select_effects(scene, liquid, others),
        )
    return pairs


def _select_effects(scene: Scene, liquid: Liquid, effects: tuple[Effect, ...]) -> Scene:
    changed = liquid.model_copy(update={"effects": effects})
    return scene.model_copy(update={"liquids": tuple(changed if it is liquid else it for it in scene.liquids)})
