"""The common part of drivers with a compiled tick: opening, closing, guard, failures, receipt and diagnosis.

Such a driver has a record that begins with the fields of `COMMON`, and two C functions, which the servo calls. A call
uses the connection only between `enter` and `leave`. `release` rejects further calls and waits for a running one; a
call that outlasts it ends the force before it returns.
"""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, ClassVar, Final, Literal, Protocol, Self, TypeAlias

import numpy as np

from study_app.devices.base import Device
from study_app.devices.descriptor import OpenRequest
from study_app.devices.doctor import DeviceFailure, FailureTable, Report
from study_app.devices.guard import Guard
from study_app.devices.hand import hand_of
from study_app.devices.registry import descriptor_of
from study_app.errors import DeviceError, DeviceLost, ServoFault
from study_app.haptics.kernels import fence, full_fence, kernel
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.user_folder import settings_file

RUNS, RELEASED, FINISHED = range(3)
"""Values of ``ended``: open; closed by the program; not open, or closed during a call that then ended the force."""
FIRST_CAUSE: Final = 3
"""First value of ``ended`` that a driver may use for its own causes."""
LEAVE_S: Final = 0.5  # a read or a write takes a few milliseconds at most
_SILENT_NS: Final = 40_000_000  # after 50 ms without a new position the servo ends the force
SECONDS: Final = 3.0
_LEAST_HZ: Final = 900.0
_MOVE: Final = "Hold the handle and move it a little…"
_CHUNK_S = 0.25

COMMON: Final[list[tuple[Any, ...]]] = [
    ("now_ns", np.int64),  # time of the tick; stays first: an emulator reads it here
    ("ended", np.int64),  # RUNS, or the reason why calls are rejected
    ("inside", np.int64),  # 1 while a read or write runs, which may use the connection
    ("unguarded", np.int64),  # 1: the guard has died, so no force may be sent
    ("sent_n", np.float64, (3,)),  # the force that acts since the last command [N, hand frame]
    ("force_limit_n", np.float64),
    ("fresh_ns", np.int64),  # time of the last tick with a new position
    ("ticks", np.int64),
    ("fresh", np.int64),  # ticks with a new position
]


@kernel
def enter(device: Any) -> bool:
    """Claim the connection until `leave`; return whether it may be used."""
    device.inside = 1
    full_fence()
    if device.ended != RUNS:
        device.inside = 0
        return False
    return True


@kernel
def closed_during_call(device: Any) -> bool:
    """Return whether the device was closed during this call, which must then end the force before returning."""
    if device.ended != RELEASED:
        return False
    device.ended = FINISHED
    return True


@kernel
def leave(device: Any) -> None:
    """Mark the connection as no longer in use."""
    fence()
    device.inside = 0


def release(exchange: Any) -> bool:
    """Reject further calls and wait for a running call; return whether none is running any more."""
    if exchange.ended == RUNS:
        exchange.ended = RELEASED
    patience = time.perf_counter() + LEAVE_S
    while exchange.inside and time.perf_counter() < patience:
        time.sleep(0.001)
    return not exchange.inside


class Connection(Protocol):
    """Access to an open device: a library, a socket, a bridge, or an emulated one."""

    def close(self) -> object:
        """Close the connection; the force has already been ended."""


AtClose: TypeAlias = Literal["stand_down", "release", "leave"]
"""After closing, the guard is dismissed, ends the force, or ends it once the device is reconnected."""


