"""The Falcon as a device: opened with its program loaded, homed and guarded; closed without torque."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from study_app.devices.base import Device
from study_app.devices.call_gate import FINISHED, RUNS, check_left, let_go
from study_app.devices.falcon import boot
from study_app.devices.falcon.exchange import (
    BRIDGE_LOST,
    COUNTERS,
    FORCE_LIMIT_N,
    LEAST_MASS_KG,
    exchange_functions,
    new_exchange,
)
from study_app.devices.falcon.failures import BY_ID, OPEN, Facts, ProgramMissing, sentence, usb_failure
from study_app.devices.falcon.firmware import check
from study_app.devices.falcon.homing import PATIENCE_S, home
from study_app.devices.falcon.mechanics import calibration
from study_app.devices.falcon.mechanics.geometry import DEFAULT_GEOMETRY, WORKSPACE_M, geometry_named
from study_app.devices.falcon.mechanics.kinematics import REACHED, count_at, inverse, new_mechanism
from study_app.devices.falcon.transport.bulk_calls import BulkCalls
from study_app.devices.falcon.transport.transport import Transport, end_torque, open_transport, quiet
from study_app.devices.falcon.wire.constants import ERROR_NO_DEVICE
from study_app.devices.guard import DIED, Guard
from study_app.errors import DeviceError, DeviceLost
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.layout import new_command, new_reading

ENDS_TORQUE: Final = f"{end_torque.__module__}:{end_torque.__name__}"
_SILENT_TICKS: Final = 40  # after 50 ms without a new position the servo ends the force
_FARTHEST = 1700  # counts, slightly more than are used in practice
_CLOSED = BulkCalls(0, 0)


class FalconDevice(Device):
    """A Novint Falcon, or an emulated one, behind a bridge.

    Parameters
    ----------
    bridge : the argument of ``transport.open_transport``
    firmware : file of its program, which it needs after it was switched on
    workspace_m : half extents of the grip's required workspace [m]
    force_limit_n : the greatest force that may be commanded [N]
    geometry : published dimensions, unless a calibration names others
    progress : receives instructions while it is opened, one line at a time
    cancelled : returns during homing whether to stop
    patience_s : time limit of homing [s]
    """

    name = "falcon"
    guarded = True

    def __init__(
        self,
        bridge: str = "falcon",
        *,
        firmware: str | Path | None = None,
        workspace_m: tuple[float, float, float] = WORKSPACE_M,
        force_limit_n: float = FORCE_LIMIT_N,
        geometry: str = DEFAULT_GEOMETRY,
        progress: Callable[[str], object] | None = None,
        cancelled: Callable[[], bool] | None = None,
        patience_s: float = PATIENCE_S,
    ) -> None:
        self.bridge = bridge
        self.name = bridge.partition(":")[0]
        self.workspace_m = workspace_m
        self.force_limit_n = force_limit_n
        self._firmware = firmware
        self._published = self._geometry = geometry_named(geometry)
        self._progress = progress if progress is not None else _say_nothing
        self._cancelled = cancelled
        self._patience_s = patience_s
        self.transport: Transport | None = None
        self.guard: Guard | None = None
        self._left_guard: Guard | None = None  # of a link that was lost
        self._calibration: calibration.Calibration | None = None
        self._guard_died = False
        self._found: dict[str, Any] = {}
        self.reading, self._command = new_reading(), new_command()
        self._round_trip_s: float | None = None
        mechanism = new_mechanism(self._geometry, calibration.UNCALIBRATED_UNITS_PER_NM)
        self._count_m = count_at(mechanism, self._geometry.centre_m)
        self._check_reach(mechanism)
        self.memory = new_exchange(_CLOSED, mechanism, self._geometry, force_limit_n)
        self.falcon = self.memory[0]
        self.falcon.ended = FINISHED
        self.context = int(self.memory.ctypes.data)
        self.read, self.write = exchange_functions()

    def open(self) -> None:
        """Open the bridge, load the program if needed, and home it with instructions; then start its guard.

        Raises
        ------
        DeviceError
            It is not there, cannot be opened, needs its program, or was not homed.
        """
        if self.transport is not None:
            if self.falcon.ended == RUNS:
                return
            self.close()
        check_left(self.falcon, self.name)
        transport = self._open_bridge()
        self._guard_died = False
        try:
            self._found = {"serial": transport.serial, "firmware": self._run_program(transport)}
            self._found |= self._hasten(transport)
            self._calibrate(transport.serial)
            self.transport = transport
            if self.guarded:
                self.guard = Guard(self.name, ENDS_TORQUE, transport.name, died=self._lose_guard)
                self.guard.start()
            if self._left_guard is not None:
                self._left_guard.recall()
                self._left_guard = None
            self._home(transport)
        except BaseException:
            self.transport = transport
            self.close()
            raise

    def close(self) -> None:
        """Send zero torque several times and release the device; a second call does nothing.

        While a servo's loop hangs in a call of the bridge, the device stays open and guarded, so that the loop can end
        the force when the call returns; a later call of ``close`` closes it.
        """
        if not let_go(self.falcon):
            return
        used, gone = bool(self.falcon.handle), self.falcon.ended == BRIDGE_LOST
        transport, self.transport = self.transport, None
        guard, self.guard = self.guard, None
        pushing = gone and bool(self.falcon.units.any())
        self.falcon.handle, self.falcon.transfer = _CLOSED
        if transport is None:
            return
        quieted = not used
        try:
            quieted = quieted or quiet(transport) > 0
            self.falcon.sent_n = 0.0 if quieted else self.falcon.sent_n
        finally:  # an interrupt prevents neither its release nor its guard
            try:
                transport.close()
            finally:
                if guard is not None:
                    self._left_guard = guard if pushing else None
                    (guard.leave if pushing else guard.stand_down if quieted or gone else guard.release)()

    @property
    def dynamics(self) -> Dynamics:
        """The round trip that was measured when it was opened, an encoder's count at the grip, and its least mass."""
        return Dynamics(self._round_trip_s, self._count_m, LEAST_MASS_KG)

    @property
    def counters(self) -> dict[str, int]:
        """Numbers of ticks, packets and errors since it was homed: see ``exchange.FALCON``."""
        return {name: int(self.falcon[name]) for name in COUNTERS}

    @property
    def held(self) -> tuple[Any, Any]:
        """The encoder counts of its last reply and its last torque command in motor units, each (3,)."""
        return self.falcon.status.encoders.copy(), self.falcon.units.copy()

    def check(self) -> None:
        """Raise ``DeviceLost`` if its guard has died: no force is sent any more, and its reads say that it is lost."""
        if self._guard_died:
            raise DeviceLost(DIED)

    @property
    def failure(self) -> str | None:
        """Cause and cure of what ended the exchange, in a sentence; None while nothing did."""
        state = self.falcon
        if self._guard_died:
            return DIED
        if state.ended == BRIDGE_LOST:
            return sentence(Facts(usb="no-device"))
        if state.ended != RUNS or state.apart <= _SILENT_TICKS:
            return None
        if state.unhomed:
            return f"it is no longer homed: {BY_ID['power'].cure(sys.platform)}"
        failed = 2 * (state.read_errors + state.write_errors) > state.apart
        return sentence(Facts(usb="io") if failed else Facts(replies=False))

    def describe(self) -> dict[str, Any]:
        """Return its record for the receipt."""
        used = self._calibration
        return {
            "name": self.name,
            "workspace_m": list(self.workspace_m),
            "force_limit_n": self.force_limit_n,
            "geometry": self._geometry.name,
            "calibration": "none" if used is None else used.describe(),
            "units_per_nm": float(self.falcon.mechanism.units_per_nm),
            "dynamics": self.dynamics.describe(),
            "delay_ticks": int(self.falcon.delay),
            **self._found,
        }

    def _open_bridge(self) -> Transport:
        return open_transport(self.bridge)

    def _check_reach(self, mechanism: Any) -> None:
        """Refuse a workspace that the arms do not reach."""
        theta = np.zeros(3)
        for corner in np.array(np.meshgrid(*((-half, half) for half in self.workspace_m))).reshape(3, -1).T:
            reached = inverse(mechanism, np.add(corner, [0.0, 0.0, self._geometry.centre_m]), theta) == REACHED
            if not reached or np.abs((theta - mechanism.zero_rad) / mechanism.rad_per_count).max() > _FARTHEST:
                asked, known = (
                    " x ".join(f"{2000 * half:g}" for half in size) for size in (self.workspace_m, WORKSPACE_M)
                )
                raise DeviceError(
                    f"a workspace of {asked} mm is more than a Falcon reaches; {known} mm is about the most: make the "
                    "protocol's workspace_mm smaller"
                )

    def _run_program(self, transport: Transport) -> str:
        """Load its program if it does not run; return which one runs."""
        boot.configure(transport)
        if boot.is_running(transport):
            return "already running"
        if self._firmware is None:
            facts = Facts(usb=OPEN, program="needed")
            raise ProgramMissing(f"the Falcon cannot be used: {sentence(facts)}", facts)
        try:
            program = Path(self._firmware).read_bytes()
        except OSError as error:
            raise ProgramMissing(
                f"the firmware {self._firmware} cannot be read: {error.strerror}", Facts(usb=OPEN, program="refused")
            ) from error
        found = check(program)
        unknown = f"SHA-256 {found.sha256[:16]}…, which is none of those that are known to work"
        self._progress(f"Loading the Falcon's firmware, {found.name or unknown}.")
        return boot.boot(transport, program, progress=self._progress).sha256

    def _hasten(self, transport: Transport) -> dict[str, Any]:
        """Measure the round trip with and without the bridge's event character, and use the faster setting."""
        boot.set_event_character(transport, on=False)
        plain_s = boot.measure_round_trip(transport)
        boot.set_event_character(transport, on=True)
        hastened_s = boot.measure_round_trip(transport)
        better = hastened_s < plain_s
        self._round_trip_s = min(plain_s, hastened_s)
        if not better:
            boot.set_event_character(transport, on=False)
        return {
            "event_character": better,
            "round_trip_ms": {"with": round(1000 * hastened_s, 3), "without": round(1000 * plain_s, 3)},
        }

    def _calibrate(self, serial: str | None) -> None:
        """Use the calibration of this Falcon, not that of another opened before."""
        self._calibration = used = calibration.load(serial) if serial else None
        self._geometry = self._published if used is None else geometry_named(used.geometry)
        gain = calibration.UNCALIBRATED_UNITS_PER_NM if used is None else used.units_per_nm
        self.falcon.mechanism = new_mechanism(self._geometry, gain, 0.0 if used is None else used.arm_offset_rad)
        self._count_m = count_at(self.falcon.mechanism, self._geometry.centre_m)

    def _home(self, transport: Transport) -> None:
        mechanism = self.falcon.mechanism.copy()
        self.memory[:] = new_exchange(transport.calls(), mechanism, self._geometry, self.force_limit_n)
        self.falcon.unguarded = int(self._guard_died)
        home(self.falcon, self._tick, transport.now_s, self._progress, patience_s=self._patience_s)
        self._begin_anew()

    def _lose_guard(self) -> None:
        """Block every force from now on; called by the guard's thread."""
        self._guard_died = True
        self.falcon.unguarded = 1

    def _begin_anew(self) -> None:
        """Fade the force in over half a second from the next tick on, and reset the counters."""
        self.falcon.share = 0.0
        self.falcon.started = 0
        for name in COUNTERS:
            self.falcon[name] = 0

    def _tick(self) -> None:
        """Run a tick without force."""
        transport = self.transport
        assert transport is not None  # noqa: S101 - it is being opened
        now_ns = round(1e9 * transport.now_s())
        self.read.ctypes(self.context, now_ns, int(self.reading.ctypes.data))
        self.write.ctypes(self.context, int(self._command.ctypes.data))
        self.check()
        if self.falcon.ended != RUNS:
            raise usb_failure(ERROR_NO_DEVICE, "homing it")
        if self._cancelled is not None and self._cancelled():
            raise DeviceError("homing the Falcon was cancelled")
        transport.pause(0.001)


def _say_nothing(_line: str) -> None:
    """Report nothing."""
