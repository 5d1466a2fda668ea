"""The Falcon's driver: opening it loads the firmware, guides the homing and starts the guard; closing it ends torque.

The arms find their index while the grip is pushed in. Before that, the encoder counts have no known origin, so no force
is sent. The out-stroke that follows confirms the positions, and that the hand is where the force fades in.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Final, Self

import numpy as np

from study_app.devices.descriptor import OpenRequest
from study_app.devices.driver import RUNS, AtClose, FramedDevice
from study_app.devices.falcon import boot, calibration, exchange, mechanics
from study_app.devices.falcon.bulk import BulkCalls
from study_app.devices.falcon.constants import ERROR_NO_DEVICE
from study_app.devices.falcon.failures import FAILURES, LONGEST_ROUND_TRIP_S, MOST_BROKEN, usb_failure
from study_app.devices.falcon.replies import ALL_HOMED
from study_app.devices.falcon.transport import Transport, end_torque, open_transport, send_zero_torque
from study_app.errors import DeviceError
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.layout import new_command, new_reading

PATIENCE_S: Final = 120.0
_REMINDERS: Final = 6  # number of reminders in that time
_MOVED_COUNTS: Final = 60  # counts by which an arm must turn to count as motion of the grip: two degrees
STROKES: Final = "Homing (red light): pull the Falcon's grip all the way out, then push it all the way in."
PULL_OUT: Final = "Homed (blue light): now pull the grip all the way out once more."
READY: Final = "The Falcon is ready (green light)."
_MAX_COUNTS = 1700  # counts, slightly more than occur in practice
_FROZEN_M = 5e-6  # a third of the least effect of one encoder count
_SKIPPED_SAMPLES = 100  # samples before positions are those of the grip


class FalconDevice(FramedDevice):
    """A Novint Falcon, or an emulated one.

    Parameters
    ----------
    serial : serial number of its bridge; "": the first one
    firmware : firmware file, needed after power-on
    geometry : name of published dimensions; those of a calibration have precedence
    progress : receives instructions while it is opened, one line at a time
    cancelled : returns during homing whether to stop
    patience_s : time limit of homing [s]
    """

    name = "falcon"
    failures, counted, silent, running = FAILURES, exchange.COUNTERS, "power", "unplugged"
    causes: ClassVar[Mapping[int, str]] = {exchange.BRIDGE_LOST: "unplugged"}
    ends_force: str | None = f"{end_torque.__module__}:{end_torque.__name__}"

    def __init__(
        self,
        serial: str = "",
        *,
        firmware: str | Path | None = None,
        workspace_m: tuple[float, float, float] = mechanics.WORKSPACE_M,
        force_limit_n: float = exchange.FORCE_LIMIT_N,
        geometry: str = mechanics.DEFAULT_GEOMETRY,
        progress: Callable[[str], object] | None = None,
        cancelled: Callable[[], bool] | None = None,
        patience_s: float = PATIENCE_S,
    ) -> None:
        self._serial, self._firmware, self._patience_s = serial, firmware, patience_s
        self._geometry = mechanics.geometry_named(geometry)
        self._progress = progress if progress is not None else str
        self._cancelled = cancelled
        self.reading, self._command = new_reading(), new_command()
        mechanism = mechanics.new_mechanism(self._geometry, calibration.UNCALIBRATED_UNITS_PER_NM)
        memory = exchange.new_exchange(BulkCalls(0, 0), mechanism, self._geometry, force_limit_n)
        super().__init__(memory, workspace_m, force_limit_n, exchange.exchange_functions())
        self._dynamics = Dynamics(
            delay_s=None, count_m=mechanics.count_at(mechanism, self._geometry.centre_m), mass_kg=exchange.LEAST_MASS_KG
        )
        self._check_reach(mechanism)

    @classmethod
    def of(cls, request: OpenRequest) -> Self:
        return cls(request.argument, **cls._device_options(request))

    @staticmethod
    def _device_options(request: OpenRequest) -> dict[str, Any]:
        firmware = request.options.get("firmware")
        return {"firmware": firmware, "progress": request.progress, "cancelled": request.cancelled, **request.limits}

    def _connect(self) -> Transport:
        return open_transport(self._serial)

    def _prepare(self, connection: Transport) -> dict[str, Any]:
        """Load the firmware if needed, measure the round trip, start the guard, and guide the homing."""
        serial = connection.serial
        facts: dict[str, Any] = {"serial": serial, "firmware": self._run_firmware(connection)}
        round_trip_s, event_character = boot.choose_event_character(connection)
        stored = calibration.load_calibration(serial) if serial else None
        geometry = self._geometry if stored is None else mechanics.geometry_named(stored.geometry)
        gain = calibration.UNCALIBRATED_UNITS_PER_NM if stored is None else stored.units_per_nm
        mechanism = mechanics.new_mechanism(geometry, gain, 0.0 if stored is None else stored.arm_offset_rad)
        self._dynamics = Dynamics(
            delay_s=round_trip_s,
            count_m=mechanics.count_at(mechanism, geometry.centre_m),
            mass_kg=exchange.LEAST_MASS_KG,
            force_error_n=mechanics.rounding_n(mechanism),
        )
        self.memory[:] = exchange.new_exchange(connection.calls(), mechanism, geometry, self.force_limit_n)
        self._start_guard(connection.name)
        self._guide_homing(connection)
        self._restart_fade()
        calibrated = "none" if stored is None else stored.describe()
        facts |= {"geometry": geometry.name, "calibration": calibrated, "units_per_nm": gain}
        return facts | event_character

    def _finish(self, connection: Transport) -> AtClose:
        """Send zero torque several times, if the exchange was used."""
        falcon = self.exchange
        is_gone = falcon.ended == exchange.BRIDGE_LOST
        may_push = is_gone and bool(falcon.units.any())
        was_used, falcon.handle = bool(falcon.handle), 0
        force_ended = not was_used or send_zero_torque(connection) > 0
        if force_ended:
            falcon.sent_n = 0.0
        return "leave" if may_push else "stand_down" if force_ended or is_gone else "release"

    @property
    def failure_mode(self) -> str | None:
        """The id of the failure that ended the exchange.

        If there are no new positions, the homed bits and the transfer errors tell why.
        """
        mode, state = super().failure_mode, self.exchange
        if mode != self.silent:
            return mode
        if state.unhomed:
            return "unhomed"
        return "transfer" if 2 * (state.read_errors + state.write_errors) > state.apart else mode

    @property
    def held(self) -> tuple[Any, Any]:
        """The encoder counts of the last reply and the last torque command in motor units, each (3,)."""
        return self.exchange.status.encoders.copy(), self.exchange.units.copy()

    def describe(self) -> dict[str, Any]:
        return super().describe() | {"delay_ticks": int(self.exchange.delay)}

    def observed(self) -> tuple[str, ...]:
        facts, serial_number = self.found, self.found["serial"]
        calibration_facts = facts["calibration"]
        return (
            f"opened, serial number {serial_number}" if serial_number else "opened",
            f"program: {facts['firmware']}",
            f"round trip {min(facts['round_trip_ms'].values()):.2f} ms; event character "
            f"{'kept' if facts['event_character'] else 'not used'}",
            f"calibration: {calibration_facts['measured'] if isinstance(calibration_facts, dict) else 'none'}",
            f"incomplete replies: {self._broken_share:.2%}",
        )

    def appeared(self, samples: Any) -> set[str]:
        if self.failure_mode is not None:
            return {self.failure_mode}
        moved_m = np.ptp(samples["position_m"][_SKIPPED_SAMPLES:], axis=0).max()
        detected = {
            "frozen": moved_m <= _FROZEN_M,
            "broken-packets": self._broken_share > MOST_BROKEN,
            "slow": min(self.found["round_trip_ms"].values()) >= 1000 * LONGEST_ROUND_TRIP_S,
        }
        return {mode for mode, is_present in detected.items() if is_present}

    @property
    def _broken_share(self) -> float:
        """The fraction of packets without a complete reply."""
        requests, replies = self.counters["requests"], self.counters["replies"]
        return max(requests - replies - 1, 0) / max(requests, 1)

    def _check_reach(self, mechanism: Any) -> None:
        """Raise an error for a workspace that the arms do not reach."""
        theta = np.zeros(3)
        for corner in np.array(np.meshgrid(*((-half, half) for half in self.workspace_m))).reshape(3, -1).T:
            reached = (
                mechanics.inverse(mechanism, np.add(corner, [0.0, 0.0, self._geometry.centre_m]), theta)
                == mechanics.REACHED
            )
            if not reached or np.abs((theta - mechanism.zero_rad) / mechanism.rad_per_count).max() > _MAX_COUNTS:
                requested, reachable = (
                    " x ".join(f"{2000 * half:g}" for half in size)
                    for size in (self.workspace_m, mechanics.WORKSPACE_M)
                )
                raise DeviceError(
                    f"a workspace of {requested} mm exceeds a Falcon's reach (about {reachable} mm): reduce the "
                    f"protocol's workspace_mm"
                )

    def _run_firmware(self, transport: Transport) -> str:
        """Load the firmware if it is not running; return the name of the running one."""
        boot.configure(transport)
        if boot.is_running(transport):
            return "already running"
        if self._firmware is None:
            raise FAILURES.failure("firmware-file")
        try:
            data = Path(self._firmware).read_bytes()
        except OSError as error:
            raise FAILURES.failure("firmware-file", f"{self._firmware} cannot be read: {error.strerror}") from error
        image = boot.check_firmware(data)
        unknown = f"an unrecognised version (SHA-256 {image.sha256[:16]}…)"
        self._progress(f"Loading the Falcon's firmware, {image.name or unknown}.")
        return boot.boot_falcon(transport, data, progress=self._progress).sha256

    def _guide_homing(self, transport: Transport) -> None:
        """Run ticks without force until all arms are homed and the grip was pulled out once more."""
        falcon = self.exchange
        began_s = reminded_s = transport.now_s()
        lowest, highest = np.zeros(3), np.zeros(3)
        pull_out_announced = False
        self._progress(STROKES)
        while not falcon.pulled_out:
            self._tick()
            counts = falcon.status.encoders
            if falcon.status.count <= 1:
                lowest, highest = counts.copy(), counts.copy()
            elif falcon.status.homed != ALL_HOMED:  # not afterwards: homing an arm shifts its origin
                lowest, highest = np.minimum(lowest, counts), np.maximum(highest, counts)
            if falcon.homed and not pull_out_announced:
                pull_out_announced = True
                self._progress(PULL_OUT)
            has_moved = (highest - lowest).max() > _MOVED_COUNTS
            mode = "power" if falcon.status.count == 0 else "stroke-in" if has_moved else "frozen"
            if falcon.homed:
                mode = "stroke-out"
            if transport.now_s() - began_s > self._patience_s:
                raise FAILURES.failure(mode)
            if transport.now_s() - reminded_s > self._patience_s / _REMINDERS:
                reminded_s = transport.now_s()
                self._progress(f"Still homing: {FAILURES.sentence(mode)}.")
        self._progress(READY)

    def _restart_fade(self) -> None:
        """Fade the force in over half a second from the next tick onwards, and reset the counters."""
        self.exchange.share = 0.0
        self.exchange.started = 0
        for name in exchange.COUNTERS:
            self.exchange[name] = 0

    def _tick(self) -> None:
        now_ns = round(1e9 * self.connection.now_s())
        self.read.ctypes(self.context, now_ns, int(self.reading.ctypes.data))
        self.write.ctypes(self.context, int(self._command.ctypes.data))
        if self.exchange.ended != RUNS:
            raise usb_failure(ERROR_NO_DEVICE, "homing")
        self.check()
        if self._cancelled is not None and self._cancelled():
            raise DeviceError("homing the Falcon was cancelled")
        self.connection.pause(0.001)
