"""The passivity controller: a liquid returns no more energy to the hand than the hand supplied.

Passivity observer and controller (Hannaford & Ryu 2002) in their exact form for a held force: from one sample to the
next the hand does the work -f·Δp on the liquid on any path. Here f is the force actually sent, without buoyancy and
weight, which are conservative, and Δp the step of the hand in the frame of the current.

The energy E is 0 at the start of a scene and is limited to what the liquid can return::

    E ← min(E - f·Δp, reserve),    reserve = (4/27) c |v_wake|³ N T / scale + m |v - v_current|² / (2 scale) + K τ P

The first terms are what the effects can return, summed by them (``state.returnable_j``): a wake of speed u gives a
body of speed v the power c (u - v)² v, at most that at v = u/3, and it lasts for N ticks of T; m is the mass of
inertial effects in the fraction that is sent (`pack`). τ is the lag of the velocity estimator and P = max(-f·v̂, 0) the
power that it absorbs: a filtered damper stores up to K τ P (`filter_storage`). Without these the lag of each quick
reversal would count as a debt.

Motors that saturate give a force between 0 and the logged one: in each step the one counts that supplies more energy.

A delayed loop and a force held for too long cause E < 0. Three balances of E are kept: for a force that acts at once,
for one that acts after the assumed loop delay, at least one tick, and for one that acts another tick later; the lowest
counts. A delayed force belongs to an earlier velocity: a delayed balance may include the energy stored then. A debt of
1 mJ is allowed; with D = -1 mJ - E, the debt beyond that:

- `reduce_gain`: a debt of 0.125 mJ halves the force, one of 0.375 mJ halves it again, and the gain recovers at 50 % per
  second: the gain of an oscillating loop falls until it no longer oscillates. A debt of the fast part of force and
  motion counts likewise (see below);
- `apply_controller`: the force along the motion may spend in 20 ms no more than the energy left; in debt it is removed,
  and damping is added so that the next step would repay the debt, up to half the maximum stable damping times the gain.
  The direction of motion is that of the last 2 ms; below 40 mm/s it may be encoder noise and is not used;
- the whole force is limited to F - D / R, F and R being the greatest force and the longest step so far. So on any path
  of the hand E ≥ -1 mJ - F R: even the worst next step leaves D at F R.

Removal of force and damping bypass the slew limit. A debt is forgiven at 1 mW, less than a hand's own damping absorbs
at 15 mm/s: without any force no debt could be repaid. A hand that shakes the handle causes debts, too, since the force
lags, and so does a release, after which inertial forces are late until the filter has noticed it. A debt that begins in
fast motion, of 15 ms or more, or within two seconds of a surprise (`known_force`), is forgiven once the hand has been
quiet for ``quiet_s``, and the gain returns within 0.3 s. One that begins otherwise, or after a gap in the
samples, is not: its oscillation would return with the gain.

A step over a gap in the samples counts only if it costs energy, and is not the longest step: the position may have
jumped.

With a force link, no debt is forgiven, the gain does not recover before the next scene, and it falls further as long as
there is a debt: with a delayed force a handle would continue to oscillate at the forgiven power, or at the gain at
which it neither supplies nor absorbs energy. It also falls while the controller has recently changed the force in more
than the ``acting_share`` of the rules: such a force is not that of the liquid, and the changes themselves can be felt.

A handle that was let go may also oscillate without a debt, since buoyancy or the liquid's reserve supplies the energy.
From six successive reversals on, each sooner than a hand can reverse, the gain falls until the oscillation ends, at
most to a twentieth (`_count_reversals`); it recovers as after a debt that is not forgiven. A delayed force lets a light
hand ring, which a study of delays must be able to present: with a force link, only faster reversals count
(``late_swing_mps`` of the rules).

The energy that the velocity estimator stores and may therefore return is `filter_storage`.

The incremental observer asks whether the fast part of a force drives the fast part of the hand's motion.

A loop may oscillate during a slow motion without an energy debt: the slow motion supplies more energy than the
oscillation takes. So the fast part has a balance of its own. Force and velocity pass the same two high-pass filters of
20 Hz, above the frequencies of a hand and below those of an oscillating loop. The filtered signals give the work -f·v
Δt of the hand from one sample to the next::

    B ← min(B - f·v Δt, 0)

The force is taken one tick later than the assumed loop delay, as in the last balance below: the observer stays
correct if the delay is one tick longer than assumed. A breaking wake and a reversal of the hand take some mJ, once: B
may fall to -2 mJ, and recovers at 5 mW. Beyond that `reduce_gain` lowers the gain.
"""

