"""The emulated Falcon's processor: its boot loader, its program, and faults of both.

Without a program it is pinged at 9600 baud, timed by an 'A', and loaded byte by byte. It understands the boot stream of
TI's loader (SPRUI33): little-endian words, the key 0x08AA, eight reserved words, the entry point, then blocks of
(count, destination, words) until a count of 0, after which the program runs. After invalid data it does not answer
until it is pinged again.

The program receives packets, sets torques, and moves a handle by motors and hand. Assumed, because not published: mass,
friction and hand (those of the scripted device), the positions of the arms' indices, the response time, that a torque
persists until the next packet, and that a torque beyond the range is clipped.
"""

import math
from random import Random
from typing import Any, Final

import numpy as np

from study_app.devices.emulators.falcon_arm import encoder_count, find_force, saturate, stop
from study_app.devices.emulators.falcon_bridge import queue_reply
from study_app.devices.falcon import constants
from study_app.devices.hand import REACH, move_hand
from study_app.errors import DeviceError
from study_app.haptics.kernels import kernel, move, push

_CHANCES: Final = ("drop", "truncate", "corrupt", "duplicate", "delay", "stall", "echo", "glued", "echo_prefix")
"""Faults that occur at random: a reply is lost, cut to 14 bytes, has a wrong byte, is sent twice or late; the device
receives nothing for some time; a byte of firmware is echoed wrongly; extra bytes follow the answer to a ping in the
same USB packet; 'A' is echoed as 13 41."""
DROP, TRUNCATE, CORRUPT, DUPLICATE, DELAY, STALL, ECHO, GLUED, ECHO_PREFIX = range(len(_CHANCES))

_SWITCHES: Final = (
    "unplugged",  # the bridge is disconnected
    "access_denied",  # cannot be opened: no permission
    "not_supported",  # cannot be opened: another driver has it
    "busy",  # cannot be claimed: another program has it
    "kernel_driver",  # cannot be claimed until the kernel's driver is detached,
    "kernel_driver_stays",  # which is not permitted
    "frozen",  # the encoder counts do not change, so homing fails
    "never_homes",  # no arm finds its index
    "forgets",  # the origin of the encoders is lost when the homing flag drops
    "leading_zero",  # a 00 before the answer to a ping
    "status_noise",  # random modem status bytes
)

POWER_OFF: Final = "power-off"
"""The fault of a disconnected mains adapter, handled by the emulator itself."""

FAULTS = np.dtype(
    [
        ("chance", np.float64, (len(_CHANCES),)),  # probability at each opportunity
        ("due", np.int64, (len(_CHANCES),)),  # number of occurrences before chance decides
        ("happened", np.int64, (len(_CHANCES),)),
        ("delay_ns", np.int64),
        ("stall_ns", np.int64),
        ("ignored_pings", np.int64),
        ("state", np.uint64),  # of the generator
        ("was_unplugged", np.int64),  # 1 until the bridge has begun anew
        *((name, np.int64) for name in _SWITCHES),
    ],
    align=True,
)


@kernel
def draw(faults: Any) -> float:
    """Return a number in [0, 1): xorshift64*, Vigna 2016."""
    state = faults.state
    state ^= state >> np.uint64(12)
    state ^= state << np.uint64(25)
    state ^= state >> np.uint64(27)
    faults.state = state
    return float((state * np.uint64(0x2545F4914F6CDD1D)) >> np.uint64(11)) * 2.0**-53


@kernel
def fault_occurs(faults: Any, kind: int) -> bool:
    """Return whether this fault occurs now, at random."""
    if faults.due[kind] > 0:
        faults.due[kind] -= 1
    elif not (faults.chance[kind] > 0.0 and draw(faults) < faults.chance[kind]):
        return False
    faults.happened[kind] += 1
    return True


