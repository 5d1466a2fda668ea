"""The emulated handle at the end of its arms' reach."""

from itertools import product

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

from study_app.devices.falcon.emulator.emulator import STOPS_M
from study_app.devices.falcon.mechanics.geometry import GEOMETRIES, WORKSPACE_M
from tests.devices.falcon.emulator.test_arm import closed_form
from tests.devices.falcon.support.emulated_falcon import at_work, exchanged, home

STRONGEST = [(4095, 4095, 4095), (-4095, 4095, -4095), (-4095, -4095, -4095)]


@pytest.mark.slow
@pytest.mark.parametrize("geometry", sorted(GEOMETRIES))
@pytest.mark.parametrize("torques", STRONGEST)
def test_thrown_beyond_its_reach_the_handle_stops_and_no_force_grows_without_bound(geometry, torques):
    """A lever of 12 mm a radian bounds what 4095 units make: 52 N an arm; and every place is one the arms can be at."""
    emulator = at_work(geometry=geometry, workspace_m=(1.0, 1.0, 1.0))
    most_n = 0.0
    for corner in product((-0.2, 0.2), repeat=3):
        emulator.hold(*corner)
        for _ in range(150):
            exchanged(emulator, torques)
            emulator.pause(1e-3)
            assert np.isfinite(closed_form(geometry, emulator.position_m)).all()
            most_n = max(most_n, np.abs(emulator.force_n).max())
    assert 5.0 < most_n < 3 * 4095 / 6616 / 0.012


def test_from_its_stop_it_comes_back():
    emulator = at_work(workspace_m=(1.0, 1.0, 1.0))
    emulator.hold(0.2, 0.2, 0.2)
    emulator.pause(0.3)
    assert np.linalg.norm(emulator.position_m) > 0.05
    emulator.hold(0.01, 0.0, 0.0)
    for _ in range(40):
        emulator.pause(0.02)
    assert emulator.position_m == pytest.approx((0.01, 0.0, 0.0), abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("geometry", sorted(GEOMETRIES))
def test_no_place_in_use_is_at_a_stop(geometry):
    emulator = at_work(geometry=geometry, workspace_m=STOPS_M)
    home(emulator)
    assert emulator.homed == 0b111
    for corner in product(*((-half, half) for half in WORKSPACE_M)):
        emulator.hold(*corner)
        for _ in range(25):
            emulator.pause(0.02)
        assert emulator.position_m == pytest.approx(corner, abs=3e-4)
