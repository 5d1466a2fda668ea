"""The compiled part of the emulated Inverse Service: it executes each command and answers it with one state.

`stream_functions` have the signatures of a socket's ``send`` and ``recv``, so that the client's compiled exchange can
call them instead. Frames are those of a server (RFC 6455 §5.1: a server must not mask its frames, and rejects unmasked
ones). A message that contains more than a force command waits at ``complex_at`` for ``inverse3_service.Service``.
"""

from functools import cache
from typing import Any, Final

import numpy as np
from numba import types

from study_app.devices.hand import HAND, move_held_handle
from study_app.haptics.kernels import HANDLE, c_function, kernel, measure, push, record_at, release_handle

_SOCKET_CALL = types.intp(types.intp, types.intp, types.uintp, types.int32)
_IDLE_NS: Final = 100_000_000
"""Time without commands after which a device becomes idle [ns]; that it does is documented, the time is not."""
INBOX: Final = 1 << 14
OUTBOX: Final = 1 << 17
TEXT: Final = 1 << 12
_FAULTY: Final = 1 << 12
_QUEUE = 256
_OWN_STEP_NS = 1_000_000
_SLOTS = 9
_SLOT_WIDTH = 14
_DECIMALS = 100_000_000

SERVICE = np.dtype(
    [
        ("clock", np.intp),  # address of the time [ns]; 0: one millisecond per command
        ("now_ns", np.int64),
        ("last_ns", np.int64),  # of the last command
        ("started", np.int64),
        ("hand", HAND),
        ("handle", HANDLE),
        ("counted_m", np.float64, (3,)),  # position according to its encoders
        ("buttons", np.int64),
        ("inbox", np.uint8, (INBOX,)),
        ("in_size", np.int64),
        ("outbox", np.uint8, (OUTBOX,)),  # a ring
        ("written", np.int64),  # number of bytes written to it so far
        ("visible", np.int64),  # number of bytes that are due so far
        ("read", np.int64),
        ("queue_end", np.int64, (_QUEUE,)),  # end of each pending frame in the outbox,
        ("queue_ns", np.int64, (_QUEUE,)),  # and the time when it is due
        ("queue_first", np.int64),
        ("queue_next", np.int64),
        ("text", np.uint8, (TEXT,)),  # a state message, with space for its numbers
        ("text_size", np.int64),
        ("slots", np.int64, (_SLOTS,)),
        ("id", np.uint8, (16,)),  # id of the device, in quotes
        ("id_size", np.int64),
        ("complex_at", np.int64),  # start of the message for Python in the inbox
        ("complex_size", np.int64),  # and its length; 0: none
        ("complex_end", np.int64),  # end of its frame
        ("ended", np.int64),  # 1: the stream is over
        ("refused", np.int64),  # 1: the client broke RFC 6455
        # commands
        ("commands", np.int64),
        ("pushes", np.int64),  # commands with a force other than zero
        ("force_n", np.float64, (3,)),  # the last one, hand frame
        ("most_n", np.float64),  # the greatest one
        ("close_frames", np.int64),
        # faults
        ("fault_at", np.int64),  # from this command on; 0: none
        ("faulty", np.uint8, (_FAULTY,)),  # bytes in place of a state
        ("faulty_size", np.int64),
        ("silent", np.int64),  # 1: no bytes
        ("ends", np.int64),  # 1: the stream ends, too
        ("lag_ns", np.int64),  # delay of states, with or without a fault [ns]
        ("portion", np.int64),  # greatest number of bytes per receive; 0: all
    ],
    align=True,
)

_service_at = record_at(SERVICE)
_byte_at = record_at(np.dtype([("value", np.uint8)]))
_time_at = record_at(np.dtype([("ns", np.int64)]))
_FORCE, _VECTOR, _SESSION, _CONFIGURE, _X, _Y, _Z = (
    np.frombuffer(b'"%b"' % word, np.uint8)
    for word in (b"set_cursor_force", b"vector", b"session", b"configure", b"x", b"y", b"z")
)


@cache
def stream_functions() -> tuple[Any, Any]:
    """Compile the functions that replace ``send`` and ``recv``."""
    return c_function(_SOCKET_CALL, _send), c_function(_SOCKET_CALL, _receive)


def _send(handle: int, data: int, size: Any, _flags: int) -> Any:
    service = _service_at(handle)
    if service.ended:
        return -1
    accepted = min(np.int64(size), INBOX - service.in_size)
    for k in range(accepted):
        service.inbox[service.in_size + k] = _byte_at(data + k).value
    service.in_size += accepted
    take_frames(service)
    return accepted


