"""The Falcon's compiled tick: read the reply to the last packet, return the grip's position, send the next torques.

The servo limits the change of its force, except when its passivity controller reduces the force or adds damping. The
driver does the same, for the case that packets were not sent or that the caller has no such limit: a force grows by at
most the servo's slew limit per tick. Reductions, and forces that take energy from the moving grip, pass at once.

The device answers each packet with one packet, so `_read` collects the reply to the packet of the last tick, and
`_write` sends the force as soon as it is known; a position is therefore one tick old. If there are several replies, the
newest is used; if there is none, there is no new position, and no position is returned twice. The force is enabled once
all arms are homed and the grip was pulled out, and then fades in over half a second. ``replies`` decides which replies
are accepted.
"""

import math
from functools import cache
from typing import Any, Final

import numpy as np

from study_app.devices.driver import COMMON, FIRST_CAUSE, RUNS, closed_during_call, enter, leave
from study_app.devices.falcon import constants, mechanics, replies
from study_app.devices.falcon.bulk import BULK, BulkCalls
from study_app.haptics.kernels import (
    READ_LOST,
    READ_NEW,
    READ_NOTHING_NEW,
    SURE_MPS,
    call_at,
    clear,
    command_at,
    copy,
    device_functions,
    dot,
    kernel,
    reading_at,
    record_at,
    square,
    square_distance,
)
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.layout import READING, records
from study_app.haptics.model.slope_limits import SLEW_S, slew_limit_n

_MAX_WAITING_N: Final = 0.5
"""Greatest difference between a force and the motors' current force with which it need not be sent at once."""

_MIN_TICK_S: Final = 1e-3
_MAX_TICK_S: Final = 4e-3
"""Limits of the tick duration that is used for the growth of a force, however late the tick is."""


@kernel
def set_motor_units(falcon: Any) -> None:
    """Convert ``force_n``, limited by the gate, into motor ``units``.

    Afterwards ``held_n`` is the force of the previous units at the grip's current position, and ``sent_n`` that of the
    new units [N].
    """
    mechanics.jacobian(falcon.mechanism, falcon.theta, falcon.position_m, falcon.rates)
    _motor_force(falcon, falcon.held_n)
    _choose_units(falcon)
    _motor_force(falcon, falcon.sent_n)


@kernel
def can_keep_force(falcon: Any) -> bool:
    """Return whether the motors may keep their force for a tick, since it is close to the requested non-zero force."""
    is_close: bool = square_distance(falcon.sent_n, falcon.held_n) <= _MAX_WAITING_N * _MAX_WAITING_N
    return is_close and (square(falcon.sent_n) > 0.0 or square(falcon.held_n) == 0.0)


@kernel
def _motor_force(falcon: Any, force_n: Any) -> None:
    """Write the force of ``units`` at the grip into ``force_n`` (3,) [N]: ``F = J^T tau``; 0 if they are 0."""
    units = falcon.units
    for axis in range(3):
        force_n[axis] = 0.0
        for i in range(3):
            if units[i] != 0:
                force_n[axis] -= units[i] / falcon.mechanism.units_per_nm * falcon.rates[i, axis]


@kernel
def _choose_units(falcon: Any) -> None:
    for axis in range(3):
        falcon.force_n[axis] *= falcon.share
    is_zero = square(falcon.force_n) == 0.0
    if is_zero or falcon.homed == 0 or falcon.unguarded != 0:
        for i in range(3):
            falcon.units[i] = 0
        return
    limit_growth(falcon)
    _limit_to_rounding(falcon)
    mechanics.torques(falcon.rates, falcon.force_n, falcon.torque_nm)
    falcon.shortened += mechanics.motor_units(falcon.mechanism, falcon.torque_nm, falcon.units)


