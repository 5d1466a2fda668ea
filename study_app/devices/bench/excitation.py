"""The forces of a bench test, computed between servo and device in the servo's own loop.

The servo presents no liquid. `BenchDriver` sits between it and the device and replaces its force by an excitation: a
spring to a position, a constant force, a chirp, a damper. A write that does not follow a reading is zero, and so is the
last write of a servo. The force ends at once if the handle oscillates or moves too far, if its stop button is pressed,
or if the device or the host stops responding; it then stays zero until the next excitation. `Stand` runs the servo on
the device: it applies excitations for a given time and returns the samples of that time.
"""

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from types import TracebackType
from typing import Any, Final, Self

import numpy as np

from study_app.devices.base import Device
from study_app.errors import DeviceError
from study_app.haptics.kernels import (
    READ,
    READ_LOST,
    READ_NEW,
    WRITE,
    Driver,
    call_at,
    can_have_moved,
    clear,
    command_at,
    copy,
    device_functions,
    is_finite,
    kernel,
    norm,
    reading_at,
    record_at,
    square_distance,
)
from study_app.haptics.model.layout import BUTTON_STOP, records
from study_app.haptics.runtime.clocks import Clock, SystemClock
from study_app.haptics.runtime.servo import Servo

RUNNING, OSCILLATES, MOVED, SILENT_DEVICE, SILENT_HOST, STOP_BUTTON = range(6)
ENDED: Final = {
    OSCILLATES: "the handle oscillated",
    MOVED: "the handle moved too far",
    SILENT_DEVICE: "the device did not report new positions",
    SILENT_HOST: "the program did not respond",
    STOP_BUTTON: "the stop button was pressed",
}

_EWMA_WEIGHT: Final = 0.1
"""Weight of the newest difference over 1 ms in the velocity of spring and damper: that of the servo's `ewma`."""
_PACE_MPS: Final = 0.03
_PUSH_NPS: Final = 2.0
SILENT_TICKS: Final = 20
_SHAKE_FILTER_S: Final = 8e-3  # time constant of a 20 Hz low-pass; what it removes counts as oscillation
_SHAKE_AVERAGE_S: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Excitation:
    """The excitation of the handle.

    Attributes
    ----------
    stiffness_npm, damping_nspm, integral_per_s, centre_m : the spring to a position
    push_n : the constant force, reached at 2 N/s
    axis, wave_n, from_hz, hz_per_s : the chirp; -1: none
    rise_nspm_per_s, most_nspm : how fast the damper grows, and its greatest value
    shake_limit_n : the greatest RMS force of the damper above 20 Hz; 0: unlimited
    reach_m : greatest distance of the handle from its initial position; 0: unlimited
    """

    stiffness_npm: float = 0.0
    damping_nspm: float = 0.0
    integral_per_s: float = 0.0
    centre_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    push_n: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: int = -1
    wave_n: float = 0.0
    from_hz: float = 0.0
    hz_per_s: float = 0.0
    rise_nspm_per_s: float = 0.0
    most_nspm: float = 0.0
    shake_limit_n: float = 0.0
    reach_m: float = 0.0


_DEFAULTS = asdict(Excitation())

_EXCITATION = np.dtype(
    [
        # the measured device
        ("context", np.intp),
        ("read", np.intp),
        ("write", np.intp),
        # written by the host
        ("armed", np.int64),  # 1: forces are sent
        ("alive_ns", np.int64),  # the host's latest report, on the servo's clock
        ("limit_n", np.float64),
        *((name, np.int64 if name == "axis" else np.float64, np.shape(default)) for name, default in _DEFAULTS.items()),
        # state of the loop
        ("ended", np.int64),  # RUNNING, or the reason why the excitation ended
        ("started", np.int64),
        ("pending", np.int64),  # 1 between a reading and its write
        ("silent", np.int64),  # readings without a usable new position in a row
        ("now_ns", np.int64),
        ("new_ns", np.int64),  # when the last new position was read
        ("position_m", np.float64, (3,)),
        ("from_m", np.float64, (3,)),  # position at the start of this excitation
        ("velocity_mps", np.float64, (3,)),
        ("aim_m", np.float64, (3,)),  # target of the spring, moving to the centre
        ("bias_n", np.float64, (3,)),
        ("pushed_n", np.float64, (3,)),
        ("wave_s", np.float64),
        ("damper_nspm", np.float64),
        ("slow_n", np.float64, (3,)),  # the damper's force below 20 Hz
        ("shake_n2", np.float64),  # mean square of the damper's remaining force
        ("force_n", np.float64, (3,)),
    ],
    align=True,
)

_excitation_at = record_at(_EXCITATION)
_inner_read, _inner_write = call_at(READ), call_at(WRITE)


