"""The running program of the emulated Falcon: packets in, torques out, and a handle moved by motors and hand.

Assumed, because not published: mass, friction and hand (those of the scripted device), the places of the arms' indices,
the response time, that a torque persists until the next packet, and that one beyond the range is clipped.
"""

import math
from typing import Any, Final

import numpy as np

from study_app.devices.falcon.emulator.arm import count, saturate, stop, strain
from study_app.devices.falcon.emulator.faults import CORRUPT, DELAY, DROP, DUPLICATE, STALL, TRUNCATE, draw, strikes
from study_app.devices.falcon.emulator.ftdi_bridge import answer
from study_app.devices.falcon.wire import constants
from study_app.devices.simulated.hand import REACH, move_hand
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.plant import move, push

STROKE_NOW, STROKE_ASKED = 1, 2

RUN = np.dtype(
    [
        ("heard", np.uint8, (constants.PACKET,)),
        ("held", np.int64),  # bytes of a packet that is coming
        ("packets", np.int64),  # well-formed ones so far
        ("refused", np.int64),  # bytes that belong to none
        ("torque", np.int64, (3,)),  # as last sent [units]
        ("acting", np.float64, (3,)),  # as exerted by the motors
        ("highest", np.int64),  # the greatest torque ever sent
        ("highest_unhomed", np.int64),  # while an arm was not homed
        ("excessive", np.int64),  # packets with a torque beyond the range: faults of a driver
        ("lights", np.int64),  # FLAG_GREEN, FLAG_BLUE, FLAG_RED
        ("homing", np.int64),  # 1 while that flag is set
        ("homed", np.int64),  # bit i: arm i found its index
        ("origin", np.int64, (3,)),  # true count where each encoder shows 0
        ("shown", np.int64, (3,)),  # counts as last sent
        ("before_rad", np.float64, (3,)),  # angles at the packet before
        ("stalled_ns", np.int64),  # receives nothing until
        ("stroke", np.int64),  # of homing, by an emulated hand with no other orders: STROKES[stroke - 1]
        ("stroke_due", np.int64),  # STROKE_NOW, STROKE_ASKED: when lights or arms ask for it, or 0: not
    ],
    align=True,
)

INDEX_RAD: Final = 0.0  # arms are at their index here: further in than any place in use
ANSWER_NS: Final = 20_000  # from the end of a packet to the start of its reply

STROKES_M: Final = (0.047, -0.045, 0.047, 0.0)  # along z: out, in, out, and to the middle
_STROKE_NS: Final = 500_000_000
_STEP_NS: Final = 2_000_000  # longest step with the same force
LONGEST_NS: Final = 50_000_000  # longest motion computed after a time without access
_NIBBLES: Final = 4


@kernel
def work(e: Any, value: int, divisor: int, at_ns: int) -> None:
    """Receive a byte of a packet that came at ``at_ns``, over the line at this speed."""
    run = e.run
    if divisor != constants.BAUD_1500000 or at_ns < run.stalled_ns:
        run.held = 0
        return
    run.heard[run.held] = value
    run.held += 1
    while run.held > 0 and run.heard[0] != constants.START:
        _skip(run)
    if run.held < constants.PACKET:
        return
    if not _well_formed(run.heard):
        _skip(run)
        while run.held > 0 and run.heard[0] != constants.START:
            _skip(run)
        return
    run.held = 0
    if strikes(e.faults, STALL):
        run.stalled_ns = at_ns + e.faults.stall_ns
        return
    _obey(e, at_ns)
    _reply(e, at_ns)


@kernel
def _skip(run: Any) -> None:
    run.refused += 1
    run.held -= 1
    for k in range(run.held):
        run.heard[k] = run.heard[k + 1]


@kernel
def _well_formed(heard: Any) -> bool:
    if heard[constants.PACKET - 1] != constants.STOP:
        return False
    wrong = 0
    for k in range(1, constants.PACKET - 2):
        if not constants.ZERO <= heard[k] < constants.ZERO + 16:
            wrong += 1
    return wrong == 0


@kernel
def _obey(e: Any, at_ns: int) -> None:
    """Advance to the arrival of the packet, then execute it."""
    run = e.run
    live(e, at_ns, LONGEST_NS)
    flags = int(run.heard[13]) - constants.ZERO
    run.lights = flags & (constants.FLAG_GREEN | constants.FLAG_BLUE | constants.FLAG_RED)
    homing = flags & constants.FLAG_HOMING
    if homing and not run.homing:
        run.stroke_due = STROKE_NOW
    if run.homing and not homing:
        run.homed = 0
        if e.faults.forgets:
            for arm in range(3):
                run.origin[arm] = count(e.arms, arm)
    run.homing = homing
    excessive = 0
    for arm in range(3):
        torque = 0
        for k in range(_NIBBLES):
            torque |= (int(run.heard[1 + _NIBBLES * arm + k]) - constants.ZERO) << (4 * k)
        if torque >= 0x8000:
            torque -= 0x10000
        run.torque[arm] = torque
        run.acting[arm] = min(max(torque, -constants.MOST_TORQUE), constants.MOST_TORQUE)
        run.highest = max(run.highest, abs(torque))
        if run.homed != 0b111:
            run.highest_unhomed = max(run.highest_unhomed, abs(torque))
        if abs(torque) > constants.MOST_TORQUE:
            excessive = 1
    run.excessive += excessive
    run.packets += 1
    _find_indices(e)


