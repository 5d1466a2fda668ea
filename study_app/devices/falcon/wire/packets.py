"""Packets of sixteen bytes each way: torques and lights out, encoders and buttons in; the stream may lose bytes.

A number is four bytes, a nibble each, the least significant first, with ``ZERO`` added; a packet is ``START``, three
such numbers, a byte of flags or status, a byte of unknown meaning, ``STOP`` (``wire``). There is no checksum, so the
parser accepts a packet only if every byte of it is permitted at its place, keeps a possible start of the next, and
returns each packet once.
"""

from typing import Any

import numpy as np

from study_app.devices.falcon.wire.constants import (
    HOMED_SHIFT,
    MOST_TORQUE,
    PACKET,
    START,
    STATUS_BYTES,
    STOP,
    USB_PACKET,
    ZERO,
)
from study_app.haptics.kernels.compiled import kernel

NIBBLES = 4
FLAGS_AT = 13  # flags to the device, status from it; numbers stand at 1, 5 and 9
UNKNOWN_AT = 14
STATUS_BITS = 7

PARSER = np.dtype(
    [
        ("tail", np.uint8, (PACKET,)),  # the start of an incomplete packet
        ("held", np.int64),  # its number of bytes
        ("packets", np.int64),  # whole valid packets so far
        ("skipped", np.int64),  # bytes so far that belonged to none
    ],
    align=True,
)

STATUS = np.dtype(
    [
        ("encoders", np.int64, (3,)),  # counts of arms 1 to 3
        ("buttons", np.int64),  # bits 0 to 3 of the grip
        ("homed", np.int64),  # bits 0 to 2: arms 1 to 3
        ("count", np.int64),  # how many packets were written here so far
    ],
    align=True,
)


@kernel
def put_number(out: Any, at: int, value: int) -> None:
    """Write ``value``, as 16 bits with sign, into the four bytes of ``out`` from ``at`` on."""
    for nibble in range(NIBBLES):
        out[at + nibble] = ZERO + ((value >> (4 * nibble)) & 0xF)


@kernel
def number(data: Any, at: int) -> Any:
    """Return what stands in the four bytes of ``data`` from ``at`` on, -32768 to 32767."""
    value: Any = 0
    for nibble in range(NIBBLES):
        value += ((np.int64(data[at + nibble]) - ZERO) & 0xF) << (4 * nibble)
    return value - 0x10000 if value >= 0x8000 else value


@kernel
def pack(torques: Any, flags: int, out: Any) -> None:
    """Write the packet of ``torques`` (3,) and ``flags`` into ``out`` (16,) bytes.

    A torque beyond ``MOST_TORQUE`` is clipped, so that it never overflows into the opposite sign.
    """
    out[0] = START
    for arm in range(3):
        put_number(out, 1 + NIBBLES * arm, min(max(torques[arm], -MOST_TORQUE), MOST_TORQUE))
    out[FLAGS_AT] = ZERO + flags
    out[UNKNOWN_AT] = ZERO
    out[PACKET - 1] = STOP


@kernel
def strip(data: Any, length: int, out: Any) -> int:
    """Copy the first ``length`` bytes of a read without the bridge's status bytes; return how many are left.

    ``out`` may be ``data`` itself.
    """
    kept = 0
    for i in range(length):
        if i % USB_PACKET >= STATUS_BYTES:
            out[kept] = data[i]
            kept += 1
    return kept


@kernel
def feed(parser: Any, data: Any, length: int, status: Any) -> Any:
    """Process ``length`` more bytes of the stream; return the number of valid packets that ended in them.

    The newest of them goes into ``status``, which stays as it was where there is none.

    Parameters
    ----------
    parser : record of ``PARSER``; zeros at the begin of a stream
    data : (>= length,) bytes, without the bridge's status bytes
    status : record of ``STATUS``
    """
    before = parser.packets
    for i in range(length):
        _take(parser, data[i])
        if parser.held == PACKET:
            _read(parser.tail, status)
            parser.packets += 1
            parser.held = 0
    return parser.packets - before


@kernel
def _take(parser: Any, byte: Any) -> None:
    """Append ``byte`` to the tail, after dropping the part of the tail that cannot be the start of a packet."""
    while not _fits(parser.held, byte):
        if parser.held == 0:
            parser.skipped += 1
            return
        # Among the bytes that fit, only the unknown one can be another start.
        if parser.held > UNKNOWN_AT and parser.tail[UNKNOWN_AT] == START:
            parser.skipped += UNKNOWN_AT
            parser.held = 1
        else:
            parser.skipped += parser.held
            parser.held = 0
    parser.tail[parser.held] = byte
    parser.held += 1


@kernel
def _fits(at: int, byte: int) -> bool:
    """Whether ``byte`` may stand ``at`` that place of a packet."""
    if at == 0:
        return byte == START
    if at < FLAGS_AT:
        return ZERO <= byte < ZERO + 16
    if at == FLAGS_AT:
        return ZERO <= byte < ZERO + (1 << STATUS_BITS)
    return at == UNKNOWN_AT or byte == STOP


@kernel
def _read(packet: Any, status: Any) -> None:
    for arm in range(3):
        status.encoders[arm] = number(packet, 1 + NIBBLES * arm)
    bits = np.int64(packet[FLAGS_AT]) - ZERO
    status.buttons = bits & 0xF
    status.homed = bits >> HOMED_SHIFT
    status.count += 1