@kernel
def _limit_to_rounding(falcon: Any) -> None:
    """Keep ``force_n`` below the limit by the rounding error, which grows toward the edge of the reach."""
    max_n = max(falcon.force_limit_n - mechanics.rounding_at(falcon.mechanism, falcon.rates), 0.0)
    if square(falcon.force_n) > max_n * max_n:
        factor = max_n / math.sqrt(square(falcon.force_n))
        for axis in range(3):
            falcon.force_n[axis] *= factor


@kernel
def limit_growth(falcon: Any) -> None:
    """Limit the part of the force that is new and does not brake the grip to the servo's slew limit.

    The new part is the difference from the nearest fraction (0 to 1) of the previous force, so that a reversing force
    drops at once and grows in steps. A grip slower than ``SURE_MPS`` may be encoder noise, and is not braked.
    """
    held_n, force_n, v_mps = falcon.held_n, falcon.force_n, falcon.velocity_mps
    kept_share = 0.0
    if square(held_n) > 0.0:
        kept_share = min(max(dot(force_n, held_n) / square(held_n), 0.0), 1.0)
    braking = 0.0  # [N s/m]
    if square(v_mps) > SURE_MPS * SURE_MPS:
        braking = min((dot(force_n, v_mps) - kept_share * dot(held_n, v_mps)) / square(v_mps), 0.0)
    new_n2 = 0.0
    for axis in range(3):
        new_n2 += (force_n[axis] - kept_share * held_n[axis] - braking * v_mps[axis]) ** 2
    requested_n2 = square(force_n)
    max_step_n = falcon.slew_n_per_s * min(max(falcon.tick_s, _MIN_TICK_S), _MAX_TICK_S)
    if new_n2 > max_step_n * max_step_n:
        new_share = max_step_n / math.sqrt(new_n2)
        for axis in range(3):
            base_n = kept_share * held_n[axis] + braking * v_mps[axis]
            force_n[axis] = base_n + new_share * (force_n[axis] - base_n)
        shrink = math.sqrt(min(requested_n2 / max(square(force_n), requested_n2), 1.0))
        for axis in range(3):  # the previous force may be greater, or the braking part may have another direction
            force_n[axis] *= shrink


FORCE_LIMIT_N: Final = 8.0
LEAST_MASS_KG: Final = 0.1
"""The least effective mass at the grip in any direction [kg], about that of arms and platform of this size. No
measured value is published; the loop stays within its limits for 30 to 250 g."""
_RAMP_S: Final = 0.5
_SMOOTHING_S: Final = 2e-3
"""Time constant of the grip's velocity, which distinguishes a braking force from a driving one."""
BRIDGE_LOST: Final = FIRST_CAUSE
_MAX_GAP_NS: Final = 20_000_000
"""Longest time between two ticks; after a longer one the waiting replies are too old to be used."""
_OUT_STROKE_POSITIONS = 2  # consecutive positions that prove it, since a single packet may be corrupted
_MAX_READS = 2  # greatest number of reads per tick: a read may return only status bytes
_TIMEOUT_MS = 1
_NORM_SLACK = 1.001
_DATA_BYTES = 4 * constants.USB_PACKET

