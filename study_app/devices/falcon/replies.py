"""Packets to and from the Falcon, the delay of its replies, and which of them are plausible.

Packets have sixteen bytes each way: torques and lights out, encoders and buttons in; the stream may lose bytes. A
number is four bytes, a nibble each, the least significant first, with ``ZERO`` added; a packet is ``START``, three such
numbers, a byte of flags or status, a byte of unknown meaning, ``STOP``. There is no checksum, so the parser accepts a
packet only if every byte is permitted at its position, keeps a possible start of the next packet, and returns each
packet once.

A reply cannot be matched to its packet, so after a loss, replies with a constant delay look like punctual ones. The
delay is therefore measured: if for ``_SLOWER_READS`` reads more replies are owed than the delay explains, or fewer for
``_FASTER_READS`` reads, no packet is sent until a read has no reply; the number of these reads is the delay. Replies
that are still owed then are lost. A longer delay is adopted at once, a shorter one after two equal measurements, since
a lost reply has the same effect as a shorter delay. If the force changes too fast for a measurement, the delay is set
to explain the owed replies. Positions with a delay above ``MOST_DELAY`` are not used, nor those read while more than
``_MAX_OWED`` replies are owed beyond the delay.

Without a checksum, a byte corrupted into a permitted one passes the parser. An implausible jump of an arm therefore
needs a second reply that confirms it, and so do buttons, the end of the out-stroke and arms that are no longer homed.
The functions work on the exchange's record (``exchange._FALCON``).
"""

from typing import Any, Final

import numpy as np

from study_app.devices.falcon import constants
from study_app.haptics.kernels import kernel
from study_app.haptics.model.device_dynamics import MOST_DELAY

_NIBBLES = 4
_FLAGS_OFFSET = 13  # flags to the device, status from it; numbers stand at 1, 5 and 9
_UNKNOWN_OFFSET = 14
_STATUS_BITS = 7

PARSER = np.dtype(
    [
        ("tail", np.uint8, (constants.PACKET,)),  # the start of an incomplete packet
        ("held", np.int64),  # its number of bytes
        ("packets", np.int64),  # whole valid packets so far
        ("skipped", np.int64),  # bytes outside of packets so far
    ],
    align=True,
)

STATUS = np.dtype(
    [
        ("encoders", np.int64, (3,)),  # counts of arms 1 to 3
        ("buttons", np.int64),  # bits 0 to 3 of the grip
        ("homed", np.int64),  # bits 0 to 2: arms 1 to 3
        ("count", np.int64),  # number of packets written here so far
    ],
    align=True,
)


@kernel
def put_number(out: Any, offset: int, value: int) -> None:
    """Write ``value``, as 16 bits with sign, into the four bytes of ``out`` from ``offset`` on."""
    for nibble in range(_NIBBLES):
        out[offset + nibble] = constants.ZERO + ((value >> (4 * nibble)) & 0xF)


@kernel
def number(data: Any, offset: int) -> Any:
    """Return the number (-32768 to 32767) in the four bytes of ``data`` from ``offset`` on."""
    value: Any = 0
    for nibble in range(_NIBBLES):
        value += ((np.int64(data[offset + nibble]) - constants.ZERO) & 0xF) << (4 * nibble)
    return value - 0x10000 if value >= 0x8000 else value


@kernel
def pack(torques: Any, flags: int, out: Any) -> None:
    """Write the packet of ``torques`` (3,) and ``flags`` into ``out`` (16,) bytes.

    A torque beyond ``MOST_TORQUE`` is clipped, so that it never overflows into the opposite sign.
    """
    out[0] = constants.START
    for arm in range(3):
        put_number(out, 1 + _NIBBLES * arm, min(max(torques[arm], -constants.MOST_TORQUE), constants.MOST_TORQUE))
    out[_FLAGS_OFFSET] = constants.ZERO + flags
    out[_UNKNOWN_OFFSET] = constants.ZERO
    out[constants.PACKET - 1] = constants.STOP


@kernel
def strip(data: Any, length: int, out: Any) -> int:
    """Copy the first ``length`` bytes of a read without the bridge's status bytes; return how many are left.

    ``out`` may be ``data`` itself.
    """
    length_kept = 0
    for i in range(length):
        if i % constants.USB_PACKET >= constants.STATUS_BYTES:
            out[length_kept] = data[i]
            length_kept += 1
    return length_kept


