"""Frames of a WebSocket client, compiled: RFC 6455 §5.2 (layout), §5.3 (masking), §5.5 (control frames).

A client masks what it sends; a server must not (§5.1). The service answers each message with one text frame, so
fragments (§5.4) are not expected and count as a violation of the protocol.
"""

from typing import Any, Final

import numpy as np

from study_app.haptics.kernels.compiled import kernel

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
    """Read the header of the frame that begins at ``begin``.

    Parameters
    ----------
    data : (n,) array
        Bytes received, of which those before ``end`` are valid.
    begin, end : int
        Where the frame begins, and how far bytes were received.
    header : (2,) array
        Is given the opcode and the length of the payload [bytes].

    Returns
    -------
    int
        The length of the header [bytes], `INCOMPLETE` where more bytes are needed, or `VIOLATION`.
    """
    if end - begin < 2:
        return INCOMPLETE
    first: Any = np.int64(data[begin])
    second: Any = np.int64(data[begin + 1])
    opcode = first & 0x0F
    control = opcode >= CLOSE
    if first & 0xF0 != _FIN or second & _MASKED or opcode not in (TEXT, CLOSE, PING, PONG):
        return VIOLATION
    size, length = 2, second
    if length > LONGEST_CONTROL:
        if control:
            return VIOLATION
        more = 2 if length == 126 else 8
        size = 2 + more
        if end - begin < size:
            return INCOMPLETE
        length = 0
        for k in range(more):
            length = (length << 8) | np.int64(data[begin + 2 + k])
        if length < 0:
            return VIOLATION
    header[0] = opcode
    header[1] = length
    return size


@kernel
def build_frame(out: Any, opcode: int, payload: Any, length: int, key: int) -> int:
    """Write a masked frame into ``out`` and return its length [bytes].

    Parameters
    ----------
    out : (n,) array
        Bytes; 8 more than the payload.
    opcode : int
        `TEXT`, `CLOSE` or `PONG`.
    payload : (m,) array
        Bytes, of which ``length`` are sent: less than 65,536.
    length : int
        Of the payload [bytes].
    key : int
        The masking key, 32 bits.
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
