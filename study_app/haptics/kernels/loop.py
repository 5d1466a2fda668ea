"""The servo's compiled loop: read the device, compute a tick, write the force, publish the sample, sleep.

Python runs only before and after it. It never allocates, logs, locks or raises; it reads the host's requests from a
control record and writes its samples into the telemetry ring. It always ends with zero force.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from study_app.haptics.kernels import c_functions
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.passivity import log_delivery, log_saturation
from study_app.haptics.kernels.safety import begin_scene
from study_app.haptics.kernels.sample_validation import FAULT_NS
from study_app.haptics.kernels.tick import compute_tick
from study_app.haptics.model import layout
from study_app.haptics.model.device_dynamics import MOST_DELAY

_read, _write, _now, _sleep = (
    c_functions.call_at(c_functions.READ),
    c_functions.call_at(c_functions.WRITE),
    c_functions.call_at(c_functions.NOW),
    c_functions.call_at(c_functions.SLEEP),
)

SLOWER_SAMPLES = 3
"""Consecutive samples with a longer delay before the loop adopts it."""
FASTER_SAMPLES = 1000
"""Consecutive samples with a shorter delay before the loop adopts it, since delays recur."""

CONTROL = np.dtype(
    [
        # written by the host
        ("run", np.int64),  # 1 while the loop may run
        ("stop", np.int64),  # 1 for no force; the loop also sets it when the device's stop button is down
        ("request", np.int64),  # counts the scenes handed over; the newest is in slot request % 2
        ("numbers", np.int64),  # counts the updates of the active scene with the constants of the spare slot
        ("serial", np.int64, (2,)),  # telemetry's number of the scene in each slot; 0 is rest
        ("period_ns", np.int64),
        # written by the loop
        ("taken", np.int64),  # the request that is active
        ("numbers_taken", np.int64),  # likewise
        ("deadline_ns", np.int64),  # time at which the next tick is due
        ("ticks", np.int64),  # ticks completed
        ("overruns", np.int64),  # deadlines passed over because a tick did not fit
        ("began_ns", np.int64),  # start time of the last tick
        ("hung", np.int64),  # 1 if the last tick took 50 ms or more
        ("worst_gap_ns", np.int64),  # the longest time between two ticks since the active scene was requested
        ("status", np.int64),  # STATUS_* of the last tick; any other than STATUS_OK ends the loop
    ],
    align=True,
)


class DeviceCalls(NamedTuple):
    """Addresses of a device's memory and functions."""

    context: int
    read: int
    write: int


class ClockCalls(NamedTuple):
    """Addresses of a clock's memory and functions."""

    context: int
    now: int
    sleep: int


class Records(NamedTuple):
    """Records exchanged between loop and device: (1,) arrays of ``layout.READING`` and ``layout.COMMAND``."""

    reading: Any
    command: Any


class Output(NamedTuple):
    """The destination of samples (``haptics.runtime.telemetry``)."""

    ring: Any
    written: Any


@kernel
def run(control: Any, slots: Any, safety: Any, exchanged: Any, output: Any, device: Any, clock: Any, ticks: int) -> int:
    """Run until the host or a fault ends it, or ``ticks`` are done (below 0: without end); return their number.

    Parameters
    ----------
    control : (1,) array
        One row of ``CONTROL``.
    slots : tuple of Model
        The models of the two slots of scenes.
    safety : (1,) array
        One row of ``layout.SAFETY``.
    exchanged : Records
        One reading and one command.
    output : Output
        Where samples are written.
    device : DeviceCalls
        The functions that read and write the device, with their contexts.
    clock : ClockCalls
        The function that sleeps, with its context.
    ticks : int
        Number of ticks; below 0: unlimited.

    Notes
    -----
    A tick that takes 50 ms or more, in the device or because its thread did not run, sends zero force after its own
    force, and the next tick sends zero, too: then the force fades in as at a start. After ``ticks`` the loop only
    pauses, and the device holds the last force; every other exit writes zero.
    """
    first, second = slots
    ring, written = output.ring, output.written
    host = control[0]
    done = 0
    while host.run != 0 and host.status == layout.STATUS_OK:
        if ticks >= 0 and done >= ticks:
            return done
        began_ns = _sleep(clock.sleep, clock.context, host.deadline_ns)
        sample = ring[written[0] % ring.shape[0]]
        sample.tick = host.ticks
        sample.time_ns = began_ns
        sample.lateness_ns = began_ns - host.deadline_ns
        _read_device(sample, safety[0], exchanged.reading, device)
        if sample.buttons & layout.BUTTON_STOP:
            host.stop = 1
        _take_scene(host, slots, safety[0], sample)
        host.worst_gap_ns = max(host.worst_gap_ns, began_ns - host.began_ns)
        host.began_ns = began_ns
        if sample.status == layout.STATUS_OK:
            safety[0].stop = 1 if host.hung != 0 else host.stop  # recorded in the sample, so that a replay repeats it
            if host.taken % 2 == 0:
                compute_tick(first, safety[0], sample)
            else:
                compute_tick(second, safety[0], sample)
        if _send(sample, safety[0], exchanged.command, device, clock, began_ns) == c_functions.READ_LOST:
            sample.status = layout.STATUS_DEVICE_LOST
        ended_ns = began_ns + sample.busy_ns
        host.hung = 1 if sample.busy_ns >= FAULT_NS else 0
        host.status = sample.status
        c_functions.fence()
        written[0] += 1
        host.ticks += 1
        done += 1
        _set_deadline(host, ended_ns)
    send_zero_force(exchanged.command, device)
    return done


