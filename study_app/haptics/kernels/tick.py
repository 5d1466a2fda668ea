"""One turn of the servo, read from top to bottom.

The lines of `respond` are the pipeline; the bits of a liquid's ``effects`` say which of them run. Nothing here
allocates, raises or waits; the servo, a rehearsal and `offline.simulate` run the same code.
"""

from __future__ import annotations

from typing import Any

from study_app.haptics.kernels.compiled import kernel, part
from study_app.haptics.kernels.effects.added_mass import push_aside
from study_app.haptics.kernels.effects.buoyancy import carry
from study_app.haptics.kernels.effects.current import stream
from study_app.haptics.kernels.effects.drag import resist
from study_app.haptics.kernels.effects.history import remember
from study_app.haptics.kernels.effects.local_wake import forget_places, leave_behind, linger
from study_app.haptics.kernels.effects.surface import expose
from study_app.haptics.kernels.effects.wake import flow, follow
from study_app.haptics.kernels.estimators.kalman import take_force
from study_app.haptics.kernels.estimators.velocity import estimate, forget
from study_app.haptics.kernels.regions import share_out
from study_app.haptics.kernels.safety import guard
from study_app.haptics.kernels.sample_validation import admit, watch
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
    interval_s = admit(model.parameters[0], model.state[0], safety, sample)
    watch(model.parameters[0], safety, sample)
    if interval_s > 0.0:
        take_force(model.state[0], safety)
        respond(model, interval_s)
    report(model.state[0], sample)
    guard(model, safety, sample, interval_s)


@part
def respond(model: Any, interval_s: float) -> None:
    """Let the liquids respond to the place the body has reached, Δt after the one before.

    Every effect is evaluated before the wake takes this tick in: the first tick of a motion meets a liquid at rest.
    """
    parameters, state = model.parameters[0], model.state[0]
    if state.tracking == 0:
        begin(model)
    estimate(parameters, state, model.window, interval_s)
    share_out(model, interval_s)

    clear(state.force_n)
    clear(state.lift_n)
    clear(state.wake_mps)
    clear(state.drift_mps)
    for i in range(parameters.liquids):
        if model.liquid_states[i].share > 0.0:
            act(model, i, interval_s)
        else:
            leave(model, i)
    if parameters.effects & EFFECT_BUOYANCY:
        carry(model)


@part
def act(model: Any, i: int, interval_s: float) -> None:
    """Let one liquid, in which the body is, act on it by the effects it asks for: in this order, no others."""
    liquid, local, state = model.liquids[i], model.liquid_states[i], model.state[0]
    copy(state.velocity_mps, local.motion_mps)
    clear(local.wake_mps)
    if liquid.effects & EFFECT_CURRENT:
        stream(liquid, local, state)
        copy(local.current.velocity_mps, state.drift_mps)
    if liquid.effects & EFFECT_WAKE:
        flow(liquid, local, model.segments)
    if liquid.effects & EFFECT_LOCAL_WAKE:
        linger(liquid, local, state, model.cells, interval_s)
    subtract(local.motion_mps, local.wake_mps, local.relative_mps)
    copy(local.wake_mps, state.wake_mps)
    if liquid.effects & EFFECT_SURFACE:
        expose(local)
    if liquid.effects & EFFECT_DRAG:
        resist(liquid, local, state)
    if liquid.effects & EFFECT_ADDED_MASS:
        push_aside(liquid, local, state, interval_s)
    if liquid.effects & EFFECT_HISTORY:
        remember(liquid, local, state, model.intervals, model.exponentials, interval_s)
    if liquid.effects & EFFECT_WAKE:
        follow(liquid, local, state, model.elements, model.segments, interval_s)
    if liquid.effects & EFFECT_LOCAL_WAKE:
        leave_behind(liquid, local, state, model.cells, interval_s)


@part
def leave(model: Any, i: int) -> None:
    """Let one liquid forget the body: it is out of it, or was lost."""
    liquid, local = model.liquids[i], model.liquid_states[i]
    if liquid.effects & EFFECT_WAKE:
        empty(liquid.wake, local.wake, model.segments)
    if liquid.effects & EFFECT_LOCAL_WAKE:
        forget_places(local.local_wake)
    if liquid.effects & EFFECT_ADDED_MASS:
        local.added_mass.primed = 0
    if liquid.effects & EFFECT_HISTORY:
        local.history.primed = 0


@kernel
def begin(model: Any) -> None:
    """Forget the motion so far: all that is known of the body is where it is."""
    forget(model.parameters[0], model.state[0])
    for i in range(model.parameters[0].liquids):
        leave(model, i)
    model.state[0].tracking = 1


@part
def report(state: Record, sample: Record) -> None:
    """Write what the liquids did into the sample."""
    copy(state.velocity_mps, sample.velocity_mps)
    copy(state.wake_mps, sample.wake_mps)
    copy(state.force_n, sample.force_n)
    if state.kalman.distrusted:
        sample.limiters |= LIMITER_ESTIMATOR
