"""A device that injects faults on purpose: it passes on another device's readings and sometimes falsifies them.

The kind, time and duration of each fault are drawn from its own random numbers inside the servo's loop, so with a
virtual clock the same seed gives the same faults at the same readings. Its memory counts the injected faults, which are
compared with telemetry, and records the forces that were written, as they would reach the hand.
"""

import math
from typing import Any, Final

import numpy as np

from study_app.haptics.kernels import (
    READ,
    READ_LOST,
    READ_NOTHING_NEW,
    WRITE,
    Driver,
    call_at,
    command_at,
    copy,
    device_functions,
    kernel,
    norm,
    random,
    reading_at,
    record_at,
)
from study_app.haptics.model.layout import BUTTON_STOP, records
from study_app.haptics.runtime.clocks import VIRTUAL, Clock

NON_FINITE, GLITCH, SILENCE, JUMP, BUTTON, LOST, LOST_AT_WRITE = range(7)
KINDS: Final = ("non_finite", "glitch", "silence", "clock_jump", "stop_button", "lost", "lost_at_write")
_NONE: Final = -1

GLITCH_M: Final = 0.1  # per millisecond: 100 m/s
_MIN_JUMP_NS: Final = 1_000_000
_MAX_JUMP_NS: Final = 2_000_000_000

FAULTS = np.dtype(
    [
        # the device that is read and written, and the clock that may jump (0: none)
        ("device", np.intp),
        ("read", np.intp),
        ("write", np.intp),
        ("clock", np.intp),
        # permitted faults, written by the host
        ("share", np.float64, (len(KINDS),)),  # fraction of each kind of fault; all 0: no faults
        ("least", np.int64, (len(KINDS),)),  # least and greatest number of readings of a fault
        ("most", np.int64, (len(KINDS),)),
        ("gap", np.int64, (2,)),  # least and greatest number of sound readings between two faults
        # current state
        ("random", np.uint64),
        ("kind", np.int64),  # of the current fault or the next one
        ("wait", np.int64),  # sound readings before it
        ("left", np.int64),  # readings it still lasts
        ("choice", np.int64),  # drawn once per fault: selects the axis and the invalid number
        ("losing", np.int64),  # 1: the next write returns that the device is lost
        # counts
        ("reads", np.int64),
        ("injected", np.int64, (len(KINDS),)),  # readings
        ("episodes", np.int64, (len(KINDS),)),
        ("jumped_ns", np.int64),
        ("writes", np.int64),
        ("not_finite", np.int64),  # non-finite forces written
        ("most_n", np.float64),  # the greatest force written
        ("last_n", np.float64, (3,)),
    ],
    align=True,
)

_faults_at = record_at(FAULTS)
_virtual_at = record_at(VIRTUAL)
_inner_read, _inner_write = call_at(READ), call_at(WRITE)


class FaultyDevice:
    """A device that injects faults between the servo and ``inner``, an opened device that must outlive the servo.

    ``clock`` is the servo's; a clock that advances by itself never jumps. The kinds and times of the faults follow from
    ``seed``.
    """

    def __init__(self, inner: Driver, clock: Clock, seed: int) -> None:
        self.name = inner.name
        self.force_limit_n = inner.force_limit_n
        self.dynamics = inner.dynamics
        self.jumps = not clock.runs
        self._kept = (inner, clock)
        self._memory = records(FAULTS, 1)
        self.state = self._memory[0]
        self.state.device, self.state.read, self.state.write = inner.context, inner.read.address, inner.write.address
        self.state.clock = clock.context if self.jumps else 0
        self.state.random = 0x9E3779B97F4A7C15 ^ (seed + 1)
        self.state.kind = _NONE
        self.context = int(self._memory.ctypes.data)
        self.read, self.write = device_functions(_read, _write)

    @property
    def failure(self) -> str | None:
        """The reason why the inner device failed, if it reports one."""
        return self._kept[0].failure

    def allow(self, faults: dict[int, tuple[float, int, int]], gap: tuple[int, int]) -> None:
        """Permit these kinds of faults from the next one on.

        ``faults`` gives for each kind its fraction of all faults, and its least and greatest number of readings.
        ``gap`` is the least and greatest number of sound readings between two faults.
        """
        state = self.state
        state.share = 0.0
        for kind, (proportion, minimum, maximum) in faults.items():
            state.share[kind], state.least[kind], state.most[kind] = proportion, minimum, maximum
        if not self.jumps:
            state.share[JUMP] = 0.0
        state.gap = gap
        state.kind = _NONE


@kernel
def _next_fault(faults: Any) -> int:
    """Return the kind of fault of this reading, or `_NONE`."""
    kind: int = faults.kind  # read once: the host may allow other faults meanwhile
    if kind == _NONE:
        kind = _draw_fault(faults)
    if kind == _NONE:
        return _NONE
    if faults.wait > 0:
        faults.wait -= 1
        return _NONE
    faults.left -= 1
    faults.injected[kind] += 1
    if faults.left <= 0:
        faults.episodes[kind] += 1
        faults.kind = _NONE
    return kind


@kernel
def _draw_fault(faults: Any) -> int:
    """Draw kind, start and duration of the next fault; return its kind, or `_NONE`."""
    total = 0.0
    for share in faults.share:
        total += share
    if total <= 0.0:
        return _NONE
    point = total * random(faults)
    kind = 0
    while kind < len(KINDS) - 1 and point >= faults.share[kind]:
        point -= faults.share[kind]
        kind += 1
    faults.wait = _draw_integer(faults, faults.gap[0], faults.gap[1])
    faults.left = _draw_integer(faults, faults.least[kind], faults.most[kind])
    faults.choice = _draw_integer(faults, 0, 8)
    faults.kind = kind
    return kind


@kernel
def _draw_integer(faults: Any, least: int, most: int) -> int:
    return least + int(random(faults) * (most - least + 1))


@kernel
def _non_finite(choice: int) -> float:
    """Return NaN, infinity or minus infinity."""
    if choice < 3:
        return math.nan
    return math.inf if choice < 6 else -math.inf


def _read(context: int, now_ns: int, reading: int) -> int:
    faults = _faults_at(context)
    faults.reads += 1
    kind = _next_fault(faults)
    if kind == LOST:
        return READ_LOST
    if kind == SILENCE:
        return READ_NOTHING_NEW
    answer: int = _inner_read(faults.read, faults.device, now_ns, reading)
    out = reading_at(reading)
    axis = faults.choice % 3
    if kind == NON_FINITE:
        out.position_m[axis] = _non_finite(faults.choice)
    elif kind == GLITCH:
        out.position_m[axis] += math.copysign(GLITCH_M, out.position_m[axis])
    elif kind == BUTTON:
        out.buttons |= BUTTON_STOP
    elif kind == LOST_AT_WRITE:
        faults.losing = 1
    elif kind == JUMP:
        jump_ns = _draw_integer(faults, _MIN_JUMP_NS, _MAX_JUMP_NS)
        _virtual_at(faults.clock).now_ns += jump_ns
        faults.jumped_ns += jump_ns
    return answer


def _write(context: int, command: int) -> int:
    faults, force_n = _faults_at(context), command_at(command).force_n
    faults.writes += 1
    size_n = norm(force_n)
    if math.isfinite(size_n):
        faults.most_n = max(faults.most_n, size_n)
    else:
        faults.not_finite += 1
    copy(force_n, faults.last_n)
    answer: int = _inner_write(faults.write, faults.device, command)
    if faults.losing != 0:
        faults.losing = 0
        return READ_LOST
    return answer
