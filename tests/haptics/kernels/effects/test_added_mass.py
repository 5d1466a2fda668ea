import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import UNBENT, examples, liquid, moving, scene, vectors

VOLUME_M3 = math.pi / 6 * 0.068**3


def heavy_scene(*others, density=1000.0, **fields):
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
    scene = heavy_scene(density=density, added_mass={"coefficient": coefficient})
    force = vectors(simulate(scene, speeding_up((ax, 0.0, az), 20, interval_s)), "force")
    assert not force[0].any()
    expected = -coefficient * density * VOLUME_M3 * np.array([ax, 0, az])
    assert force[1:] == pytest.approx(np.tile(expected, (19, 1)), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("interval_s", [0.5e-3, 1e-3, 2e-3])
def test_measured_acceleration_is_smoothed_over_its_time_at_any_rate(interval_s):
    t_s = np.arange(round(0.4 / interval_s)) * interval_s
    motion = Motion(t_s, np.column_stack([0.5 * t_s**2, 0 * t_s, 0 * t_s]))
    scene = heavy_scene(added_mass={"filter_s": 0.05}).model_copy(update={"rate_hz": 1 / interval_s})
    full = -0.5 * 1000 * VOLUME_M3
    force = simulate(scene, motion).fx_n
    assert force[-1] == pytest.approx(full, rel=0.001)
    lag_s = 0.05 + 9.5e-3  # of this filter and of the velocity's
    assert force[round(lag_s / interval_s)] / full == pytest.approx(1 - 1 / math.e, abs=0.05)