from __future__ import annotations

import math
from typing import Any

from study_app.haptics.kernels.compiled import kernel, part
from study_app.haptics.kernels.sample_validation import is_gap
from study_app.haptics.kernels.vector import (
    Vector,
    clear,
    components,
    copy,
    difference,
    distance,
    dot,
    is_finite,
    multiple,
    norm,
    square,
    square_distance,
    vector_sum,
)
from study_app.haptics.model import layout
from study_app.haptics.model.device_dynamics import MOST_DELAY

CORNER_RADPS = 2.0 * math.pi * 20.0
INCREMENTAL_ALLOWANCE_J = 2e-3
INCREMENTAL_FORGIVEN_W = 5e-3


@part
def begin_incremental(fast: layout.Record) -> None:
    """Reset the balance to 0, at rest and without force."""
    for axis in range(3):
        fast.force_n[axis] = fast.force_once_n[axis] = fast.force_twice_n[axis] = 0.0
    clear(fast.velocity_mps)
    clear(fast.velocity_once_mps)
    clear(fast.velocity_twice_mps)
    fast.balance_j = 0.0


@part
def observe_incremental(fast: layout.Record, axis: int, force_n: float, velocity_mps: float, interval_s: float) -> None:
    """Add the work along one axis, from the mean force and velocity since the last sample."""
    x = CORNER_RADPS * interval_s
    kept = 1.0 / (1.0 + x * (1.0 + 0.5 * x))
    once_n = kept * (fast.force_once_n[axis] + force_n - fast.force_n[axis])
    twice_n = kept * (fast.force_twice_n[axis] + once_n - fast.force_once_n[axis])
    once_mps = kept * (fast.velocity_once_mps[axis] + velocity_mps - fast.velocity_mps[axis])
    twice_mps = kept * (fast.velocity_twice_mps[axis] + once_mps - fast.velocity_once_mps[axis])
    fast.force_n[axis], fast.force_once_n[axis], fast.force_twice_n[axis] = force_n, once_n, twice_n
    fast.velocity_mps[axis], fast.velocity_once_mps[axis], fast.velocity_twice_mps[axis] = (
        velocity_mps,
        once_mps,
        twice_mps,
    )
    fast.balance_j -= twice_n * twice_mps * interval_s


@part
def close_incremental(fast: layout.Record, interval_s: float) -> None:
    """Forgive a part of the debt; the balance is at most 0."""
    fast.balance_j = min(fast.balance_j + INCREMENTAL_FORGIVEN_W * interval_s, 0.0)


@part
def filter_storage(model: Any, passivity: layout.Record) -> float:
    """Return the energy [J at the hand] that the velocity estimator stores because it lags behind.

    With v̂' = (v − v̂)/τ a damper F(v̂) takes ∫F v dt = ∫F v̂ dt + τ∫F dv̂ from the hand: the second term is a storage,
    K τ F v̂ with K = 1/3 for a force that grows as v̂², 1/2 for one that grows as v̂. If the force limit leaves only
    the fraction s of F, K = 1 - 2/3 √s and 1 - s/2; for a force that grows less than v̂, K is at most 1. After a debt
    the storage is multiplied by the controller's gain: otherwise it would sustain an oscillating loop.
    """
    parameters, state = model.parameters[0], model.state[0]
    lag_s = parameters.fallback_lag_s if state.kalman.on_ewma else parameters.filter_lag_s
    if lag_s == 0.0:
        return 0.0
    sent_n, saturated_n = passivity.sent_n[passivity.row], passivity.saturated_n[passivity.row]
    v_mps = difference(state.estimate_mps, state.drift_mps)
    power_w = -dot(sent_n, v_mps)
    if passivity.saturated_ticks > 0:
        power_w -= max(-dot(saturated_n, v_mps), 0.0)
    if power_w <= 0.0:
        return 0.0
    share = 1.0 - 2.0 / 3.0 * math.sqrt(passivity.norm_share)
    if state.growth == layout.GROWS_AS_SPEED:
        share = max(share, 1.0 - 0.5 * passivity.norm_share)
    elif state.growth == layout.GROWS_LESS:
        share = 1.0
    return float(passivity.gain * share * lag_s * power_w / parameters.scale)