@kernel
def _read_device(sample: Any, safety: Any, reading: Any, device: Any) -> None:
    """Read the device into ``sample``; if it is lost, set the status, zero velocity and zero force."""
    reading[0].delay_ticks = -1
    reading[0].measured = 0
    answer = _read(device.read, device.context, sample.time_ns, np.intp(reading.ctypes.data))
    sample.fresh = 1 if answer == c_functions.READ_NEW else 0
    sample.status = layout.STATUS_DEVICE_LOST if answer == c_functions.READ_LOST else layout.STATUS_OK
    follow_delay(safety, sample, reading[0].delay_ticks)
    sample.buttons = reading[0].buttons
    sample.limiters = 0
    sample.permitted_n = sample.withheld_n = 0.0
    sample.delay_ticks = safety.delay_ticks
    for axis in range(3):
        sample.position_m[axis] = reading[0].position_m[axis]
        sample.velocity_mps[axis] = 0.0
        sample.wake_mps[axis] = 0.0
        sample.force_n[axis] = 0.0
        sample.command_n[axis] = 0.0
        sample.device_force_n[axis] = 0.0
    take_measurements(sample, reading[0])


@kernel
def take_measurements(sample: Any, reading: Any) -> None:
    """Copy the device's measurements other than position and buttons; set those it lacks to 0."""
    measured = reading.measured
    sample.measured = measured
    for axis in range(3):
        sample.device_velocity_mps[axis] = reading.velocity_mps[axis] if measured & layout.MEASURED_VELOCITY else 0.0
    for part in range(4):
        sample.orientation[part] = reading.orientation[part] if measured & layout.MEASURED_ORIENTATION else 0.0
    sample.gripper_m = reading.gripper_m if measured & layout.MEASURED_GRIPPER else 0.0
    sample.device_time_ns = reading.device_time_ns if measured & layout.MEASURED_TIME else 0


@kernel
def follow_delay(safety: Any, sample: Any, measured: int) -> None:
    """Adopt a delay that the device measures while it runs: a longer one soon, a shorter one gradually.

    A sample later than any delay with which the loop is stable does not count as new.
    """
    if measured < 0 or sample.fresh == 0:
        return
    if measured > MOST_DELAY:
        sample.fresh = 0
    safety.slower = safety.slower + 1 if measured > safety.delay_ticks else 0
    safety.faster = safety.faster + 1 if measured < safety.delay_ticks else 0
    if safety.slower >= SLOWER_SAMPLES:
        safety.delay_ticks = min(safety.delay_ticks + 1, MOST_DELAY)
        safety.slower = 0
    elif safety.faster >= FASTER_SAMPLES:
        safety.delay_ticks -= 1
        safety.faster = 0


@kernel
def _send(sample: Any, safety: Any, command: Any, device: Any, clock: Any, began_ns: int) -> int:
    """Command the force, then zero if the tick hung; log the force that the device sent instead, or may have."""
    row = command[0]
    for axis in range(3):
        row.force_n[axis] = row.sent_n[axis] = sample.device_force_n[axis]
    answer = _write(device.write, device.context, np.intp(command.ctypes.data))
    sample.busy_ns = _now(clock.now, clock.context) - began_ns
    if sample.busy_ns >= FAULT_NS:
        send_zero_force(command, device)
    for axis in range(3):
        if row.sent_n[axis] != sample.device_force_n[axis]:
            log_delivery(safety, sample, row.sent_n)
            break
    if answer == c_functions.WRITE_SATURATED:
        log_saturation(safety, sample)
    return int(answer)


@kernel
def _take_scene(host: Any, slots: Any, safety: Any, sample: Any) -> None:
    """Switch to a newly requested scene, and copy newly requested constants into the active one."""
    request, numbers = host.request, host.numbers
    if request != host.taken:
        host.worst_gap_ns = 0  # before the host reads the new ``taken``
        c_functions.fence()
        host.taken = request
        begin_scene(safety)
    if numbers != host.numbers_taken:
        c_functions.fence()
        first, second = slots
        if host.taken % 2 == 0:
            _copy_constants(host, first, second, 0)
        else:
            _copy_constants(host, second, first, 1)
        host.numbers_taken = numbers
    sample.scene = host.serial[host.taken % 2]


@kernel
def _copy_constants(host: Any, model: Any, spare: Any, slot: int) -> None:
    """Copy the constants and the serial of the spare model into a model; its state stays."""
    c_functions.copy_record(model.parameters[0], spare.parameters[0])
    for i in range(model.liquids.shape[0]):
        c_functions.copy_record(model.liquids[i], spare.liquids[i])
    host.serial[slot] = host.serial[1 - slot]


@kernel
def _set_deadline(host: Any, ended_ns: int) -> None:
    """Set the next deadline and skip those that have passed: a gap is never followed by a burst of ticks."""
    host.deadline_ns += host.period_ns
    if ended_ns > host.deadline_ns:
        missed = (ended_ns - host.deadline_ns) // host.period_ns
        host.overruns += missed
        host.deadline_ns += missed * host.period_ns


@kernel
def offer_scene(control: Any, slot: int, serial: int) -> None:
    """Request the scene in ``slot``, already packed, for the next tick; discard constants not yet taken."""
    control[0].numbers = control[0].numbers_taken
    control[0].serial[slot] = serial
    c_functions.fence()
    control[0].request += 1


@kernel
def offer_numbers(control: Any, slot: int, serial: int) -> None:
    """Request the constants in ``slot``, the spare one, for the active scene from the next tick on."""
    control[0].serial[slot] = serial
    c_functions.fence()
    control[0].numbers += 1


@kernel
def send_zero_force(command: Any, device: Any) -> None:
    """Command zero force."""
    for axis in range(3):
        command[0].force_n[axis] = command[0].sent_n[axis] = 0.0
    _write(device.write, device.context, np.intp(command.ctypes.data))
