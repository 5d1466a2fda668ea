"""The emulated Falcon's memory and its interface to a host: transfers, control requests, time, and mains power.

A transfer advances emulated time from byte to byte at the device, until it is complete or its time is out.
"""

from functools import cache
from typing import Any

import numpy as np

from study_app.devices.falcon.emulator import ftdi_bridge
from study_app.devices.falcon.emulator.arm import ARMS, bend, count, saturate, strain
from study_app.devices.falcon.emulator.boot_loader import LOADER, RUNNING, WAITING, load, reset
from study_app.devices.falcon.emulator.faults import FAULTS, draw
from study_app.devices.falcon.emulator.firmware_loop import LONGEST_NS, RUN, live, work
from study_app.devices.falcon.emulator.ftdi_bridge import BRIDGE, OUT_RING, byte_at
from study_app.devices.falcon.transport.bulk_calls import BULK
from study_app.devices.falcon.wire import constants
from study_app.devices.simulated.hand import HAND
from study_app.haptics.kernels.c_functions import c_function, record_at
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.plant import HANDLE

EMULATOR = np.dtype(
    [
        ("bridge", BRIDGE),
        ("faults", FAULTS),
        ("loader", LOADER),
        ("run", RUN),
        ("arms", ARMS),
        ("handle", HANDLE),
        ("hand", HAND),
        ("powered", np.int64),  # 1 while the mains adapter is on
        ("buttons", np.int64),  # bits 0 to 3, as the grip reports them
        ("moved_ns", np.int64),  # time of the last motion of hand and handle
        ("weight_n", np.float64),  # of the load on the grip
    ],
    align=True,
)

_emulator_at = record_at(EMULATOR)
INT = np.dtype([("value", np.int32)])
_int_at = record_at(INT)


@cache
def bulk() -> Any:
    """Compile the transfer function, once for all emulators."""
    return c_function(BULK, _bulk)


def _bulk(handle: int, endpoint: int, data: int, length: int, transferred: int, timeout_ms: int) -> int:
    e = _emulator_at(handle)
    moved = _int_at(transferred)
    moved.value = 0
    if e.faults.unplugged:
        return constants.ERROR_NO_DEVICE
    _begin(e)
    end_ns = ftdi_bridge.end_of(e.bridge, timeout_ms * 1_000_000)
    if endpoint == constants.ENDPOINT_OUT:
        return _bulk_out(e, data, length, moved, end_ns)
    if endpoint == constants.ENDPOINT_IN:
        return _bulk_in(e, data, length, moved, end_ns)
    return constants.ERROR_NOT_FOUND


@kernel
def _begin(e: Any) -> None:
    """Begin a transfer now; if the clock was changed, shift all times to it."""
    jump_ns = ftdi_bridge.begin(e.bridge)
    if jump_ns != 0:
        ftdi_bridge.shift_bridge(e.bridge, jump_ns)
        e.moved_ns += jump_ns
        e.hand.began_ns += jump_ns
        e.run.stalled_ns += jump_ns
    if e.faults.was_unplugged:
        e.faults.was_unplugged = 0
        ftdi_bridge.power_up(e.bridge)
    _advance(e, e.bridge.now_ns)


@kernel
def _bulk_out(e: Any, data: int, length: int, moved: Any, end_ns: int) -> int:
    for k in range(length):
        if not ftdi_bridge.send(e.bridge, byte_at(data + k).value, end_ns):
            _advance(e, end_ns)
            return constants.ERROR_TIMEOUT
        moved.value = k + 1
        _advance(e, e.bridge.now_ns)
    return constants.SUCCESS


@kernel
def _bulk_in(e: Any, data: int, length: int, moved: Any, end_ns: int) -> int:
    bridge = e.bridge
    while moved.value < length:
        ftdi_bridge.overflow(bridge)
        due_ns = ftdi_bridge.hand_over_ns(bridge)
        if bridge.out_first < bridge.out_last:
            heard_ns = bridge.out_ns[bridge.out_first % OUT_RING]
            if heard_ns <= min(due_ns, end_ns):  # the device's answer to it may be due sooner
                _advance(e, heard_ns)
                continue
        if due_ns > end_ns:
            _advance(e, end_ns)
            return constants.ERROR_TIMEOUT
        _advance(e, due_ns)
        waiting = bridge.back_last - bridge.back_first
        room = length - moved.value
        if room < constants.USB_PACKET and _arrived_of(bridge, waiting) + constants.STATUS_BYTES > room:
            return constants.ERROR_OVERFLOW
        noise = int(draw(e.faults) * 0x10000) if e.faults.status_noise else 0
        got = ftdi_bridge.hand_over(bridge, data + moved.value, noise)
        moved.value += got
        if got < constants.USB_PACKET:
            return constants.SUCCESS
    return constants.SUCCESS


