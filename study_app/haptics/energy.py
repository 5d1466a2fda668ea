"""The energy account: a liquid gives back to the hand no more than the hand put into it.

Passivity observer and controller (Hannaford & Ryu 2002) in their exact form for a held force: from one sample to the
next the hand does the work -f·Δp on the liquid, whatever happened in between. Here f is the force really sent, without
buoyancy and weight, which only lend energy, and Δp the step of the hand in the frame of the current.

The account E begins at 0 with a scene and holds at most what the liquid can return::

    E ← min(E - f·Δp, reserve),    reserve = (4/27) c |v_wake|³ N T / scale + m |v - v_current|² / (2 scale)

A wake of speed u gives a body of speed v the power c (u - v)² v, at most that at v = u/3, and it lasts for N ticks of
T. m is the added mass and, with a history, its inertia in a sway of 1 Hz, 3πR² √(2µρ/ω) (Landau & Lifshitz, §24).

A filter that lags, a loop that is late, a force held for too long all show as E < 0. From -1 mJ on the debt D =
-1 mJ - E is paid back: what pushes along the last step is taken from the force, and damping is added until the next
step, if it is like the last, pays D, but no stronger than the loop bears. And the whole force is kept within

    |f| ≤ F (1 - D / (F R)),    F, R: the strongest force and the longest step so far,

so that E ≥ -1 mJ - F R on any path of the hand: even the worst next step leaves the debt at F R. A debt is forgiven at
1 mW, less than a hand's own damping takes at 15 mm/s: without any force none could ever be paid.
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.compiled import kernel, part
from study_app.haptics.effects.drag import resistance
from study_app.haptics.effects.records import LAW_CONSTANT
from study_app.haptics.layout import (
    EFFECT_ADDED_MASS,
    EFFECT_HISTORY,
    EFFECT_LOCAL_WAKE,
    EFFECT_WAKE,
    LIMITER_ENERGY,
    Record,
)
from study_app.haptics.vector import clear, distance, norm

ALLOWANCE_J = 1e-3
FORGIVEN_W = 1e-3
HISTORY_PERIOD_S = 1.0


@kernel
def open_account(account: Record) -> None:
    """Begin at 0, with nothing sent: what came before was another liquid's."""
    account.balance_j = 0.0
    clear(account.impulse_ns)
    account.impulse_s = 0.0
    clear(account.step_m)
    account.interval_s = 0.0
    account.longest_m = 0.0
    account.strongest_n = 0.0
    clear(account.lift_n)
    clear(account.lift_before_n)


@part
def observe(model: Any, safety: Record, interval_s: float) -> None:
    """Enter the work of the last step into the account; ``interval_s`` is 0 where there is no new sample.

    Where several forces were sent between two samples, their mean over time counts.
    """
    parameters, state, account = model.parameters[0], model.state[0], safety.account
    for axis in range(3):
        account.impulse_ns[axis] += (safety.sent_n[axis] - account.lift_n[axis]) * safety.turn_s
    account.impulse_s += safety.turn_s
    if interval_s == 0.0:
        return
    work_j = 0.0
    for axis in range(3):
        moved_m = state.position_m[axis] - state.previous_m[axis] - state.drift_mps[axis] * interval_s
        account.step_m[axis] = moved_m / parameters.scale
        if account.impulse_s > 0.0:
            work_j -= account.impulse_ns[axis] / account.impulse_s * account.step_m[axis]
    account.interval_s = interval_s
    account.longest_m = max(account.longest_m, norm(account.step_m))
    forgiven_j = FORGIVEN_W * interval_s if account.balance_j < -ALLOWANCE_J else 0.0
    account.balance_j = min(account.balance_j + work_j + forgiven_j, reserve(model))
    clear(account.impulse_ns)
    account.impulse_s = 0.0


@part
def reserve(model: Any) -> float:
    """Return the most that the liquids can still give back [J at the hand]."""
    parameters = model.parameters[0]
    most_j = 0.0
    for i in range(parameters.liquids):
        liquid, local = model.liquids[i], model.liquid_states[i]
        if local.share > 0.0:
            speed_mps = norm(local.motion_mps)
            if liquid.effects & EFFECT_WAKE:
                most_j += _wake_power(liquid, local) * liquid.wake.length * parameters.period_s
            if liquid.effects & EFFECT_LOCAL_WAKE:
                most_j += _wake_power(liquid, local) * liquid.local_wake.length * parameters.period_s
            if liquid.effects & EFFECT_ADDED_MASS:
                most_j += 0.5 * liquid.added_mass.mass_kg * local.share * speed_mps * speed_mps
            if liquid.effects & EFFECT_HISTORY:
                inertia_kg = 0.5 * liquid.history.factor_kg_rs * local.share * math.sqrt(HISTORY_PERIOD_S)
                most_j += 0.5 * inertia_kg * speed_mps * speed_mps
    return float(most_j / parameters.scale)


@part
def _wake_power(liquid: Record, local: Record) -> float:
    """Return the greatest power [W, scene] that the wake gives to a body: max over v of R(u - v) (u - v) v.

    For a constant coefficient that is (4/27) c u³; R of the other laws grows less, so R(u) u²/4 bounds it.
    """
    wake_mps = norm(local.wake_mps)
    share = 4.0 / 27.0 if liquid.drag.law == LAW_CONSTANT else 0.25
    return float(share * resistance(liquid.drag, wake_mps) * wake_mps * wake_mps)


@part
def settle(parameters: Record, account: Record, sample: Record) -> None:
    """Change the force about to be sent so that a debt is paid back, and cannot grow beyond one step's work."""
    force_n, lift_n = sample.device_force_n, account.lift_n
    debt_j = -ALLOWANCE_J - account.balance_j
    if debt_j <= 0.0:
        return
    step_m = norm(account.step_m)
    if step_m > 0.0:
        bearable_n = parameters.slope_limit_nspm * parameters.scale * step_m / account.interval_s
        damping_n = min(debt_j / step_m, bearable_n)
        along_n = 0.0
        for axis in range(3):
            along_n += (force_n[axis] - lift_n[axis]) * account.step_m[axis] / step_m
        if along_n > -damping_n:
            sample.limiters |= LIMITER_ENERGY
            for axis in range(3):
                force_n[axis] -= (along_n + damping_n) * account.step_m[axis] / step_m
    most_n = max(account.strongest_n - debt_j / account.longest_m, 0.0)
    _keep_within(most_n, force_n, lift_n, sample)


@part
def _keep_within(most_n: float, force_n: Any, lift_n: Any, sample: Record) -> None:
    """Shorten the force, buoyancy aside, to ``most_n``."""
    size_n = distance(force_n, lift_n)
    if size_n > most_n:
        sample.limiters |= LIMITER_ENERGY
        for axis in range(3):
            force_n[axis] = lift_n[axis] + (force_n[axis] - lift_n[axis]) * most_n / size_n


@part
def remember(account: Record, force_n: Any) -> None:
    """Keep the strongest force that was ever sent, buoyancy aside."""
    account.strongest_n = max(account.strongest_n, distance(force_n, account.lift_n))
