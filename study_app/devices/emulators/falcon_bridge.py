"""The emulated USB bridge: an FT232R between the host's transfers and the bytes on the Falcon's line.

Two rings store bytes with their arrival times: ``out`` toward the device, ``back`` from it. A transfer is a small
simulation in emulated time: it runs to its end and never waits. The chip returns a packet, which begins with two status
bytes, when it has 62 bytes, when the event character has arrived (except as the first byte), or when the latency timer
expires, in that case even without bytes (FTDI AN232B-04).

The time is read at the address ``clock``; the emulated time exceeds it by at most the time-out of a transfer. Without a
clock, the emulator has its own time, which every transfer advances.
"""

from typing import Any, Final

import numpy as np

from study_app.devices.falcon import constants
from study_app.haptics.kernels import kernel, record_at

OUT_RING: Final = 4096
BACK_RING: Final = 4096
_OUT_BUFFER: Final = 128  # size of the chip's buffer toward the device
_BACK_BUFFER: Final = 256  # and of that from the device

BRIDGE = np.dtype(
    [
        ("now_ns", np.int64),  # present time
        ("clock", np.intp),  # address of an int64 [ns]; 0: its own time
        ("joined", np.int64),  # 1 once its time is that clock's
        ("divisor", np.int64),
        ("latency_ns", np.int64),
        ("event", np.int64),  # event character; -1: off
        ("dtr", np.int64),
        ("sent_ns", np.int64),  # time of the last packet to the host, which restarted the latency timer
        ("lost", np.int64),  # bytes dropped because a buffer was full
        ("out", np.uint8, (OUT_RING,)),
        ("out_ns", np.int64, (OUT_RING,)),  # arrival at the device
        ("out_divisor", np.int64, (OUT_RING,)),  # baud-rate divisor of each
        ("out_first", np.int64),  # bytes out_first ... out_last - 1 of all are still on their way
        ("out_last", np.int64),
        ("out_free_ns", np.int64),  # time until which the line is busy
        ("back", np.uint8, (BACK_RING,)),
        ("back_ns", np.int64, (BACK_RING,)),  # arrival in the chip
        ("back_first", np.int64),
        ("back_last", np.int64),
        ("back_free_ns", np.int64),
    ],
    align=True,
)

_BYTE = np.dtype([("value", np.uint8)])
_WORD = np.dtype([("value", np.int64)])
byte_at = record_at(_BYTE)
_word_at = record_at(_WORD)

_USB_NS: Final = 30_000  # least duration of a transfer, in the emulator's own time
_ENDLESS_NS: Final = 3_600_000_000_000
_BACK_NS: Final = 1_000_000_000  # a clock this far behind was replaced or reset
_STATUS = (0x01, 0x60)  # modem status, line status: ready and empty
_EIGHTHS = (0, 4, 2, 1)  # the fraction of a divisor, by its two highest bits


@kernel
def power_up(bridge: Any) -> None:
    """Reset the bridge to its state after connection: 9600 baud, 16 ms, empty buffers."""
    bridge.divisor, bridge.latency_ns, bridge.event = constants.BAUD_9600, 16_000_000, -1
    bridge.dtr = 0
    bridge.out_first, bridge.back_first = bridge.out_last, bridge.back_last
    bridge.out_free_ns, bridge.back_free_ns, bridge.sent_ns = bridge.now_ns, bridge.now_ns, bridge.now_ns


@kernel
def begin_transfer(bridge: Any) -> int:
    """Begin a transfer; return the clock jump since the last one, by which all other times must be shifted [ns]."""
    if bridge.clock == 0:
        bridge.now_ns += _USB_NS
        return 0
    clock_ns = _word_at(bridge.clock).value
    if bridge.joined == 0 or clock_ns < bridge.now_ns - _BACK_NS:
        bridge.joined = 1
        return int(clock_ns - bridge.now_ns)
    bridge.now_ns = max(bridge.now_ns, clock_ns)
    return 0


@kernel
def transfer_end_ns(bridge: Any, timeout_ns: int) -> int:
    """Return the time at which a transfer that begins now reaches its time-out [ns]; 0 means no time-out."""
    duration_ns = timeout_ns if timeout_ns > 0 else _ENDLESS_NS
    if bridge.clock == 0:
        return int(bridge.now_ns + duration_ns)
    return int(max(bridge.now_ns, _word_at(bridge.clock).value + duration_ns))


@kernel
def shift_bridge(bridge: Any, jump_ns: int) -> None:
    """Shift all times by a duration."""
    bridge.now_ns += jump_ns
    bridge.sent_ns += jump_ns
    bridge.out_free_ns += jump_ns
    bridge.back_free_ns += jump_ns
    for k in range(bridge.out_first, bridge.out_last):
        bridge.out_ns[k % OUT_RING] += jump_ns
    for k in range(bridge.back_first, bridge.back_last):
        bridge.back_ns[k % BACK_RING] += jump_ns


