"""What a tick costs: python tests/benchmarks/tick.py prints nanoseconds, medians over batches of 1,000 ticks.

Each scene is felt along one motion (circling, reversing, resting; 10 s, over and over) in compiled code, as in the
servo. The wake is filled before the measurement begins.
"""

from __future__ import annotations

import statistics
import time
from typing import Any

import numba
import numpy as np

from study_app.haptics.layout import SAMPLE, records
from study_app.haptics.pack import pack
from study_app.haptics.safety import new_safety
from study_app.haptics.scene import Liquid, Scene, Wake
from study_app.haptics.tick import tick

BATCH = 1_000
BATCHES = 500
ROUND = 10_000


def one_liquid(density_kg_m3: float, **wake: Any) -> Scene:
    """Return a scene of one liquid, with a wake if its parameters are given."""
    liquid = Liquid(
        id="liquid",
        density_kg_m3=density_kg_m3,
        effects=("drag", "wake") if wake else ("drag",),
        wake=Wake(**wake) if wake else None,
    )
    return Scene(liquids=(liquid,))


SCENES = {
    "rest (no liquid)": Scene(),
    "drag only": one_liquid(1000),
    "water (N 1700, S 1700, y 0.75)": one_liquid(1000, length=1700, scaling=1700, exponent=0.75),
    "honey (drag only)": one_liquid(1400),
    "light oil (N 125, S 250, y 0.25)": one_liquid(4500, length=125, scaling=250, exponent=0.25),
    "water, N 100": one_liquid(1000, length=100, scaling=50_000, exponent=0.75),
    "water, N 50,000": one_liquid(1000, length=50_000, scaling=50_000, exponent=0.75),
}


def hand() -> Any:
    """Return positions (ROUND, 3) [m, hand]: circles of 30 mm that slow down, turn back and rest."""
    t_s = np.arange(ROUND) / 1000
    angle = 4 * np.sin(2 * np.pi * np.minimum(t_s, 8.0) / 4)
    return 0.03 * np.column_stack([np.cos(angle), 0.2 * np.sin(3 * angle), np.sin(angle)])


@numba.njit(nogil=True)
def run(model: Any, safety: Any, sample: Any, positions_m: Any, start: int, ticks: int) -> None:
    """Take ``ticks`` samples, one a millisecond."""
    for k in range(start, start + ticks):
        sample.time_ns = k * 1_000_000
        sample.fresh = 1
        for axis in range(3):
            sample.position_m[axis] = positions_m[k % len(positions_m), axis]
        tick(model, safety, sample)


def measure(scene: Scene) -> list[float]:
    """Return the nanoseconds a tick of each batch."""
    model, safety, sample, positions_m = pack(scene), new_safety(), records(SAMPLE, 1), hand()
    run(model, safety[0], sample[0], positions_m, 0, 100_000)
    start, costs = 100_000, []
    for _ in range(BATCHES):
        began = time.perf_counter_ns()
        run(model, safety[0], sample[0], positions_m, start, BATCH)
        costs.append((time.perf_counter_ns() - began) / BATCH)
        start += BATCH
    return costs


def main() -> None:
    """Print the table."""
    print(f"{'scene':34} {'median':>8} {'p95':>8}   [ns a tick, {BATCHES} batches of {BATCH}]")
    medians = {}
    for name, scene in SCENES.items():
        costs = measure(scene)
        medians[name] = statistics.median(costs)
        print(f"{name:34} {medians[name]:8.0f} {np.percentile(costs, 95):8.0f}")
    ratio = medians["water, N 50,000"] / medians["water, N 100"]
    print(f"water: {medians['water (N 1700, S 1700, y 0.75)']:.0f} ns, at most 300 wanted")
    print(f"N 50,000 over N 100: {ratio:.2f}, at most 2 wanted")


if __name__ == "__main__":
    main()