class FramedDevice(Device):
    """A device with a record of `COMMON` and more fields, shape (1,), and C functions ``read`` and ``write``.

    A subclass defines its failures, connects, and prepares the device with zero force.
    """

    failures: ClassVar[FailureTable]
    causes: ClassVar[Mapping[int, str]] = {}
    """Mode of failure of each cause that ends the exchange."""
    silent: ClassVar[str] = "rate"
    """Mode of failure of a device that gives no new positions."""
    running: ClassVar[str]
    """First mode of failure that appears only while the device runs."""
    counted: ClassVar[Sequence[str]] = ("ticks", "fresh")
    ends_force: str | None = None
    """The function with which ``guard.Guard`` ends the force if the program dies; None: the device does so itself."""

    def __init__(
        self, memory: Any, workspace_m: tuple[float, float, float], force_limit_n: float, functions: tuple[Any, Any]
    ) -> None:
        self.workspace_m, self.force_limit_n = workspace_m, force_limit_n
        self.memory, self.exchange = memory, memory[0]
        self.exchange.ended = FINISHED
        self.context = int(memory.ctypes.data)
        self.read, self.write = functions
        self.found: dict[str, Any] = {}
        self.connection: Any = None
        self.guard: Guard | None = None
        self._left_guard: Guard | None = None  # of a device that may still exert force
        self._dynamics = UNKNOWN

    @classmethod
    def of(cls, request: OpenRequest) -> Self:
        """Return a closed device for a request."""
        raise NotImplementedError

    def _connect(self) -> Connection:
        """Return the open connection."""
        raise NotImplementedError

    def _prepare(self, connection: Any) -> Mapping[str, Any]:
        """Check the device and fill its memory, with the force at zero; return the fields for the receipt."""
        raise NotImplementedError

    def _finish(self, connection: Any) -> AtClose:
        """End the force by final commands, unless that was done already."""
        raise NotImplementedError

    def open(self) -> None:
        """Connect, check and prepare the device; its force is zero.

        Raises
        ------
        DeviceError
            The device is not connected or cannot be used; nothing is left open.
        """
        if self.connection is not None:
            if self.exchange.ended == RUNS:
                return
            self.close()
        if self.exchange.inside:
            raise DeviceError(
                f"a call to the device '{self.name}' has not returned: turn the device off, and restart this program"
            )
        self.connection = self._connect()
        try:
            self.found = dict(self._prepare(self.connection))
        except BaseException:
            self.close()
            raise
        self.exchange.ended = RUNS

    def close(self) -> None:
        """End the force and close the connection; a second call does nothing.

        While a call of the servo does not return, the connection stays open and guarded, and the call ends the force
        once it returns; closing again then closes the connection.
        """
        if self.connection is None or not release(self.exchange):
            return
        connection, self.connection = self.connection, None
        guard, self.guard = self.guard, None
        guard_action: AtClose = "release"
        try:
            guard_action = self._finish(connection)
        finally:  # an interrupt prevents neither closing nor the guard
            try:
                connection.close()
            finally:
                if guard is not None:
                    self._left_guard = guard if guard_action == "leave" else None
                    getattr(guard, guard_action)()

    def _start_guard(self, *arguments: str, needed: bool = True) -> None:
        """Start the guard, if ``needed``, with its function's arguments, and end a guard that was left running."""
        if needed and self.ends_force is not None:
            self.guard = Guard(self.name, self.ends_force, *arguments, died=self._lose_guard)
            self.guard.start()
        left, self._left_guard = self._left_guard, None
        if left is not None:
            left.recall()

    def _lose_guard(self) -> None:
        """Block every force from now on; called by the guard's thread."""
        self.exchange.unguarded = 1

    @property
    def dynamics(self) -> Dynamics:
        """Delay, encoder count and mass as reported by the device or measured by its bench."""
        return self._dynamics

    @property
    def counters(self) -> dict[str, int]:
        return {name: int(self.exchange[name]) for name in self.counted}

    @property
    def failure_mode(self) -> str | None:
        """The id in ``failures`` of the failure that ended the exchange; None while it runs."""
        state = self.exchange
        if state.unguarded:
            return "unguarded"
        silent = state.ticks and state.now_ns - state.fresh_ns > _SILENT_NS
        return self.silent if state.ended == RUNS and silent else self.causes.get(int(state.ended))

    @property
    def failure(self) -> str | None:
        """Symptom, cause and remedy of the failure that ended the exchange, as a sentence; None while it runs."""
        mode = self.failure_mode
        return None if mode is None else self.failures.sentence(mode, self._detail(mode))

    def _detail(self, mode: str) -> str:
        """Return the device's own message about a failure."""
        return ""

    def check(self) -> None:
        """Raise ``DeviceLost`` if its exchange has ended."""
        if (self.exchange.unguarded or self.exchange.ended != RUNS) and self.failure is not None:
            raise DeviceLost(self.failure)

    def describe(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "workspace_m": list(self.workspace_m),
            "force_limit_n": self.force_limit_n,
            "dynamics": self.dynamics.describe(),
            **self.found,
        }

    def observed(self) -> tuple[str, ...]:
        """Return the doctor's lines about the open device."""
        return ()

    def appeared(self, samples: Any) -> set[str]:
        """Return the failure modes that are visible in the samples of a run at rest."""
        return set() if self.failure_mode is None else {self.failure_mode}

    def take_fault(self, fault: str) -> None:
        """Simulate a fault, if the device is emulated."""
        raise DeviceError(f"faults can be simulated only with {self.name}-emulated, not with '{self.name}'")


