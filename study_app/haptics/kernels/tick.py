"""One tick of the servo, read from top to bottom.

The lines of `step_model` are the pipeline; the bits of a liquid's ``effects`` select which of them run. The code never
allocates, raises or waits; the servo, a rehearsal and `offline.simulate` run it alike.
"""

from __future__ import annotations

from typing import Any

from study_app.haptics.kernels.compiled import kernel, part
from study_app.haptics.kernels.effects.added_mass import added_mass_force, implicit_added_mass_force
from study_app.haptics.kernels.effects.buoyancy import buoyancy_force
from study_app.haptics.kernels.effects.current import current_velocity
from study_app.haptics.kernels.effects.drag import drag_force
from study_app.haptics.kernels.effects.history import basset_force
from study_app.haptics.kernels.effects.local_wake import deposit_local_wake, local_wake_velocity
from study_app.haptics.kernels.effects.non_newtonian import non_newtonian_force
from study_app.haptics.kernels.effects.surface import wetted_fraction
from study_app.haptics.kernels.effects.unsteady_drag import unsteady_drag_force
from study_app.haptics.kernels.effects.wake import update_wake, wake_velocity
from study_app.haptics.kernels.estimators import estimate_velocity, reset_estimator, take_force
from study_app.haptics.kernels.regions import update_volume_fractions
from study_app.haptics.kernels.safety import guard
from study_app.haptics.kernels.sample_validation import accept_sample, watchdog
from study_app.haptics.kernels.vector import clear, copy, subtract
from study_app.haptics.model import effects
from study_app.haptics.model.layout import GROWS_AS_SQUARE, LIMITER_ESTIMATOR, STATUS_OK, Record


@kernel
def compute_tick(model: Any, safety: Record, sample: Record) -> None:
    """Process one reading and compute the force to send.

    The caller fills ``sample.time_ns``, ``position_m`` (hand frame) and ``fresh``; velocity, wake, forces, limiters and
    status are filled here. Without a new usable sample the model is unchanged; the safety layer still runs.
    """
    sample.limiters = 0
    sample.status = STATUS_OK
    interval_s = accept_sample(model.parameters[0], model.state[0], safety, sample)
    watchdog(model.parameters[0], safety, sample)
    if interval_s > 0.0:
        take_force(model.parameters[0], model.state[0], safety)
        step_model(model, interval_s, safety.delay_ticks)
    write_sample(model.state[0], sample)
    guard(model, safety, sample, interval_s)


@part
def step_model(model: Any, interval_s: float, delay_ticks: int) -> None:
    """Compute the force of the liquids at the body's new place, Δt after the last one.

    Every effect is evaluated before the wake is updated: the first tick of a motion meets a liquid at rest.
    ``delay_ticks`` is the assumed delay of a force, in writes.
    """
    parameters, state = model.parameters[0], model.state[0]
    if state.tracking == 0:
        reset_tracking(model)
    estimate_velocity(parameters, state, interval_s)
    update_volume_fractions(model, interval_s)

    clear(state.force_n)
    clear(state.lift_n)
    clear(state.wake_mps)
    clear(state.drift_mps)
    state.returnable_j = 0.0
    state.growth = GROWS_AS_SQUARE
    state.surprised = 0
    for i in range(parameters.liquids):
        if model.liquid_states[i].share > 0.0:
            apply_effects(model, i, interval_s, delay_ticks)
        else:
            model.liquid_states[i].ticks = 0
    if parameters.effects & effects.buoyancy.BIT:
        buoyancy_force(model)


@part
def apply_effects(model: Any, i: int, interval_s: float, delay_ticks: int) -> None:
    """Apply the effects of one liquid, which contains the body, in this order.

    A damper uses the estimated velocity without the speed limiter (knee), which is for liquids.
    """
    parameters, state = model.parameters[0], model.state[0]
    liquid, local, rows = model.liquids[i], model.liquid_states[i], model.rows
    copy(state.estimate_mps if liquid.drag.law == effects.drag.LAW_LINEAR else state.velocity_mps, local.motion_mps)
    clear(local.wake_mps)
    clear(local.damping_n)
    clear(local.excess_n)
    local.late_mps = 0.0
    local.inertial = 0
    if liquid.effects & effects.current.BIT:
        current_velocity(liquid, local, state)
    if liquid.effects & effects.wake.BIT:
        wake_velocity(parameters, liquid, local, state, rows.segments)
    if liquid.effects & effects.local_wake.BIT:
        local_wake_velocity(parameters, liquid, local, state, rows.cells, interval_s)
    subtract(local.motion_mps, local.wake_mps, local.relative_mps)
    copy(local.wake_mps, state.wake_mps)
    if liquid.effects & effects.surface.BIT:
        wetted_fraction(local)
    if liquid.effects & effects.drag.BIT:
        drag_force(liquid, local, state)
    share, trust = liquid.inertia_share[delay_ticks], state.kalman.trust
    may_know_force = state.kalman.on_ewma == 0 and liquid.known_force[delay_ticks] > 0.0
    knows_force = may_know_force and trust > 0.0
    if may_know_force and trust < 1.0:
        state.surprised = 1
    local.inertia_share = share + trust * (1.0 - share) if knows_force else share
    local.slope_factor = 1.0 + trust * (liquid.known_force[delay_ticks] - 1.0) if knows_force else 1.0
    if liquid.effects & effects.added_mass.BIT and not knows_force:
        added_mass_force(parameters, liquid, local, state, delay_ticks, interval_s)
    if liquid.effects & effects.history.BIT:
        basset_force(parameters, liquid, local, state, rows, delay_ticks, interval_s)
    if liquid.effects & effects.unsteady_drag.BIT:
        unsteady_drag_force(parameters, liquid, local, state, delay_ticks, interval_s, knows_force)
    if liquid.effects & effects.non_newtonian.BIT:
        non_newtonian_force(parameters, liquid, local, state, delay_ticks, interval_s)
    if liquid.effects & effects.added_mass.BIT and knows_force:
        implicit_added_mass_force(parameters, liquid, local, state, delay_ticks)
    if liquid.effects & effects.wake.BIT:
        update_wake(liquid, local, state, rows.elements, rows.segments, interval_s)
    if liquid.effects & effects.local_wake.BIT:
        deposit_local_wake(liquid, local, state, rows.cells, interval_s)
    local.ticks += 1


@kernel
def reset_tracking(model: Any) -> None:
    """Reset the motion so far: only the body's place is known."""
    reset_estimator(model.parameters[0], model.state[0])
    for i in range(model.parameters[0].liquids):
        model.liquid_states[i].ticks = 0
    model.state[0].tracking = 1


@part
def write_sample(state: Record, sample: Record) -> None:
    """Write the results of the liquids into the sample."""
    copy(state.velocity_mps, sample.velocity_mps)
    copy(state.wake_mps, sample.wake_mps)
    copy(state.force_n, sample.force_n)
    if state.kalman.on_ewma:
        sample.limiters |= LIMITER_ESTIMATOR