def _receive(handle: int, data: int, size: Any, _flags: int) -> Any:
    service = _service_at(handle)
    _read_clock(service)
    release_due_frames(service)
    size_due = min(service.visible - service.read, np.int64(size))
    if service.portion > 0:
        size_due = min(size_due, service.portion)
    for k in range(size_due):
        _byte_at(data + k).value = service.outbox[(service.read + k) % OUTBOX]
    service.read += size_due
    if size_due > 0:
        return size_due
    return 0 if service.ended and service.read == service.written else -1


@kernel
def _read_clock(service: Any) -> None:
    if service.clock != 0:
        service.now_ns = _time_at(service.clock).ns


@kernel
def release_due_frames(service: Any) -> None:
    """Release the frames that are due to the client."""
    while service.queue_first < service.queue_next:
        row = service.queue_first % _QUEUE
        if service.queue_ns[row] > service.now_ns:
            return
        service.visible = service.queue_end[row]
        service.queue_first += 1


@kernel
def put_frame(service: Any, opcode: int, payload: Any, size: int, lag_ns: int) -> None:
    """Queue an unmasked frame (RFC 6455 §5.2)."""
    _put_byte(service, 0x80 | opcode)
    if size < 126:
        _put_byte(service, size)
    else:
        _put_byte(service, 126)
        _put_byte(service, size >> 8)
        _put_byte(service, size & 0xFF)
    for k in range(size):
        _put_byte(service, payload[k])
    _enqueue(service, lag_ns)


@kernel
def put_bytes(service: Any, data: Any, size: int) -> None:
    """Queue raw bytes."""
    for k in range(size):
        _put_byte(service, data[k])
    _enqueue(service, 0)


@kernel
def _put_byte(service: Any, byte: int) -> None:
    service.outbox[service.written % OUTBOX] = np.uint8(byte)
    service.written += 1


@kernel
def _enqueue(service: Any, lag_ns: int) -> None:
    row = service.queue_next % _QUEUE
    service.queue_end[row] = service.written
    service.queue_ns[row] = service.now_ns + lag_ns
    service.queue_next += 1


@kernel
def take_frames(service: Any) -> None:
    """Process the complete frames, up to one that Python code must process."""
    while service.complex_size == 0 and service.in_size >= 2 and not service.ended:
        first: Any = np.int64(service.inbox[0])
        second: Any = np.int64(service.inbox[1])
        if second & 0x80 == 0:  # a client must mask
            service.refused = service.ended = 1
            return
        size, at = second & 0x7F, 2
        if size == 126:
            if service.in_size < 4:
                return
            size, at = (np.int64(service.inbox[2]) << 8) | np.int64(service.inbox[3]), 4
        if size == 127 or at + 4 + size > INBOX:
            service.refused = service.ended = 1
            return
        end = at + 4 + size
        if service.in_size < end:
            return
        for k in range(size):
            service.inbox[at + 4 + k] ^= service.inbox[at + k % 4]
        if first & 0x0F == 8:
            service.close_frames += 1
            remove_force(service)
            put_frame(service, 8, service.inbox[at + 4 : end], size, 0)
            service.ended = 1
            return
        if first & 0x0F == 1 and not _execute_command(service, at + 4, end):
            service.complex_at, service.complex_size, service.complex_end = at + 4, size, end
            return
        drop_frame(service, end)


@kernel
def drop_frame(service: Any, end: int) -> None:
    """Remove a frame from the inbox."""
    for k in range(end, service.in_size):
        service.inbox[k - end] = service.inbox[k]
    service.in_size -= end


@kernel
def _execute_command(service: Any, begin: int, end: int) -> bool:
    """Execute a command and answer it; return False if the message contains more."""
    if (
        _find_word_end(service.inbox, begin, end, _SESSION) >= 0
        or _find_word_end(service.inbox, begin, end, _CONFIGURE) >= 0
    ):
        return False
    advance_handle(service)
    addressed = _find_word_end(service.inbox, begin, end, service.id[: service.id_size])
    at = _find_word_end(service.inbox, begin, end, _FORCE)
    if addressed >= 0 and at >= 0:
        at = _find_word_end(service.inbox, at, end, _VECTOR)
        if at >= 0:
            x_n = _parse_number(service.inbox, _find_word_end(service.inbox, at, end, _X), end)
            y_n = _parse_number(service.inbox, _find_word_end(service.inbox, at, end, _Y), end)
            z_n = _parse_number(service.inbox, _find_word_end(service.inbox, at, end, _Z), end)
            apply_force(service, x_n, y_n, z_n)
    send_state(service)
    return True


