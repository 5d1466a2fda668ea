"""The expected error in non-Newtonian liquids."""

import pytest

from study_app.evaluation.expected_error import error_report, expected
from study_app.haptics.model.scene import Given, MotionBox
from tests.haptics.materials import PRESETS, tank
from tests.haptics.scenes import COMPILED

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not COMPILED, reason="measures compiled code")]

STROKES = MotionBox(speed_mps=0.6, acceleration_mps2=6)


@pytest.mark.nightly
@pytest.mark.parametrize("name", PRESETS)
def test_non_newtonian_liquids_are_compared_with_their_law_added_mass_and_buoyancy(name):
    whole = tank(name, scale=3.0, effects=("non_newtonian", "added_mass", "buoyancy"), motion=STROKES)
    found = expected(whole)
    assert found.causes.law < 0.05
    assert 0.03 < found.error_share < 0.2 + found.causes.limits
    known = expected(whole.model_copy(update={"velocity": Given()}))
    assert known.error_share < 0.05 + known.causes.limits
    lacking = expected(tank(name, scale=3.0, motion=STROKES))
    assert lacking.causes.law > found.causes.law + 0.02
    assert f"{PRESETS[name][1].kind} law (no reference in unsteady flow)" in error_report(whole)
