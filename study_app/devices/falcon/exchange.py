"""The Falcon's turn, compiled: take the reply to the packet before, say where the grip is, send the next torques.

The device answers each packet with one, so `_read` collects what the packet of the turn before asked for, and `_write`
sends the force as soon as it is known; a position is one turn old. Several replies at once: the newest counts. None:
nothing new, and what came last is never given twice. Force passes a gate: all arms homed, the grip pulled out once, and
then half a second from none to all. Which replies are believed: see ``replies``.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, Final

import numpy as np

from study_app.devices.falcon.bulk import BULK, BulkCalls
from study_app.devices.falcon.geometry import OUT_STROKE_M, Geometry
from study_app.devices.falcon.kinematics import (
    MECHANISM,
    REACHED,
    START_M,
    angles,
    forward,
    jacobian,
    motor_units,
    torques,
)
from study_app.devices.falcon.packets import PARSER, STATUS, feed, pack, strip
from study_app.devices.falcon.replies import believe, settle, trust
from study_app.devices.falcon.wire import (
    ENDPOINT_IN,
    ENDPOINT_OUT,
    ERROR_NO_DEVICE,
    ERROR_TIMEOUT,
    FLAG_BLUE,
    FLAG_GREEN,
    FLAG_HOMING,
    FLAG_RED,
    PACKET,
    SUCCESS,
    USB_PACKET,
)
from study_app.haptics.cfunctions import (
    READ,
    READ_LOST,
    READ_NEW,
    READ_NOTHING_NEW,
    WRITE,
    c_function,
    call_at,
    record_at,
)
from study_app.haptics.compiled import kernel
from study_app.haptics.layout import READING, records

RAMP_S: Final = 0.5
MOST_STEP_N: Final = 0.47
"""The force at the grip steps by no more within a turn, however many turns the motors were not told anything new: the
servo's 0.5 N, less what motion within a turn makes of torques."""
LONGEST_GAP_NS: Final = 20_000_000
"""A reply that waited longer for the loop to look is too old to be given."""
_BEYOND = 2  # so many positions in a row show an out-stroke: one may be of a packet whose homed bits were garbled
_READS = 2  # a turn asks the bridge at most so often: one answer may be nothing but status bytes
_TIMEOUT_MS = 1
_DATA = 4 * USB_PACKET

FALCON = np.dtype(
    [
        ("now_ns", np.int64),  # time of the turn; stays first: an emulator reads it here
        ("handle", np.intp),  # of the bridge, and
        ("transfer", np.intp),  # address of its function (``bulk.BULK``)
        ("mechanism", MECHANISM),
        ("centre_m", np.float64),  # z of the hand's origin in the Falcon's frame
        ("started", np.int64),  # 1 after the first turn
        ("lost", np.int64),  # 1: the bridge is gone
        # the stream
        ("data", np.uint8, (_DATA,)),
        ("packet", np.uint8, (PACKET,)),
        ("transferred", np.int32),
        ("parser", PARSER),
        ("status", STATUS),
        # the pose, in the Falcon's frame
        ("seen_rad", np.float64, (3,)),  # what the last encoders say
        ("theta", np.float64, (3,)),  # of the last pose
        ("position_m", np.float64, (3,)),
        ("rates", np.float64, (3, 3)),
        ("force_n", np.float64, (3,)),  # as it passed the gate
        ("held_n", np.float64, (3,)),  # what the motors push with, as told before
        ("torque_nm", np.float64, (3,)),
        ("units", np.int64, (3,)),  # what the motors were last told
        # the motion of the arms, to tell garbled encoders
        ("tracked", np.int64),  # 1 once encoders were believed
        ("apart", np.int64),  # turns since then
        ("counts", np.int64, (3,)),  # as last believed
        ("pace", np.float64, (3,)),  # counts a turn
        ("doubted", np.int64, (3,)),  # as last not believed,
        ("doubted_at", np.int64),  # so many turns after the last believed
        ("doubts", np.int64),  # in a row
        # the gate
        ("homed", np.int64),  # 1 while all arms are
        ("unhomed", np.int64),  # packets in a row that said otherwise
        ("beyond", np.int64),  # positions in a row at the end of the out-stroke
        ("pulled_out", np.int64),  # 1 after it
        ("share", np.float64),  # of the force that passes
        ("unguarded", np.int64),  # 1: its guard has died: nothing passes, and it is given up
        ("buttons", np.int64),  # as two packets in a row said
        ("seen_buttons", np.int64),  # as the last one said
        # who owes whom
        ("asked", np.int64),  # packets sent since the last look
        ("owed", np.int64),  # replies that did not come so far
        ("testing", np.int64),  # turn of the test for late replies; 0: none
        ("retest", np.int64),  # turns until the next one
        # counters
        ("turns", np.int64),
        ("fresh", np.int64),  # turns that gave a position
        ("missing", np.int64),  # turns without a reply
        ("late", np.int64),  # turns whose reply was too old, or may have been
        ("refused", np.int64),  # turns whose reply was no pose of a homed Falcon, or is doubted
        ("requests", np.int64),  # packets sent
        ("replies", np.int64),  # packets received
        ("written_off", np.int64),  # replies that were given up
        ("surplus", np.int64),  # replies that nobody waited for any more
        ("cut_short", np.int64),  # reads that ended within a packet
        ("read_errors", np.int64),
        ("write_errors", np.int64),
        ("shortened", np.int64),  # forces that were more than the motors give
    ],
    align=True,
)

