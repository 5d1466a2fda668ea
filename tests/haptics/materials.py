"""Non-Newtonian liquids that tests share: the presets of protocols/slime.toml."""

import numpy as np

from study_app.haptics.kernels.plant import measure, move, new_handle, push
from study_app.haptics.model import laws
from study_app.haptics.model.scene import Liquid, Scene
from study_app.protocol.load import load
from tests.haptics.scenes import Hand

PRESETS = {
    name: (liquid.density_kg_m3, liquid.non_newtonian)
    for name, liquid in load("slime").liquids.items()
    if liquid.non_newtonian is not None
}


def tank(name, *, scale=1.0, effects=("non_newtonian",), table=None, **fields):
    """Return a scene of one preset, by default with its drag alone, perhaps with another flow curve."""
    density_kg_m3, preset = PRESETS[name]
    liquid = Liquid(id=name, density_kg_m3=density_kg_m3, effects=effects, non_newtonian=table or preset)
    return Scene(liquids=(liquid,), scale=scale, **fields)


def creep_mps(name, share, *, noise=0.0, scale=3.0):
    """Return how fast a free handle of 0.1 kg creeps under a share of the yield force, read in counts.

    ``noise`` is a share of samples that are off by a count.
    """
    tank_scene = tank(name, scale=scale)
    pull_n = share * laws.yield_n(tank_scene.liquids[0].non_newtonian, tank_scene.body.diameter_m)
    handle = new_handle(mass_kg=0.1, viscous_nspm=0.5, stiffness_npm=1.0, quantum_m=38e-6, delay=1)
    hand, random = Hand(tank_scene), np.random.default_rng(0)
    seen_m, place_m = np.zeros(3), np.zeros((4000, 3))
    for k in range(4000):
        aim_m = handle.position_m + np.array([min(k / 500, 1.0) * pull_n, 0.0, 0.0])
        move(handle, aim_m, aim_m, 1e-3)
        measure(handle, seen_m)
        sent = hand.tick(seen_m + 38e-6 * random.integers(-1, 2, 3) * (random.random() < noise))
        push(handle, *sent.device_force_n)
        place_m[k] = handle.position_m
    return abs(place_m[-1, 0] - place_m[2000, 0]) / 2.0
