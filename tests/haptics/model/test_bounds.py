"""The bounds of the gate, held against what the effects really do along motions within the box."""

import numpy as np
import pytest

from study_app.haptics.model.effects.current import Channel, Uniform, Vortex
from study_app.haptics.model.effects.drag import REFERENCE, Drag
from study_app.haptics.model.estimators import Given
from study_app.haptics.model.gate import bounds, effect_verdicts, resolve
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Accuracy, Body, Box, Liquid, MotionBox, Scene
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, vectors

pytestmark = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")

SPEED_MPS, ACCELERATION_MPS2 = 0.5, 4.0
TICK_S = 1e-3
POOL = Box(centre_m=(0.0, -0.5, 0.0), size_m=(50.0, 1.0, 50.0))  # its top is at y = 0
DEPTH_M = (-0.06, 0.3)
LIQUIDS = {"water": (998.2, 1.0016e-3), "glycerin": (1261, 1.41), "honey": (1420, 10.0)}
CURRENTS = {
    "uniform": Uniform(velocity_mps=(0.3, 0.0, -0.2)),
    "channel": Channel(width_m=1.0, peak_mps=0.4),
    "vortex": Vortex(core_m=0.2, peak_mps=0.4),
}


def wandering(seed, seconds=4.0):
    """Return a motion within the box: random turns at full acceleration, rests, places above and below the surface."""
    random = np.random.default_rng(seed)
    ticks = int(seconds / TICK_S)
    velocity_mps, wanted_mps = np.zeros((ticks, 3)), np.zeros(3)
    position_m = np.tile([0.0, -0.05, 0.0], (ticks, 1))
    for k in range(1, ticks):
        if random.random() < 0.004:
            wanted_mps = random.normal(size=3)
            wanted_mps *= random.choice([0.0, 0.3, 1.0], p=[0.2, 0.2, 0.6]) * SPEED_MPS / np.linalg.norm(wanted_mps)
        if not -DEPTH_M[1] < position_m[k - 1, 1] + 0.05 * velocity_mps[k - 1, 1] < -DEPTH_M[0]:
            wanted_mps[1] = -np.sign(position_m[k - 1, 1] + 0.15) * 0.2
            wanted_mps *= min(1.0, SPEED_MPS / np.linalg.norm(wanted_mps))
        step = wanted_mps - velocity_mps[k - 1]
        step *= min(1.0, ACCELERATION_MPS2 * TICK_S / max(np.linalg.norm(step), 1e-12))
        velocity_mps[k] = velocity_mps[k - 1] + step
        position_m[k] = position_m[k - 1] + velocity_mps[k] * TICK_S
    return Motion(np.arange(ticks) * TICK_S, position_m, velocity_mps=velocity_mps)


WANDERINGS = [wandering(seed) for seed in range(4)]


def box_of(motion, velocity_mps=SPEED_MPS):
    """Return the motion box that contains a motion."""
    depth_m = -motion.position_m[:, 1]
    return MotionBox(
        speed_mps=velocity_mps, acceleration_mps2=ACCELERATION_MPS2, depth_m=(depth_m.min(), depth_m.max())
    )


def pool(name, motion, **fields):
    """Return a scene of one liquid with a surface."""
    density, viscosity = LIQUIDS[name]
    liquid = Liquid(**{"id": name, "density_kg_m3": density, "viscosity_pa_s": viscosity, "region": POOL, **fields})
    return Scene(scale=1, velocity=Given(), motion=box_of(motion), body=Body(density_kg_m3=700), liquids=(liquid,))


def with_effects(scene, effects, law=REFERENCE):
    """Return the scene with these effects in its liquid."""
    liquid = scene.liquids[0].model_copy(update={"effects": tuple(effects), "drag": Drag(law=law)})
    return scene.model_copy(update={"liquids": (liquid,)})


def simulated_force(scene, motion):
    """Return the force (n, 3) [N]."""
    return vectors(simulate(scene, motion), "force")


ALL = ("drag", "current", "buoyancy", "surface", "added_mass", "history")


@pytest.mark.parametrize("name", LIQUIDS)
@pytest.mark.parametrize("current", CURRENTS)
def test_effects_omitted_by_auto_change_the_force_by_no_more_than_the_target(name, current):
    for motion in WANDERINGS:
        scene = pool(name, motion, current=CURRENTS[current], effects="auto")
        scene = scene.model_copy(update={"accuracy": Accuracy(without=("unsteady_drag",))})
        verdicts = effect_verdicts(scene)
        total_n = sum(verdict.bound_n for verdict in verdicts)
        target_n = max(0.05 * total_n, 0.05)
        chosen = resolve(scene)
        missing_n = simulated_force(with_effects(scene, ALL), motion) - simulated_force(chosen, motion)
        law_n = max(0.05 * bounds(scene, scene.liquids[0])["drag"], 0.05) if "drag" in chosen.liquids[0].effects else 0
        assert np.linalg.norm(missing_n, axis=1).max() <= target_n + law_n


def test_the_worst_motion_for_history_all_but_reaches_its_bound():
    steady_ticks, turn_s = 4000, 2 * SPEED_MPS / ACCELERATION_MPS2
    turning = np.minimum(np.arange(1, int(turn_s / TICK_S) + 1) * TICK_S * ACCELERATION_MPS2, 2 * SPEED_MPS)
    vx = np.concatenate([np.full(steady_ticks, -SPEED_MPS), turning - SPEED_MPS])
    velocity_mps = np.column_stack([vx, 0 * vx, 0 * vx])
    motion = Motion(np.arange(len(vx)) * TICK_S, np.cumsum(velocity_mps, axis=0) * TICK_S, velocity_mps=velocity_mps)
    scene = pool("honey", motion).model_copy(
        update={"motion": MotionBox(speed_mps=SPEED_MPS, acceleration_mps2=ACCELERATION_MPS2)}
    )
    liquid = Liquid(id="honey", density_kg_m3=1420, viscosity_pa_s=10, history={"smoothing_s": 0})
    scene = scene.model_copy(update={"liquids": (liquid,)})
    force_n = simulated_force(with_effects(scene, ["history"]), motion)
    assert -force_n[-1, 0] == pytest.approx(bounds(scene, liquid)["history"], rel=0.02)