class Faults:
    """The faults of one emulated Falcon, which may be changed while it runs.

    Those in `_CHANCES` occur at random, those in `_SWITCHES` while they are on.
    """

    def __init__(self, state: Any, random: Random) -> None:
        self._state = state
        state.state = 1 + int(random.random() * 2**52)
        state.delay_ns, state.stall_ns = 3_000_000, 20_000_000

    def chance(self, name: str, chance: float) -> None:
        if not 0.0 <= chance <= 1.0:
            raise DeviceError(f"the probability of the fault '{name}' must be from 0 to 1, not {chance}")
        self._state.chance[_chance_index(name)] = chance

    def schedule(self, name: str, times: int = 1) -> None:
        """Make the fault occur at the next ``times`` opportunities."""
        self._state.due[_chance_index(name)] = times

    def occurrences(self, name: str) -> int:
        """Return how often the fault has occurred."""
        return int(self._state.happened[_chance_index(name)])

    def on(self, name: str, on: bool = True) -> None:
        setattr(self._state, _checked_switch(name), int(on))
        if name == "unplugged" and on:
            self._state.was_unplugged = 1
        if name == "kernel_driver_stays" and on:
            self._state.kernel_driver = 1  # the origin must exist before it is lost

    def off(self, name: str) -> None:
        self.on(name, False)

    def is_on(self, name: str) -> bool:
        return bool(self._state[_checked_switch(name)])

    def set_durations(self, *, delay_s: float | None = None, stall_s: float | None = None) -> None:
        """Set the delay of a late reply and the duration of a stall [s]; a stall of 0 s skips one packet."""
        if delay_s is not None:
            self._state.delay_ns = round(delay_s * 1e9)
        if stall_s is not None:
            self._state.stall_ns = round(stall_s * 1e9)

    def ignore_pings(self, encoder_count: int) -> None:
        """Leave the next ``encoder_count`` pings of the boot loader unanswered."""
        self._state.ignored_pings = encoder_count

    def set_fault(self, fault: str) -> None:
        """Set a fault in the notation of the command line: ``drop=0.01`` or ``frozen``."""
        name, equals_sign, value = fault.partition("=")
        name = name.strip().replace("-", "_")
        if name in _SWITCHES and not equals_sign:
            self.on(name)
            return
        try:
            chance = float(value)
        except ValueError:
            known = ", ".join(
                (*(f"{fault_spelling(known)}=CHANCE" for known in _CHANCES), *map(fault_spelling, _SWITCHES), POWER_OFF)
            )
            raise DeviceError(f"fault '{fault}' is not known; choose from: {known}") from None
        self.chance(name, chance)


def fault_spelling(name: str) -> str:
    """Return a fault's name in the notation of command line and messages."""
    return name.replace("_", "-")


def _chance_index(name: str) -> int:
    if name not in _CHANCES:
        raise DeviceError(
            f"fault '{name}' cannot occur at random; choose one of: {', '.join(map(fault_spelling, _CHANCES))}"
        )
    return _CHANCES.index(name)


def _checked_switch(name: str) -> str:
    if name not in _SWITCHES:
        raise DeviceError(
            f"fault '{name}' cannot be switched on; choose one of: {', '.join(map(fault_spelling, _SWITCHES))}"
        )
    return name


WAITING, RESET, PINGED, LOADING, STUCK, RUNNING = range(6)
"""States: powered; reset by DTR; ping answered; speed known; data invalid; program loaded."""

LOADER = np.dtype(
    [
        ("state", np.int64),
        ("matched", np.int64),  # bytes of a ping received in a row
        ("loaded", np.int64),  # bytes of the stream so far
        ("low", np.int64),  # first byte of an incomplete word
        ("words", np.int64),  # words left of the current block, including its destination; 0: its count comes next
        ("blocks", np.int64),
    ],
    align=True,
)

_HEADER_WORDS: Final = 11  # key, eight reserved, entry point
_PING = tuple(constants.PING)
_PONG = tuple(constants.PONG)
_PONG_NS: Final = 2_000_000
_ECHO_NS: Final = 10_000
_PREFIX: Final = 0x13
_EXTRA_BYTES = (0x00, 0x0D)


@kernel
def reset(loader: Any) -> None:
    """Clear the program."""
    loader.state = RESET
    loader.matched = 0
    loader.loaded = 0
    loader.words = 0
    loader.blocks = 0


@kernel
def receive_boot_byte(loader: Any, bridge: Any, faults: Any, value: int, divisor: int, at_ns: int) -> None:
    """Receive a byte of the boot stream that arrives at ``at_ns`` over the line at this speed."""
    if loader.state == RESET:
        if divisor == constants.BAUD_9600:
            _receive_ping(loader, bridge, faults, value, at_ns)
    elif loader.state == PINGED:
        if divisor == constants.BAUD_9600:
            _receive_ping(loader, bridge, faults, value, at_ns)
        elif divisor == constants.BAUD_142857 and value == constants.AUTOBAUD[0]:
            if fault_occurs(faults, ECHO_PREFIX):
                queue_reply(bridge, _PREFIX, at_ns + _ECHO_NS, divisor)
            queue_reply(bridge, value, at_ns + _ECHO_NS, divisor)
            loader.state = LOADING
    elif loader.state == LOADING:
        if divisor == constants.BAUD_142857:
            echoed = value ^ 0x10 if fault_occurs(faults, ECHO) else value
            queue_reply(bridge, echoed, at_ns + _ECHO_NS, divisor)
            _process_byte(loader, value)
        else:
            loader.state = STUCK


