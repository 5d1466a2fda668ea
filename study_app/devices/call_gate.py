"""The gate between a driver's read and write, which the servo calls, and the thread that opens and closes the device.

An exchange's record has the fields of ``GATE``. A call uses the connection between `enter` and `leave` only. `let_go`
rejects further calls and waits for a running one; a call that outlasts it ends the force before it returns.
"""

import time
from typing import Any, Final

import numpy as np

from study_app.errors import DeviceError
from study_app.haptics.kernels.c_functions import fence, full_fence
from study_app.haptics.kernels.compiled import kernel

RUNS, LET_GO, FINISHED = range(3)
"""Values of ``ended``: open; closed by the program, or not open; closed, and ended by a call that outlasted it."""
FIRST_CAUSE: Final = 3
"""First value of a driver's own causes for ending the exchange."""
LEAVE_S: Final = 0.5  # a read or a write takes a few milliseconds at most

GATE: Final[list[tuple[Any, ...]]] = [
    ("ended", np.int64),  # RUNS, or why calls are rejected
    ("inside", np.int64),  # 1 while a read or write runs, which may use the connection
    ("sent_n", np.float64, (3,)),  # the force that acts since the last command [N, hand frame]
]


@kernel
def enter(device: Any) -> bool:
    """Return whether the connection may be used, until `leave`."""
    device.inside = 1
    full_fence()
    if device.ended != RUNS:
        device.inside = 0
        return False
    return True


@kernel
def outlasted(device: Any) -> bool:
    """Return whether the device was closed during this call, which then must end the force before it returns."""
    if device.ended != LET_GO:
        return False
    device.ended = FINISHED
    return True


@kernel
def leave(device: Any) -> None:
    """Mark the connection as no longer in use."""
    fence()
    device.inside = 0


def check_left(exchange: Any, name: str) -> None:
    """Raise ``DeviceError`` if a call that outlasted `let_go` has not returned yet: its memory must stay."""
    if exchange.inside:
        raise DeviceError(f"a call to the device '{name}' does not return: turn it off, and start this program again")


def let_go(exchange: Any) -> bool:
    """Reject further calls and wait for a running one; return whether none is left."""
    if exchange.ended == RUNS:
        exchange.ended = LET_GO
    patience = time.monotonic() + LEAVE_S
    while exchange.inside and time.monotonic() < patience:
        time.sleep(0.001)
    return not exchange.inside