@kernel
def feed(parser: Any, data: Any, length: int, status: Any) -> Any:
    """Process ``length`` more bytes of the stream; return the number of valid packets that ended in them.

    The newest is written to ``status``, which is unchanged if there is none.

    Parameters
    ----------
    parser : record of ``PARSER``; zeros at the start of a stream
    data : (>= length,) bytes, without the bridge's status bytes
    status : record of ``STATUS``
    """
    before = parser.packets
    for i in range(length):
        _append_byte(parser, data[i])
        if parser.held == constants.PACKET:
            _read_packet(parser.tail, status)
            parser.packets += 1
            parser.held = 0
    return parser.packets - before


@kernel
def _append_byte(parser: Any, byte: Any) -> None:
    """Append ``byte`` to the tail, after dropping the part of the tail that cannot be the start of a packet."""
    while not _fits_packet(parser.held, byte):
        if parser.held == 0:
            parser.skipped += 1
            return
        # Among the bytes of the tail, only the unknown one can be the start of another packet.
        if parser.held > _UNKNOWN_OFFSET and parser.tail[_UNKNOWN_OFFSET] == constants.START:
            parser.skipped += _UNKNOWN_OFFSET
            parser.held = 1
        else:
            parser.skipped += parser.held
            parser.held = 0
    parser.tail[parser.held] = byte
    parser.held += 1


@kernel
def _fits_packet(offset: int, byte: int) -> bool:
    """Return whether ``byte`` can occur at position ``offset`` of a packet."""
    if offset == 0:
        return byte == constants.START
    if offset < _FLAGS_OFFSET:
        return constants.ZERO <= byte < constants.ZERO + 16
    if offset == _FLAGS_OFFSET:
        return constants.ZERO <= byte < constants.ZERO + (1 << _STATUS_BITS)
    return offset == _UNKNOWN_OFFSET or byte == constants.STOP


@kernel
def _read_packet(packet: Any, status: Any) -> None:
    for arm in range(3):
        status.encoders[arm] = number(packet, 1 + _NIBBLES * arm)
    bits = np.int64(packet[_FLAGS_OFFSET]) - constants.ZERO
    status.buttons = bits & 0xF
    status.homed = bits >> constants.HOMED_SHIFT
    status.count += 1


_MAX_OWED: Final = 4
_SLOWER_READS: Final = 8
_FASTER_READS: Final = 200
_GIVEN_UP_READS: Final = 32
_RETEST_TICKS: Final = 30
"""Least number of ticks between two measurements, in which the motors receive a command in every tick."""
ALL_HOMED: Final = 0b111
_UNHOMED_PACKETS: Final = 3
"""Number of packets in a row that must report that an arm is no longer homed: a single one may be corrupted."""

_MAX_DEVIATION: Final = 24.0
"""Greatest plausible deviation of an arm from its predicted motion [counts]: 0.7 to 1.4 mm of the grip per tick."""
_MAX_DOUBTS: Final = 2  # greatest number of rejected replies in a row


@kernel
def update_delay(falcon: Any, packets: int, gap: bool) -> bool:
    """Update the pending replies and the delay; return whether the received reply is recent enough."""
    owed = falcon.owed + falcon.asked - packets
    falcon.asked = 0
    falcon.surplus += max(-owed, 0)
    falcon.owed = max(owed, 0)
    falcon.retest = max(falcon.retest - 1, 0)
    if owed < 0:
        falcon.unsure = 1
    if gap:
        falcon.testing = 0
        _write_off(falcon)
        falcon.tracked = 0
        return False
    if falcon.testing > 0:
        _measure_delay(falcon, packets)
    elif packets > 0:  # a missing reply says nothing about the pending ones
        _check_for_change(falcon)
    return bool(falcon.delay <= MOST_DELAY and _has_few_owed(falcon))


