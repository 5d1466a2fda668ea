"""Messages to and from the Inverse Service, compiled: WebSocket frames, numbers as text, and a JSON scanner.

Frames follow RFC 6455 §5.2 (layout), §5.3 (masking), §5.5 (control frames). A client masks what it sends; a server must
not (§5.1). The service answers each message with one text frame, so fragments (§5.4) are not expected and count as a
violation of the protocol. `scan` reads the values of one device from a state message (RFC 8259). It checks the grammar
of the whole message, with its keys in any order, and stores the numbers at known paths (``_PLACES``). Unknown keys are
skipped, so that a later service may add some. A path is identified by a hash of its keys; an element of an array has
the key ``*``.

Documented in docs.haply.co, version 3.5.x: "WebSocket Protocol", steps 1 and 2 (``inverse3``: ``state.cursor_position``
[m], ``state.cursor_velocity`` [m/s], ``status``) and "HTTP", Devices (``verse_grip``, ``wireless_verse_grip``).
"""

from typing import Any, Final

import numpy as np

from study_app.haptics.kernels import kernel

TEXT: Final = 0x1
CLOSE: Final = 0x8
PING: Final = 0x9
PONG: Final = 0xA

INCOMPLETE: Final = 0
VIOLATION: Final = -1
LONGEST_CONTROL: Final = 125

_FIN = 0x80
_MASKED = 0x80


@kernel
def parse_header(data: Any, begin: int, end: int, header: Any) -> int:
    """Read the header of the frame that begins at ``begin`` in ``data``, whose bytes before ``end`` are valid.

    ``header`` (2,) receives the opcode and the length of the payload [bytes]. Return the length of the header [bytes],
    `INCOMPLETE` if more bytes are needed, or `VIOLATION`.
    """
    if end - begin < 2:
        return INCOMPLETE
    first: Any = np.int64(data[begin])
    second: Any = np.int64(data[begin + 1])
    opcode = first & 0x0F
    is_control = opcode >= CLOSE
    if first & 0xF0 != _FIN or second & _MASKED or opcode not in (TEXT, CLOSE, PING, PONG):
        return VIOLATION
    size, length = 2, second
    if length > LONGEST_CONTROL:
        if is_control:
            return VIOLATION
        length_bytes = 2 if length == 126 else 8
        size = 2 + length_bytes
        if end - begin < size:
            return INCOMPLETE
        length = 0
        for k in range(length_bytes):
            length = (length << 8) | np.int64(data[begin + 2 + k])
        if length < 0:
            return VIOLATION
    header[0] = opcode
    header[1] = length
    return size


@kernel
def build_frame(out: Any, opcode: int, payload: Any, length: int, key: int) -> int:
    """Write a masked frame of ``length`` bytes (less than 65,536) of ``payload`` into ``out``; return its length.

    ``out`` needs 8 bytes more than the payload; ``key`` is the masking key, 32 bits.
    """
    out[0] = np.uint8(_FIN | opcode)
    size = 2
    if length <= LONGEST_CONTROL:
        out[1] = np.uint8(_MASKED | length)
    else:
        out[1] = np.uint8(_MASKED | 126)
        out[2] = np.uint8(length >> 8)
        out[3] = np.uint8(length & 0xFF)
        size = 4
    for k in range(4):
        out[size + k] = np.uint8((key >> (8 * (3 - k))) & 0xFF)
    for i in range(length):
        out[size + 4 + i] = payload[i] ^ out[size + i % 4]
    return size + 4 + length


@kernel
def next_key(state: Any) -> int:
    """Return the next masking key, and step the generator in ``state[0]``: xorshift64*, Vigna 2016."""
    word = state[0]
    word ^= word >> np.uint64(12)
    word ^= word << np.uint64(25)
    word ^= word >> np.uint64(27)
    state[0] = word
    return int(np.int64((word * np.uint64(0x2545F4914F6CDD1D)) >> np.uint64(32)))


_DECIMALS = 6
_SCALE = 10**_DECIMALS


@kernel
def put_text(out: Any, at: int, text: Any) -> int:
    """Copy ``text`` to ``out`` from ``at`` on; return the end."""
    for k in range(text.size):
        out[at + k] = text[k]
    return at + int(text.size)