COUNTERS: Final = (
    "turns",
    "fresh",
    "missing",
    "late",
    "refused",
    "requests",
    "replies",
    "written_off",
    "surplus",
    "cut_short",
    "read_errors",
    "write_errors",
    "shortened",
)

_falcon_at = record_at(FALCON)
_reading_at = record_at(READING)
_transfer = call_at(BULK)


def _offset(field: str) -> int:
    fields = FALCON.fields
    assert fields is not None  # noqa: S101 - it is a record
    return int(fields[field][1])


_DATA_AT, _PACKET_AT, _TRANSFERRED_AT = _offset("data"), _offset("packet"), _offset("transferred")


def new_exchange(calls: BulkCalls, mechanism: Any, geometry: Geometry) -> Any:
    """Return the memory of an exchange over an open bridge, shape (1,): its address is the device's ``context``."""
    memory = records(FALCON, 1)
    falcon = memory[0]
    falcon.handle, falcon.transfer = calls.handle, calls.transfer
    falcon.mechanism = mechanism
    falcon.centre_m = geometry.centre_m
    falcon.position_m = START_M
    return memory


@cache
def exchange_functions() -> tuple[Any, Any]:
    """Compile read and write, once for all Falcons."""
    return c_function(READ, _read), c_function(WRITE, _write)


def _read(context: int, now_ns: int, reading: int) -> int:
    falcon = _falcon_at(context)
    if falcon.lost != 0:  # or not open: then there is no function to call
        return READ_LOST
    elapsed_ns = now_ns - falcon.now_ns
    falcon.now_ns = now_ns
    falcon.turns += 1
    falcon.apart += 1
    packets = _receive(falcon, context)
    if falcon.lost != 0 or falcon.unguarded != 0:
        return READ_LOST
    gap = falcon.started == 0 or elapsed_ns <= 0 or elapsed_ns > LONGEST_GAP_NS
    falcon.started = 1
    punctual = settle(falcon, packets, gap)
    if packets == 0:
        falcon.missing += 1
        return READ_NOTHING_NEW
    if not punctual:
        falcon.late += 1
        return READ_NOTHING_NEW
    if not (believe(falcon) and trust(falcon) and _locate(falcon)):
        falcon.refused += 1
        return READ_NOTHING_NEW
    _open_gate(falcon, elapsed_ns * 1e-9)
    out = _reading_at(reading)
    for axis in range(3):
        out.position_m[axis] = falcon.position_m[axis]
    out.position_m[2] -= falcon.centre_m
    out.buttons = falcon.buttons
    falcon.fresh += 1
    return READ_NEW


def _write(context: int, fx: float, fy: float, fz: float) -> int:
    falcon = _falcon_at(context)
    if falcon.lost != 0:
        return READ_LOST
    none = fx == 0.0 and fy == 0.0 and fz == 0.0
    pushing = falcon.units[0] != 0 or falcon.units[1] != 0 or falcon.units[2] != 0
    if falcon.testing != 0 and not (none and pushing):
        return 0
    falcon.force_n[0], falcon.force_n[1], falcon.force_n[2] = fx, fy, fz
    told = falcon.units[0], falcon.units[1], falcon.units[2]
    push(falcon)
    pack(falcon.units, _lights(falcon), falcon.packet)
    if not _send(falcon, context):
        falcon.units[0], falcon.units[1], falcon.units[2] = told
    return READ_LOST if falcon.lost != 0 else 0


