"""What liquids and velocity estimator hold, and so may give back to the hand: the reserve of the energy account."""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.effects.drag import resistance
from study_app.haptics.kernels.vector import norm, square
from study_app.haptics.model.effects.records import LAW_CONSTANT
from study_app.haptics.model.layout import (
    EFFECT_ADDED_MASS,
    EFFECT_HISTORY,
    EFFECT_LOCAL_WAKE,
    EFFECT_WAKE,
    ESTIMATOR_KALMAN,
    Record,
)

HISTORY_PERIOD_S = 1.0


@part
def liquid_storage(model: Any, delay_ticks: int) -> float:
    """Return the most that the liquids can still give back [J at the hand]."""
    parameters = model.parameters[0]
    most_j = 0.0
    for i in range(parameters.liquids):
        liquid, local = model.liquids[i], model.liquid_states[i]
        inertia_share = liquid.inertia_share[delay_ticks]
        if local.share > 0.0:
            if liquid.effects & EFFECT_WAKE:
                most_j += _wake_power(liquid, local) * liquid.wake.length * parameters.period_s
            if liquid.effects & EFFECT_LOCAL_WAKE:
                most_j += _wake_power(liquid, local) * liquid.local_wake.length * parameters.period_s
            if liquid.effects & EFFECT_ADDED_MASS:
                most_j += (
                    0.5
                    * inertia_share
                    * liquid.added_mass.mass_kg
                    * local.share
                    * _added_mass_square(parameters, liquid, local)
                )
            if liquid.effects & EFFECT_HISTORY:
                inertia_kg = 0.5 * liquid.history.factor_kg_rs * local.share * math.sqrt(HISTORY_PERIOD_S)
                most_j += 0.5 * inertia_share * inertia_kg * _history_square(parameters, local)
    return float(most_j / parameters.scale)


@part
def _added_mass_square(parameters: Record, liquid: Record, local: Record) -> float:
    """Return the square of the velocity [m²/s²] by which the added mass m holds energy, ½ m v².

    Its force is -m dw_s/dt, w_s being w smoothed over τ: w_s' = (w - w_s)/τ. So the hand does the work ∫m w_s' w dt =
    ½ m w_s² + ∫m τ w_s'² dt: what can come back is that of w_s = w - τ w_s', which at a reversal is not 0 when w is.
    With the other estimators their own storage, of a longer lag, covers the difference.
    """
    if parameters.estimator != ESTIMATOR_KALMAN:
        return float(square(local.motion_mps))
    lag_s, square_m2ps2 = 1.0 / liquid.added_mass.filter_per_s, 0.0
    for axis in range(3):
        smoothed_mps = local.motion_mps[axis] - lag_s * local.added_mass.acceleration_mps2[axis]
        square_m2ps2 += smoothed_mps * smoothed_mps
    return square_m2ps2


@part
def _history_square(parameters: Record, local: Record) -> float:
    """Return the same for the inertia in a history, whose velocity is smoothed, too."""
    if parameters.estimator != ESTIMATOR_KALMAN:
        return float(square(local.motion_mps))
    square_m2ps2 = 0.0
    for axis in range(3):
        smoothed_mps = local.motion_mps[axis] + local.history.smoothed_mps[axis] - local.relative_mps[axis]
        square_m2ps2 += smoothed_mps * smoothed_mps
    return square_m2ps2


@part
def filter_storage(model: Any, account: Record) -> float:
    """Return the energy [J at the hand] that the velocity estimator stores because it lags behind.

    With v̂' = (v − v̂)/τ a damper F(v̂) takes ∫F v dt = ∫F v̂ dt + τ∫F dv̂ from the hand: the second term is a storage,
    K τ F v̂ with K = 1/3 for a force that grows as v̂², 1/2 for one that grows as v̂. Where only the share s of F is left
    at the force limit, K = 1 - 2/3 √s and 1 - s/2. A loop that has shown a debt is believed less of it, by the
    controller's gain: a swinging loop would live on its storage.
    """
    parameters, state = model.parameters[0], model.state[0]
    lag_s = parameters.fallback_lag_s if state.kalman.distrusted else parameters.filter_lag_s
    if lag_s == 0.0:
        return 0.0
    sent_n = account.sent_n[account.turn]
    power_w = 0.0
    for axis in range(3):
        power_w -= sent_n[axis] * (state.estimate_mps[axis] - state.drift_mps[axis])
    if power_w <= 0.0:
        return 0.0
    share = 1.0 - 2.0 / 3.0 * math.sqrt(account.norm_share)
    for i in range(parameters.liquids):
        if model.liquids[i].drag.law != LAW_CONSTANT and model.liquid_states[i].share > 0.0:
            share = max(share, 1.0 - 0.5 * account.norm_share)
    return float(account.gain * share * lag_s * power_w / parameters.scale)


@part
def _wake_power(liquid: Record, local: Record) -> float:
    """Return the greatest power [W, scene] that the wake gives to a body: max over v of R(u - v) (u - v) v.

    For a constant coefficient that is (4/27) c u³; R of the other laws grows less, so R(u) u²/4 bounds it.
    """
    wake_mps = norm(local.wake_mps)
    share = 4.0 / 27.0 if liquid.drag.law == LAW_CONSTANT else 0.25
    return float(share * resistance(liquid.drag, wake_mps) * wake_mps * wake_mps)
