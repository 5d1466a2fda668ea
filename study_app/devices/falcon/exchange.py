"""The Falcon's compiled tick: read the reply to the last packet, return the grip's position, send the next torques.

The servo limits the change of its force, except when its passivity controller reduces force or adds damping. So does
the driver: after packets that were not sent, or for a caller without such a limit, a force grows by at most the servo's
slew limit per tick; reductions, and forces that take energy from the moving grip, pass at once.

The device answers each packet with one, so `_read` collects the reply to the last tick's packet, and `_write` sends the
force as soon as it is known; a position is one tick old. Of several replies the newest counts; without one there is no
new position, and none is returned twice. Force is enabled after all arms are homed and the grip was pulled out once,
and then fades in over half a second. ``replies`` decides which replies are accepted.
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

_MOST_WAITING_N: Final = 0.5
"""Greatest difference between a force and the motors' present force at which a delay measurement may omit it."""

_SHORTEST_TICK_S: Final = 1e-3
_LONGEST_TICK_S: Final = 4e-3
"""Time that limits the growth of a force in a tick, even if the tick is late."""


@kernel
def set_motor_units(falcon: Any) -> None:
    """Convert ``force_n``, limited by the gate, into motor ``units``.

    ``held_n`` is then the motors' force until the next command at the grip's current position, and ``sent_n`` the force
    after it [N].
    """
    mechanics.jacobian(falcon.mechanism, falcon.theta, falcon.position_m, falcon.rates)
    _motor_force(falcon, falcon.held_n)
    _choose_units(falcon)
    _motor_force(falcon, falcon.sent_n)


@kernel
def can_wait(falcon: Any) -> bool:
    """Return whether the motors may keep their force for a tick: it is close to the requested non-zero force."""
    near: bool = square_distance(falcon.sent_n, falcon.held_n) <= _MOST_WAITING_N * _MOST_WAITING_N
    return near and (square(falcon.sent_n) > 0.0 or square(falcon.held_n) == 0.0)


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
    none = square(falcon.force_n) == 0.0
    if none or falcon.homed == 0 or falcon.unguarded != 0:
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
    most_n = max(falcon.force_limit_n - mechanics.rounding_at(falcon.mechanism, falcon.rates), 0.0)
    if square(falcon.force_n) > most_n * most_n:
        shorter = most_n / math.sqrt(square(falcon.force_n))
        for axis in range(3):
            falcon.force_n[axis] *= shorter


@kernel
def limit_growth(falcon: Any) -> None:
    """Limit the part of the force that is new and does not brake the grip to the servo's slew limit.

    The new part is the difference from the nearest fraction (0 to 1) of the previous force, so that a reversing force
    drops at once and grows in steps. A grip slower than ``SURE_MPS`` may be encoder noise, and is not braked.
    """
    held_n, force_n, v_mps = falcon.held_n, falcon.force_n, falcon.velocity_mps
    kept = 0.0
    if square(held_n) > 0.0:
        kept = min(max(dot(force_n, held_n) / square(held_n), 0.0), 1.0)
    braking = 0.0  # [N s/m]
    if square(v_mps) > SURE_MPS * SURE_MPS:
        braking = min((dot(force_n, v_mps) - kept * dot(held_n, v_mps)) / square(v_mps), 0.0)
    square_n2 = 0.0
    for axis in range(3):
        square_n2 += (force_n[axis] - kept * held_n[axis] - braking * v_mps[axis]) ** 2
    asked_n2 = square(force_n)
    most_n = falcon.slew_n_per_s * min(max(falcon.tick_s, _SHORTEST_TICK_S), _LONGEST_TICK_S)
    if square_n2 > most_n * most_n:
        share = most_n / math.sqrt(square_n2)
        for axis in range(3):
            given_n = kept * held_n[axis] + braking * v_mps[axis]
            force_n[axis] = given_n + share * (force_n[axis] - given_n)
        shorter = math.sqrt(min(asked_n2 / max(square(force_n), asked_n2), 1.0))
        for axis in range(3):  # the previous force may be greater, or the braking part may have another direction
            force_n[axis] *= shorter


FORCE_LIMIT_N: Final = 8.0
LEAST_MASS_KG: Final = 0.1
"""The least effective mass at the grip in any direction [kg], about that of arms and platform of this size. Nobody
published a measured value; the limits of the loop are held for 30 to 250 g."""
_RAMP_S: Final = 0.5
_SMOOTHING_S: Final = 2e-3
"""Time constant of the grip's velocity, which separates a braking force from a driving one."""
BRIDGE_LOST: Final = FIRST_CAUSE
_LONGEST_GAP_NS: Final = 20_000_000
"""Greatest waiting time of a reply before the loop reads it: older ones are not used."""
_BEYOND = 2  # consecutive positions that show an out-stroke, since a single one may come from a corrupted packet
_READS = 2  # most reads of the bridge per tick: an answer may contain only status bytes
_TIMEOUT_MS = 1
_NORM_SLACK = 1.001
_DATA = 4 * constants.USB_PACKET