@kernel
def _check_for_change(falcon: Any) -> None:
    """Begin a measurement if more (or, for a long time, fewer) replies are pending than the delay explains."""
    is_slower, is_faster = falcon.owed > falcon.delay - 1, falcon.owed < falcon.delay - 1
    falcon.astray = falcon.astray + 1 if is_slower or is_faster else max(falcon.astray - 1, 0)
    is_due = (
        falcon.unsure != 0
        or falcon.delay > MOST_DELAY
        or falcon.astray >= (_SLOWER_READS if is_slower else _FASTER_READS)
    )
    if (is_due and falcon.retest == 0) or (not _has_few_owed(falcon) and falcon.delay <= MOST_DELAY):
        falcon.testing = 1
    if is_slower and falcon.astray >= _GIVEN_UP_READS:  # the force changes too fast for a measurement
        _adopt_delay(falcon, falcon.owed + 1)


@kernel
def _has_few_owed(falcon: Any) -> bool:
    """Return whether so few replies are pending beyond the delay that a received one must be recent."""
    return bool(falcon.owed < falcon.delay + _MAX_OWED)


@kernel
def _measure_delay(falcon: Any, packets: int) -> None:
    """Continue the measurement until a read has no reply, which means that no reply is pending."""
    delay = falcon.testing
    if packets > 0 and delay <= MOST_DELAY:
        falcon.testing += 1
        return
    falcon.testing = 0
    if packets == 0:
        _write_off(falcon)
    if delay >= falcon.delay or delay == falcon.measured:
        _adopt_delay(falcon, delay)
    else:  # a lost reply has the same effect, so measure again
        falcon.measured = delay
        falcon.unsure = 1
        falcon.retest = MOST_DELAY


@kernel
def give_up_measurement(falcon: Any) -> None:
    """Cancel the measurement; the delay becomes at least the number of ticks measured so far."""
    falcon.delay = max(falcon.delay, falcon.testing)
    falcon.testing = 0
    falcon.retest = MOST_DELAY


@kernel
def _adopt_delay(falcon: Any, delay: int) -> None:
    falcon.delay = delay
    falcon.measured = 0
    falcon.unsure = 0
    falcon.astray = 0
    falcon.retest = _RETEST_TICKS


@kernel
def _write_off(falcon: Any) -> None:
    falcon.written_off += falcon.owed
    falcon.owed = 0


@kernel
def take_status(falcon: Any) -> bool:
    """Copy buttons and homed arms from the newest packet; return whether its encoders count from their index."""
    status = falcon.status
    if status.homed != ALL_HOMED:
        falcon.unhomed += 1
        falcon.tracked = 0
        falcon.beyond = 0
        if falcon.unhomed >= _UNHOMED_PACKETS:
            falcon.homed = 0
            falcon.pulled_out = 0
            falcon.share = 0.0
        return False
    falcon.unhomed = 0
    falcon.homed = 1
    if status.buttons == falcon.seen_buttons:
        falcon.buttons = status.buttons
    falcon.seen_buttons = status.buttons
    return True


@kernel
def is_plausible(falcon: Any) -> bool:
    """Return whether the encoder counts continue the arms' motion, or confirm previously rejected counts."""
    counts = falcon.status.encoders
    deviates, is_repeated = False, falcon.doubts > 0
    for i in range(3):
        if abs(counts[i] - falcon.counts[i] - falcon.pace[i] * falcon.apart) > _MAX_DEVIATION:
            deviates = True
        if abs(counts[i] - falcon.doubted[i]) > _MAX_DEVIATION:
            is_repeated = False
    if falcon.tracked != 0 and deviates and not is_repeated and falcon.doubts < _MAX_DOUBTS:
        falcon.doubts += 1
        falcon.doubted_at = falcon.apart
        for i in range(3):
            falcon.doubted[i] = counts[i]
        return False
    for i in range(3):
        if falcon.tracked == 0:
            falcon.pace[i] = 0.0
        elif deviates and falcon.doubts > 0:
            falcon.pace[i] = (counts[i] - falcon.doubted[i]) / (falcon.apart - falcon.doubted_at)
        else:
            falcon.pace[i] = (counts[i] - falcon.counts[i]) / falcon.apart
        falcon.counts[i] = counts[i]
    falcon.tracked = 1
    falcon.apart = 0
    falcon.doubts = 0
    return True