@kernel
def poll(e: Any, data: int, length: int, moved: Any) -> int:
    """Transfer in the chip's bytes up to now, to address ``data``; ``moved`` is a record of ``INT``.

    Returns ``ERROR_TIMEOUT`` while the transfer is not complete; the rest is requested later.
    """
    moved.value = 0
    if e.faults.unplugged:
        return constants.ERROR_NO_DEVICE
    _begin(e)
    return _bulk_in(e, data, length, moved, e.bridge.now_ns)


@kernel
def next_event_ns(e: Any) -> int:
    """Return when a poll may transfer more than now: the chip hands over, or the device hears a byte [ns]."""
    bridge = e.bridge
    due_ns = ftdi_bridge.hand_over_ns(bridge)
    if bridge.out_first < bridge.out_last:
        due_ns = min(due_ns, bridge.out_ns[bridge.out_first % OUT_RING])
    return int(due_ns)


@kernel
def _arrived_of(bridge: Any, waiting: int) -> int:
    """Return how many bytes the next packet would carry."""
    held = 0
    while held < min(waiting, constants.CHUNK):
        if bridge.back_ns[(bridge.back_first + held) % ftdi_bridge.BACK_RING] > bridge.now_ns:
            break
        held += 1
    return held


@kernel
def _advance(e: Any, to_ns: int) -> None:
    """Let the device process the bytes that arrive up to ``to_ns``."""
    bridge = e.bridge
    while bridge.out_first < bridge.out_last:
        place = bridge.out_first % OUT_RING
        at_ns = bridge.out_ns[place]
        if at_ns > to_ns:
            break
        bridge.now_ns = max(bridge.now_ns, at_ns)
        bridge.out_first += 1
        if e.powered == 0:
            continue
        if e.loader.state == RUNNING:
            work(e, bridge.out[place], bridge.out_divisor[place], at_ns)
        else:
            load(e.loader, bridge, e.faults, bridge.out[place], bridge.out_divisor[place], at_ns)
            if e.loader.state == RUNNING:
                run_program(e)
    bridge.now_ns = max(bridge.now_ns, to_ns)


@kernel
def run_program(e: Any) -> None:
    """Begin with encoders at 0, no torque and no arm homed."""
    e.loader.state = RUNNING
    _limp(e)
    for arm in range(3):
        e.run.origin[arm] = count(e.arms, arm)
        e.run.before_rad[arm] = e.arms.angle_rad[arm]


@kernel
def _limp(e: Any) -> None:
    run = e.run
    run.held = 0
    run.homed = 0
    run.homing = 0
    run.lights = 0
    run.stroke = 0
    for arm in range(3):
        run.torque[arm] = 0
        run.acting[arm] = 0.0


@kernel
def control(e: Any, request: int, value: int) -> int:
    """Carry out a control request of the bridge; a rising DTR at 9600 baud resets the device."""
    if e.faults.unplugged:
        return constants.ERROR_NO_DEVICE
    _begin(e)
    dtr = e.bridge.dtr
    ftdi_bridge.control(e.bridge, request, value)
    if e.bridge.dtr > dtr and e.bridge.divisor == constants.BAUD_9600 and e.powered != 0:
        reset(e.loader)
        _limp(e)
    return constants.SUCCESS


@kernel
def supply(e: Any, on: int) -> None:
    """Turn its mains power on or off; without power its program is lost."""
    if e.powered == on:
        return
    e.powered = on
    reset(e.loader)
    e.loader.state = WAITING
    _limp(e)


@kernel
def let_pass(e: Any, lasting_ns: int) -> None:
    """Advance the time, including the motion of hand and handle."""
    _begin(e)
    end_ns = ftdi_bridge.end_of(e.bridge, lasting_ns)
    _advance(e, end_ns)
    live(e, end_ns, max(lasting_ns, LONGEST_NS))


@kernel
def look(e: Any) -> None:
    """Advance to the clock's present time."""
    _begin(e)
    live(e, e.bridge.now_ns, LONGEST_NS)


@kernel
def settle(e: Any) -> None:
    """Reset to the state after connection: arms at the grip's place, no program."""
    bend(e.arms, e.handle.position_m)
    e.loader.state = WAITING


@kernel
def feel(e: Any) -> None:
    """Set ``arms.force_n`` to the motors' present force."""
    strain(e.arms, e.run.acting, e.handle.position_m)
    saturate(e.arms)