_FALCON = np.dtype(
    [
        *COMMON,  # sent_n: the force at the grip's position at the last command
        ("handle", np.intp),  # of the bridge, and
        ("transfer", np.intp),  # address of its function (``bulk.BULK``)
        ("mechanism", mechanics.MECHANISM),
        ("centre_m", np.float64),  # z of the hand's origin in the Falcon's frame
        ("started", np.int64),  # 1 after the first tick
        # the stream
        ("data", np.uint8, (_DATA_BYTES,)),
        ("packet", np.uint8, (constants.PACKET,)),
        ("transferred", np.int32),
        ("parser", replies.PARSER),
        ("status", replies.STATUS),
        # the pose, in the Falcon's frame
        ("seen_rad", np.float64, (3,)),  # from the last encoder counts
        ("theta", np.float64, (3,)),  # of the last pose
        ("position_m", np.float64, (3,)),
        ("rates", np.float64, (3, 3)),
        ("posed_ns", np.int64),  # time of the last pose; 0: none since the stream was reset
        ("previous_m", np.float64, (3,)),  # the pose before
        ("velocity_mps", np.float64, (3,)),
        ("tick_s", np.float64),  # duration of the last one
        ("slew_n_per_s", np.float64),  # growth rate of a force that does not brake the grip
        ("force_n", np.float64, (3,)),  # as it passed the gate
        ("held_n", np.float64, (3,)),  # force of the motors by the command before
        ("torque_nm", np.float64, (3,)),
        ("units", np.int64, (3,)),  # the last torque command
        # the motion of the arms, to detect corrupted encoder counts
        ("tracked", np.int64),  # 1 once encoder counts were accepted
        ("apart", np.int64),  # ticks since then
        ("counts", np.int64, (3,)),  # as last accepted
        ("pace", np.float64, (3,)),  # counts a tick
        ("doubted", np.int64, (3,)),  # as last rejected,
        ("doubted_at", np.int64),  # ticks since the last accepted ones
        ("doubts", np.int64),  # in a row
        # the gate
        ("homed", np.int64),  # 1 while all arms are
        ("unhomed", np.int64),  # packets in a row that report otherwise
        ("beyond", np.int64),  # positions in a row at the end of the out-stroke
        ("pulled_out", np.int64),  # 1 after it
        ("share", np.float64),  # of the force that passes
        ("buttons", np.int64),  # as in two packets in a row
        ("seen_buttons", np.int64),  # as in the last one
        # replies owed
        ("asked", np.int64),  # packets sent since the last read
        ("owed", np.int64),  # missing replies so far
        ("delay", np.int64),  # reads after which a packet's reply comes, as measured
        ("measured", np.int64),  # result of a measurement that awaits confirmation
        ("testing", np.int64),  # packets omitted so far to measure it; 0: no measurement
        ("astray", np.int64),  # reads in a row with more or fewer replies owed than the delay explains
        ("unsure", np.int64),  # 1: the delay has to be measured
        ("retest", np.int64),  # ticks until it may be
        # counters
        ("missing", np.int64),  # ticks without a reply
        ("late", np.int64),  # ticks whose reply was too old, or may have been
        ("refused", np.int64),  # ticks whose reply was not a pose of a homed Falcon, or is in doubt
        ("requests", np.int64),  # packets sent
        ("replies", np.int64),  # packets received
        ("written_off", np.int64),  # replies that were given up
        ("surplus", np.int64),  # replies that were no longer expected
        ("cut_short", np.int64),  # reads that ended within a packet
        ("read_errors", np.int64),
        ("write_errors", np.int64),
        ("shortened", np.int64),  # forces that exceeded the motors' range
    ],
    align=True,
)