def framed_device(name: str, request: OpenRequest) -> FramedDevice | None:
    """Return the closed device with this name; None if its driver is not a `FramedDevice`."""
    driver = descriptor_of(name).driver
    device: FramedDevice | None = resolve_name(driver).of(request) if driver else None
    return device


def dynamics_of(
    delay_s: float | None, count_m: float | None, mass_kg: float | None, *, name: str, serial: str | None
) -> Dynamics:
    """Return a device's dynamics as reported, or otherwise as measured by its latest bench on this computer.

    ``name`` and ``serial`` identify its bench; unreadable settings are ignored.
    """
    with suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
        for bench in json.loads(settings_file().read_bytes())["benches"]:
            if (bench["name"], bench["serial"]) == (name, serial or ""):
                count_m = count_m or bench.get("count_m")
                mass_kg = mass_kg or max(min(bench["mass_kg"]), 0.0)
    assumed = tuple(word for word, value in (("count_m", count_m), ("mass_kg", mass_kg)) if not value)
    return Dynamics(
        delay_s=delay_s, count_m=count_m or UNKNOWN.count_m, mass_kg=mass_kg or UNKNOWN.mass_kg, assumed=assumed
    )


def examine(
    name: str,
    *,
    options: Mapping[str, str | Path] | None = None,
    faults: Sequence[str] = (),
    progress: Callable[[str], object],
    seconds: float = SECONDS,
) -> Report:
    """Open a device with the driver of sessions, run it at rest, and return a report on its failure modes.

    Parameters
    ----------
    name : its name as for ``--device``
    options : values of its options, by name
    faults : of an emulated device
    progress : receives instructions, one line at a time
    seconds : duration of the run

    Raises
    ------
    DeviceError
        The device cannot have faults, or not these ones.
    """
    request = OpenRequest(argument=name.partition(":")[2], options=options or {}, progress=progress)
    device = framed_device(name, request)
    assert device is not None  # noqa: S101 - this kind of doctor belongs to a `FramedDevice`
    for fault in faults:
        device.take_fault(fault)
    table = device.failures
    try:
        device.open()
    except DeviceFailure as error:
        return Report((), table.findings({error.mode}, table.before(error.mode)), str(error))
    with device:
        progress(_MOVE)
        samples, fault_found = _run_at_rest(device, seconds)
        modes, fresh_hz = device.appeared(samples), _fresh_rate_hz(samples)
        observations = (*device.observed(), f"new positions per second: {fresh_hz:.0f}")
    if not modes and fresh_hz < _LEAST_HZ:
        modes = {"rate"}
    passed = {mode.id for mode in table.modes} if fault_found is None else table.before(device.running)
    return Report(observations, table.findings(modes, passed), fault_found)


def _run_at_rest(device: Device, seconds: float) -> tuple[Any, str | None]:
    """Run an open device without force; a simulated hand moves in virtual time.

    Return the samples (n,) and the reason why the servo stopped itself, or None.
    """
    hand = hand_of(device)
    chunks: list[Any] = []
    with Servo(device, clock=None if hand is None else VirtualClock()) as servo:
        reader = servo.telemetry.reader()
        for _ in range(max(round(seconds / _CHUNK_S), 1)):
            if hand is None:
                time.sleep(_CHUNK_S)
            else:
                hand.reach_to(0.01 * (-1) ** len(chunks), 0.005, 0.0)
                servo.advance(round(_CHUNK_S * servo.rate_hz))
            chunks.append(np.asarray(reader.read()).copy())
        fault = None
        try:
            servo.check()
        except (DeviceLost, ServoFault) as error:
            fault = str(error)
    return np.concatenate(chunks), fault


def _fresh_rate_hz(samples: Any) -> float:
    """Return the number of new positions per second in samples at 1 kHz."""
    return float(samples["fresh"].sum()) / max(len(samples), 1) * 1000.0