_FALCON = np.dtype(
    [
        *COMMON,  # the force sent: at the grip's place at the last command
        ("handle", np.intp),  # of the bridge, and
        ("transfer", np.intp),  # address of its function (``bulk.BULK``)
        ("mechanism", mechanics.MECHANISM),
        ("centre_m", np.float64),  # z of the hand's origin in the Falcon's frame
        ("started", np.int64),  # 1 after the first tick
        # the stream
        ("data", np.uint8, (_DATA,)),
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


def _offset(field: str) -> int:
    fields = _FALCON.fields
    assert fields is not None  # noqa: S101 - it is a record
    return int(fields[field][1])


_READING_BYTES = READING.itemsize
_DATA_AT, _PACKET_AT, _TRANSFERRED_AT = _offset("data"), _offset("packet"), _offset("transferred")


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
    falcon, asked = _falcon_at(context), command_at(command)
    answer = READ_LOST
    if enter(falcon):
        answer = _send_force(falcon, context, asked.force_n)
        if closed_during_call(falcon):
            finish(falcon, context)
        leave(falcon)
    copy(falcon.sent_n, asked.sent_n)
    return answer


@kernel
def finish(falcon: Any, context: int) -> None:
    """Send zero torque."""
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
    gap = falcon.started == 0 or elapsed_ns <= 0 or elapsed_ns > _LONGEST_GAP_NS
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
    if not (replies.take_status(falcon) and replies.is_plausible(falcon) and _locate(falcon)):
        falcon.refused += 1
        return READ_NOTHING_NEW
    _follow(falcon)
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
    most_n = _NORM_SLACK * falcon.force_limit_n
    if square(force_n) <= most_n * most_n:
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
    waits = falcon.testing > 0 and can_wait(falcon)
    if falcon.testing > 0 and not waits:
        replies.give_up_measurement(falcon)
    replies.pack(falcon.units, _lights(falcon), falcon.packet)
    if waits or not _send(falcon, context):
        falcon.units[0], falcon.units[1], falcon.units[2] = before
        copy(falcon.held_n, falcon.sent_n)


@kernel
def _lights(falcon: Any) -> int:
    """Return the homing flag, which must remain set, and red before homing, blue before the out-stroke, then green."""
    if falcon.homed == 0:
        return constants.FLAG_HOMING | constants.FLAG_RED
    return constants.FLAG_HOMING | (constants.FLAG_BLUE if falcon.pulled_out == 0 else constants.FLAG_GREEN)


@kernel
def _receive(falcon: Any, context: int) -> Any:
    """Read the bridge's bytes; return the number of packets."""
    packets = 0
    for _ in range(_READS):
        falcon.transferred = 0
        code = _transfer(
            falcon.transfer,
            falcon.handle,
            np.uint8(constants.ENDPOINT_IN),
            np.intp(context + _DATA_AT),
            np.int32(_DATA),
            np.intp(context + _TRANSFERRED_AT),
            np.uint32(_TIMEOUT_MS),
        )
        if code == constants.ERROR_NO_DEVICE:
            falcon.ended = BRIDGE_LOST
            return 0
        if code not in (constants.SUCCESS, constants.ERROR_TIMEOUT):
            falcon.read_errors += 1
            break
        kept = replies.strip(falcon.data, falcon.transferred, falcon.data)
        packets += replies.feed(falcon.parser, falcon.data, kept, falcon.status)
        if kept > 0 and falcon.parser.held > 0:
            falcon.cut_short += 1
        if packets > 0:
            break
    falcon.replies += packets
    return packets


@kernel
def _locate(falcon: Any) -> bool:
    """Compute the grip's position; return whether it is possible for a Falcon."""
    mechanics.angles(falcon.mechanism, falcon.status.encoders, falcon.seen_rad)
    if mechanics.forward(falcon.mechanism, falcon.seen_rad, falcon.position_m) != mechanics.REACHED:
        return False
    for i in range(3):
        falcon.theta[i] = falcon.seen_rad[i]
    return True


@kernel
def _follow(falcon: Any) -> None:
    interval_s = (falcon.now_ns - falcon.posed_ns) * 1e-9
    known, weight = falcon.posed_ns != 0, interval_s / (interval_s + _SMOOTHING_S)
    for axis in range(3):
        moved_mps = (falcon.position_m[axis] - falcon.previous_m[axis]) / interval_s
        falcon.velocity_mps[axis] += weight * (moved_mps - falcon.velocity_mps[axis])
        if not known:
            falcon.velocity_mps[axis] = 0.0
        falcon.previous_m[axis] = falcon.position_m[axis]
    falcon.posed_ns = falcon.now_ns


@kernel
def _open_gate(falcon: Any, elapsed_s: float) -> None:
    falcon.beyond = falcon.beyond + 1 if falcon.position_m[2] > mechanics.OUT_STROKE_M else 0
    if falcon.beyond >= _BEYOND:
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
