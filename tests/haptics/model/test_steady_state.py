"""The force predicted by arithmetic, held against the servo's own tick."""

import numpy as np
import pytest

from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.layout import LIMITER_NORM, LIMITER_SLOPE
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Knee, Liquid, Scene
from study_app.haptics.model.slope_limits import steady_force
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, vectors

LIQUIDS = {
    "water": (998.2, 1.0016e-3),
    "olive_oil": (913, 0.084),
    "glycerin": (1261, 1.41),
    "honey": (1420, 10.0),
    "tar": (1150, 100.0),
}


def scene_of(name, scale, law="brown-lawler"):
    density, viscosity = LIQUIDS[name]
    liquid = Liquid(id=name, density_kg_m3=density, viscosity_pa_s=viscosity, drag=Drag(law=law))
    return Scene(scale=scale, liquids=(liquid,))


def simulated_force(scene, hand_mps, lasting_s=1):
    """Return the force [N] and the limiters after a uniform motion of the hand of ``lasting_s``."""
    t_s = np.arange(1000 * lasting_s) / 1000
    x_m = scene.scale * hand_mps * t_s
    table = simulate(scene, Motion(t_s, np.column_stack([x_m, 0 * x_m, 0 * x_m])))
    return float(np.linalg.norm(vectors(table, "device")[-1])), int(table.limiters[-1])


@pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")
@pytest.mark.parametrize("name", LIQUIDS)
@pytest.mark.parametrize("scale", [1, 3, 10])
@pytest.mark.parametrize("hand_mps", [0.02, 0.1, 0.25, 0.6])
def test_the_predicted_force_equals_the_force_that_the_servo_sends(name, scale, hand_mps):
    for law in ("constant", "schiller-naumann", "haider-levenspiel", "brown-lawler"):
        predicted = steady_force(scene_of(name, scale, law), hand_mps)
        force_n, limiters = simulated_force(scene_of(name, scale, law), hand_mps)
        assert predicted.force_n == pytest.approx(force_n, rel=1e-6)
        acted = {LIMITER_NORM: "norm", LIMITER_SLOPE: "slope"}.get(limiters & (LIMITER_NORM | LIMITER_SLOPE))
        if limiters & LIMITER_NORM and limiters & LIMITER_SLOPE:
            acted = "norm"
        assert predicted.limit == acted


@pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")
@pytest.mark.parametrize("name", ["gear_oil", "honey", "tar"])
def test_unsteady_drag_reaches_the_predicted_force_once_its_history_is_over(name):
    liquid = Liquid(id=name, density_kg_m3=890, viscosity_pa_s={"gear_oil": 0.35, "honey": 10, "tar": 100}[name])
    scene = Scene(scale=3, liquids=(liquid.model_copy(update={"effects": ("unsteady_drag",)}),))
    predicted = steady_force(scene)
    force_n, limiters = simulated_force(scene, 0.1, lasting_s=30)
    assert predicted.force_n == pytest.approx(force_n, rel=0.01)
    assert (predicted.limit == "slope") == bool(limiters & LIMITER_SLOPE)
    assert (predicted.limit == "slope") == (name == "tar")


def test_tar_is_clipped_by_the_slope_limit():
    tar = steady_force(scene_of("tar", 3))
    assert (tar.force_n, tar.limit) == (pytest.approx(5.3), "slope")
    assert tar.drag_n > 19


def test_the_thesis_honey_is_forty_percent_above_its_water():
    water, honey = (steady_force(Scene(liquids=(Liquid(id="x", density_kg_m3=rho),))) for rho in (1000, 1400))
    assert honey.force_n / water.force_n == pytest.approx(1.4)
    assert water.force_n == pytest.approx(0.853, rel=1e-3)


def test_the_knee_and_the_gate_are_reckoned_with():
    fast = Scene(scale=10, liquids=(Liquid(id="x", density_kg_m3=100),), force_limit_n=8)
    assert steady_force(fast, 0.9).force_n == pytest.approx(0.0853 * 49, rel=1e-3)
    unbent = fast.model_copy(update={"knee": Knee(law="none")})
    assert steady_force(unbent, 0.9).force_n == pytest.approx(0.0853 * 81, rel=1e-3)
    thin = Liquid(id="air", density_kg_m3=1.2, viscosity_pa_s=1.8e-5, effects="auto")
    assert steady_force(Scene(scale=1, liquids=(thin,))) == (0.0, 0.0, None)
