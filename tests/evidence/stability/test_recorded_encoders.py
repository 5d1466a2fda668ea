"""Real encoders go through estimators, sample validation and safety layer without an alarm."""

import numpy as np
import pytest

from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_FADE, LIMITER_NORM, LIMITER_SLEW, LIMITER_SLOPE
from study_app.protocol.load import load_scene
from tests.evidence.stability.recorded_encoders import COUNTS_M, ESTIMATORS, FORCE_LIMIT_N, errors, excerpt, felt
from tests.haptics.scenes import COMPILED

pytestmark = [pytest.mark.skipif(not COMPILED, reason="many thousands of ticks"), pytest.mark.slow]

LIMITERS = LIMITER_SLOPE | LIMITER_ENERGY | LIMITER_NORM | LIMITER_SLEW | LIMITER_FADE
SHAKEN = {"Tool_5_Maryland_L_3/29", "Tool_4_Maryland_L_4/07", "Tool_4_Maryland_L_Pitch_1/103"}
"""Recordings in which the spindle shakes, jumps 1 mm after it stuck, or the motor runs away: the controller acts."""


@pytest.mark.parametrize("encoder", COUNTS_M)
@pytest.mark.parametrize(("study", "liquid", "most"), [("physical2", "honey", 0.1), ("rek2024", "light_oil", 0.002)])
def test_no_sample_of_a_real_encoder_is_rejected(encoder: str, study: str, liquid: str, most: float) -> None:
    """The motor is faster than strokes of a hand, and slower than the bound of the validation.

    Of honey's added mass and history a share is always withheld.
    """
    scene, fastest_mps = load_scene(study, liquid), 0.0
    for name, counts in excerpt().items():
        x_m = COUNTS_M[encoder] * counts[:, list(COUNTS_M).index(encoder)]
        fastest_mps = max(fastest_mps, 1e3 * float(np.abs(np.diff(x_m)).max()))
        samples = felt(scene, x_m, COUNTS_M[encoder])
        assert not (samples.limiters & ~LIMITERS).any(), name
        assert not samples.status.any(), name
        assert np.linalg.norm(samples.device_force_n, axis=1).max() <= FORCE_LIMIT_N * (1 + 1e-9)
        assert name in SHAKEN or samples.withheld_n.sum() < most * samples.permitted_n.sum(), name
    assert 0.9 < fastest_mps < 10.0


def test_errors_on_real_encoders_rank_the_estimators() -> None:
    found = {
        encoder: np.mean([errors(count_m * counts[:, column], count_m) for counts in excerpt().values()], axis=0)
        for column, (encoder, count_m) in enumerate(COUNTS_M.items())
    }
    kinds = [velocity.kind for velocity in ESTIMATORS]
    coarse, fine = (dict(zip(kinds, found[encoder], strict=True)) for encoder in ("spindle", "motor"))
    assert fine["kalman"] < 10
    assert fine["kalman"] < 0.6 * fine["ewma"]
    assert coarse["raw"] == max(coarse.values())
    assert all(coarse[kind] > fine[kind] for kind in kinds)
