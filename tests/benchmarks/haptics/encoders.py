"""Velocity estimators, sample validation and safety layer on real encoders, recorded at 1 kHz.

``python tests/benchmarks/haptics/encoders.py [FOLDER]``: a folder of the data set named in
``tests/evidence/stability/encoders.md`` (340 recordings, some minutes); without it, the excerpt beside the tests.
Errors and noise are relative to the velocity of the smoothed counts of the same encoder, and of the finer one.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_ESTIMATOR, LIMITER_GLITCH
from study_app.protocol.load import load_scene
from tests.evidence.stability.recorded_encoders import (
    COUNTS_M,
    ESTIMATORS,
    accuracy,
    excerpt,
    positions_m,
    recordings,
    servo_samples,
    smoothed_mps,
)

LIQUIDS = (("physical2", "honey"), ("physical2", "water"), ("rek2024", "light_oil"))
NAMED = 3


def main() -> None:
    """Print errors of the estimators, then the effects of servo and safety layer."""
    recorded = list(recordings(Path(sys.argv[1]))) if len(sys.argv) > 1 else list(excerpt().items())
    names = [name for name, _ in recorded]
    print(f"{len(recorded)} recordings, {sum(len(counts) for _, counts in recorded) / 1000:.0f} s at 1 kHz")
    for column, (encoder, count_m) in enumerate(COUNTS_M.items()):
        places_m = [positions_m(counts, encoder) for _, counts in recorded]
        fastest = 1e3 * np.array([np.abs(np.diff(x_m)).max() for x_m in places_m])
        print(f"\n{encoder}, {1e6 * count_m:.2g} µm a count; up to {fastest.max():.2g} m/s")
        for finer in list(COUNTS_M)[column:]:
            pairs = zip(places_m, (counts for _, counts in recorded), strict=True)
            measured = np.array(
                [accuracy(x_m, count_m, smoothed_mps(positions_m(counts, finer))) for x_m, counts in pairs]
            )
            for number, name in enumerate(("error of v·|v| [%]", "noise above 20 Hz [mm/s]")):
                print(f"{f'{name}, {finer}':<36}{'mean':>8}{'median':>8}{'worst':>8}")
                for k, velocity in enumerate(ESTIMATORS):
                    _print_row(velocity.kind, measured[:, k, number])
        longer = np.array([_difference(smoothed_mps(x_m), smoothed_mps(x_m, 61)) for x_m in places_m])
        _print_row("smoother of 61 samples", longer)
        for study, liquid in LIQUIDS:
            _print_felt(
                study, liquid, names, [servo_samples(load_scene(study, liquid), x_m, count_m) for x_m in places_m]
            )


def _print_row(name: str, values: np.ndarray) -> None:
    print(f"{name:<36}{values.mean():8.2f}{np.median(values):8.2f}{values.max():8.2f}")


def _difference(v_mps: np.ndarray, other_mps: np.ndarray) -> float:
    right = other_mps * np.abs(other_mps)
    return 100 * float(np.sqrt(np.sum((v_mps * np.abs(v_mps) - right) ** 2) / np.sum(right**2)))


def _print_felt(study: str, liquid: str, names: list[str], sides: list[np.recarray]) -> None:
    """Print rejected samples, ticks of limiters, the strongest force, and where force was withheld."""
    acted = [
        sum(int(np.count_nonzero(samples.limiters & bit)) for samples in sides)
        for bit in (LIMITER_GLITCH, LIMITER_ESTIMATOR, LIMITER_ENERGY)
    ]
    faults = sum(int(np.count_nonzero(samples.status)) for samples in sides)
    strongest_n = max(float(np.linalg.norm(samples.device_force_n, axis=1).max()) for samples in sides)
    withheld = np.array([samples.withheld_n.sum() / samples.permitted_n.sum() for samples in sides])
    most = [f"{names[k]} {100 * withheld[k]:.1f} %" for k in np.argsort(-withheld)[:NAMED]]
    print(
        f"{study} {liquid}: rejected {acted[0]}, estimator replaced {acted[1]}, passivity controller {acted[2]} ticks, "
        f"faults {faults}, up to {strongest_n:.2f} N; withheld {100 * withheld.mean():.2f} %, most: {', '.join(most)}"
    )


if __name__ == "__main__":
    main()