class BenchDriver:
    """A driver between the servo and ``inner``; both must exist as long as the servo runs.

    Parameters
    ----------
    inner : the device that is measured, opened
    limit_n : the greatest force of an excitation [N]
    """

    def __init__(self, inner: Driver, limit_n: float) -> None:
        self.name = inner.name
        self.force_limit_n = inner.force_limit_n
        self.dynamics = inner.dynamics
        self._inner = inner
        self._memory = records(_EXCITATION, 1)
        self.state = self._memory[0]
        self.state.context, self.state.read, self.state.write = inner.context, inner.read.address, inner.write.address
        self.state.limit_n = limit_n
        self.context = int(self._memory.ctypes.data)
        self.read, self.write = device_functions(_read, _write)

    @property
    def failure(self) -> str | None:
        """The reason why the inner device failed, if it reports one."""
        return self._inner.failure

    def excite(self, excitation: Excitation) -> None:
        """Apply this excitation from the next reading on.

        A new spring starts at the handle's position; a spring that follows another one keeps its target and integral.
        """
        state = self.state
        state.armed = 0
        keeps_spring = state.stiffness_npm > 0.0 and excitation.stiffness_npm > 0.0 and state.ended == RUNNING
        for name in Excitation.__slots__:
            state[name] = getattr(excitation, name)
        state.wave_s = state.damper_nspm = state.shake_n2 = 0.0
        state.slow_n, state.from_m = 0.0, state.position_m
        state.ended = RUNNING
        if not keeps_spring:
            state.aim_m, state.bias_n, state.pushed_n = state.position_m, 0.0, 0.0
        state.armed = 1

    def end(self) -> None:
        """Send zero force from now on, until the next excitation."""
        self.state.armed = 0
        self.state.ended = RUNNING


def _read(context: int, now_ns: int, reading: int) -> int:
    bench = _excitation_at(context)
    answer: int = _inner_read(bench.read, bench.context, now_ns, reading)
    elapsed_s = (now_ns - bench.now_ns) * 1e-9 if bench.started != 0 else 0.0
    bench.now_ns = now_ns
    if answer == READ_LOST:
        bench.armed = 0
        return answer
    out = reading_at(reading)
    if answer == READ_NEW and _is_usable(bench, out.position_m, now_ns):
        _track_position(bench, out.position_m, now_ns)
    else:
        bench.silent += 1
    _check_end(bench, out.buttons)
    _update_force(bench, elapsed_s)
    bench.pending = 1
    return answer


def _write(context: int, command: int) -> int:
    bench, record = _excitation_at(context), command_at(command)
    if bench.pending != 0 and bench.armed != 0 and bench.ended == RUNNING:
        copy(bench.force_n, record.force_n)
    else:
        clear(record.force_n)
    bench.pending = 0
    copy(record.force_n, record.sent_n)
    answer: int = _inner_write(bench.write, bench.context, command)
    clear(record.force_n)  # the servo then records the force that was sent instead of its own
    return answer


@kernel
def _is_usable(bench: Any, position_m: Any, now_ns: int) -> bool:
    if bench.started == 0:
        return bool(is_finite(position_m))
    return bool(can_have_moved(bench.position_m, position_m, (now_ns - bench.new_ns) * 1e-9))


@kernel
def _track_position(bench: Any, position_m: Any, now_ns: int) -> None:
    interval_s = (now_ns - bench.new_ns) * 1e-9
    weight = 1.0 - (1.0 - _EWMA_WEIGHT) ** (interval_s * 1e3)
    for axis in range(3):
        if bench.started == 0 or interval_s <= 0.0:
            bench.velocity_mps[axis] = 0.0
        else:
            moved_mps = (position_m[axis] - bench.position_m[axis]) / interval_s
            bench.velocity_mps[axis] += weight * (moved_mps - bench.velocity_mps[axis])
        bench.position_m[axis] = position_m[axis]
    bench.new_ns = now_ns
    bench.silent = 0
    bench.started = 1


@kernel
def _check_end(bench: Any, buttons: int) -> None:
    if bench.ended != RUNNING or bench.armed == 0:
        return
    if buttons & BUTTON_STOP:
        bench.ended = STOP_BUTTON
    elif bench.now_ns > bench.alive_ns:
        bench.ended = SILENT_HOST
    elif bench.silent > SILENT_TICKS:
        bench.ended = SILENT_DEVICE
    elif bench.reach_m > 0.0 and square_distance(bench.position_m, bench.from_m) > bench.reach_m * bench.reach_m:
        bench.ended = MOVED
    elif bench.shake_limit_n > 0.0 and bench.shake_n2 > bench.shake_limit_n * bench.shake_limit_n:
        bench.ended = OSCILLATES


