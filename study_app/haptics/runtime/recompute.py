"""Recomputes ticks from their telemetry, and the places of the wake that they left.

A sample contains all inputs of a tick: when and where the device was read, whether that was new, and whether the force
was stopped. So the same tick outside the servo, with a separate model and safety record, yields the same force to the
last bit, or that of another liquid on the same motion.
"""

from typing import Any

import numpy as np

from study_app.haptics.kernels.compiled import kernel, part
from study_app.haptics.kernels.effects.wake import REST_MPS
from study_app.haptics.kernels.passivity import log_acted, log_delivery, log_saturation
from study_app.haptics.kernels.safety import begin_scene
from study_app.haptics.kernels.tick import tick
from study_app.haptics.kernels.vector import copy, distance, square
from study_app.haptics.model.effects import local_wake, wake
from study_app.haptics.model.layout import LIMITER_SATURATED, LIMITER_STOP, STATUS_DEVICE_LOST, Record, records

PLACE = np.dtype(
    [
        ("hand_m", np.float64, (3,)),  # place of the hand, hand frame
        ("segment", np.int64),  # number of the wake's segment
        ("moving", np.int64),  # 0 for a zero element
    ],
    align=True,
)

TRAIL = np.dtype(
    [
        ("left", np.int64),  # elements stored since the wake was empty; number q is in row q % (rows of the ring)
        ("held", np.int64),  # elements still in the wake
        ("segments", np.int64),  # segments that contain one of them
        ("time_s", np.float64),  # of a local wake, after the last tick
    ],
    align=True,
)


def new_wake_places(elements: int) -> tuple[Any, Any]:
    """Return an empty trail, (1,) ``TRAIL``, and the ring of its places, (elements,) ``PLACE``."""
    return records(TRAIL, 1), records(PLACE, elements)


@part
def was_lost_at_read(sample: Record) -> bool:
    """Return whether the servo found the device lost: then it ran no tick, and the force is the device's own."""
    return bool(
        sample.status == STATUS_DEVICE_LOST
        and sample.fresh == 0
        and sample.limiters == 0
        and square(sample.force_n) == 0.0
        and square(sample.velocity_mps) == 0.0
    )


@part
def take_sample(model: Any, safety: Record, sample: Record, delivered: bool) -> None:
    """Recompute the tick of a sample from the servo's inputs in it: stop, delay, saturation, the device's force.

    If that force was not ``delivered`` for this model's command, only the velocity estimator receives it, since it
    moved the hand.
    """
    sent_x, sent_y, sent_z = sample.device_force_n[0], sample.device_force_n[1], sample.device_force_n[2]
    as_asked = sent_x == sample.command_n[0] and sent_y == sample.command_n[1] and sent_z == sample.command_n[2]
    saturated = sample.limiters & LIMITER_SATURATED
    safety.stop = 1 if sample.limiters & LIMITER_STOP else 0
    safety.delay_ticks = sample.delay_ticks
    tick(model, safety, sample)
    if not delivered:
        log_acted(safety.passivity, (sent_x, sent_y, sent_z))
    elif not as_asked:
        log_delivery(safety, sample, (sent_x, sent_y, sent_z))
    if delivered and saturated:
        log_saturation(safety, sample)


@kernel
def recompute_sample(model: Any, safety: Record, samples: Any, trail: Record, places: Any, delivered: bool) -> None:
    """Recompute each of ``samples`` like the servo, and write the results into them.

    ``trail`` and ``places`` follow the wake of the model's first liquid. ``delivered`` says that the forces in
    ``samples`` result from this model's commands: if the device sent another one, it is logged.
    """
    for k in range(samples.shape[0]):
        sample = samples[k]
        if was_lost_at_read(sample):
            continue
        take_sample(model, safety, sample, delivered)
        _note(model, trail, places)


@kernel
def recompute_scenes(
    rest: Any, earlier: Any, model: Any, serial_before: int, serial: int, safety: Record, samples: Any, first: int
) -> None:
    """Recompute each of ``samples`` from ``first`` on by the model of its scene, and write the forces into them.

    ``model`` is that of the scene ``serial``, ``earlier`` that of ``serial_before``, ``rest`` that of all others.
    """
    for i in range(first, samples.shape[0]):
        sample = samples[i]
        if i > 0 and sample.scene != samples[i - 1].scene:
            begin_scene(safety)
        if was_lost_at_read(sample):
            continue
        if sample.scene == serial and serial != 0:
            take_sample(model, safety, sample, True)
        elif sample.scene == serial_before and serial_before != 0:
            take_sample(earlier, safety, sample, True)
        else:
            take_sample(rest, safety, sample, True)


@part
def _note(model: Any, trail: Record, places: Any) -> None:
    """Store the place of the hand if this tick left an element of the wake there."""
    if model.parameters[0].liquids == 0:
        return
    liquid, local, state = model.liquids[0], model.liquid_states[0], model.state[0]
    if local.ticks == 0:  # outside the liquid, whose state is then reset
        trail.left = trail.held = trail.segments = 0
        trail.time_s = 0.0
    elif liquid.effects & wake.BIT:
        tail, tracks = liquid.wake, local.wake
        if tracks.stored > 0 and tracks.stored != trail.left:
            place = places[(tracks.stored - 1) % places.shape[0]]
            copy(state.hand_m, place.hand_m)
            place.segment = tracks.last_segment
            place.moving = model.rows.elements[tail.row + (tracks.stored - 1) % tail.length].moving
        trail.left = tracks.stored
        trail.held = tracks.held
        trail.segments = tracks.last_segment - tracks.first_segment + 1 if tracks.speed_mps > 0.0 else 0
    elif liquid.effects & local_wake.BIT:
        tracks = local.local_wake
        if tracks.held == 0:
            trail.left = 0
        elif tracks.time_s != trail.time_s:
            place = places[trail.left % places.shape[0]]
            copy(state.hand_m, place.hand_m)
            place.segment = 0
            place.moving = 1 if distance(state.velocity_mps, state.drift_mps) >= REST_MPS else 0
            trail.left += 1
        trail.time_s = tracks.time_s
        trail.held = tracks.held
        trail.segments = tracks.cells