@kernel
def _receive_ping(loader: Any, bridge: Any, faults: Any, value: int, at_ns: int) -> None:
    if value == _PING[loader.matched]:
        loader.matched += 1
    else:
        loader.matched = 1 if value == _PING[0] else 0
    if loader.matched < len(_PING):
        return
    loader.matched = 0
    if faults.ignored_pings > 0:
        faults.ignored_pings -= 1
        return
    if faults.leading_zero:
        queue_reply(bridge, 0, at_ns + _PONG_NS, constants.BAUD_9600)
    for k in range(len(_PONG)):
        queue_reply(bridge, _PONG[k], at_ns + _PONG_NS, constants.BAUD_9600)
    if fault_occurs(faults, GLUED):
        for k in range(len(_EXTRA_BYTES)):
            queue_reply(bridge, _EXTRA_BYTES[k], at_ns + _PONG_NS, constants.BAUD_9600)
    loader.state = PINGED


@kernel
def _process_byte(loader: Any, value: int) -> None:
    """Process a byte of the stream; the last one starts the program."""
    loader.loaded += 1
    if loader.loaded % 2 == 1:
        loader.low = value
        return
    word = value << 8 | loader.low
    index = loader.loaded // 2 - 1
    if index == 0:
        if word != constants.BOOT_KEY:
            loader.state = STUCK
    elif index < _HEADER_WORDS:
        return
    elif loader.words > 0:
        loader.words -= 1
    elif word == 0:
        loader.state = RUNNING
    else:
        loader.blocks += 1
        loader.words = word + 2


STROKE_NOW, STROKE_ASKED = 1, 2

RUN = np.dtype(
    [
        ("heard", np.uint8, (constants.PACKET,)),
        ("held", np.int64),  # bytes of an incomplete packet
        ("packets", np.int64),  # well-formed ones so far
        ("refused", np.int64),  # bytes outside of packets
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
        ("stalled_ns", np.int64),  # time until which nothing is received
        ("stroke", np.int64),  # of the homing motion by a hand without other orders: _STROKES_M[stroke - 1]
        ("stroke_due", np.int64),  # STROKE_NOW; STROKE_ASKED: if lights or arms require it; 0: not at all
    ],
    align=True,
)

_INDEX_RAD: Final = 0.0  # arms are at their index here, further in than any position in use
_ANSWER_NS: Final = 20_000  # from the end of a packet to the start of its reply

_STROKES_M: Final = (0.047, -0.045, 0.047, 0.0)  # along z: out, in, out, and to the middle
_STROKE_DURATION_NS: Final = 500_000_000
_STEP_NS: Final = 2_000_000  # longest step with the same force
LONGEST_NS: Final = 50_000_000  # longest motion that is computed after a time without transfers
_NIBBLES: Final = 4


@kernel
def receive_byte(e: Any, value: int, divisor: int, at_ns: int) -> None:
    """Receive a byte of a packet that arrives at ``at_ns`` over the line at this speed."""
    run = e.run
    if divisor != constants.BAUD_1500000 or at_ns < run.stalled_ns:
        run.held = 0
        return
    run.heard[run.held] = value
    run.held += 1
    while run.held > 0 and run.heard[0] != constants.START:
        _drop_byte(run)
    if run.held < constants.PACKET:
        return
    if not _is_well_formed(run.heard):
        _drop_byte(run)
        while run.held > 0 and run.heard[0] != constants.START:
            _drop_byte(run)
        return
    run.held = 0
    if fault_occurs(e.faults, STALL):
        run.stalled_ns = at_ns + e.faults.stall_ns
        return
    _execute_packet(e, at_ns)
    _reply(e, at_ns)


@kernel
def _drop_byte(run: Any) -> None:
    run.refused += 1
    run.held -= 1
    for k in range(run.held):
        run.heard[k] = run.heard[k + 1]


@kernel
def _is_well_formed(packet: Any) -> bool:
    if packet[constants.PACKET - 1] != constants.STOP:
        return False
    wrong_bytes = 0
    for k in range(1, constants.PACKET - 2):
        if not constants.ZERO <= packet[k] < constants.ZERO + 16:
            wrong_bytes += 1
    return wrong_bytes == 0


