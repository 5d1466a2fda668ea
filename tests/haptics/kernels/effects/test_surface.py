import math

import numpy as np
import pytest

from study_app.haptics.model.estimators import Given
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Box, Cylinder
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import UNBENT, WATER_FACTOR, liquid, scene, vectors

RADIUS_M = 0.034
TOP_M = 0.3
POOL = Box(centre_m=(0.0, -0.2, 0.0), size_m=(2.0, 1.0, 2.0))
TANK = Cylinder(centre_m=(0.0, -0.2, 0.0), radius_m=1.0, height_m=1.0)


def pool(*effects, region=POOL, **fields):
    return scene(liquid(effects=(*effects, "surface"), region=region, **fields), knee=UNBENT, velocity=Given())


def shares(depth, region=POOL):
    """Return the shares of volume, of the frontal areas upright and level, at h/D = ``depth``."""
    heights_m = TOP_M + RADIUS_M - np.array([depth, 3.0, -1.0]) * 2 * RADIUS_M
    shares_found = []
    for effect, velocity_mps in (("buoyancy", (0, 0, 0)), ("drag", (0, 1.0, 0)), ("drag", (1.0, 0, 0))):
        pool_scene = pool(effect, region=region, density_kg_m3=500)
        at, below, above = vectors(simulate(pool_scene, motion_at_heights(heights_m, velocity_mps)), "force").sum(
            axis=1
        )
        shares_found.append((at - above) / (below - above))
    return shares_found


def motion_at_heights(y_m, velocity_mps, interval_s=1e-3):
    """Return a motion at these heights (n,) with one velocity (3,)."""
    y_m = np.asarray(y_m, float)
    places = np.column_stack([0 * y_m, y_m, 0 * y_m])
    return Motion(
        np.arange(len(y_m)) * interval_s, places, velocity_mps=np.tile(np.asarray(velocity_mps, float), (len(y_m), 1))
    )


@pytest.mark.parametrize("region", [POOL, TANK], ids=["box", "cylinder"])
@pytest.mark.parametrize(
    ("depth", "volume", "upright", "level"),
    [
        (-0.5, 0, 0, 0),
        (0.0, 0, 0, 0),
        (0.1, 0.0280, 0.36, 0.0520),
        (0.25, 0.15625, 0.75, 0.1955),
        (0.5, 0.5, 1, 0.5),
        (0.75, 0.84375, 1, 0.8045),
        (1.0, 1, 1, 1),
        (3.0, 1, 1, 1),
    ],
)
def test_the_cap_of_a_ball(depth, volume, upright, level, region):
    assert shares(depth, region) == pytest.approx((volume, upright, level), abs=5e-5)


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("effects", "velocity"),
    [(("drag",), (1.0, -1.0, 0.0)), (("buoyancy",), (0, -1.0, 0)), (("drag", "buoyancy"), (0.0, -1.0, 0.5))],
)
def test_nothing_steps_at_the_surface(effects, velocity):
    y_m = np.linspace(TOP_M + 0.05, TOP_M - 0.05, 2001)
    force = vectors(simulate(pool(*effects), motion_at_heights(y_m, velocity)), "force")
    assert abs(np.diff(force, axis=0)).max() < 0.01 * abs(force).max()


def test_entering_through_the_surface_takes_no_time_and_through_a_wall_20_ms():
    falling = simulate(pool("drag"), motion_at_heights([TOP_M + 0.05, TOP_M - 0.05], (0, -1.0, 0))).fy_n
    assert falling == pytest.approx([0.0, WATER_FACTOR])
    x_m = np.where(np.arange(40) < 10, 1.5, 0.9)
    places = np.column_stack([x_m, np.zeros(40), np.zeros(40)])
    entering = simulate(
        pool("drag"), Motion(np.arange(40) / 1000, places, velocity_mps=np.tile([-1.0, 0.0, 0.0], (40, 1)))
    ).fx_n
    assert entering[:10] == pytest.approx(0)
    assert entering[10:30] == pytest.approx(WATER_FACTOR * np.arange(1, 21) / 20)


def test_of_two_liquids_on_top_of_each_other_the_ball_is_shared_at_their_surface():
    oil = liquid(500, id="oil", region=Box(size_m=(2, 4, 2)), effects=("drag", "buoyancy"))
    water = liquid(1000, id="water", region=POOL, effects=("drag", "buoyancy", "surface"))
    layered_scene = scene(oil, water, knee=UNBENT, velocity=Given())
    volume = 4 / 3 * math.pi * RADIUS_M**3
    half, above, below = (
        simulate(layered_scene, motion_at_heights(np.full(30, y), (0, 0, 0))).fy_n[-1]
        for y in (TOP_M, TOP_M + 0.1, TOP_M - 0.1)
    )
    assert above == pytest.approx((500 - 1000) * volume * 9.80665)
    assert half == pytest.approx((750 - 1000) * volume * 9.80665)
    assert below == pytest.approx(0.0, abs=1e-12)