_ALLOWANCE_J = 1e-3
_SPENDING_S = 20e-3
HALVING_J = 0.125e-3
_FORGIVEN_W = 1e-3
_SMOOTHING_S = 2e-3
SURE_MPS = 0.04
_BRAKE = 0.5
_RECOVERY_PER_S = 0.5
_INDEBTED_S = 0.1
_ACTING_S = 0.5
_HAND_S = 16e-3
_FAST_MPS = 0.2
_FAST_J = 2e-3
_QUIET_MPS = 0.06
_PUSHED_S = 0.2
_LEAST_PUSH_S = 0.015
_REGAINED_S = 0.3
_SWING_WEIGHT = 4.0
_REVERSAL_S = 0.05
_SHAKEN_MPS = 0.04
_REVERSALS = 6
_SLOW_RATIO = 6.0
_CALMED_S = 0.04
_LEAST_GAIN = 0.05
_NOTHING_M2PS2 = 1e-30
DELIVERY_STEPS_PER_N = 2.0**14


@kernel
def reset_observer(passivity: layout.Record) -> None:
    """Reset to 0, with no force sent: earlier forces belong to another liquid."""
    passivity.balance_j = 0.0
    passivity.late_balance_j = 0.0
    passivity.later_balance_j = 0.0
    passivity.reserve_j = 0.0
    passivity.row = passivity.saturated_ticks = 0
    for tick in range(MOST_DELAY + 2):
        clear(passivity.sent_n[tick])
        clear(passivity.saturated_n[tick])
        clear(passivity.acted_n[tick])
        passivity.stored_j[tick] = 0.0
    clear(passivity.impulse_ns)
    clear(passivity.late_impulse_ns)
    clear(passivity.later_impulse_ns)
    clear(passivity.acted_impulse_ns)
    passivity.impulse_s = 0.0
    begin_incremental(passivity.fast)
    clear(passivity.velocity_mps)
    clear(passivity.slow_mps)
    passivity.fast_s = passivity.quiet_s = 0.0
    passivity.gap_s = math.inf
    clear(passivity.swing_mps)
    clear(passivity.peak_mps)
    passivity.peak_m2ps2 = passivity.reversed_s = 0.0
    passivity.reversals = 0
    passivity.acting_s = 0.0
    passivity.debt = layout.DEBT_NONE
    passivity.longest_m = 0.0
    passivity.strongest_n = 0.0
    passivity.gain = 1.0
    passivity.norm_share = 1.0
    passivity.settling = 0
    clear(passivity.lift_n)


