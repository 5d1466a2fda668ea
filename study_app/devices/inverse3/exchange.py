"""The Inverse3's compiled tick: it reads the replies to earlier commands, returns the newest position, sends the force.

The service answers each message with one state and pushes nothing (docs.haply.co 3.5.x, "WebSocket Protocol", core
rule), so `_write` sends the force and asks for the state that `_read` finds at the next tick. Neither waits: the socket
does not block. A reply older than `_MAX_REPLY_AGE_NS` is ignored, and without replies the servo ends the force after 50
ms. Any other fault ends the stream at once: zero force is sent, then a close frame, then nothing. The service applies
each command only once, and a device without commands returns to idle ("Control Commands"), so the force ends if this
program ends or hangs.
"""

from functools import cache
from typing import Any, Final

import numpy as np
from numba import types

from study_app.devices.driver import COMMON, FIRST_CAUSE, RUNS, closed_during_call, enter, leave
from study_app.devices.inverse3 import wire
from study_app.haptics.kernels import (
    READ_LOST,
    READ_NEW,
    READ_NOTHING_NEW,
    call_at,
    clear,
    command_at,
    copy,
    device_functions,
    kernel,
    reading_at,
    record_at,
)
from study_app.haptics.kernels import square as square_of
from study_app.haptics.model.layout import MEASURED_VELOCITY, records

_TRANSFER = types.intp(types.intp, types.intp, types.uintp, types.int32)
"""``send`` and ``recv`` of a socket: (handle, address, bytes, flags) -> number of bytes (0: closed, < 0: none now)."""

_MAX_REPLY_AGE_NS: Final = 20_000_000
_MAX_UNANSWERED: Final = 4
"""Number of unanswered commands from which only weaker forces are sent, since others would queue up."""
_MAX_UNANSWERED_WEAKER: Final = 60
"""Number of unanswered commands from which only zero force is sent; the servo's fade takes 45 ticks."""
_INBOX_BYTES: Final = 1 << 16
_OUTBOX_BYTES = 512
_TEXT_BYTES = 384
_LOG_ROWS = 64  # number of commands whose time is stored: more than can be unanswered
_MAX_RECEIVES = 8  # greatest number of reads of the socket per tick
_NORM_SLACK = 1.001

CLOSED, BROKE_PROTOCOL, NOT_A_STATE, DEVICE_GONE, NO_POSITION, BAD_NUMBER, NOT_READY, UNCALIBRATED, TOO_LONG = range(
    FIRST_CAUSE, FIRST_CAUSE + 9
)

_INVERSE3 = np.dtype(
    [
        *COMMON,
        ("handle", np.intp),  # of the connection, and
        ("send", np.intp),  # addresses of its functions (``_TRANSFER``)
        ("receive", np.intp),
        # received data
        ("inbox", np.uint8, (_INBOX_BYTES,)),
        ("filled", np.int64),
        ("header", np.int64, (2,)),
        ("scan", wire.SCAN),
        # data to send
        ("prefix", np.uint8, (_TEXT_BYTES,)),  # the command up to its first number
        ("prefix_size", np.int64),
        ("text", np.uint8, (_TEXT_BYTES,)),
        ("outbox", np.uint8, (_OUTBOX_BYTES,)),
        ("out_size", np.int64),  # of the frame in it
        ("out_sent", np.int64),  # bytes of it already sent
        ("key", np.uint64, (1,)),  # of the masking keys' generator
        # pending replies
        ("sent", np.int64),  # commands
        ("answered", np.int64),  # replies
        ("sent_ns", np.int64, (_LOG_ROWS,)),
        ("sent_tick", np.int64, (_LOG_ROWS,)),
        ("age_ns", np.int64),  # time since the command whose reply was used last
        ("buttons", np.int64),
        # counters
        ("missing", np.int64),  # ticks without a reply
        ("late", np.int64),  # ticks whose reply was too old
        ("skipped", np.int64),  # forces that were not sent because replies were missing
        ("unasked", np.int64),  # messages that do not answer a command
    ],
    align=True,
)

COUNTERS: Final = ("ticks", "fresh", "missing", "late", "skipped", "unasked", "sent", "answered")

_device_at = record_at(_INVERSE3)
_call = call_at(_TRANSFER)
_fields = _INVERSE3.fields
assert _fields is not None  # noqa: S101 - it is a record
_INBOX_AT, _OUTBOX_AT = int(_fields["inbox"][1]), int(_fields["outbox"][1])

_VELOCITY_BITS = 0b111 << wire.VELOCITY
_Y, _Z, _END = (np.frombuffer(text, np.uint8) for text in (b',"y":', b',"z":', b"}}}}]}"))


