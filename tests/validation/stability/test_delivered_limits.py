"""The force of physical2 that arrives with "kalman", on the hand's true motion: how far it may be off the law."""

import pytest

from study_app.validation.stability.delivered_force import measure
from study_app.validation.stability.stability_cases import of_physical2
from tests.haptics.scenes import COMPILED

LIQUIDS = [name for name in of_physical2() if name != "physical2_tar"]


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")
@pytest.mark.parametrize(("delay", "honey", "times"), [(1, 15, 1.5), (2, 18, 2)])
def test_the_force_arrives_at_one_and_two_ticks_of_delay(delay, honey, times):
    """Honey within a given error [%], the others within a multiple of the best linear estimator's."""
    for found in measure(LIQUIDS, ("kalman",), (delay,), ("falcon",)):
        assert found.error < (honey if found.liquid == "physical2_honey" else times * found.bound), found.liquid
        assert not found.unstable