@part
def update_observer(model: Any, safety: layout.Record, interval_s: float) -> None:
    """Add the work of the last step to the balances; ``interval_s`` is 0 without a new sample.

    Several forces sent between two samples count by their mean over time.
    """
    parameters, state, passivity = model.parameters[0], model.state[0], safety.passivity
    tick_s, delay_ticks = safety.tick_s, max(safety.delay_ticks, 1)
    sent_n = _least_favourable(passivity, state, passivity.row, interval_s)
    late_n = _least_favourable(passivity, state, _row_before(passivity, delay_ticks), interval_s)
    later_n = _least_favourable(passivity, state, _row_before(passivity, delay_ticks + 1), interval_s)
    impulse_ns = vector_sum(passivity.impulse_ns, multiple(sent_n, tick_s))
    late_impulse_ns = vector_sum(passivity.late_impulse_ns, multiple(late_n, tick_s))
    later_impulse_ns = vector_sum(passivity.later_impulse_ns, multiple(later_n, tick_s))
    elapsed_s = passivity.impulse_s + tick_s
    if interval_s == 0.0:
        acted_n = passivity.acted_n[_row_before(passivity, safety.delay_ticks)]
        copy(vector_sum(passivity.acted_impulse_ns, multiple(acted_n, tick_s)), passivity.acted_impulse_ns)
        copy(impulse_ns, passivity.impulse_ns)
        copy(late_impulse_ns, passivity.late_impulse_ns)
        copy(later_impulse_ns, passivity.later_impulse_ns)
        passivity.impulse_s = elapsed_s
        return
    if passivity.impulse_s > 0.0:
        clear(passivity.acted_impulse_ns)
        clear(passivity.impulse_ns)
        clear(passivity.late_impulse_ns)
        clear(passivity.later_impulse_ns)
        passivity.impulse_s = 0.0
    if elapsed_s == 0.0:  # two samples at once: no time to average over
        elapsed_s, impulse_ns, late_impulse_ns, later_impulse_ns = 1.0, sent_n, late_n, later_n
    if interval_s != passivity.weighted_s:
        passivity.weighted_s = interval_s
        passivity.weight, passivity.hand_weight = (
            _smoothing_weight(interval_s, _SMOOTHING_S),
            _smoothing_weight(interval_s, _HAND_S),
        )
    per_scale, per_s = 1.0 / parameters.scale, 1.0 / interval_s
    moved_m = difference(difference(state.position_m, state.previous_m), multiple(state.drift_mps, interval_s))
    step_m = multiple(moved_m, per_scale)
    work_j, late_work_j = -dot(impulse_ns, step_m), -dot(late_impulse_ns, step_m)
    later_work_j, square_m2 = -dot(later_impulse_ns, step_m), square(step_m)
    for axis in range(3):
        step_mps = step_m[axis] * per_s
        passivity.velocity_mps[axis] += passivity.weight * (step_mps - passivity.velocity_mps[axis])
        observe_incremental(passivity.fast, axis, later_impulse_ns[axis] / elapsed_s, step_mps, interval_s)
    _watch_motion(parameters, passivity, interval_s)
    close_incremental(passivity.fast, interval_s if parameters.link.acts == 0 else 0.0)
    if is_gap(parameters, interval_s) and parameters.rules.trusts_gaps == 0.0:
        work_j, late_work_j, later_work_j = min(work_j, 0.0), min(late_work_j, 0.0), min(later_work_j, 0.0)
    elif square_m2 > passivity.longest_m * passivity.longest_m:
        passivity.longest_m = math.sqrt(square_m2)
    stored_j = filter_storage(model, passivity)
    forgiven_j = _FORGIVEN_W * interval_s if parameters.link.acts == 0 else 0.0
    passivity.stored_j[passivity.row] = stored_j
    late_j = max(stored_j, passivity.stored_j[_row_before(passivity, delay_ticks)])
    later_j = max(late_j, passivity.stored_j[_row_before(passivity, delay_ticks + 1)])
    most_j = state.returnable_j / parameters.scale
    passivity.reserve_j = most_j + late_j
    per_time = 1.0 / elapsed_s
    passivity.balance_j = min(_forgive(passivity.balance_j, forgiven_j) + work_j * per_time, most_j + stored_j)
    passivity.late_balance_j = min(
        _forgive(passivity.late_balance_j, forgiven_j) + late_work_j * per_time, passivity.reserve_j
    )
    passivity.later_balance_j = min(
        _forgive(passivity.later_balance_j, forgiven_j) + later_work_j * per_time, most_j + later_j
    )


@part
def _smoothing_weight(interval_s: float, time_s: float) -> float:
    """Return the weight of the newest value in a filter of first order: 1 - exp(-share), to 1 % up to a share of 2."""
    share = interval_s / time_s
    return share / (1.0 + share * (0.5 + share / 12.0))


