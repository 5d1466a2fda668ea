"""The force that the Falcon's driver gives is never longer than the one that it was asked for."""

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("records as compiled code has them", allow_module_level=True)

from study_app.devices.falcon.exchange import limit_growth
from tests.devices.falcon.support.scripted_bridge import Ticks


@pytest.mark.slow
def test_limited_growth_never_makes_a_force_longer():
    falcon = Ticks().falcon
    random = np.random.default_rng(3)
    falcon.tick_s, falcon.slew_n_per_s = 1e-3, 1500.0
    shortened = 0
    for _ in range(5_000):
        asked_n = random.normal(0, 4, 3)
        falcon.force_n, falcon.held_n, falcon.velocity_mps = asked_n, random.normal(0, 4, 3), random.normal(0, 0.3, 3)
        limit_growth(falcon)
        assert np.linalg.norm(falcon.force_n) <= np.linalg.norm(asked_n) * (1 + 1e-12)
        shortened += np.linalg.norm(falcon.force_n - asked_n) > 1e-9
    assert shortened > 1_000
