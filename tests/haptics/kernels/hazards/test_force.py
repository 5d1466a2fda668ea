"""Hazards 13-16: the way of a force to the device, tiny numbers, and the ends of a drag law."""

import numpy as np
import pytest

from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.laws import HIGHEST_REYNOLDS, LAWS, drag_n
from study_app.haptics.model.layout import LIMITER_NORM
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, THESIS, UNBENT, Hand, liquid, moving, scene, vectors
from tests.haptics.tails import all_numbers, pass_time

BALL = {"diameter_m": 0.068, "drag_coefficient": 0.47}
TAR = {"density_kg_m3": 1150, "viscosity_pa_s": 100, **BALL}
WATER = {"density_kg_m3": 998.2, "viscosity_pa_s": 1.0016e-3, **BALL}


def viscous(law, fluid):
    """Return a scene of a liquid by this law, without a knee."""
    known = {"viscosity_pa_s": fluid["viscosity_pa_s"], "drag": Drag(law=law)}
    return scene(liquid(fluid["density_kg_m3"], **known), knee=UNBENT)


@pytest.mark.parametrize("density", [4500, 20_000])
def test_hazard_13_clamping_does_not_tick_the_force(density):
    random = np.random.default_rng(13)
    for v in random.normal(size=(20, 3)) * [5.0, 1.0, 3.0]:
        table = simulate(scene(liquid(density), scale=1), moving(np.tile(v, (60, 1))))
        sent = vectors(table, "device")[-1]
        assert table.limiters[-1] & LIMITER_NORM
        assert 4 < np.linalg.norm(sent) < 8 + 1e-9
        turned_deg = np.degrees(np.arctan2(np.linalg.norm(np.cross(sent, -v)), -sent @ v))
        assert turned_deg < 0.1


@pytest.mark.skipif(not COMPILED, reason="minutes are for compiled code")
@pytest.mark.parametrize("name", THESIS)
def test_hazard_14_a_long_rest_leaves_exactly_nothing(name):
    """A value that decays by a tenth per tick becomes subnormal after 6700 ticks."""
    hand = Hand(THESIS[name])
    place = hand.sweep(0.2, 300)[-1].position_m + 1e-4
    for _ in range(100):
        rested = pass_time(hand, place, 100)
        numbers = all_numbers(hand.model)
        assert not ((numbers != 0) & (abs(numbers) < np.finfo(float).tiny)).any()
    state = hand.model.state[0]
    for vector in (state.estimate_mps, rested.velocity_mps, rested.wake_mps, rested.force_n, rested.device_force_n):
        assert not vector.any()


@pytest.mark.skipif(not COMPILED, reason="minutes are for compiled code")
def test_hazard_14_a_smoothed_acceleration_decays_to_zero():
    """An average over 25 ms becomes subnormal after 18 s; the kernel's tail lasts far longer."""
    effects = ("drag", "added_mass", "history")
    hand = Hand(scene(liquid(1400, viscosity_pa_s=2.0, effects=effects)))
    place = hand.sweep(0.2, 300)[-1].position_m + 1e-4
    tracks = hand.model.liquid_states[0]
    for _ in range(300):
        rested = pass_time(hand, place, 100)
        numbers = np.concatenate([tracks.added_mass.acceleration_mps2, tracks.history.smoothed_mps, rested.force_n])
        assert not ((numbers != 0) & (abs(numbers) < np.finfo(float).tiny)).any()
    assert not tracks.added_mass.acceleration_mps2.any()
    assert not tracks.history.smoothed_mps.any()
    assert tracks.inertia_n[1].any(), "the tail remembers"


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("speed_mps", [0.0, 5e-324, 1e-300, 1e-160, 1e-12])
def test_hazard_15_as_the_reynolds_number_vanishes_drag_is_stokes(law, speed_mps):
    stokes_n = 3 * np.pi * 100 * 0.068 * speed_mps
    assert drag_n(law, speed_mps, **TAR) == pytest.approx(stokes_n, rel=1e-6)
    table = simulate(viscous(law, TAR), moving([(0.0, 0.0, 0.0), (speed_mps, 0.0, 0.0)]))
    assert table.fx_n[0] == 0.0
    assert np.isfinite(vectors(table, "force")).all()
    # The square of a speed under 1e-154 m/s is no number any more: its force is nothing, and right to 1e-150 N.
    assert table.fx_n[1] == pytest.approx(-stokes_n, rel=1e-6, abs=1e-150)


@pytest.mark.parametrize("law", LAWS)
def test_hazard_16_beyond_its_range_a_coefficient_stays(law):
    def coefficient(reynolds):
        return LAWS[law](reynolds) * 24 / reynolds

    held = coefficient(HIGHEST_REYNOLDS)
    assert 0.43 < held < 0.48
    assert [coefficient(re) for re in (2.1e5, 1e6, 1e9)] == pytest.approx([held] * 3)
    at_mps = np.array([3.0, 5.0, 20.0])  # Re 2.03e5, 3.4e5, 1.4e6
    force_n = simulate(viscous(law, WATER), moving(np.outer(at_mps, [1.0, 0.0, 0.0]))).fx_n
    assert force_n == pytest.approx(-0.5 * 998.2 * held * np.pi * 0.034**2 * at_mps**2)