@kernel
def push(falcon: Any) -> None:
    """Turn ``force_n``, as much of it as passes the gate, into ``units`` for the motors."""
    for axis in range(3):
        falcon.force_n[axis] *= falcon.share
    none = falcon.force_n[0] == 0.0 and falcon.force_n[1] == 0.0 and falcon.force_n[2] == 0.0
    if none or falcon.homed == 0 or falcon.unguarded != 0:
        for i in range(3):
            falcon.units[i] = 0
        return
    jacobian(falcon.mechanism, falcon.theta, falcon.position_m, falcon.rates)
    _limit_step(falcon)
    torques(falcon.rates, falcon.force_n, falcon.torque_nm)
    falcon.shortened += motor_units(falcon.mechanism, falcon.torque_nm, falcon.units)


@kernel
def _limit_step(falcon: Any) -> None:
    """Shorten the step from what the motors push with at present, where the grip is now."""
    square = 0.0
    for axis in range(3):
        held_n = 0.0
        for i in range(3):
            held_n -= falcon.units[i] / falcon.mechanism.units_per_nm * falcon.rates[i, axis]
        falcon.held_n[axis] = held_n
        square += (falcon.force_n[axis] - held_n) ** 2
    if square > MOST_STEP_N * MOST_STEP_N:
        share = MOST_STEP_N / math.sqrt(square)
        for axis in range(3):
            falcon.force_n[axis] = falcon.held_n[axis] + share * (falcon.force_n[axis] - falcon.held_n[axis])


@kernel
def _lights(falcon: Any) -> int:
    """Return the homing flag, which must stay set, and red before homing, blue before the out-stroke, then green."""
    if falcon.homed == 0:
        return FLAG_HOMING | FLAG_RED
    return FLAG_HOMING | (FLAG_BLUE if falcon.pulled_out == 0 else FLAG_GREEN)


@kernel
def _receive(falcon: Any, context: int) -> Any:
    """Read what the bridge has; return how many packets that was."""
    packets = 0
    for _ in range(_READS):
        falcon.transferred = 0
        code = _transfer(
            falcon.transfer,
            falcon.handle,
            np.uint8(ENDPOINT_IN),
            np.intp(context + _DATA_AT),
            np.int32(_DATA),
            np.intp(context + _TRANSFERRED_AT),
            np.uint32(_TIMEOUT_MS),
        )
        if code == ERROR_NO_DEVICE:
            falcon.lost = 1
            return 0
        if code not in (SUCCESS, ERROR_TIMEOUT):
            falcon.read_errors += 1
            break
        kept = strip(falcon.data, falcon.transferred, falcon.data)
        packets += feed(falcon.parser, falcon.data, kept, falcon.status)
        if kept > 0 and falcon.parser.held > 0:
            falcon.cut_short += 1
        if packets > 0:
            break
    falcon.replies += packets
    return packets


@kernel
def _locate(falcon: Any) -> bool:
    """Find the grip; return whether it is anywhere a Falcon's grip can be."""
    angles(falcon.mechanism, falcon.status.encoders, falcon.seen_rad)
    if forward(falcon.mechanism, falcon.seen_rad, falcon.position_m) != REACHED:
        return False
    for i in range(3):
        falcon.theta[i] = falcon.seen_rad[i]
    return True


@kernel
def _open_gate(falcon: Any, elapsed_s: float) -> None:
    falcon.beyond = falcon.beyond + 1 if falcon.position_m[2] > OUT_STROKE_M else 0
    if falcon.beyond >= _BEYOND:
        falcon.pulled_out = 1
    if falcon.pulled_out != 0:
        falcon.share = min(falcon.share + elapsed_s / RAMP_S, 1.0)


@kernel
def _send(falcon: Any, context: int) -> bool:
    """Send ``packet``; return whether all of it went out, so that the motors know it."""
    falcon.transferred = 0
    code = _transfer(
        falcon.transfer,
        falcon.handle,
        np.uint8(ENDPOINT_OUT),
        np.intp(context + _PACKET_AT),
        np.int32(PACKET),
        np.intp(context + _TRANSFERRED_AT),
        np.uint32(_TIMEOUT_MS),
    )
    sent: bool = code in (SUCCESS, ERROR_TIMEOUT) and falcon.transferred == PACKET
    if code == ERROR_NO_DEVICE:
        falcon.lost = 1
    elif not sent:
        falcon.write_errors += 1
    else:
        falcon.requests += 1
        falcon.asked += 1
    return sent