@kernel
def byte_ns(divisor: int) -> int:
    """Return the duration of ten bits at 3 MHz over this divisor [ns]; 0 and 1 mean 1 and 1.5."""
    eighths = 8 * (divisor & 0x3FFF) + _EIGHTHS[(divisor >> 14) & 3]
    if divisor == 0:
        eighths = 8
    elif divisor == 1:
        eighths = 12
    return int(10 * eighths * 1000 // 24)


@kernel
def send(bridge: Any, value: int, end_ns: int) -> bool:
    """Queue a byte for the device once there is room; return False if there is none until ``end_ns``."""
    duration_ns = byte_ns(bridge.divisor)
    arrival = max(bridge.out_free_ns, bridge.now_ns) + duration_ns
    room_ns = arrival - _OUT_BUFFER * duration_ns
    if room_ns > end_ns or bridge.out_last - bridge.out_first >= OUT_RING:
        return False
    bridge.now_ns = max(bridge.now_ns, room_ns)
    index = bridge.out_last % OUT_RING
    bridge.out[index] = value
    bridge.out_ns[index] = arrival
    bridge.out_divisor[index] = bridge.divisor
    bridge.out_free_ns = arrival
    bridge.out_last += 1
    return True


@kernel
def queue_reply(bridge: Any, value: int, since_ns: int, divisor: int) -> None:
    """Send a byte from the device over the line, not before ``since_ns``."""
    if bridge.back_last - bridge.back_first >= BACK_RING:
        bridge.lost += 1
        return
    bridge.back_free_ns = max(bridge.back_free_ns, since_ns) + byte_ns(divisor)
    index = bridge.back_last % BACK_RING
    bridge.back[index] = value
    bridge.back_ns[index] = bridge.back_free_ns
    bridge.back_last += 1


@kernel
def next_packet_ns(bridge: Any) -> int:
    """Return when the chip sends its next packet to a host that requests it from now on [ns]."""
    due = bridge.sent_ns + bridge.latency_ns
    first, waiting = bridge.back_first, bridge.back_last - bridge.back_first
    if waiting >= constants.CHUNK:
        due = min(due, bridge.back_ns[(first + constants.CHUNK - 1) % BACK_RING])
    if bridge.event >= 0:
        for k in range(1, min(waiting, constants.CHUNK)):
            if bridge.back[(first + k) % BACK_RING] == bridge.event:
                due = min(due, bridge.back_ns[(first + k) % BACK_RING])
                break
    return int(max(due, bridge.now_ns))


@kernel
def deliver_packet(bridge: Any, data: int, noise: int) -> int:
    """Write the current packet to the address ``data``; return its length, including status bytes."""
    byte_at(data).value = _STATUS[0] ^ (noise & 0xF0)
    byte_at(data + 1).value = _STATUS[1] ^ ((noise >> 8) & 0xFF)
    length = constants.STATUS_BYTES
    while length < constants.USB_PACKET and has_arrived(bridge) > 0:
        byte_at(data + length).value = bridge.back[bridge.back_first % BACK_RING]
        bridge.back_first += 1
        length += 1
    bridge.sent_ns = bridge.now_ns
    return length


@kernel
def has_arrived(bridge: Any) -> int:
    """Return 1 if the chip has a byte for the host, else 0."""
    if bridge.back_first == bridge.back_last:
        return 0
    return 1 if bridge.back_ns[bridge.back_first % BACK_RING] <= bridge.now_ns else 0


@kernel
def drop_overflow(bridge: Any) -> None:
    """Drop the bytes that arrived while the chip's buffer was full; it keeps the oldest."""
    waiting = 0
    for k in range(bridge.back_first, bridge.back_last):
        if bridge.back_ns[k % BACK_RING] <= bridge.now_ns:
            waiting += 1
    excess = waiting - _BACK_BUFFER
    if excess <= 0:
        return
    bridge.lost += excess
    for k in range(bridge.back_first + _BACK_BUFFER, bridge.back_last - excess):
        bridge.back[k % BACK_RING] = bridge.back[(k + excess) % BACK_RING]
        bridge.back_ns[k % BACK_RING] = bridge.back_ns[(k + excess) % BACK_RING]
    bridge.back_last -= excess


@kernel
def control(bridge: Any, request: int, value: int) -> None:
    """Execute a control request of the host; ignore requests without an effect on bytes."""
    if request == constants.REQUEST_RESET:
        if value in (constants.RESET_ALL, constants.PURGE_RX):
            _purge_back(bridge)
        if value in (constants.RESET_ALL, constants.PURGE_TX):
            _purge_out(bridge)
    elif request == constants.REQUEST_MODEM:
        if value & 0x0100:
            bridge.dtr = value & 1
    elif request == constants.REQUEST_BAUD:
        bridge.divisor = value
    elif request == constants.REQUEST_EVENT_CHARACTER:
        bridge.event = value & 0xFF if value & constants.EVENT_ENABLED else -1
    elif request == constants.REQUEST_LATENCY:
        bridge.latency_ns = 1_000_000 * max(value & 0xFF, 1)


@kernel
def _purge_back(bridge: Any) -> None:
    while has_arrived(bridge) > 0:
        bridge.back_first += 1


@kernel
def _purge_out(bridge: Any) -> None:
    """Clear bytes whose transfer has not begun."""
    while bridge.out_last > bridge.out_first:
        newest = (bridge.out_last - 1) % OUT_RING
        if bridge.out_ns[newest] - byte_ns(bridge.out_divisor[newest]) <= bridge.now_ns:
            break
        bridge.out_last -= 1
        bridge.out_free_ns = bridge.out_ns[newest] - byte_ns(bridge.out_divisor[newest])
