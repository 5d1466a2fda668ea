"""What a tick costs: python tests/benchmarks/haptics/tick.py prints nanoseconds, medians over batches of 1,000 ticks.

Every scene is felt along one motion (circling, reversing, resting; 10 s, over and over) in compiled code, as in the
servo; its wake is filled before the measurement begins. Scenes take ticks batch by batch, so that what else the machine
does strikes all alike. "Over rest" is what a scene costs more than one without any liquid: what its effects cost. Where
a clock is said to jitter, no two ticks are equally long, as in a servo; elsewhere all take a millisecond.
"""

import statistics
import time
from typing import Any

import numpy as np

from study_app.evaluation.cost import hand
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.kernels.tick import tick
from study_app.haptics.model.effects.current import Uniform, Vortex
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.effects.local_wake import LocalWake
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.model.scene import Box, Effect, Liquid, Scene
from study_app.haptics.runtime.pack import pack
from study_app.protocol.load import load_scenes, shipped

BATCH = 1_000
BATCHES = 300
WARM_UP = 20_000
JITTER_NS = 50_000

LIQUID = Liquid(
    id="liquid",
    density_kg_m3=1260,
    viscosity_pa_s=1.41,
    region=Box(centre_m=(0, -1.47, 0), size_m=(3, 3, 3)),  # the ball rises through its top now and then
    wake=Wake(length=1700, scaling=1700, exponent=0.75),
    local_wake=LocalWake(length=1700, scaling=1700, exponent=0.75),
    current=Vortex(core_m=0.2, peak_mps=0.5),
)
DEEP = Box(size_m=(3, 3, 3))


def scene(*effects: Effect, **fields: Any) -> Scene:
    """Return a scene of one deep liquid with these effects."""
    return Scene(liquids=(LIQUID.model_copy(update={"region": DEEP, "effects": effects, **fields}),))


def alone() -> dict[str, Scene]:
    """Return each effect by itself, or with the drag that it acts through."""
    laws = ("schiller-naumann", "haider-levenspiel", "brown-lawler")
    return {
        "rest: no liquid": Scene(),
        "a liquid without effects": scene(),
        "drag, constant": scene("drag"),
        **{f"drag, {law}": scene("drag", drag=Drag(law=law)) for law in laws},
        "drag + wake, N 100": scene("drag", "wake", wake=Wake(length=100, scaling=1700, exponent=0.75)),
        "drag + wake, N 1,700": scene("drag", "wake"),
        "drag + wake, N 50,000": scene("drag", "wake", wake=Wake(length=50_000, scaling=50_000, exponent=0.75)),
        "drag + local_wake": scene("drag", "local_wake"),
        "drag + current, uniform": scene("drag", "current", current=Uniform(velocity_mps=(0.1, 0, 0))),
        "drag + current, vortex": scene("drag", "current"),
        "buoyancy": scene("buoyancy"),
        "surface": scene("surface", region=LIQUID.region),
        "added_mass": scene("added_mass"),
        "history": scene("history"),
    }


def at_once() -> dict[str, Scene]:
    """Return every effect in one liquid, with either wake."""
    others: tuple[Effect, ...] = ("current", "buoyancy", "surface", "added_mass", "history")
    truest = {"region": LIQUID.region, "drag": Drag(law="haider-levenspiel")}
    return {
        "all effects, wake": scene("drag", "wake", *others, **truest),
        "all effects, local_wake": scene("drag", "local_wake", *others, **truest),
    }


def presets() -> dict[str, Scene]:
    """Return every liquid of every shipped protocol, effects that are left to the gate resolved."""
    return {f"{name}: {liquid}": resolve(it) for name in shipped() for liquid, it in load_scenes(name).items()}


@kernel
def run(model: Any, safety: Any, sample: Any, path: Any, start: int, ticks: int, row: int) -> int:
    """Take ``ticks`` samples from ``row`` of the path on, around its end; return the row after the last."""
    positions_m, offsets_ns = path
    for k in range(start, start + ticks):
        sample.time_ns = k * 1_000_000 + offsets_ns[row]
        sample.fresh = 1
        for axis in range(3):
            sample.position_m[axis] = positions_m[row, axis]
        row = row + 1 if row + 1 < len(positions_m) else 0
        tick(model, safety, sample)
    return row


class Bench:
    """One scene on the bench: its memory, and the nanoseconds a tick of every batch so far."""

    def __init__(self, felt: Scene, *, jitters: bool = False) -> None:
        positions_m = hand()
        offsets_ns = np.random.default_rng(1).integers(0, JITTER_NS, len(positions_m)) * jitters
        self._path = (positions_m, offsets_ns)
        self._model, self._safety, self._sample = pack(felt), new_safety(), records(SAMPLE, 1)
        self._ticks = self._row = 0
        self.costs_ns: list[float] = []
        self._run(WARM_UP)

    def batch(self) -> None:
        """Take one batch and note its cost."""
        began = time.perf_counter_ns()
        self._run(BATCH)
        self.costs_ns.append((time.perf_counter_ns() - began) / BATCH)

    @property
    def median_ns(self) -> float:
        """The median cost of a tick."""
        return statistics.median(self.costs_ns)

    def _run(self, ticks: int) -> None:
        memory = (self._model, self._safety[0], self._sample[0])
        self._row = run(*memory, self._path, self._ticks, ticks, self._row)
        self._ticks += ticks


def main() -> None:
    """Print the tables."""
    began = time.perf_counter()
    Bench(Scene())
    print(f"compiled or loaded from the cache in {time.perf_counter() - began:.1f} s\n")
    tables = {"each effect alone": alone(), "all at once": at_once(), "shipped scenes": presets()}
    scenes = {name: felt for table in tables.values() for name, felt in table.items()}
    even = {name: Bench(felt) for name, felt in scenes.items()}
    jittering = {name: Bench(felt, jitters=True) for name, felt in scenes.items()}
    for _ in range(BATCHES):
        for bench in (*even.values(), *jittering.values()):
            bench.batch()
    rest_ns = even["rest: no liquid"].median_ns
    print(f"{'[ns a tick]':42} {'median':>7} {'p95':>7} {'over rest':>10} {'jittering clock':>16}")
    for title, table in tables.items():
        print(f"-- {title}")
        for name in table:
            median_ns, p95_ns = even[name].median_ns, np.percentile(even[name].costs_ns, 95)
            over_ns, jittering_ns = median_ns - rest_ns, jittering[name].median_ns
            print(f"{name:42} {median_ns:7.0f} {p95_ns:7.0f} {over_ns:10.0f} {jittering_ns:16.0f}")
    long, short = even["drag + wake, N 50,000"].median_ns, even["drag + wake, N 100"].median_ns
    print(f"\nN 50,000 over N 100: {long / short:.2f}")


if __name__ == "__main__":
    main()