@kernel
def advance_handle(service: Any) -> None:
    """Move the handle until the current time; after a long time without commands the device is idle."""
    _read_clock(service)
    if service.clock == 0:
        service.now_ns += _OWN_STEP_NS
    elapsed_ns = service.now_ns - service.last_ns if service.started else 0
    if elapsed_ns > _IDLE_NS:
        remove_force(service)
    service.started = 1
    service.last_ns = service.now_ns
    move_held_handle(service, service.now_ns, elapsed_ns * 1e-9)


@kernel
def apply_force(service: Any, x_n: float, y_n: float, z_n: float) -> None:
    """Apply a force from now on [N, service frame: x right, y forward, z up]."""
    service.commands += 1
    service.force_n[0], service.force_n[1], service.force_n[2] = x_n, z_n, -y_n
    size_n = (x_n * x_n + y_n * y_n + z_n * z_n) ** 0.5
    service.most_n = max(service.most_n, size_n)
    service.pushes += 1 if size_n > 0.0 else 0
    push(service.handle, x_n, z_n, -y_n)


@kernel
def remove_force(service: Any) -> None:
    """Remove the force: the device becomes idle."""
    release_handle(service.handle)
    for axis in range(3):
        service.force_n[axis] = 0.0


@kernel
def send_state(service: Any) -> None:
    """Send the state, or the bytes of a fault instead."""
    if service.fault_at > 0 and service.commands >= service.fault_at:
        if service.silent == 0:
            put_bytes(service, service.faulty, service.faulty_size)
        if service.ends:
            remove_force(service)
            service.ended = 1
        return
    fill_numbers(service, service.text, service.slots)
    put_frame(service, 1, service.text, service.text_size, service.lag_ns)


@kernel
def fill_numbers(service: Any, text: Any, slots: Any) -> None:
    """Write position, velocity and force (in the service's axes) into the slots of a state message."""
    handle = service.handle
    measure(handle, service.counted_m)
    for quantity in range(3):
        for axis in range(3):
            source = 0 if axis == 0 else 3 - axis
            sign = -1.0 if axis == 1 else 1.0
            if quantity == 0:
                value = service.counted_m[source]
            else:
                value = handle.velocity_mps[source] if quantity == 1 else handle.force_n[source]
            if slots[3 * quantity + axis] >= 0:
                _write_number(text, slots[3 * quantity + axis], sign * value)


@kernel
def _write_number(text: Any, at: int, value: float) -> None:
    """Write a number with eight decimals and blanks up to the slot's width."""
    scaled = np.int64(abs(value) * _DECIMALS + 0.5)
    text[at] = 45 if value < 0.0 else 32
    whole, fraction = scaled // _DECIMALS, scaled % _DECIMALS
    text[at + 1] = 48 + whole // 10 if whole >= 10 else 32
    if whole >= 10 and value < 0.0:
        text[at], text[at + 1] = 45, 48 + whole // 10
    elif value < 0.0:
        text[at], text[at + 1] = 32, 45
    text[at + 2] = 48 + whole % 10
    text[at + 3] = 46
    for k in range(8):
        text[at + 11 - k] = 48 + fraction % 10
        fraction //= 10
    text[at + 12] = text[at + 13] = 32


@kernel
def _find_word_end(data: Any, begin: int, end: int, word: Any) -> int:
    """Return the end of a word in the data; -1 if it is missing or ``begin`` is negative."""
    if begin < 0:
        return -1
    for at in range(begin, end - word.size + 1):
        same = True
        for k in range(word.size):
            if data[at + k] != word[k]:
                same = False
                break
        if same:
            return at + int(word.size)
    return -1


@kernel
def _parse_number(data: Any, at: int, end: int) -> float:
    """Return the number after the colon at ``at``; 0 if there is none."""
    if at < 0:
        return 0.0
    while at < end and (data[at] == 58 or data[at] == 32):
        at += 1
    sign, value, place_value = 1.0, 0.0, 0.0
    if at < end and data[at] == 45:
        sign = -1.0
        at += 1
    while at < end and (48 <= data[at] <= 57 or data[at] == 46):
        if data[at] == 46:
            place_value = 1.0
        elif place_value == 0.0:
            value = 10.0 * value + (float(data[at]) - 48.0)
        else:
            place_value *= 0.1
            value += place_value * (float(data[at]) - 48.0)
        at += 1
    return sign * value
