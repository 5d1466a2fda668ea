"""The energy that the velocity estimator stores and may therefore return to the hand."""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.model.layout import GROWS_AS_SPEED, GROWS_LESS, Record


@part
def filter_storage(model: Any, passivity: Record) -> float:
    """Return the energy [J at the hand] that the velocity estimator stores because it lags behind.

    With v̂' = (v − v̂)/τ a damper F(v̂) takes ∫F v dt = ∫F v̂ dt + τ∫F dv̂ from the hand: the second term is a storage,
    K τ F v̂ with K = 1/3 for a force that grows as v̂², 1/2 for one that grows as v̂. If the force limit leaves only
    the share s of F, K = 1 - 2/3 √s and 1 - s/2; for a force that grows less than v̂, K is at most 1. After a debt the
    storage is multiplied by the controller's gain: otherwise it would sustain an oscillating loop.
    """
    parameters, state = model.parameters[0], model.state[0]
    lag_s = parameters.fallback_lag_s if state.kalman.distrusted else parameters.filter_lag_s
    if lag_s == 0.0:
        return 0.0
    sent_n, saturated_n = passivity.sent_n[passivity.row], passivity.saturated_n[passivity.row]
    power_w = missing_w = 0.0
    for axis in range(3):
        v_mps = state.estimate_mps[axis] - state.drift_mps[axis]
        power_w -= sent_n[axis] * v_mps
        missing_w -= saturated_n[axis] * v_mps
    power_w -= max(missing_w, 0.0)
    if power_w <= 0.0:
        return 0.0
    share = 1.0 - 2.0 / 3.0 * math.sqrt(passivity.norm_share)
    if state.growth == GROWS_AS_SPEED:
        share = max(share, 1.0 - 0.5 * passivity.norm_share)
    elif state.growth == GROWS_LESS:
        share = 1.0
    return float(passivity.gain * share * lag_s * power_w / parameters.scale)
