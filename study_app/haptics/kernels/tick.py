"""One tick of the servo, read from top to bottom.

The lines of `step_model` are the pipeline; the bits of a liquid's ``effects`` say which of them run. Nothing here
allocates, raises or waits; the servo, a rehearsal and `offline.simulate` run the same code.
"""

from __future__ import annotations

from typing import Any

from study_app.haptics.kernels.compiled import kernel, part
from study_app.haptics.kernels.effects.added_mass import added_mass_force
from study_app.haptics.kernels.effects.buoyancy import buoyancy_force
from study_app.haptics.kernels.effects.current import current_velocity
from study_app.haptics.kernels.effects.drag import drag_force
from study_app.haptics.kernels.effects.history import basset_force
from study_app.haptics.kernels.effects.local_wake import clear_local_wake, deposit_local_wake, local_wake_velocity
from study_app.haptics.kernels.effects.surface import wetted_fraction
from study_app.haptics.kernels.effects.wake import update_wake, wake_velocity
from study_app.haptics.kernels.estimators.kalman import take_force
from study_app.haptics.kernels.estimators.velocity import estimate_velocity, reset_estimator
from study_app.haptics.kernels.regions import update_volume_fractions
from study_app.haptics.kernels.safety import guard
from study_app.haptics.kernels.sample_validation import accept_sample, watchdog
from study_app.haptics.kernels.vector import clear, copy, subtract
from study_app.haptics.kernels.wake_segments import empty
from study_app.haptics.model.layout import (
    EFFECT_ADDED_MASS,
    EFFECT_BUOYANCY,
    EFFECT_CURRENT,
    EFFECT_DRAG,
    EFFECT_HISTORY,
    EFFECT_LOCAL_WAKE,
    EFFECT_SURFACE,
    EFFECT_WAKE,
    LIMITER_ESTIMATOR,
    STATUS_OK,
    Record,
)


@kernel
def tick(model: Any, safety: Record, sample: Record) -> None:
    """Take one reading and say what force to send.

    The caller fills ``sample.time_ns``, ``position_m`` (hand frame) and ``fresh``; velocity, wake, forces, limiters and
    status are filled here. Without a new usable sample the model rests as it is; safety goes on.
    """
    sample.limiters = 0
    sample.status = STATUS_OK
    interval_s = accept_sample(model.parameters[0], model.state[0], safety, sample)
    watchdog(model.parameters[0], safety, sample)
    if interval_s > 0.0:
        take_force(model.state[0], safety)
        step_model(model, interval_s)
    write_sample(model.state[0], sample)
    guard(model, safety, sample, interval_s)


@part
def step_model(model: Any, interval_s: float) -> None:
    """Let the liquids respond to the place the body has reached, Δt after the one before.

    Every effect is evaluated before the wake takes this tick in: the first tick of a motion meets a liquid at rest.
    """
    parameters, state = model.parameters[0], model.state[0]
    if state.tracking == 0:
        reset_tracking(model)
    estimate_velocity(parameters, state, model.window, interval_s)
    update_volume_fractions(model, interval_s)

    clear(state.force_n)
    clear(state.lift_n)
    clear(state.wake_mps)
    clear(state.drift_mps)
    for i in range(parameters.liquids):
        if model.liquid_states[i].share > 0.0:
            apply_effects(model, i, interval_s)
        else:
            reset_liquid(model, i)
    if parameters.effects & EFFECT_BUOYANCY:
        buoyancy_force(model)


@part
def apply_effects(model: Any, i: int, interval_s: float) -> None:
    """Let one liquid, in which the body is, act on it by the effects it asks for: in this order, no others."""
    liquid, local, state = model.liquids[i], model.liquid_states[i], model.state[0]
    copy(state.velocity_mps, local.motion_mps)
    clear(local.wake_mps)
    if liquid.effects & EFFECT_CURRENT:
        current_velocity(liquid, local, state)
        copy(local.current.velocity_mps, state.drift_mps)
    if liquid.effects & EFFECT_WAKE:
        wake_velocity(liquid, local, model.segments)
    if liquid.effects & EFFECT_LOCAL_WAKE:
        local_wake_velocity(liquid, local, state, model.cells, interval_s)
    subtract(local.motion_mps, local.wake_mps, local.relative_mps)
    copy(local.wake_mps, state.wake_mps)
    if liquid.effects & EFFECT_SURFACE:
        wetted_fraction(local)
    if liquid.effects & EFFECT_DRAG:
        drag_force(liquid, local, state)
    if liquid.effects & EFFECT_ADDED_MASS:
        added_mass_force(liquid, local, state, interval_s)
    if liquid.effects & EFFECT_HISTORY:
        basset_force(liquid, local, state, model.intervals, model.exponentials, interval_s)
    if liquid.effects & EFFECT_WAKE:
        update_wake(liquid, local, state, model.elements, model.segments, interval_s)
    if liquid.effects & EFFECT_LOCAL_WAKE:
        deposit_local_wake(liquid, local, state, model.cells, interval_s)


@part
def reset_liquid(model: Any, i: int) -> None:
    """Let one liquid forget the body: it is out of it, or was lost."""
    liquid, local = model.liquids[i], model.liquid_states[i]
    if liquid.effects & EFFECT_WAKE:
        empty(liquid.wake, local.wake, model.segments)
    if liquid.effects & EFFECT_LOCAL_WAKE:
        clear_local_wake(local.local_wake)
    if liquid.effects & EFFECT_ADDED_MASS:
        local.added_mass.primed = 0
    if liquid.effects & EFFECT_HISTORY:
        local.history.primed = 0


@kernel
def reset_tracking(model: Any) -> None:
    """Forget the motion so far: all that is known of the body is where it is."""
    reset_estimator(model.parameters[0], model.state[0])
    for i in range(model.parameters[0].liquids):
        reset_liquid(model, i)
    model.state[0].tracking = 1


@part
def write_sample(state: Record, sample: Record) -> None:
    """Write what the liquids did into the sample."""
    copy(state.velocity_mps, sample.velocity_mps)
    copy(state.wake_mps, sample.wake_mps)
    copy(state.force_n, sample.force_n)
    if state.kalman.distrusted:
        sample.limiters |= LIMITER_ESTIMATOR