def new_exchange(device_id: str, force_limit_n: float, seed: int) -> Any:
    """Return the memory of an exchange, shape (1,), not connected yet: its address is the device's ``context``."""
    memory = records(_INVERSE3, 1)
    device = memory[0]
    device.force_limit_n = force_limit_n
    device.key[0] = seed | 1
    prefix = f'{{"inverse3":[{{"device_id":"{device_id}","commands":{{"set_cursor_force":{{"vector":{{"x":'.encode()
    device.prefix[: len(prefix)] = np.frombuffer(prefix, np.uint8)
    device.prefix_size = len(prefix)
    return memory


@cache
def exchange_functions() -> tuple[Any, Any]:
    """Compile read and write, once for all devices."""
    return device_functions(_read, _write)


def _read(context: int, now_ns: int, reading: int) -> int:
    device = _device_at(context)
    answer = READ_LOST
    if enter(device):
        answer = _take_replies(device, context, now_ns, reading_at(reading))
        if closed_during_call(device):
            finish(device, context)
        leave(device)
    return answer


def _write(context: int, command: int) -> int:
    device, record = _device_at(context), command_at(command)
    answer = READ_LOST
    if enter(device):
        answer = _send_force(device, context, record.force_n)
        if closed_during_call(device):
            finish(device, context)
        leave(device)
    copy(device.sent_n, record.sent_n)
    return answer


@kernel
def _take_replies(device: Any, context: int, now_ns: int, out: Any) -> int:
    """Receive replies; write the newest position into the reading ``out``."""
    device.now_ns = now_ns
    device.ticks += 1
    answered = device.answered
    for _ in range(_MAX_RECEIVES):
        room = _INBOX_BYTES - device.filled
        received = np.int32(
            _call(device.receive, device.handle, context + _INBOX_AT + device.filled, np.uintp(room), np.int32(0))
        )
        if received == 0:
            return _end_exchange(device, context, CLOSED)
        if received < 0:
            break
        device.filled += received
        ended = _take_frames(device, context)
        if ended != RUNS:
            return _end_exchange(device, context, ended)
        if device.filled == 0 and device.answered >= device.sent:
            break  # no more replies are owed
    if device.answered == answered:
        device.missing += 1
        return READ_NOTHING_NEW
    row = (device.answered - 1) % _LOG_ROWS
    device.age_ns = now_ns - device.sent_ns[row]
    if device.age_ns > _MAX_REPLY_AGE_NS:
        device.late += 1
        return READ_NOTHING_NEW
    device.fresh += 1
    device.fresh_ns = now_ns
    value = device.scan.value
    _put_vector(value, wire.POSITION, out.position_m)
    if device.scan.known & _VELOCITY_BITS == _VELOCITY_BITS:
        _put_vector(value, wire.VELOCITY, out.velocity_mps)
        out.measured |= MEASURED_VELOCITY
    out.buttons = device.buttons
    out.delay_ticks = device.ticks - device.sent_tick[row]
    return READ_NEW


@kernel
def _put_vector(value: Any, index: int, out: Any) -> None:
    """Write a vector in the hand frame; the service's basis XYZ has x right, y forward, z up.

    Documented in docs.haply.co 3.1.x, "Haply Inverse Service", Coordinate System Convention.
    """
    out[0] = value[index]
    out[1] = value[index + 2]
    out[2] = -value[index + 1]


@kernel
def _take_frames(device: Any, context: int) -> int:
    """Process every complete frame in the inbox; return `RUNS` or the reason why the stream ends."""
    begin = 0
    while True:
        size = wire.parse_header(device.inbox, begin, device.filled, device.header)
        if size == wire.VIOLATION:
            return BROKE_PROTOCOL
        if size == wire.INCOMPLETE:
            break
        opcode, length = device.header[0], device.header[1]
        if length > _INBOX_BYTES - size:
            return TOO_LONG
        at, end = begin + size, begin + size + length
        if end > device.filled:
            break
        begin = end
        if opcode == wire.CLOSE:
            return CLOSED
        if opcode == wire.PING and length <= wire.LONGEST_CONTROL:
            _answer_ping(device, context, at, length)
        if opcode == wire.TEXT:
            ended = _take_state(device, at, end)
            if ended != RUNS:
                return ended
    for k in range(begin, device.filled):
        device.inbox[k - begin] = device.inbox[k]
    device.filled -= begin
    return RUNS