COUNTERS: Final = (
    "ticks",
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

_falcon_at = record_at(_FALCON)
_transfer = call_at(BULK)


def _field_offset(field: str) -> int:
    fields = _FALCON.fields
    assert fields is not None  # noqa: S101 - it is a record
    return int(fields[field][1])


_READING_BYTES = READING.itemsize
_DATA_AT, _PACKET_AT, _TRANSFERRED_AT = _field_offset("data"), _field_offset("packet"), _field_offset("transferred")


def new_exchange(
    calls: BulkCalls, mechanism: Any, geometry: mechanics.Geometry, force_limit_n: float = FORCE_LIMIT_N
) -> Any:
    """Return the memory of an exchange over an open bridge, shape (1,): its address is the device's ``context``."""
    memory = records(_FALCON, 1)
    falcon = memory[0]
    falcon.handle, falcon.transfer = calls.handle, calls.transfer
    falcon.mechanism = mechanism
    falcon.centre_m = geometry.centre_m
    falcon.position_m = mechanics.START_M
    falcon.delay = 1
    falcon.force_limit_n = force_limit_n
    falcon.slew_n_per_s = slew_limit_n(SLEW_S, Dynamics(mass_kg=LEAST_MASS_KG)) / SLEW_S
    return memory


@cache
def exchange_functions() -> tuple[Any, Any]:
    """Compile read and write, once for all Falcons."""
    return device_functions(_read, _write)


def _read(context: int, now_ns: int, reading: int) -> int:
    falcon = _falcon_at(context)
    answer = READ_LOST
    if enter(falcon):
        answer = _take_reply(falcon, context, now_ns, reading_at(reading))
        if closed_during_call(falcon):
            finish(falcon, context)
        leave(falcon)
    return answer


def _write(context: int, command: int) -> int:
    falcon, record = _falcon_at(context), command_at(command)
    answer = READ_LOST
    if enter(falcon):
        answer = _send_force(falcon, context, record.force_n)
        if closed_during_call(falcon):
            finish(falcon, context)
        leave(falcon)
    copy(falcon.sent_n, record.sent_n)
    return answer


@kernel
def finish(falcon: Any, context: int) -> None:
    """End the exchange with zero torque."""
    clear(falcon.force_n)
    _send_packet(falcon, context)


@kernel
def _take_reply(falcon: Any, context: int, now_ns: int, out: Any) -> int:
    """Receive the Falcon's replies; write a new position into the reading ``out``."""
    elapsed_ns = now_ns - falcon.now_ns
    falcon.now_ns = now_ns
    falcon.tick_s = elapsed_ns * 1e-9
    falcon.ticks += 1
    falcon.apart += 1
    packets = _receive(falcon, context)
    if falcon.ended != RUNS or falcon.unguarded != 0:
        return READ_LOST
    gap = falcon.started == 0 or elapsed_ns <= 0 or elapsed_ns > _MAX_GAP_NS
    falcon.started = 1
    if gap:
        falcon.posed_ns = 0
    punctual = replies.update_delay(falcon, packets, gap)
    if packets == 0:
        falcon.missing += 1
        return READ_NOTHING_NEW
    if not punctual:
        falcon.late += 1
        return READ_NOTHING_NEW
    if not (replies.take_status(falcon) and replies.is_plausible(falcon) and _update_position(falcon)):
        falcon.refused += 1
        return READ_NOTHING_NEW
    _update_velocity(falcon)
    _open_gate(falcon, elapsed_ns * 1e-9)
    for axis in range(3):
        out.position_m[axis] = falcon.position_m[axis]
    out.position_m[2] -= falcon.centre_m
    out.buttons = falcon.buttons
    if out.size_bytes >= _READING_BYTES:
        out.delay_ticks = falcon.delay
    falcon.fresh += 1
    falcon.fresh_ns = now_ns
    return READ_NEW


@kernel
def _send_force(falcon: Any, context: int, force_n: Any) -> int:
    max_n = _NORM_SLACK * falcon.force_limit_n
    if square(force_n) <= max_n * max_n:
        copy(force_n, falcon.force_n)
    else:  # nor NaN: the servo sends neither
        clear(falcon.force_n)
    _send_packet(falcon, context)
    return READ_LOST if falcon.ended != RUNS else 0


@kernel
def _send_packet(falcon: Any, context: int) -> None:
    """Send ``force_n`` or, to measure the delay, keep the motors' force; ``sent_n`` is the force actually sent."""
    before = falcon.units[0], falcon.units[1], falcon.units[2]
    set_motor_units(falcon)
    keep_force = falcon.testing > 0 and can_keep_force(falcon)
    if falcon.testing > 0 and not keep_force:
        replies.give_up_measurement(falcon)
    replies.pack(falcon.units, _light_flags(falcon), falcon.packet)
    if keep_force or not _send(falcon, context):
        falcon.units[0], falcon.units[1], falcon.units[2] = before
        copy(falcon.held_n, falcon.sent_n)


@kernel
def _light_flags(falcon: Any) -> int:
    """Return the homing flag, which must remain set, and red before homing, blue before the out-stroke, then green."""
    if falcon.homed == 0:
        return constants.FLAG_HOMING | constants.FLAG_RED
    return constants.FLAG_HOMING | (constants.FLAG_BLUE if falcon.pulled_out == 0 else constants.FLAG_GREEN)


@kernel
def _receive(falcon: Any, context: int) -> Any:
    """Read the bridge's bytes; return the number of packets."""
    packets = 0
    for _ in range(_MAX_READS):
        falcon.transferred = 0
        code = _transfer(
            falcon.transfer,
            falcon.handle,
            np.uint8(constants.ENDPOINT_IN),
            np.intp(context + _DATA_AT),
            np.int32(_DATA_BYTES),
            np.intp(context + _TRANSFERRED_AT),
            np.uint32(_TIMEOUT_MS),
        )
        if code == constants.ERROR_NO_DEVICE:
            falcon.ended = BRIDGE_LOST
            return 0
        if code not in (constants.SUCCESS, constants.ERROR_TIMEOUT):
            falcon.read_errors += 1
            break
        length = replies.strip(falcon.data, falcon.transferred, falcon.data)
        packets += replies.feed(falcon.parser, falcon.data, length, falcon.status)
        if length > 0 and falcon.parser.held > 0:
            falcon.cut_short += 1
        if packets > 0:
            break
    falcon.replies += packets
    return packets


@kernel
def _update_position(falcon: Any) -> bool:
    """Compute the grip's position; return whether it is possible for a Falcon."""
    mechanics.angles(falcon.mechanism, falcon.status.encoders, falcon.seen_rad)
    if mechanics.forward(falcon.mechanism, falcon.seen_rad, falcon.position_m) != mechanics.REACHED:
        return False
    for i in range(3):
        falcon.theta[i] = falcon.seen_rad[i]
    return True


@kernel
def _update_velocity(falcon: Any) -> None:
    interval_s = (falcon.now_ns - falcon.posed_ns) * 1e-9
    is_tracked, weight = falcon.posed_ns != 0, interval_s / (interval_s + _SMOOTHING_S)
    for axis in range(3):
        moved_mps = (falcon.position_m[axis] - falcon.previous_m[axis]) / interval_s
        falcon.velocity_mps[axis] += weight * (moved_mps - falcon.velocity_mps[axis])
        if not is_tracked:
            falcon.velocity_mps[axis] = 0.0
        falcon.previous_m[axis] = falcon.position_m[axis]
    falcon.posed_ns = falcon.now_ns


@kernel
def _open_gate(falcon: Any, elapsed_s: float) -> None:
    falcon.beyond = falcon.beyond + 1 if falcon.position_m[2] > mechanics.OUT_STROKE_M else 0
    if falcon.beyond >= _OUT_STROKE_POSITIONS:
        falcon.pulled_out = 1
    if falcon.pulled_out != 0:
        falcon.share = min(falcon.share + elapsed_s / _RAMP_S, 1.0)


@kernel
def _send(falcon: Any, context: int) -> bool:
    falcon.transferred = 0
    code = _transfer(
        falcon.transfer,
        falcon.handle,
        np.uint8(constants.ENDPOINT_OUT),
        np.intp(context + _PACKET_AT),
        np.int32(constants.PACKET),
        np.intp(context + _TRANSFERRED_AT),
        np.uint32(_TIMEOUT_MS),
    )
    sent: bool = code in (constants.SUCCESS, constants.ERROR_TIMEOUT) and falcon.transferred == constants.PACKET
    if code == constants.ERROR_NO_DEVICE:
        falcon.ended = BRIDGE_LOST
    elif not sent:
        falcon.write_errors += 1
    else:
        falcon.requests += 1
        falcon.asked += 1
    return sent
