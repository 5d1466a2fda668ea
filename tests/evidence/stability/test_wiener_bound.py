"""The least error of a linear estimator: that of the best filter by brute force, and numbers of an outside check."""

import numpy as np
import pytest

from study_app.evidence.reference_solutions import without_buoyancy
from study_app.evidence.stability import velocity as bounds
from study_app.evidence.stability.stability_cases import scenes
from study_app.evidence.stability.velocity import wiener_bound
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.scene import Knee, Liquid, Scene
from tests.haptics.scenes import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")

DAMPER = Scene(
    scale=1,
    knee=Knee(law="none"),
    liquids=(Liquid(id="damper", density_kg_m3=1000, drag=Drag(law="linear", damping_nspm=20.0)),),
)


@pytest.mark.parametrize(("count_m", "delay"), [(38e-6, 0), (200e-6, 1), (200e-6, 30)])
def test_no_filter_of_counted_positions_finds_the_velocity_better(count_m: float, delay: int) -> None:
    """Least squares over 300 positions, fitted to one course of the motion and judged on it, is as good."""
    turns, power_m2 = bounds._spectrum(1000.0)
    phase = np.random.default_rng(7).uniform(0, 2 * np.pi, len(turns))
    x_m = np.sqrt(2 * power_m2) * np.exp(1j * phase)
    places_m, speeds_mps = bounds._signal(x_m), bounds._signal(turns * x_m)
    seen_m = np.rint(places_m / count_m) * count_m
    rows = np.arange(300, len(seen_m) - delay)
    past_m = np.column_stack([seen_m[rows - k] for k in range(300)])
    right_mps = speeds_mps[rows + delay]
    found_mps = past_m @ np.linalg.solve(past_m.T @ past_m, past_m.T @ right_mps)
    least = np.sqrt(np.mean((found_mps - right_mps) ** 2) / np.mean(right_mps**2))
    assert wiener_bound(DAMPER, count_m, delay * 1e-3) == pytest.approx(least, rel=0.06)


@pytest.mark.parametrize(
    ("liquid", "percent"), [("water", (16.5, 12.4, 11.2)), ("glycerin", (9.3, 6.6, 5.9)), ("honey", (6.1, 4.5, 4.0))]
)
def test_bounds_of_physical2_agree_with_an_independent_check(liquid: str, percent: tuple[float, ...]) -> None:
    scene = without_buoyancy(scenes()[f"physical2_{liquid}"])
    bounds = [100 * wiener_bound(scene, count_m, 1e-3) for count_m in (38e-6, 14e-6, 10e-6)]
    assert bounds == pytest.approx(percent, rel=0.16)
