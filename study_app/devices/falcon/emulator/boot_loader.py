"""The emulated Falcon's processor before it has a program: pinged at 9600 baud, timed by an 'A', loaded byte by byte.

It knows the boot stream of TI's loader (SPRUI33): little-endian words, the key 0x08AA, eight reserved words, the entry
point, then blocks of (count, destination, words) until a count of 0, after which the program runs. After invalid data
it does not answer until it is pinged again.
"""

from typing import Any, Final

import numpy as np

from study_app.devices.falcon.emulator.faults import ECHO, ECHO_PREFIX, GLUED, strikes
from study_app.devices.falcon.emulator.ftdi_bridge import answer
from study_app.devices.falcon.wire import constants
from study_app.haptics.kernels.compiled import kernel

WAITING, RESET, PINGED, LOADING, STUCK, RUNNING = range(6)
"""States: powered; reset by DTR; ping answered; speed known; data invalid; program loaded."""

LOADER = np.dtype(
    [
        ("state", np.int64),
        ("matched", np.int64),  # bytes of a ping that came in a row
        ("loaded", np.int64),  # bytes of the stream so far
        ("low", np.int64),  # the first byte of the word that is coming
        ("words", np.int64),  # of the block that is coming, its destination counted; 0: its count comes next
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
_GLUED_BYTES = (0x00, 0x0D)


@kernel
def reset(loader: Any) -> None:
    """Clear the program."""
    loader.state = RESET
    loader.matched = 0
    loader.loaded = 0
    loader.words = 0
    loader.blocks = 0


@kernel
def load(loader: Any, bridge: Any, faults: Any, value: int, divisor: int, at_ns: int) -> None:
    """Receive a byte that came at ``at_ns``, over the line at this speed."""
    if loader.state == RESET:
        if divisor == constants.BAUD_9600:
            _hear_ping(loader, bridge, faults, value, at_ns)
    elif loader.state == PINGED:
        if divisor == constants.BAUD_9600:
            _hear_ping(loader, bridge, faults, value, at_ns)
        elif divisor == constants.BAUD_142857 and value == constants.AUTOBAUD[0]:
            if strikes(faults, ECHO_PREFIX):
                answer(bridge, _PREFIX, at_ns + _ECHO_NS, divisor)
            answer(bridge, value, at_ns + _ECHO_NS, divisor)
            loader.state = LOADING
    elif loader.state == LOADING:
        if divisor == constants.BAUD_142857:
            echoed = value ^ 0x10 if strikes(faults, ECHO) else value
            answer(bridge, echoed, at_ns + _ECHO_NS, divisor)
            _take(loader, value)
        else:
            loader.state = STUCK


@kernel
def _hear_ping(loader: Any, bridge: Any, faults: Any, value: int, at_ns: int) -> None:
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
        answer(bridge, 0, at_ns + _PONG_NS, constants.BAUD_9600)
    for k in range(len(_PONG)):
        answer(bridge, _PONG[k], at_ns + _PONG_NS, constants.BAUD_9600)
    if strikes(faults, GLUED):
        for k in range(len(_GLUED_BYTES)):
            answer(bridge, _GLUED_BYTES[k], at_ns + _PONG_NS, constants.BAUD_9600)
    loader.state = PINGED


@kernel
def _take(loader: Any, value: int) -> None:
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
