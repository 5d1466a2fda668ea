"""What arrives of each shipped liquid's force: its error and share withheld."""

import numpy as np
import pytest

from study_app.evidence.stability import delivered_force
from study_app.evidence.stability.delivered_force import measure
from study_app.evidence.stability.stability_cases import Case, of_physical2
from tests.haptics.scenes import COMPILED

compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")


@compiled
def test_the_error_is_that_of_the_force_sent_on_the_motion_of_the_handle() -> None:
    """A damper whose force lags behind the velocity by EWMA: (1 − α)/α ticks and half a tick; the rest is noise."""
    case = Case(liquid="viscosityjnd_damper", scale=3.0, estimator="ewma", plant="arm", mass_kg=0.2)
    error, _, withheld = delivered_force.errors(case)
    assert error == pytest.approx(100 * 2 * np.pi * 1.6 * 9.5e-3, rel=0.03)
    assert withheld < 0.5


@pytest.mark.slow
@compiled
@pytest.mark.parametrize(("delay", "honey", "times"), [(1, 15, 1.5), (2, 18, 2)])
def test_the_force_arrives_at_one_and_two_ticks_of_delay(delay: int, honey: float, times: float) -> None:
    """Honey of physical2 within a given error [%], the others within a multiple of the best linear estimator's."""
    liquids = [name for name in of_physical2() if name != "physical2_tar"]
    for found in measure(liquids, ("kalman",), (delay,), ("falcon",)):
        assert found.error < (honey if found.liquid == "physical2_honey" else times * found.bound), found.liquid
        assert not found.unstable