@part
def _watch_motion(parameters: layout.Record, passivity: layout.Record, interval_s: float) -> None:
    """Measure how long the hand recently moved fast, how long it has been quiet, and the time since the last gap.

    Its velocity counts without what is slow: a filter of 10 Hz separates shaking from stirring. It is fast if the
    handle has more kinetic energy than the force can have given to it without a debt; a handle that was let go is so
    for a shorter time than one that is pushed.
    """
    weight = passivity.hand_weight
    for axis in range(3):
        passivity.slow_mps[axis] += weight * (passivity.velocity_mps[axis] - passivity.slow_mps[axis])
    square_m2ps2 = square_distance(passivity.velocity_mps, passivity.slow_mps)
    if square_m2ps2 > _FAST_MPS * _FAST_MPS and square_m2ps2 > 2.0 * _FAST_J / parameters.mass_kg:
        passivity.fast_s += interval_s
    if passivity.fast_s > 0.0:
        passivity.fast_s /= 1.0 + interval_s / _PUSHED_S
    passivity.quiet_s = 0.0 if square_m2ps2 > _QUIET_MPS * _QUIET_MPS else passivity.quiet_s + interval_s
    passivity.gap_s = 0.0 if is_gap(parameters, interval_s) else passivity.gap_s + interval_s
    _count_reversals(parameters, passivity, min(_SWING_WEIGHT * weight, 1.0), interval_s)


@part
def _count_reversals(parameters: layout.Record, passivity: layout.Record, weight: float, interval_s: float) -> None:
    """Count successive reversals of a swing, each sooner than a hand can reverse.

    The swing is the velocity between 10 and 40 Hz. It must exceed the speed in the rules, and a fraction of the slow
    speed: smaller ones are ripples of a stroke.
    """
    swing_mps, peak_mps = passivity.swing_mps, passivity.peak_mps
    least_mps = parameters.rules.swing_mps if parameters.link.acts == 0 else parameters.rules.late_swing_mps
    for axis in range(3):
        fast_mps = passivity.velocity_mps[axis] - passivity.slow_mps[axis]
        swing_mps[axis] += weight * (fast_mps - swing_mps[axis])
    square_m2ps2, peak_m2ps2 = square(swing_mps), passivity.peak_m2ps2
    is_shaken = peak_m2ps2 > _SHAKEN_MPS * _SHAKEN_MPS
    passivity.reversed_s += interval_s
    is_late = passivity.reversed_s > (parameters.rules.shaken_reversal_s if is_shaken else _REVERSAL_S)
    if is_late:
        passivity.reversals = 0
    if square_m2ps2 <= least_mps * least_mps:
        if square_m2ps2 < _NOTHING_M2PS2:
            clear(swing_mps)
        return
    along_m2ps2 = dot(swing_mps, peak_mps)
    has_reversed = along_m2ps2 < 0.0 and along_m2ps2 * along_m2ps2 > 0.5 * square_m2ps2 * peak_m2ps2
    if has_reversed or is_late:
        is_ripple = square(passivity.slow_mps) > _SLOW_RATIO * _SLOW_RATIO * peak_m2ps2
        passivity.reversals = 0 if is_late or is_ripple else passivity.reversals + 1
        passivity.reversed_s = 0.0
    elif along_m2ps2 <= peak_m2ps2:
        return
    copy(swing_mps, peak_mps)
    passivity.peak_m2ps2 = square_m2ps2


@part
def _row_before(passivity: layout.Record, ticks: int) -> int:
    """Return the row of the force that was sent ``ticks`` before the last one."""
    row: int = passivity.row - ticks
    return row if row >= 0 else row + MOST_DELAY + 2


@part
def _least_favourable(
    passivity: layout.Record, state: layout.Record, row: int, interval_s: float
) -> tuple[float, float, float]:
    """Return the force of a row [N]; of saturated motors the one, from 0 on, that absorbs least in the newest step.

    Without a new sample, ``interval_s`` 0, the last velocity stands for the step.
    """
    sent_n, saturated_n = passivity.sent_n[row], passivity.saturated_n[row]
    if passivity.saturated_ticks == 0:
        return components(sent_n)
    power = 0.0
    for axis in range(3):
        step = passivity.velocity_mps[axis]
        if interval_s > 0.0:
            step = state.position_m[axis] - state.previous_m[axis] - state.drift_mps[axis] * interval_s
        power += saturated_n[axis] * step
    share = 1.0 if power < 0.0 else 0.0
    return (sent_n[0] - share * saturated_n[0], sent_n[1] - share * saturated_n[1], sent_n[2] - share * saturated_n[2])