@kernel
def _find_indices(e: Any) -> None:
    """Set an arm's true zero when it passes its index, while homing is on."""
    run = e.run
    for arm in range(3):
        before, now = run.before_rad[arm] - INDEX_RAD, e.arms.angle_rad[arm] - INDEX_RAD
        run.before_rad[arm] = e.arms.angle_rad[arm]
        if run.homing and before * now <= 0.0 and before != now and not (e.faults.never_homes or e.faults.frozen):
            run.homed |= 1 << arm
            run.origin[arm] = 0


@kernel
def _reply(e: Any, at_ns: int) -> None:
    run, faults = e.run, e.faults
    if not faults.frozen:
        for arm in range(3):
            run.shown[arm] = count(e.arms, arm) - run.origin[arm]
    if strikes(faults, DROP):
        return
    length = constants.PACKET - 2 if strikes(faults, TRUNCATE) else constants.PACKET
    wrong = int(draw(faults) * length) if strikes(faults, CORRUPT) else -1
    since_ns = at_ns + ANSWER_NS
    if strikes(faults, DELAY):
        since_ns += faults.delay_ns
    times = 2 if strikes(faults, DUPLICATE) else 1
    for _ in range(times):
        for k in range(length):
            value = _byte_of_reply(e, k)
            if k == wrong:
                value ^= 1 + int(draw(faults) * 255)
            answer(e.bridge, value, since_ns, constants.BAUD_1500000)


@kernel
def _byte_of_reply(e: Any, k: int) -> int:
    if k == 0:
        return constants.START
    if k == constants.PACKET - 1:
        return constants.STOP
    if k == constants.PACKET - 2:
        return constants.ZERO
    if k == constants.PACKET - 3:
        return int(constants.ZERO + (e.buttons & 0xF) + (e.run.homed << constants.HOMED_SHIFT))
    arm, nibble = (k - 1) // _NIBBLES, (k - 1) % _NIBBLES
    return int(constants.ZERO + ((e.run.shown[arm] >> (4 * nibble)) & 0xF))


@kernel
def live(e: Any, now_ns: int, longest_ns: int) -> None:
    """Let hand and handle move up to ``now_ns``, but for no longer than ``longest_ns``."""
    elapsed_ns = min(now_ns - e.moved_ns, longest_ns)
    if elapsed_ns <= 0:
        return
    steps = (elapsed_ns + _STEP_NS - 1) // _STEP_NS
    step_s = elapsed_ns * 1e-9 / steps
    for k in range(steps):
        then_ns = now_ns - elapsed_ns + elapsed_ns * (k + 1) // steps
        _stroke(e, then_ns)
        move_hand(e.hand, then_ns, step_s)
        _load(e)
        move(e.handle, e.hand.was_m, e.hand.place_m, step_s)
        stop(e.arms, e.handle)
    e.moved_ns = now_ns


@kernel
def _load(e: Any) -> None:
    """Apply the force of the motors and of the load to the handle."""
    if e.run.acting[0] == 0.0 and e.run.acting[1] == 0.0 and e.run.acting[2] == 0.0:
        push(e.handle, 0.0, -e.weight_n, 0.0)
        return
    strain(e.arms, e.run.acting, e.handle.position_m)
    saturate(e.arms)
    force = e.arms.force_n
    if math.isfinite(force[0] + force[1] + force[2]):
        push(e.handle, force[0], force[1] - e.weight_n, force[2])


@kernel
def _stroke(e: Any, now_ns: int) -> None:
    """Pull out, push in, pull out and go to the middle, if homing needs it and no other command is active.

    Repeat it, like a person, whenever an arm is not homed or the blue light requests a pull.
    """
    run, hand = e.run, e.hand
    if hand.serial != hand.taken:
        if run.stroke > 0:
            run.stroke = 0
            run.stroke_due = 0
        return
    if hand.moving:
        return
    if run.stroke == 0:
        asked = run.homed != 0b111 or run.lights & constants.FLAG_BLUE
        if not run.homing or run.stroke_due == 0 or (run.stroke_due == STROKE_ASKED and not asked):
            return
    if run.stroke == len(STROKES_M):
        run.stroke = 0
        run.stroke_due = STROKE_ASKED
        return
    run.stroke += 1
    hand.order.kind = REACH
    hand.order.target_m[0] = 0.0
    hand.order.target_m[1] = 0.0
    hand.order.target_m[2] = STROKES_M[run.stroke - 1]
    hand.order.duration_ns = _STROKE_NS
    hand.began_ns = now_ns
    for i in range(3):
        hand.began_m[i] = hand.aim_m[i]
    hand.row = 0
    hand.moving = 1
