import numpy as np
import pytest

from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Box, Cylinder
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import WATER_FACTOR, liquid, scene

CUBE = Box(size_m=(0.2, 0.2, 0.2))


def shares(scene, position_m, interval_s=1e-3):
    """Return φ of the scene's water at each place: the drag at a given 1 m/s along x over the drag of full water."""
    position_m = np.asarray(position_m, float)
    velocity_mps = np.tile([1.0, 0.0, 0.0], (len(position_m), 1))
    motion = Motion(interval_s * np.arange(len(position_m)), position_m, velocity_mps=velocity_mps)
    return simulate(scene, motion).fx_n / -WATER_FACTOR


def walk(x_m, y_m=0.0, z_m=0.0):
    """Return places (n, 3)."""
    return np.column_stack(np.broadcast_arrays(x_m, y_m, z_m)).astype(float)


@pytest.mark.parametrize(
    ("region", "inside", "outside"),
    [
        (CUBE, [(0, 0, 0), (0.1, 0.1, -0.1), (-0.1, 0, 0)], [(0.101, 0, 0), (0, -0.101, 0), (0, 0, 0.2)]),
        (
            Box(centre_m=(1, 2, 3), size_m=(0.2, 0.4, 0.6)),
            [(1.09, 2.19, 2.71), (0.91, 1.81, 3.29)],
            [(1.11, 2, 3), (1, 2.21, 3), (0, 0, 0)],
        ),
        (Cylinder(radius_m=0.1, height_m=1), [(0.07, 0.5, 0.07)], [(0.08, 0, 0.08), (0, 0.51, 0), (0.11, 0, 0)]),
        (Cylinder(centre_m=(0, 1, 0), radius_m=0.1, height_m=1), [(0, 1.5, 0.1)], [(0, 0.49, 0), (0, 1.51, 0)]),
    ],
)
def test_a_region_holds_its_border_and_nothing_beyond(region, inside, outside):
    region_scene = scene(liquid(region=region))
    assert [shares(region_scene, [place])[0] for place in inside] == pytest.approx([1] * len(inside))
    assert [shares(region_scene, [place])[0] for place in outside] == [0] * len(outside)


def test_entering_and_leaving_fade_over_20_ms():
    phi = shares(scene(liquid(region=CUBE)), walk([0.5] + [0.0] * 30 + [0.5] * 30))
    assert phi[:32] == pytest.approx([0, *np.minimum(np.arange(1, 31) / 20, 1), 0.95])
    assert phi[-1] == 0.0
    assert phi[31:51] == pytest.approx(1 - np.arange(1, 21) / 20)


def test_the_fade_goes_by_time_not_by_samples():
    phi = shares(scene(liquid(region=CUBE)), walk([0.5, 0, 0, 0, 0]), interval_s=6e-3)
    assert phi == pytest.approx([0, 0.3, 0.6, 0.9, 1.0])


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_border_has_a_millimetre_of_hysteresis(axis):
    places = np.zeros((8, 3))
    places[:, axis] = [0.102, 0.1005, 0.0999, 0.1005, 0.1009, 0.1011, 0.1005, 0.0999]
    phi = np.diff(shares(scene(liquid(region=CUBE)), places), prepend=0)
    assert np.sign(np.round(phi, 9)).tolist() == [0, 0, 1, 1, 1, -1, -1, 1]


def test_where_liquids_overlap_the_last_listed_counts():
    overlapping = scene(liquid(1000, id="all"), liquid(3000, id="part", region=CUBE))
    phi = shares(overlapping, walk([1.0] * 3 + [0.0] * 25 + [1.0] * 25))
    assert phi[0] == pytest.approx(1)
    assert phi[3] == pytest.approx(0.95 + 3 * 0.05)
    assert phi[27] == pytest.approx(3)
    assert phi[-1] == pytest.approx(1)
