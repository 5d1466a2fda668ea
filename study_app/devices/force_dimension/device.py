"""A Force Dimension device: opened and checked through the maker's library, closed with zero force."""

from pathlib import Path
from typing import Any, Final, Protocol

from study_app.devices.base import Device
from study_app.devices.bench.kept import dynamics_of
from study_app.devices.call_gate import LET_GO, RUNS, let_go
from study_app.devices.force_dimension import exchange
from study_app.devices.force_dimension.exchange import COUNTERS, FUNCTIONS, exchange_functions, finish, new_exchange
from study_app.devices.force_dimension.failures import CAUSES, FAILURES
from study_app.devices.force_dimension.library import Library, end_force
from study_app.devices.guard import Guard
from study_app.errors import DeviceError
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics

WORKSPACE_M: Final = (0.05, 0.05, 0.05)
FORCE_LIMIT_N: Final = 8.0
_SILENT_NS: Final = 40_000_000  # after 50 ms without a new position the servo ends the force
_ENDED: Final = {
    exchange.ERROR: "error",
    exchange.BAD_NUMBER: "not-finite",
    exchange.FORCE_OFF: "force-off",
    exchange.UNGUARDED: "unguarded",
}
ENDS_FORCE: Final = f"{end_force.__module__}:{end_force.__name__}"


class Functions(Protocol):
    """What a device is opened and run with: the maker's library, or an emulated one."""

    def open(self, serial: int | None) -> int:
        """Open the device with this serial number, or the first one; return its id."""
        ...

    def prepare(self, device: int, force_limit_n: float) -> dict[str, Any]:
        """Check an open device and enable its force; return what the receipt records."""
        ...

    def address(self, name: str) -> int:
        """Return where a function is, for compiled code."""
        ...

    def abandon(self, device: int) -> bool:
        """End the force and close a device that could not be prepared; return whether it accepted the end."""
        ...

    def close(self, device: int) -> None:
        """Close a device."""
        ...


class ForceDimensionDevice(Device):
    """A device behind the maker's library.

    Parameters
    ----------
    serial : its serial number; "": the first device
    library : path of libdrd; None: see ``library.Library``
    workspace_m : half extents of where the handle shall reach [m]
    force_limit_n : the greatest force it may be asked for [N]
    """

    name = "force-dimension"
    guarded = True

    def __init__(
        self,
        serial: str = "",
        *,
        library: str | Path | None = None,
        workspace_m: tuple[float, float, float] = WORKSPACE_M,
        force_limit_n: float = FORCE_LIMIT_N,
    ) -> None:
        if serial and not serial.isdecimal():
            raise DeviceError(
                f"'{serial}' is not a serial number of a Force Dimension device: give digits, as the device's label "
                "shows them, such as force-dimension:10233"
            )
        self.workspace_m = workspace_m
        self.force_limit_n = force_limit_n
        self._serial = int(serial) if serial else None
        self._path = library
        self._functions: Functions | None = None
        self._found: dict[str, Any] = {}
        self._dynamics = UNKNOWN
        self.guard: Guard | None = None
        self._left_guard: Guard | None = None  # of a device that may still push
        self.memory = new_exchange(force_limit_n)
        self.exchange = self.memory[0]
        self.context = int(self.memory.ctypes.data)
        self.read, self.write = exchange_functions()

    def open(self) -> None:
        """Load the library, open and check the device, and enable its force at zero.

        Raises
        ------
        DeviceFailure
            There is no library or device, or it cannot be used.
        """
        if self._functions is not None:
            if self.exchange.ended == RUNS:
                return
            self.close()
        if self.exchange.inside:
            raise FAILURES.failure("hangs")
        functions = self._load()
        device = functions.open(self._serial)
        try:
            found = functions.prepare(device, self.force_limit_n)
            self.memory[:] = new_exchange(self.force_limit_n)
            for field, name in FUNCTIONS.items():
                self.exchange[field] = functions.address(name)
            self._start_guard(found)
        except BaseException:
            functions.abandon(device)
            self._dismiss_guard()
            raise
        measured = (found.pop(name) for name in ("delay_s", "count_m", "mass_kg"))
        self._dynamics = dynamics_of(*measured, name=self.name, serial=found.get("serial"))
        self._found, self._functions = found, functions
        self.exchange.id = device
        self.exchange.wrist = found["wrist"]
        self.exchange.gripper = found["gripper"]
        self.exchange.active = found["active_wrist"] or found["active_gripper"]
        self.exchange.ended = RUNS

    def close(self) -> None:
        """Send zero force, take the current off the motors, and close the device; a second call does nothing.

        Where a call of the library does not return, its thread does the first two once it does; until then the
        device's watchdog is what ends the force. Where the device accepts neither, its guard goes on trying.
        """
        functions = self._functions
        if functions is None or not let_go(self.exchange):
            return
        self._functions = None
        try:
            if self.exchange.ended == LET_GO:
                finish(self.exchange, self.context)
        finally:
            try:
                functions.close(int(self.exchange.id))
            finally:
                self._dismiss_guard()

    @property
    def dynamics(self) -> Dynamics:
        """The delay measured when it was opened, and what the library or a bench says of encoder count and mass."""
        return self._dynamics

    @property
    def counters(self) -> dict[str, int]:
        """How many ticks and new positions there were since it was opened: see ``exchange.FORCE_DIMENSION``."""
        return {name: int(self.exchange[name]) for name in COUNTERS}

    @property
    def failure_mode(self) -> str | None:
        """The id of what ended the exchange in ``failures.FAILURES``; None while nothing did."""
        state = self.exchange
        silent = state.ticks and state.now_ns - state.fresh_ns > _SILENT_NS
        return "rate" if state.ended == RUNS and silent else _ENDED.get(int(state.ended))

    @property
    def failure(self) -> str | None:
        """Symptom, cause and cure of what ended the exchange in a sentence; None while nothing did."""
        mode = self.failure_mode
        if mode is None:
            return None
        return FAILURES.sentence(mode, CAUSES.get(int(self.exchange.off_cause), "") if mode == "force-off" else "")

    def describe(self) -> dict[str, Any]:
        """Return what the receipt says of it."""
        return {
            "name": self.name,
            "workspace_m": list(self.workspace_m),
            "force_limit_n": self.force_limit_n,
            "dynamics": self.dynamics.describe(),
            "guard": self.guard is not None,
            **self._found,
        }

    def _start_guard(self, found: dict[str, Any]) -> None:
        """Start the guard of a device whose own watchdog is absent or off, and end one that still tries to open it."""
        if self.guarded and found.get("watchdog_s") is None:
            path, serial = "" if self._path is None else str(self._path), found.get("serial") or ""
            self.guard = Guard(self.name, ENDS_FORCE, path, serial, died=self._lose_guard)
            self.guard.start()
        if self._left_guard is not None:
            self._left_guard.recall()
            self._left_guard = None

    def _dismiss_guard(self) -> None:
        guard, self.guard = self.guard, None
        if guard is not None and self.exchange.pushes:
            self._left_guard = guard
            guard.leave()
        elif guard is not None:
            guard.stand_down()

    def _lose_guard(self) -> None:
        """Block every force from now on; called by the guard's thread."""
        self.exchange.unguarded = 1

    def _load(self) -> Functions:
        return Library(self._path)
