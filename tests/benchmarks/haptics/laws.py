"""What the laws of drag keep, and by how much: python tests/benchmarks/haptics/laws.py prints it beside the limits.

Unsteady drag in six liquids: rotation of the motion; net work on the hand since rest over ½ m_a v² in 300 random
motions; ticks of 0.25 to 4 ms compared with 1 ms. Yield stress at rest: how fast a free handle of 0.1 kg creeps under
half the yield force, read in counts of 38 µm, with 0 and 1 % of the samples off by a count.
"""

from tests.haptics.materials import creep_mps
from tests.haptics.unsteady import FLUIDS, highest_gain, rotation_error, tick_error

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


def _row(what: str, measured: float, limit: float) -> None:
    print(f"{what:60} {measured:10.2g} {limit:8g}", flush=True)


if __name__ == "__main__":
    main()