@kernel
def put_fixed(out: Any, at: int, value: float) -> int:
    """Write a number below 10^9 as JSON with six decimals from ``at`` on; return the end."""
    scaled = int(abs(value) * _SCALE + 0.5)
    if value < 0.0 and scaled > 0:
        out[at] = np.uint8(45)
        at += 1
    digits = _DECIMALS + 1
    power = _SCALE
    while scaled // power >= 10:
        power *= 10
        digits += 1
    for k in range(digits):
        if digits - k == _DECIMALS:
            out[at] = np.uint8(46)
            at += 1
        out[at] = np.uint8(48 + scaled // power)
        at += 1
        scaled %= power
        power //= 10
    return at


UNDERSTOOD: Final = 0
NOT_JSON: Final = 1
NO_DEVICE: Final = 2  # the message does not list the device
WITHOUT_POSITION: Final = 3  # the device has no position
NOT_FINITE: Final = 4

_MAX_DEPTH: Final = 16
_OBJECT, _ARRAY = 1, 2
_FNV_BASIS, _FNV_PRIME = 0xCBF29CE484222325, 0x100000001B3

_VECTOR = ("x", "y", "z")
_PLACES: Final = (
    *(f"inverse3.*.state.cursor_position.{axis}" for axis in _VECTOR),
    *(f"inverse3.*.state.cursor_velocity.{axis}" for axis in _VECTOR),
    "inverse3.*.status.ready",
    "inverse3.*.status.calibrated",
    "inverse3.*.status.power_supply",
    "verse_grip.*.state.button",
    *(f"wireless_verse_grip.*.state.buttons.{name}" for name in "abc"),
)
POSITION, VELOCITY, READY, CALIBRATED, POWER, BUTTON, BUTTONS = 0, 3, 6, 7, 8, 9, 10
PLACES: Final = len(_PLACES)
_DEVICE_PLACES = 9  # number of places of the device itself; the rest are those of grips
_POSITION_BITS = 0b111

SCAN = np.dtype(
    [
        ("own_id", np.uint64),  # hash of the device's id
        ("kinds", np.int64, (_MAX_DEPTH,)),
        ("paths", np.uint64, (_MAX_DEPTH,)),
        ("candidate", np.float64, (PLACES,)),  # of the device being read
        ("seen", np.int64),  # bits of the values read for the candidate
        ("value", np.float64, (PLACES,)),  # of the device
        ("known", np.int64),  # bits of the values read for the device
        ("is_own", np.int64),  # 1: the id of the candidate is the device's
        ("found", np.int64),  # 1: the message lists the device
        ("infinite", np.int64),  # 1: a number of the device exceeds the range of float64
    ],
    align=True,
)


def text_hash(text: bytes) -> int:
    """Return the 64-bit FNV-1a hash of the bytes of a string between its quotes."""
    value = _FNV_BASIS
    for byte in text:
        value = ((value ^ byte) * _FNV_PRIME) % 2**64
    return value


def _path_hash(path: str) -> int:
    value = 0
    for key in path.split("."):
        value = ((value ^ text_hash(key.encode())) * _FNV_PRIME) % 2**64
    return value


_BASIS, _PRIME = np.uint64(_FNV_BASIS), np.uint64(_FNV_PRIME)
_ELEMENT = np.uint64(text_hash(b"*"))
_CODES = np.array([_path_hash(path) for path in _PLACES], np.uint64)
_DEVICE, _ID = np.uint64(_path_hash("inverse3.*")), np.uint64(_path_hash("inverse3.*.device_id"))
_NOTHING = np.uint64(0)
_TENS = np.array([float(f"1e{power}") for power in range(309)] + [np.inf])


@kernel
def scan(data: Any, begin: int, end: int, state: Any) -> int:
    """Read the message from ``begin`` to ``end``; return `UNDERSTOOD` or the reason why it gives no position.

    ``state`` is a record of `SCAN`, whose ``own_id`` identifies the device.
    """
    state.known = state.found = state.infinite = state.seen = state.is_own = 0
    at, depth, path, value_due = _skip_space(data, begin, end), 0, _NOTHING, True
    while True:
        if at >= end:
            return NOT_JSON
        byte = data[at]
        if value_due:
            if byte == 123 or byte == 91:  # noqa: PLR1714 - { or [; compiled as it stands
                if depth + 1 >= _MAX_DEPTH:
                    return NOT_JSON
                depth += 1
                state.kinds[depth] = _OBJECT if byte == 123 else _ARRAY
                state.paths[depth] = path
                if path == _DEVICE:
                    state.seen = state.is_own = 0
                at = _skip_space(data, at + 1, end)
                if at < end and data[at] == (125 if byte == 123 else 93):
                    value_due = False
                    continue
            else:
                at = _skip_space(data, _parse_scalar(data, at, end, path, state), end)
                value_due = False
                if at < 0:
                    return NOT_JSON
                if depth == 0:
                    return NOT_JSON  # a state is an object
                continue
        elif byte == 44:  # ,
            at = _skip_space(data, at + 1, end)
        elif byte == (125 if state.kinds[depth] == _OBJECT else 93):  # } ]
            if state.paths[depth] == _DEVICE:
                _accept_values(state)
            depth -= 1
            at = _skip_space(data, at + 1, end)
            if depth == 0:
                return _result_of(state) if at == end else NOT_JSON
            continue
        else:
            return NOT_JSON
        # the next member or element
        value_due = True
        if state.kinds[depth] == _ARRAY:
            path = (state.paths[depth] ^ _ELEMENT) * _PRIME
            continue
        close = _string_end(data, at, end)
        if close < 0:
            return NOT_JSON
        path = (state.paths[depth] ^ _hash_bytes(data, at + 1, close)) * _PRIME
        at = _skip_space(data, close + 1, end)
        if at >= end or data[at] != 58:  # :
            return NOT_JSON
        at = _skip_space(data, at + 1, end)


@kernel
def _result_of(state: Any) -> int:
    if state.found == 0:
        return NO_DEVICE
    if state.infinite:
        return NOT_FINITE
    return UNDERSTOOD if state.known & _POSITION_BITS == _POSITION_BITS else WITHOUT_POSITION


@kernel
def _accept_values(state: Any) -> None:
    """Accept the values read for a device if its id matches."""
    if state.is_own == 0:
        return
    state.found = 1
    state.known |= state.seen
    for place in range(_DEVICE_PLACES):
        if state.seen >> place & 1:
            state.value[place] = state.candidate[place]
            if not abs(state.value[place]) < np.inf:
                state.infinite = 1


@kernel
def _skip_space(data: Any, at: int, end: int) -> int:
    """Return the end of the white space from ``at`` onwards; a negative ``at`` is returned unchanged."""
    while 0 <= at < end and data[at] <= 32:
        byte = data[at]
        if byte != 32 and byte != 10 and byte != 13 and byte != 9:  # noqa: PLR1714 - compiled
            return at
        at += 1
    return at


@kernel
def _string_end(data: Any, at: int, end: int) -> int:
    """Return the position of the closing quote of the string at ``at``; -1 if there is none."""
    if at >= end or data[at] != 34:
        return -1
    at += 1
    while at < end and data[at] != 34:
        if data[at] < 32:
            return -1
        if data[at] == 92:
            at += 1
            if at >= end or not _is_escape(data, at, end):
                return -1
        at += 1
    return at if at < end else -1


@kernel
def _is_escape(data: Any, at: int, end: int) -> bool:
    """Return whether the bytes after a backslash are an escape (RFC 8259 §7): a letter, or u and four digits."""
    if data[at] != 117:
        return data[at] in (34, 92, 47, 98, 102, 110, 114, 116)
    if at + 4 >= end:
        return False
    for k in range(1, 5):
        byte = data[at + k]
        if not (48 <= byte <= 57 or 65 <= byte <= 70 or 97 <= byte <= 102):
            return False
    return True


@kernel
def _hash_bytes(data: Any, begin: int, end: int) -> Any:
    value = _BASIS
    for i in range(begin, end):
        value = (value ^ np.uint64(data[i])) * _PRIME
    return value


@kernel
def _parse_scalar(data: Any, at: int, end: int, path: Any, state: Any) -> int:
    """Read a string, number or literal, and store it if its path is known; return the end, -1 if it is invalid."""
    byte = data[at]
    if byte == 34:
        close = _string_end(data, at, end)
        if close < 0:
            return -1
        if path == _ID and _hash_bytes(data, at + 1, close) == state.own_id:
            state.is_own = 1
        return close + 1
    if byte == 116:  # true
        return _parse_literal(data, at, end, _TRUE, 1.0, path, state)
    if byte == 102:  # false
        return _parse_literal(data, at, end, _FALSE, 0.0, path, state)
    if byte == 110:  # null
        return _parse_literal(data, at, end, _NULL, np.nan, path, state)
    return _parse_number(data, at, end, path, state)


_TRUE, _FALSE, _NULL = (np.frombuffer(word, np.uint8) for word in (b"true", b"false", b"null"))


@kernel
def _parse_literal(data: Any, at: int, end: int, word: Any, value: float, path: Any, state: Any) -> int:
    if at + word.size > end:
        return -1
    for k in range(word.size):
        if data[at + k] != word[k]:
            return -1
    _store_value(state, path, value)
    return at + int(word.size)


@kernel
def _parse_number(data: Any, at: int, end: int, path: Any, state: Any) -> int:
    """Read a number with a relative error up to 1e-15, far below a device's resolution."""
    negative = data[at] == 45
    if negative:
        at += 1
    first, mantissa, power = at, 0.0, 0
    while at < end and 48 <= data[at] <= 57:
        mantissa = 10.0 * mantissa + (np.int64(data[at]) - 48)
        at += 1
    if at == first or (data[first] == 48 and at > first + 1):
        return -1
    if at < end and data[at] == 46:
        at += 1
        first = at
        while at < end and 48 <= data[at] <= 57:
            mantissa = 10.0 * mantissa + (np.int64(data[at]) - 48)
            power -= 1
            at += 1
        if at == first:
            return -1
    if at < end and (data[at] == 69 or data[at] == 101):
        at += 1
        down = at < end and data[at] == 45
        if at < end and (data[at] == 43 or data[at] == 45):
            at += 1
        first = at
        exponent: Any = 0
        while at < end and 48 <= data[at] <= 57:
            exponent = min(10 * exponent + (np.int64(data[at]) - 48), 9999)
            at += 1
        if at == first:
            return -1
        power += -exponent if down else exponent
    value = mantissa
    if power != 0 and mantissa != 0.0:
        tens = _TENS[min(abs(power), _TENS.size - 1)]
        value = mantissa / tens if power < 0 else mantissa * tens
    _store_value(state, path, -value if negative else value)
    return at


@kernel
def _store_value(state: Any, path: Any, value: float) -> None:
    for place in range(PLACES):
        if path == _CODES[place]:
            if place < _DEVICE_PLACES:
                state.candidate[place] = value
                state.seen |= 1 << place
            else:
                state.value[place] = value
                state.known |= 1 << place
