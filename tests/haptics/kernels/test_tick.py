import numpy as np
import pytest
from numba import njit
from numba.core.runtime import _nrt_python, rtsys

from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.kernels.tick import compute_tick
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Box, Scene
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import pack, pack_into
from tests.haptics.scenes import COMPILED, EVERYTHING, LIGHT_OIL, THESIS, WATER, Hand, liquid, scene, stroke, vectors

MANY = scene(
    *WATER.liquids,
    liquid(900, id="pool", region=Box(size_m=(0.3, 0.3, 0.3)), wake={"length": 50, "scaling": 60, "axes": "xyz"}),
    liquid(1400, id="core", region=Box(size_m=(0.1, 0.1, 0.1))),
)
SCENES = {**THESIS, "many": MANY, **EVERYTHING}


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_servos_tick_and_simulate_are_the_same(scene):
    positions_m = stroke(1500)
    hand = Hand(scene)
    live = [hand.tick(place) for place in positions_m]
    t_s = 1e-9 * (np.array([sample.time_ns for sample in live]) - live[0].time_ns)
    table = simulate(scene, Motion(t_s, scene.scale * positions_m))
    for kind, field in [("velocity", "velocity_mps"), ("wake", "wake_mps"), ("force", "force_n")]:
        assert vectors(table, kind) == pytest.approx(np.array([sample[field] for sample in live]), abs=1e-9)
    sent = np.array([sample.device_force_n for sample in live])
    assert vectors(table, "device") == pytest.approx(sent, abs=1e-9)
    assert (table.limiters == [sample.limiters for sample in live]).all()


def test_a_model_is_refilled_in_place_with_a_fresh_state():
    model = pack(WATER, capacity=2000)
    memory = [field.ctypes.data for field in model.arrays]
    used = Hand(WATER)
    used.model = model
    for place in stroke(500):
        used.tick(place)
    pack_into(model, LIGHT_OIL)
    assert [field.ctypes.data for field in model.arrays] == memory
    again, fresh = Hand(LIGHT_OIL), Hand(LIGHT_OIL)
    again.model = model
    for place in stroke(500):
        assert again.tick(place).tobytes() == fresh.tick(place).tobytes()


@njit
def run(model, safety, sample, positions_m, ticks):
    for k in range(ticks):
        sample.time_ns += 1_000_000
        sample.fresh = k % 7 != 0
        for axis in range(3):
            sample.position_m[axis] = positions_m[k % len(positions_m), axis]
        compute_tick(model, safety, sample)


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="the interpreter allocates all the time")
@pytest.mark.parametrize("scene", [Scene(), *SCENES.values()], ids=["rest", *SCENES])
def test_hazard_18_no_tick_allocates_so_no_collection_can_pause_it(scene):
    def allocations(ticks):
        before = rtsys.get_allocation_stats()
        run(model, safety[0], sample[0], positions_m, ticks)
        after = rtsys.get_allocation_stats()
        return after.alloc - before.alloc, after.mi_alloc - before.mi_alloc

    model, safety, sample, positions_m = pack(scene), new_safety(), records(SAMPLE, 1), stroke(4000)
    run(model, safety[0], sample[0], positions_m, 10)
    _nrt_python.memsys_enable_stats()
    try:
        assert allocations(1000) == allocations(0)
        assert allocations(4000) == allocations(0)
    finally:
        _nrt_python.memsys_disable_stats()
