import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Box
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import UNBENT, examples, liquid, moving, scene, vectors

VOLUME_M3 = math.pi / 6 * 0.068**3


def heavy(*others, density=1000.0, **fields):
    return scene(liquid(density, effects=(*others, "added_mass"), **fields), knee=UNBENT)


def speeding_up(acceleration, ticks=50, interval_s=1e-3):
    return moving(np.outer(np.arange(ticks) * interval_s, acceleration), interval_s)


@pytest.mark.slow
@settings(max_examples=examples(60), deadline=None)
@given(
    density=st.floats(1, 20_000),
    coefficient=st.floats(0, 10),
    ax=st.floats(-20, 20),
    az=st.floats(-20, 20),
    interval_s=st.sampled_from([0.0002, 0.001, 0.01]),
)
def test_half_the_displaced_mass_is_accelerated_with_the_ball(density, coefficient, ax, az, interval_s):
    felt = heavy(density=density, added_mass={"coefficient": coefficient})
    force = vectors(simulate(felt, speeding_up((ax, 0.0, az), 20, interval_s)), "force")
    assert not force[0].any()
    expected = -coefficient * density * VOLUME_M3 * np.array([ax, 0, az])
    assert force[1:] == pytest.approx(np.tile(expected, (19, 1)), rel=1e-6, abs=1e-9)


def test_in_water_it_is_82_grams():
    force = simulate(heavy(density=998.2), speeding_up((1.0, 0, 0))).fx_n[-1]
    assert force == pytest.approx(-0.0822, abs=5e-5)


@pytest.mark.parametrize("interval_s", [0.5e-3, 1e-3, 2e-3])
def test_measured_acceleration_is_smoothed_over_its_time_at_any_rate(interval_s):
    t_s = np.arange(round(0.4 / interval_s)) * interval_s
    motion = Motion(t_s, np.column_stack([0.5 * t_s**2, 0 * t_s, 0 * t_s]))
    felt = heavy(added_mass={"filter_s": 0.05}).model_copy(update={"rate_hz": 1 / interval_s})
    full = -0.5 * 1000 * VOLUME_M3
    force = simulate(felt, motion).fx_n
    assert force[-1] == pytest.approx(full, rel=0.001)
    lag_s = 0.05 + 9.5e-3  # of this filter and of the velocity's
    assert force[round(lag_s / interval_s)] / full == pytest.approx(1 - 1 / math.e, abs=0.05)


def test_one_count_of_an_encoder_is_hardly_felt():
    place_m = np.zeros((80, 3))
    place_m[40:, 0] = 38e-6
    motion = Motion(np.arange(80) / 1000, place_m)
    smooth, rough = (simulate(heavy(added_mass={"filter_s": t}), motion).fx_n for t in (0.025, 0.0))
    assert abs(rough).max() == pytest.approx(0.31, abs=0.01)
    assert abs(smooth).max() < 0.02


def test_entering_a_liquid_is_no_acceleration():
    pool = heavy(region=Box(size_m=(1, 1, 1)))
    x_m = np.where(np.arange(60) < 30, 2.0, 0.0)
    motion = Motion(np.arange(60) / 1000, np.column_stack([x_m, 0 * x_m, 0 * x_m]), np.tile([3.0, 0, 0], (60, 1)))
    assert not simulate(pool, motion).fx_n.any()
