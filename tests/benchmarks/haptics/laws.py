"""What the laws of drag keep, and by how much: python tests/benchmarks/haptics/laws.py prints it beside the limits.

Unsteady drag in six liquids: rotation of the motion; net work on the hand since rest over ½ m_a v² in 300 random
motions; ticks of 0.25 to 4 ms compared with 1 ms. Yield stress at rest: how fast a free handle of 0.1 kg creeps under
half the yield force, read in counts of 38 µm, with 0 and 1 % of the samples off by a count.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from tests.haptics.materials import creep_mps
from tests.haptics.unsteady import FLUIDS, force, highest_gain, random_motion, tank

ROTATIONS = 20
MOTIONS = 300
TICKS_S = (0.25e-3, 0.5e-3, 2e-3, 4e-3)


def main() -> None:
    """Print the table."""
    print(f"{'what':60} {'measured':>10} {'limit':>8}")
    _row(f"rotation of {ROTATIONS} motions", max(rotation_error(seed, 600) for seed in range(ROTATIONS)), 1e-12)
    for name in FLUIDS:
        _row(f"net work in {MOTIONS} motions, {name} [½ m_a v²]", highest_gain(name, range(MOTIONS)), 1e-3)
    for tick_s in TICKS_S:
        _row(
            f"ticks of {1e3 * tick_s:g} ms [of the greatest force]", max(tick_error(it, tick_s) for it in FLUIDS), 0.03
        )
    for name in ("ketchup", "toothpaste"):
        for noise in (0.0, 0.01):
            _row(f"creep of {name}, {noise:.0%} off by a count [mm/s]", 1e3 * creep_mps(name, 0.5, noise=noise), 1.0)


def rotation_error(seed: int, ticks: int) -> float:
    """Return the greatest difference between the force of a rotated motion and the rotated force, over the greatest."""
    velocity = random_motion(seed, ticks=ticks, rest=20) + np.array([0.1, 0.2, 0.05])
    rotation = Rotation.random(rng=np.random.default_rng(seed))
    expected = rotation.apply(force(tank("glycerin"), velocity))
    return float(abs(force(tank("glycerin"), rotation.apply(velocity)) - expected).max() / abs(expected).max())


def tick_error(name: str, tick_s: float) -> float:
    """Return the greatest difference between the force of a stroke in such ticks and in 1 ms, over the greatest."""

    def stroke(interval_s: float) -> tuple[np.ndarray, np.ndarray]:
        t_s = np.arange(0, 2, interval_s)
        return np.outer(np.sin(6 * t_s), [0.3, 0.0, 0.4]), t_s

    (usual, t_s), (other, other_s) = stroke(1e-3), stroke(tick_s)
    expected = force(tank(name), usual)
    found = force(tank(name), other, np.full(len(other), tick_s))
    errors = [abs(np.interp(t_s, other_s, found[:, axis]) - expected[:, axis])[10:-10].max() for axis in range(3)]
    return float(max(errors) / abs(expected).max())


def _row(what: str, measured: float, limit: float) -> None:
    print(f"{what:60} {measured:10.2g} {limit:8g}", flush=True)


if __name__ == "__main__":
    main()
