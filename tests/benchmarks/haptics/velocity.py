"""What a velocity estimator is worth: python tests/benchmarks/haptics/velocity.py prints lag, noise, settling and cost.

Positions come from an encoder of 38 µm at 1 kHz. Lag is the shift that fits best on a sinusoid of ±30 mm at 1.5 Hz
(peak 0.283 m/s), noise what is left after it, error what is left without it; then the spread at an even 5 mm/s, and how
long after a reversal at 0.1 m/s the estimate is off by more than 20 %. Published figures stand beside. "Bears" is what
counts in a closed loop: the damping that a free handle of 0.1 kg bears at 1 kHz with one tick of delay, safety off.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from study_app.evaluation.cost import measure
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Ewma, Foaw, Knee, Line, Raw, Scene
from study_app.haptics.runtime.offline import simulate
from study_app.validation.stability.damping_boundary import boundary_nspm

COUNT_M = 38e-6
AMPLITUDE_M = 0.03
OMEGA = 2 * math.pi * 1.5
SKIP = 500


class Figures(NamedTuple):
    """Lag [ms], noise, error and spread [mm/s], settling [ms; infinite if it never does]."""

    lag_ms: float
    noise_mmps: float
    error_mmps: float
    spread_mmps: float
    settling_ms: float


NEVER = math.inf
ESTIMATORS: dict[str, tuple[Any, Figures]] = {
    "raw": (Raw(), Figures(0.5, 15.9, 15.9, 12.9, NEVER)),
    "ewma 0.5": (Ewma(alpha=0.5), Figures(1.5, 6.4, 7.0, 6.3, 3)),
    "ewma 0.2": (Ewma(alpha=0.2), Figures(4.5, 2.35, 8.8, 2.4, 9)),
    "ewma 0.1": (Ewma(), Figures(9.5, 1.39, 17.9, 1.15, 22)),
    "ewma 0.05": (Ewma(alpha=0.05), Figures(19.3, 3.3, 36.0, 0.56, 44)),
    "line 15": (Line(), Figures(7.0, 0.64, 13.2, 0.66, 11)),
    "foaw 16": (Foaw(), Figures(4.5, 2.9, 9.1, 0.35, 6)),
}


def felt(velocity: Any, x_m: Any) -> Any:
    """Return the velocity (n,) [m/s] found in true places (n,) [m] that an encoder counts."""
    seen_m = np.round(x_m / COUNT_M) * COUNT_M
    motion = Motion(np.arange(len(seen_m)) / 1000, np.column_stack([seen_m, 0 * seen_m, 0 * seen_m]))
    return simulate(Scene(scale=1, velocity=velocity, knee=Knee(law="none")), motion).vx_mps


def figures(velocity: Any) -> Figures:
    """Measure one estimator."""
    t_s = np.arange(10_000) / 1000
    v = felt(velocity, AMPLITUDE_M * np.sin(OMEGA * t_s + 0.3))[SKIP:]
    lags_s = np.arange(0, 25.1, 0.25) / 1000

    def error_mmps(lag_s: float) -> float:
        true = AMPLITUDE_M * OMEGA * np.cos(OMEGA * (t_s[SKIP:] - lag_s) + 0.3)
        return 1e3 * float(np.sqrt(np.mean((v - true) ** 2)))

    lag_s = min(lags_s, key=error_mmps)
    even = felt(velocity, 0.005 * t_s + 1.23e-5)[SKIP:]
    settling = [_settling_ms(velocity, phase) for phase in np.linspace(0, 1, 12, endpoint=False)]
    return Figures(1e3 * lag_s, error_mmps(lag_s), error_mmps(0.0), 1e3 * float(even.std()), float(np.median(settling)))


def _settling_ms(velocity: Any, phase: float) -> float:
    t_s = np.arange(400) / 1000
    v = felt(velocity, np.where(t_s < 0.2, 0.1 * t_s, 0.1 * (0.4 - t_s)) + phase * COUNT_M)[200:]
    off = np.flatnonzero(abs(v + 0.1) > 0.02)
    if not len(off):
        return 0.0
    return float(off[-1] + 1) if off[-1] < 150 else NEVER


def main() -> None:
    """Print the table, each figure beside the published one."""
    titles = ("lag ms", "noise mm/s", "error mm/s", "5 mm/s: σ", "settles ms")
    print(f"{'':10}  " + "".join(f"{title:>13} " for title in titles) + f"{'ns':>6} {'bears':>7}")
    print(f"{'':10}  " + f"{'here   publ.':>13} " * 5 + f"{'a tick':>6} {'N·s/m':>7}")
    for name, (velocity, published) in ESTIMATORS.items():
        cells = [f"{_shown(a):>6} {_shown(b):>6}" for a, b in zip(figures(velocity), published, strict=True)]
        print(
            f"{name:10}  " + " ".join(cells) + f" {measure(Scene(velocity=velocity)).scene_ns:6.0f} {_limits(velocity)}"
        )
    print("\nns a tick: a scene without liquids, by estimator. The published foaw is the best-fit one.")


def _limits(velocity: Any) -> str:
    return f"{boundary_nspm(velocity, 1e-3, 1):7.0f}"


def _shown(figure: float) -> str:
    if figure == NEVER:
        return "never"
    return f"{figure:.2f}" if figure < 10 else f"{figure:.1f}"


if __name__ == "__main__":
    main()
