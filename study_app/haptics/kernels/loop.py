"""The servo's loop, compiled: read the device, take a tick, write the force, publish the sample, sleep.

It meets Python only where it begins and ends. It never allocates, logs, locks or raises; what the host wants it finds
in a control record, what it did it leaves in the telemetry ring. Whatever ends it, it ends with zero force.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from study_app.haptics.kernels.c_functions import NOW, READ, READ_LOST, READ_NEW, SLEEP, WRITE, call_at, fence
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.passivity import log_delivery
from study_app.haptics.kernels.safety import begin_scene
from study_app.haptics.kernels.sample_validation import FAULT_NS
from study_app.haptics.kernels.tick import tick
from study_app.haptics.model.device_dynamics import MOST_DELAY
from study_app.haptics.model.layout import (
    BUTTON_STOP,
    MEASURED_GRIPPER,
    MEASURED_ORIENTATION,
    MEASURED_TIME,
    MEASURED_VELOCITY,
    STATUS_DEVICE_LOST,
    STATUS_OK,
)

_read, _write, _now, _sleep = call_at(READ), call_at(WRITE), call_at(NOW), call_at(SLEEP)

SLOWER_SAMPLES = 3
"""A longer delay is taken over after so many samples in a row that show it."""
FASTER_SAMPLES = 1000
"""A shorter one likewise: what was slow once may be so again."""

CONTROL = np.dtype(
    [
        # written by the host
        ("run", np.int64),  # 1 while the loop may go on
        ("stop", np.int64),  # 1 for no force; the loop sets it too, when the device's stop button is down
        ("request", np.int64),  # counts the scenes handed over; the newest is in slot request % 2
        ("numbers", np.int64),  # counts the times that the scene in force was given the numbers of the spare slot
        ("serial", np.int64, (2,)),  # what telemetry calls the scene of each slot; 0 is rest
        ("period_ns", np.int64),
        # written by the loop
        ("taken", np.int64),  # the request in force
        ("numbers_taken", np.int64),  # likewise
        ("deadline_ns", np.int64),  # when the next tick is due
        ("ticks", np.int64),  # how many were taken
        ("overruns", np.int64),  # deadlines passed over because a tick did not fit
        ("began_ns", np.int64),  # when the last tick began
        ("hung", np.int64),  # 1 where the last tick took 50 ms or more
        ("worst_gap_ns", np.int64),  # the longest time between two ticks since the scene in force was handed over
        ("status", np.int64),  # STATUS_* of the last tick; any but STATUS_OK ended the loop
    ],
    align=True,
)


class DeviceCalls(NamedTuple):
    """A device as the loop sees it: addresses."""

    context: int
    read: int
    write: int


class ClockCalls(NamedTuple):
    """A clock as the loop sees it: addresses."""

    context: int
    now: int
    sleep: int


class Records(NamedTuple):
    """What loop and device exchange: (1,) arrays of ``layout.READING`` and ``layout.COMMAND``."""

    reading: Any
    command: Any


class Output(NamedTuple):
    """Where samples go (``haptics.runtime.telemetry``)."""

    ring: Any
    written: Any


@kernel
def run(control: Any, slots: Any, safety: Any, exchanged: Any, output: Any, device: Any, clock: Any, ticks: int) -> int:
    """Run until the host or a fault ends it, or ``ticks`` are done (below 0: without end); return how many were taken.

    Parameters
    ----------
    control : (1,) array
        One row of ``CONTROL``.
    slots : tuple of Model
        The two models a scene may be in.
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
        How many ticks; below 0 without end.

    Notes
    -----
    A tick that takes 50 ms or more, in the device or because its thread did not run, sends zero force after its own,
    and the next one sends zero: then the force fades in as at a start.
    After ``ticks`` it only pauses, and the device goes on holding the last force; all other ways out write zero.
    """
    first, second = slots
    ring, written = output.ring, output.written
    host = control[0]
    done = 0
    while host.run != 0 and host.status == STATUS_OK:
        if ticks >= 0 and done >= ticks:
            return done
        began_ns = _sleep(clock.sleep, clock.context, host.deadline_ns)
        sample = ring[written[0] % ring.shape[0]]
        sample.tick = host.ticks
        sample.time_ns = began_ns
        sample.lateness_ns = began_ns - host.deadline_ns
        _sense(sample, safety[0], exchanged.reading, device)
        if sample.buttons & BUTTON_STOP:
            host.stop = 1
        _take_scene(host, slots, safety[0], sample)
        host.worst_gap_ns = max(host.worst_gap_ns, began_ns - host.began_ns)
        host.began_ns = began_ns
        if sample.status == STATUS_OK:
            safety[0].stop = 1 if host.hung != 0 else host.stop  # the sample says so: a replay repeats it
            if host.taken % 2 == 0:
                tick(first, safety[0], sample)
            else:
                tick(second, safety[0], sample)
        if _send(sample, safety[0], exchanged.command, device, clock, began_ns) == READ_LOST:
            sample.status = STATUS_DEVICE_LOST
        ended_ns = began_ns + sample.busy_ns
        host.hung = 1 if sample.busy_ns >= FAULT_NS else 0
        host.status = sample.status
        fence()
        written[0] += 1
        host.ticks += 1
        done += 1
        _set_deadline(host, ended_ns)
    let_go(exchanged.command, device)
    return done


@kernel
def _sense(sample: Any, safety: Any, reading: Any, device: Any) -> None:
    """Read the device into ``sample``; a lost one leaves its status, no velocity and no force."""
    reading[0].delay_ticks = -1
    reading[0].measured = 0
    answer = _read(device.read, device.context, sample.time_ns, np.intp(reading.ctypes.data))
    sample.fresh = 1 if answer == READ_NEW else 0
    sample.status = STATUS_DEVICE_LOST if answer == READ_LOST else STATUS_OK
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
    """Take what the device measured besides position and buttons; what it did not measure is 0."""
    measured = reading.measured
    sample.measured = measured
    for axis in range(3):
        sample.device_velocity_mps[axis] = reading.velocity_mps[axis] if measured & MEASURED_VELOCITY else 0.0
    for part in range(4):
        sample.orientation[part] = reading.orientation[part] if measured & MEASURED_ORIENTATION else 0.0
    sample.gripper_m = reading.gripper_m if measured & MEASURED_GRIPPER else 0.0
    sample.device_time_ns = reading.device_time_ns if measured & MEASURED_TIME else 0


@kernel
def follow_delay(safety: Any, sample: Any, measured: int) -> None:
    """Take over a delay that the device measures while it runs: a longer one soon, a shorter one by and by.

    A sample that is later than any loop is stable with does not count as new.
    """
    if measured < 0 or sample.fresh == 0:
        return
    if measured > MOST_DELAY:
        sample.fresh = 0
    safety.slower = safety.slower + 1 if measured > safety.delay_ticks else 0
    safety.faster = safety.faster + 1 if measured < safety.delay_ticks else 0
    if safety.slower >= SLOWER_SAMPLES:
        safety.delay_ticks = min(measured, MOST_DELAY)
        safety.slower = 0
    elif safety.faster >= FASTER_SAMPLES:
        safety.delay_ticks -= 1
        safety.faster = 0


@kernel
def _send(sample: Any, safety: Any, command: Any, device: Any, clock: Any, began_ns: int) -> int:
    """Command the device to send the force, zero after a tick that hung; log what it sent instead, if it did."""
    row = command[0]
    for axis in range(3):
        row.force_n[axis] = row.sent_n[axis] = sample.device_force_n[axis]
    answer = _write(device.write, device.context, np.intp(command.ctypes.data))
    sample.busy_ns = _now(clock.now, clock.context) - began_ns
    if sample.busy_ns >= FAULT_NS:
        let_go(command, device)
    for axis in range(3):
        if row.sent_n[axis] != sample.device_force_n[axis]:
            log_delivery(safety, sample, row.sent_n)
            break
    return int(answer)


@kernel
def _take_scene(host: Any, slots: Any, safety: Any, sample: Any) -> None:
    """Take the scene that was handed over last, if it is another one; or its numbers, with which it goes on."""
    request, numbers = host.request, host.numbers
    if request != host.taken:
        host.worst_gap_ns = 0  # before the host sees that the scene was taken
        fence()
        host.taken = request
        begin_scene(safety)
    if numbers != host.numbers_taken:
        fence()
        first, second = slots
        if host.taken % 2 == 0:
            _take_numbers(host, first, second, 0)
        else:
            _take_numbers(host, second, first, 1)
        host.numbers_taken = numbers
    sample.scene = host.serial[host.taken % 2]


@kernel
def _take_numbers(host: Any, model: Any, spare: Any, slot: int) -> None:
    """Give a model the constants of the spare one, and its serial; what moves in it stays."""
    model.parameters[0] = spare.parameters[0]
    for i in range(model.liquids.shape[0]):
        model.liquids[i] = spare.liquids[i]
    host.serial[slot] = host.serial[1 - slot]


@kernel
def _set_deadline(host: Any, ended_ns: int) -> None:
    """Set the next deadline and pass over those that are gone: a gap is never made up for by a burst of ticks."""
    host.deadline_ns += host.period_ns
    if ended_ns > host.deadline_ns:
        missed = (ended_ns - host.deadline_ns) // host.period_ns
        host.overruns += missed
        host.deadline_ns += missed * host.period_ns


@kernel
def offer_scene(control: Any, slot: int, serial: int) -> None:
    """Make the scene in ``slot``, already packed, the one that the next tick takes; numbers not taken yet are void."""
    control[0].numbers = control[0].numbers_taken
    control[0].serial[slot] = serial
    fence()
    control[0].request += 1


@kernel
def offer_numbers(control: Any, slot: int, serial: int) -> None:
    """Give the scene in force the numbers of that in ``slot``, the spare one, from the next tick on."""
    control[0].serial[slot] = serial
    fence()
    control[0].numbers += 1


@kernel
def let_go(command: Any, device: Any) -> None:
    """Command zero force."""
    for axis in range(3):
        command[0].force_n[axis] = command[0].sent_n[axis] = 0.0
    _write(device.write, device.context, np.intp(command.ctypes.data))