@kernel
def _take_state(device: Any, begin: int, end: int) -> int:
    result = wire.scan(device.inbox, begin, end, device.scan)
    if result != wire.UNDERSTOOD:
        if result == wire.NOT_JSON:
            return NOT_A_STATE
        if result == wire.NO_DEVICE:
            return DEVICE_GONE
        return BAD_NUMBER if result == wire.NOT_FINITE else NO_POSITION
    if device.answered < device.sent:
        device.answered += 1
    else:
        device.unasked += 1
    if _is_zero(device.scan, wire.READY) or _is_zero(device.scan, wire.POWER):
        return NOT_READY
    if _is_zero(device.scan, wire.CALIBRATED):
        return UNCALIBRATED
    buttons = 0
    if device.scan.known >> wire.BUTTON & 1 and device.scan.value[wire.BUTTON] != 0.0:
        buttons |= 1
    for k in range(3):
        if device.scan.known >> (wire.BUTTONS + k) & 1 and device.scan.value[wire.BUTTONS + k] != 0.0:
            buttons |= 1 << k
    device.buttons = buttons
    return RUNS


@kernel
def _is_zero(scan: Any, index: int) -> bool:
    return bool(scan.known >> index & 1 and scan.value[index] == 0.0)


@kernel
def _send_force(device: Any, context: int, force_n: Any) -> int:
    """Send a force [N, hand frame]; if it is not sent, the last one stays in effect and in ``sent_n``."""
    _send_command(device, context, force_n[0], force_n[1], force_n[2])
    return 0


@kernel
def _send_command(device: Any, context: int, x_n: float, y_n: float, z_n: float) -> None:
    square = x_n * x_n + y_n * y_n + z_n * z_n
    max_n = _NORM_SLACK * device.force_limit_n
    if not square <= max_n * max_n:  # nor NaN: the servo sends neither
        x_n = y_n = z_n = square = 0.0
    unanswered = device.sent - device.answered
    is_weaker = square < square_of(device.sent_n) and (square == 0.0 or unanswered < _MAX_UNANSWERED_WEAKER)
    if unanswered >= _MAX_UNANSWERED and not is_weaker:
        device.skipped += 1
        return
    if not _flush(device, context):
        device.skipped += 1
        return
    text = device.text
    end = 0
    for k in range(device.prefix_size):
        text[k] = device.prefix[k]
    end = wire.put_fixed(text, device.prefix_size, x_n)
    end = wire.put_fixed(text, wire.put_text(text, end, _Y), -z_n)
    end = wire.put_fixed(text, wire.put_text(text, end, _Z), y_n)
    end = wire.put_text(text, end, _END)
    device.out_size = wire.build_frame(device.outbox, wire.TEXT, text, end, wire.next_key(device.key))
    device.out_sent = 0
    row = device.sent % _LOG_ROWS
    device.sent_ns[row] = device.now_ns
    device.sent_tick[row] = device.ticks
    device.sent += 1
    device.sent_n[0], device.sent_n[1], device.sent_n[2] = x_n, y_n, z_n
    _flush(device, context)


@kernel
def _flush(device: Any, context: int) -> bool:
    """Send the rest of the frame in the outbox; return whether it is complete."""
    while device.out_sent < device.out_size:
        sent = np.int32(
            _call(
                device.send,
                device.handle,
                context + _OUTBOX_AT + device.out_sent,
                np.uintp(device.out_size - device.out_sent),
                np.int32(0),
            )
        )
        if sent <= 0:
            return False
        device.out_sent += sent
    return True


@kernel
def _send_control(device: Any, context: int, opcode: int, length: int) -> None:
    """Send a control frame whose payload is in ``text``, if the previous frame was sent completely."""
    if _flush(device, context):
        device.out_size = wire.build_frame(device.outbox, opcode, device.text, length, wire.next_key(device.key))
        device.out_sent = 0
        _flush(device, context)


@kernel
def _answer_ping(device: Any, context: int, at: int, length: int) -> None:
    """Answer a ping with its payload (RFC 6455 §5.5.3)."""
    for k in range(length):
        device.text[k] = device.inbox[at + k]
    _send_control(device, context, wire.PONG, length)


@kernel
def _end_exchange(device: Any, context: int, cause: int) -> int:
    """End the stream: send zero force and a close frame, and nothing after them."""
    if cause != CLOSED:
        finish(device, context)
    clear(device.sent_n)  # a force that could not be reset ends without further commands
    device.ended = cause
    return READ_LOST


@kernel
def finish(device: Any, context: int) -> None:
    """Send zero force and a close frame (RFC 6455 §5.5.1, status 1000)."""
    _send_command(device, context, 0.0, 0.0, 0.0)
    device.text[0], device.text[1] = np.uint8(1000 >> 8), np.uint8(1000 & 0xFF)
    _send_control(device, context, wire.CLOSE, 2)