@kernel
def _execute_packet(e: Any, at_ns: int) -> None:
    """Advance to the arrival of the packet, then execute it."""
    run = e.run
    move_until(e, at_ns, LONGEST_NS)
    flags = int(run.heard[13]) - constants.ZERO
    run.lights = flags & (constants.FLAG_GREEN | constants.FLAG_BLUE | constants.FLAG_RED)
    homing = flags & constants.FLAG_HOMING
    if homing and not run.homing:
        run.stroke_due = STROKE_NOW
    if run.homing and not homing:
        run.homed = 0
        if e.faults.forgets:
            for arm in range(3):
                run.origin[arm] = encoder_count(e.arms, arm)
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
        before, now = run.before_rad[arm] - _INDEX_RAD, e.arms.angle_rad[arm] - _INDEX_RAD
        run.before_rad[arm] = e.arms.angle_rad[arm]
        if run.homing and before * now <= 0.0 and before != now and not (e.faults.never_homes or e.faults.frozen):
            run.homed |= 1 << arm
            run.origin[arm] = 0


@kernel
def _reply(e: Any, at_ns: int) -> None:
    run, faults = e.run, e.faults
    if not faults.frozen:
        for arm in range(3):
            run.shown[arm] = encoder_count(e.arms, arm) - run.origin[arm]
    if fault_occurs(faults, DROP):
        return
    length = constants.PACKET - 2 if fault_occurs(faults, TRUNCATE) else constants.PACKET
    wrong_index = int(draw(faults) * length) if fault_occurs(faults, CORRUPT) else -1
    since_ns = at_ns + _ANSWER_NS
    if fault_occurs(faults, DELAY):
        since_ns += faults.delay_ns
    times = 2 if fault_occurs(faults, DUPLICATE) else 1
    for _ in range(times):
        for k in range(length):
            value = _byte_of_reply(e, k)
            if k == wrong_index:
                value ^= 1 + int(draw(faults) * 255)
            queue_reply(e.bridge, value, since_ns, constants.BAUD_1500000)


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
def move_until(e: Any, now_ns: int, longest_ns: int) -> None:
    """Move hand and handle until ``now_ns``, but for no longer than ``longest_ns``."""
    elapsed_ns = min(now_ns - e.moved_ns, longest_ns)
    if elapsed_ns <= 0:
        return
    steps = (elapsed_ns + _STEP_NS - 1) // _STEP_NS
    step_s = elapsed_ns * 1e-9 / steps
    for k in range(steps):
        then_ns = now_ns - elapsed_ns + elapsed_ns * (k + 1) // steps
        _advance_homing_stroke(e, then_ns)
        move_hand(e.hand, then_ns, step_s)
        _apply_load(e)
        move(e.handle, e.hand.was_m, e.hand.place_m, step_s)
        stop(e.arms, e.handle)
    e.moved_ns = now_ns


@kernel
def _apply_load(e: Any) -> None:
    """Apply the force of the motors and of the load to the handle."""
    if e.run.acting[0] == 0.0 and e.run.acting[1] == 0.0 and e.run.acting[2] == 0.0:
        push(e.handle, 0.0, -e.weight_n, 0.0)
        return
    find_force(e.arms, e.run.acting, e.handle.position_m)
    saturate(e.arms)
    force = e.arms.force_n
    if math.isfinite(force[0] + force[1] + force[2]):
        push(e.handle, force[0], force[1] - e.weight_n, force[2])


@kernel
def _advance_homing_stroke(e: Any, now_ns: int) -> None:
    """Continue the homing motion of the hand (out, in, out, to the centre) if it is needed and there is no order.

    Like a person, the hand repeats it whenever an arm is not homed or the blue light requests a pull.
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
        needed = run.homed != 0b111 or run.lights & constants.FLAG_BLUE
        if not run.homing or run.stroke_due == 0 or (run.stroke_due == STROKE_ASKED and not needed):
            return
    if run.stroke == len(_STROKES_M):
        run.stroke = 0
        run.stroke_due = STROKE_ASKED
        return
    run.stroke += 1
    hand.order.kind = REACH
    hand.order.target_m[0] = 0.0
    hand.order.target_m[1] = 0.0
    hand.order.target_m[2] = _STROKES_M[run.stroke - 1]
    hand.order.duration_ns = _STROKE_DURATION_NS
    hand.began_ns = now_ns
    for i in range(3):
        hand.began_m[i] = hand.aim_m[i]
    hand.row = 0
    hand.moving = 1
