"""Values planted in a liquid, found from measured force while it comes; how often not; and the cost of a row.

``python tests/benchmarks/haptics/online_estimation.py [SEEDS]``, three minutes with the default of 20. Rows come at
1 kHz, 33 at a time, with 0.03 N of noise along each axis. Times are those of the processor; compare them with that of
the model alone, in the same run.
"""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from study_app.lab.estimation.estimator import Estimate, OnlineEstimator
from study_app.lab.estimation.fits import DRAG, NAMES, LiquidModel, prepare
from study_app.lab.estimation.sources import CentredVelocity
from tests.lab.estimation.measured import BATCH, WATER, fed, measured, planted, stirring, wandering

TRUE = {DRAG: 0.42, "length": 1200.0, "scaling": 1500.0}
WHOLE = {"drag": 0.42, "length": 1700, "scaling": 1700}  # the wake of the setting itself
WITHIN = 5.0


def recovered(seeds: int) -> None:
    """Print the greatest errors over seeds of the noise."""
    print(f"\nFrom C_d 0.47, N 1700, S 1700, after 10 s of stirring, {seeds} seeds of the noise")
    print(f"{'estimated':<34}{'identified':>12}  {'greatest error %':<52}{'in the interval':>16}")
    for words, names, scene, velocities in (
        ("drag coefficient (0.42)", (DRAG,), planted(**WHOLE), True),
        ("the same, velocities from places", (DRAG,), planted(**WHOLE), False),
        ("drag, N (1200), S (1500)", NAMES, planted(), True),
        ("the same, velocities from places", NAMES, planted(), False),
    ):
        found = [after(scene, names, seed, velocities=velocities) for seed in range(seeds)]
        errors = [max(abs(100 * (it.values[name] / TRUE[name] - 1)) for it in found) for name in names]
        inside = [it.intervals[n][0] < TRUE[n] < it.intervals[n][1] for it in found for n in names]
        named = ", ".join(f"{name} {error:.2f}" for name, error in zip(names, errors, strict=True))
        sound = sum(it.identified for it in found)
        print(f"{words:<34}{sound:>9} of {seeds}  {named:<52}{100 * np.mean(inside):>14.0f} %")


def after(scene: Any, names: tuple[str, ...], seed: int, *, velocities: bool) -> Estimate:
    """Return the estimate after 10 s."""
    rows = measured(scene, *stirring(), seed=seed)
    estimator = OnlineEstimator(WATER, names)
    if velocities:
        return fed(estimator, rows)
    centred = CentredVelocity()
    for first in range(0, len(rows), BATCH):
        part = rows.part(first, first + BATCH)
        estimator.take(centred.take(part.t_s, part.position_m, part.force_n))
    return estimator.estimate


def random_motions(count: int) -> None:
    """Print what became of random motions in random liquids: how many were identified, and how wrong those were."""
    draw = np.random.default_rng(1)
    print(f"\n{count} random motions of 3 to 15 s in random liquids, from C_d 0.47, N 1700, S 1700")
    print(f"{'estimated':<20}{'identified':>12}{f'beyond {WITHIN:g} %':>14}{'greatest error %':>20}")
    for words, names in (("drag coefficient", (DRAG,)), ("drag, N, S", NAMES)):
        wrong, identified, greatest = 0, 0, 0.0
        for _ in range(count):
            t_s, places = wandering(draw)
            true = {DRAG: draw.uniform(0.25, 0.9), "length": 1700.0, "scaling": 1700.0}
            if names == NAMES:
                true["length"] = float(round(draw.uniform(500, 3000)))
                true["scaling"] = true["length"] * draw.uniform(1.0, 2.0)
            scene = planted(WATER, true[DRAG], int(true["length"]), true["scaling"])
            found = fed(OnlineEstimator(WATER, names), measured(scene, t_s, places, seed=int(draw.integers(1 << 30))))
            if found.identified:
                error = max(abs(100 * (found.values[name] / true[name] - 1)) for name in names)
                identified, wrong, greatest = identified + 1, wrong + (error > WITHIN), max(greatest, error)
        print(f"{words:<20}{identified:>9} of {count}{wrong:>11}{greatest:>20.1f}")


def costs() -> None:
    """Print what a row costs."""
    rows = measured(planted(), *stirring(30.0))
    model = time_of(lambda: LiquidModel(WATER, 1000.0).follow(rows), len(rows))
    print(f"\nProcessor time of a row [µs], 33 rows at a time\n  the model alone, in one piece     {model:8.2f}")
    for words, names in (("drag coefficient", (DRAG,)), ("drag, length and scaling", NAMES)):
        spent = time_of(lambda names=names: fed(OnlineEstimator(WATER, names), rows), len(rows))
        print(f"  {words:<32}{spent:8.2f}   {spent / model:6.1f} times the model, {0.1 * spent:.2f} % of a core")


def time_of(work: Any, count: int) -> float:
    """Return the least processor time of three [µs per row]."""
    spent = []
    for _ in range(3):
        began_s = time.process_time()
        work()
        spent.append(time.process_time() - began_s)
    return 1e6 * min(spent) / count


def main() -> None:
    """Print all tables."""
    prepare()
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    recovered(seeds)
    unknown()
    random_motions(2 * seeds)
    costs()


def unknown() -> None:
    """Print what is said of motions that identify nothing."""
    print("\nMotions that do not identify it: nothing is changed")
    t_s, places = stirring()
    circle = np.column_stack([0.26 * np.cos(4 * t_s), 0 * t_s, 0.26 * np.sin(4 * t_s)])
    long_wake = planted(drag=0.42, length=7000, scaling=7000)
    for words, names, rows in (
        ("at rest", (DRAG,), measured(planted(**WHOLE), t_s, 0 * places)),
        ("strokes of ±1 mm of the hand", (DRAG,), measured(planted(**WHOLE), t_s, 0.04 * places)),
        ("a wake of 7 s", NAMES, measured(long_wake, t_s, circle)),
        ("short strokes", NAMES, measured(planted(), t_s, 0.1 * places)),
    ):
        said(words, fed(OnlineEstimator(WATER, names), rows))


def said(words: str, found: Estimate) -> None:
    """Print a sentence about an estimate."""
    print(f"  {words:<32}{'IDENTIFIED' if found.identified else found.reason}")


if __name__ == "__main__":
    main()