@part
def _left_j(passivity: layout.Record) -> float:
    """Return the distance of the lowest balance from the allowed debt [J]; below 0 it is a debt."""
    return float(_ALLOWANCE_J + min(passivity.balance_j, passivity.late_balance_j, passivity.later_balance_j))


@part
def _forgive(balance_j: float, forgiven_j: float) -> float:
    return min(balance_j + forgiven_j, -_ALLOWANCE_J) if balance_j < -_ALLOWANCE_J else balance_j


@part
def reduce_gain(parameters: layout.Record, state: layout.Record, passivity: layout.Record) -> float:
    """Update and return the gain of the force, which a debt reduces at once and which recovers within seconds."""
    left_j = min(_left_j(passivity), INCREMENTAL_ALLOWANCE_J + passivity.fast.balance_j)
    left_j = _judge_debt(parameters, state, passivity, left_j)
    if passivity.reversals >= _REVERSALS:
        passivity.debt = layout.DEBT_OWN
        calmed = max(passivity.gain * (1.0 - parameters.period_s / _CALMED_S), _LEAST_GAIN)
        passivity.gain = min(passivity.gain, calmed)
    elif passivity.debt == layout.DEBT_FORGIVEN:
        passivity.gain = min(passivity.gain + parameters.period_s / _REGAINED_S, 1.0)
    elif parameters.link.acts == 0:
        passivity.gain = min(passivity.gain * (1.0 + _RECOVERY_PER_S * parameters.period_s), 1.0)
    else:
        passivity.acting_s += parameters.period_s if passivity.settling else 0.0
        passivity.acting_s /= 1.0 + parameters.period_s / _ACTING_S
        if left_j < 0.0 or passivity.acting_s > parameters.rules.acting_share * _ACTING_S:
            passivity.gain *= max(1.0 - parameters.period_s / _INDEBTED_S, 0.0)
    if left_j < 0.0:
        passivity.gain = min(passivity.gain, HALVING_J / (HALVING_J - left_j))
    return float(passivity.gain)


@part
def _judge_debt(parameters: layout.Record, state: layout.Record, passivity: layout.Record, left_j: float) -> float:
    """Classify a debt; forgive one of a push or a surprise once the hand is quiet. Return the energy left [J]."""
    if left_j < 0.0 and passivity.debt in (layout.DEBT_NONE, layout.DEBT_FORGIVEN):
        pushed = (passivity.fast_s > _LEAST_PUSH_S or state.surprised != 0) and passivity.gap_s > _PUSHED_S
        passivity.debt = layout.DEBT_PUSHED if pushed else layout.DEBT_OWN
    elif left_j >= 0.0 and passivity.gain >= 1.0:
        passivity.debt = layout.DEBT_NONE
    quiet = passivity.quiet_s >= parameters.rules.quiet_s and parameters.link.acts == 0
    if passivity.debt == layout.DEBT_PUSHED and quiet:
        passivity.debt = layout.DEBT_FORGIVEN
        passivity.balance_j = max(passivity.balance_j, 0.0)
        passivity.late_balance_j = max(passivity.late_balance_j, 0.0)
        passivity.later_balance_j = max(passivity.later_balance_j, 0.0)
        passivity.fast.balance_j = 0.0
        return _ALLOWANCE_J
    return left_j


@part
def apply_controller(
    parameters: layout.Record, safety: layout.Record, sample: layout.Record, force_n: Vector, lift_n: Vector
) -> Vector:
    """Return the force changed so that a debt is repaid, and cannot grow by more than one step's work."""
    passivity = safety.passivity
    left_j = _left_j(passivity)
    force_n, changed = _limit_power(parameters, safety, left_j, force_n, lift_n)
    if left_j < 0.0:
        most_n = passivity.strongest_n + left_j / passivity.longest_m if passivity.longest_m > 0.0 else 0.0
        most_n = max(most_n, 0.0)
        size_n = distance(force_n, lift_n)
        if size_n > most_n:
            changed = True
            without_n = multiple(difference(force_n, lift_n), most_n)
            force_n = vector_sum(lift_n, (without_n[0] / size_n, without_n[1] / size_n, without_n[2] / size_n))
    if changed or passivity.settling:  # also the tick after, in which the force returns
        sample.limiters |= layout.LIMITER_ENERGY
    passivity.settling = changed
    return force_n