@kernel
def _update_force(bench: Any, elapsed_s: float) -> None:
    wave_n = 0.0
    if bench.wave_n > 0.0:
        bench.wave_s += elapsed_s
        turns = (bench.from_hz + 0.5 * bench.hz_per_s * bench.wave_s) * bench.wave_s
        wave_n = bench.wave_n * math.sin(2.0 * math.pi * turns)
    bench.damper_nspm = min(bench.damper_nspm + bench.rise_nspm_per_s * elapsed_s, bench.most_nspm)
    fast_n2 = 0.0
    for axis in range(3):
        bench.aim_m[axis] += _clamp(bench.centre_m[axis] - bench.aim_m[axis], _PACE_MPS * elapsed_s)
        error_m = bench.aim_m[axis] - bench.position_m[axis]
        spring_n = bench.stiffness_npm * error_m
        bench.bias_n[axis] += bench.integral_per_s * elapsed_s * spring_n
        bench.bias_n[axis] = _clamp(bench.bias_n[axis], 0.5 * bench.limit_n)
        bench.pushed_n[axis] += _clamp(bench.push_n[axis] - bench.pushed_n[axis], _PUSH_NPS * elapsed_s)
        damper_n = -bench.damper_nspm * bench.velocity_mps[axis]
        bench.slow_n[axis] += elapsed_s / (elapsed_s + _SHAKE_FILTER_S) * (damper_n - bench.slow_n[axis])
        fast_n2 += (damper_n - bench.slow_n[axis]) ** 2
        bench.force_n[axis] = (
            spring_n
            - bench.damping_nspm * bench.velocity_mps[axis]
            + bench.bias_n[axis]
            + bench.pushed_n[axis]
            + damper_n
            + (wave_n if axis == bench.axis else 0.0)
        )
    bench.shake_n2 += elapsed_s / (elapsed_s + _SHAKE_AVERAGE_S) * (fast_n2 - bench.shake_n2)
    size_n = norm(bench.force_n)
    if not math.isfinite(size_n):
        clear(bench.force_n)
    elif size_n > bench.limit_n:
        for axis in range(3):
            bench.force_n[axis] *= bench.limit_n / size_n


@kernel
def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


RATE_HZ: Final = 1000.0
_MAX_FORCE_N: Final = 4.0
"""Greatest force of an excitation, even if the device permits more."""
_CHECK_INTERVAL_S: Final = 0.02
_HOST_TIMEOUT_NS: Final = 500_000_000


class Stand:
    """The servo around a device that is measured; as a context manager it ends with zero force.

    Parameters
    ----------
    device : opened
    clock : default: the system's; a virtual one runs as fast as the computation
    """

    def __init__(self, device: Device, clock: Clock | None = None) -> None:
        self.device = device
        self.clock = clock or SystemClock()
        self.limit_n = min(device.force_limit_n, _MAX_FORCE_N)
        self._driver = BenchDriver(device, self.limit_n)
        self._servo = Servo(self._driver, clock=self.clock, rate_hz=RATE_HZ, elements=0)
        self._reader = self._servo.telemetry.reader()

    @property
    def position_m(self) -> Any:
        """The position of the handle (3,) [m, hand frame]."""
        return self._driver.state.position_m.copy()

    @property
    def damper_nspm(self) -> float:
        return float(self._driver.state.damper_nspm)

    @property
    def ended(self) -> str | None:
        """The reason why the excitation ended by itself; None while it continues."""
        return ENDED.get(int(self._driver.state.ended))

    @property
    def overruns(self) -> int:
        """The number of deadlines that the servo skipped."""
        return self._servo.overruns

    def excite(self, excitation: Excitation) -> None:
        """Apply this excitation from the next tick on."""
        self._report_alive()
        self._driver.excite(excitation)

    def run(
        self, seconds: float, *, answered: Callable[[], str | None] | None = None, may_end: bool = False
    ) -> tuple[Any, str | None]:
        """Let the servo run for a duration; return the samples and the operator's answer, if any.

        Parameters
        ----------
        answered : returns the operator's input, None without one
        may_end : whether the excitation may end by itself, in which case this returns at once

        Raises
        ------
        DeviceError
            The excitation ended by itself although it may not, or the device was lost.
        """
        self._reader.read()
        chunks, ticks_left = [], round(seconds * RATE_HZ)
        answer: str | None = None
        while ticks_left > 0 and answer is None:
            ticks = min(ticks_left, round(_CHECK_INTERVAL_S * RATE_HZ))
            self._report_alive()
            if self.clock.runs:
                time.sleep(ticks / RATE_HZ)
            else:
                self._servo.advance(ticks)
            ticks_left -= ticks
            chunks.append(self._reader.read())
            self._servo.check()
            answer = None if answered is None else answered()
            if self._driver.state.ended != RUNNING:
                if may_end:
                    break
                raise DeviceError(
                    f"the bench test stopped because {self.ended}; the force is zero: check the device, then start "
                    "again"
                )
        return np.concatenate(chunks).view(np.recarray) if chunks else self._reader.read(), answer

    def rest(self) -> None:
        self._driver.end()

    def _report_alive(self) -> None:
        self._driver.state.alive_ns = self._servo.now_ns() + _HOST_TIMEOUT_NS

    def __enter__(self) -> Self:
        if self.clock.runs:
            self._servo.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._driver.end()
        self._servo.stop()