@part
def _limit_power(
    parameters: layout.Record, safety: layout.Record, left_j: float, force_n: Vector, lift_n: Vector
) -> tuple[Vector, bool]:
    """Reduce the force along the motion to the power that the energy left allows; in debt, add damping.

    Return the force, and whether it was changed.
    """
    passivity = safety.passivity
    v_mps = components(passivity.velocity_mps)
    square_mps2 = square(v_mps)
    if square_mps2 <= SURE_MPS * SURE_MPS:
        return force_n, False
    power_w = dot(difference(force_n, lift_n), v_mps)
    if left_j >= 0.0 and power_w * _SPENDING_S <= left_j:
        return force_n, False
    speed_mps = math.sqrt(square_mps2)
    along_n = power_w / speed_mps
    if left_j >= 0.0:
        wanted_n = left_j / (_SPENDING_S * speed_mps)
    else:
        limit_nspm = parameters.slope_limit_nspm[safety.delay_ticks] * parameters.scale
        brake_n = _BRAKE * passivity.gain * limit_nspm * speed_mps
        wanted_n = -min(-left_j / (parameters.period_s * speed_mps), brake_n)
    if along_n <= wanted_n:
        return force_n, False
    excess_n = min(speed_mps / SURE_MPS - 1.0, 1.0) * (along_n - wanted_n)
    x_n, y_n, z_n = multiple(v_mps, excess_n)
    return (force_n[0] - x_n / speed_mps, force_n[1] - y_n / speed_mps, force_n[2] - z_n / speed_mps), True


@part
def log_command(passivity: layout.Record, sent_n: Vector) -> None:
    """Log the commanded force, without buoyancy, as the one that the device sends."""
    stored_j = passivity.stored_j[passivity.row]
    passivity.row = passivity.row + 1 if passivity.row <= MOST_DELAY else 0
    passivity.stored_j[passivity.row] = stored_j  # until the next sample
    if passivity.saturated_ticks > 0:
        passivity.saturated_ticks -= 1
        clear(passivity.saturated_n[passivity.row])
    _log(passivity, sent_n)


@kernel
def log_delivery(safety: layout.Record, sample: layout.Record, sent_n: Any) -> None:
    """Log the force that the device sent instead of the last command: ``sent_n`` (3,) [N on the hand].

    Both are rounded to the resolution of a recording, so that the tick can be recomputed from it. If they are equal
    then, or the device reports a force that is not finite, the command counts.
    """
    if not is_finite(sent_n):
        return
    same = True
    for axis in range(3):
        if round(sent_n[axis] * DELIVERY_STEPS_PER_N) != round(sample.command_n[axis] * DELIVERY_STEPS_PER_N):
            same = False
    if same:
        return
    for axis in range(3):
        sample.device_force_n[axis] = round(sent_n[axis] * DELIVERY_STEPS_PER_N) / DELIVERY_STEPS_PER_N
    _log(safety.passivity, difference(sample.device_force_n, safety.passivity.lift_n))
    sample.withheld_n = distance(safety.requested_n, sample.device_force_n)


@kernel
def log_saturation(safety: layout.Record, sample: layout.Record) -> None:
    """Log that the device's motors may have given only a part of the last force."""
    sample.limiters |= layout.LIMITER_SATURATED
    copy(sample.device_force_n, safety.passivity.saturated_n[safety.passivity.row])
    safety.passivity.saturated_ticks = MOST_DELAY + 2


@part
def _log(passivity: layout.Record, sent_n: Vector) -> None:
    """Store the force of this tick, without buoyancy."""
    copy(sent_n, passivity.sent_n[passivity.row])
    copy(sent_n, passivity.acted_n[passivity.row])
    if square(sent_n) > passivity.strongest_n * passivity.strongest_n:
        passivity.strongest_n = norm(sent_n)


@part
def log_acted(passivity: layout.Record, force_n: Any) -> None:
    """Log the force that acted on the hand in this tick, if the observer counted another one."""
    acted_n = passivity.acted_n[passivity.row]
    for axis in range(3):
        acted_n[axis] = force_n[axis] - passivity.lift_n[axis]
