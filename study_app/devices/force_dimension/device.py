"""The driver of Force Dimension devices: it opens one through the maker's library, and closes it with zero force."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Final, Protocol, Self

from study_app.devices.descriptor import OpenRequest
from study_app.devices.driver import RELEASED, AtClose, FramedDevice, dynamics_of
from study_app.devices.force_dimension import exchange
from study_app.devices.force_dimension.exchange import COUNTERS, FUNCTIONS, exchange_functions, finish, new_exchange
from study_app.devices.force_dimension.library import CAUSES, FAILURES, OPTION, Library, end_force
from study_app.errors import DeviceError

_WORKSPACE_M: Final = (0.05, 0.05, 0.05)
_FORCE_LIMIT_N: Final = 8.0


class Functions(Protocol):
    """The functions of an open device, in the maker's library or emulated; ``id`` is passed to them."""

    id: int

    def prepare(self, force_limit_n: float) -> dict[str, Any]: ...

    def address(self, name: str) -> int: ...

    def close(self) -> bool:
        """End the force and close the device; return whether the device accepted the end of the force."""


class ForceDimensionDevice(FramedDevice):
    """A device accessed through the maker's library.

    Parameters
    ----------
    serial : its serial number; "": the first device
    library : path of libdrd; None: see ``library.Library``
    """

    name = "force-dimension"
    failures, counted, running = FAILURES, COUNTERS, "error"
    causes: ClassVar[Mapping[int, str]] = {
        exchange.ERROR: "error",
        exchange.BAD_NUMBER: "not-finite",
        exchange.FORCE_OFF: "force-off",
    }
    ends_force: str | None = f"{end_force.__module__}:{end_force.__name__}"

    def __init__(
        self,
        serial: str = "",
        *,
        library: str | Path | None = None,
        workspace_m: tuple[float, float, float] = _WORKSPACE_M,
        force_limit_n: float = _FORCE_LIMIT_N,
    ) -> None:
        if serial and not serial.isdecimal():
            raise DeviceError(
                f"'{serial}' is not a Force Dimension serial number: specify the digits on the device's label, such as "
                "force-dimension:10233"
            )
        super().__init__(new_exchange(force_limit_n), workspace_m, force_limit_n, exchange_functions())
        self._serial, self._path = serial, library

    @classmethod
    def of(cls, request: OpenRequest) -> Self:
        return cls(request.argument, library=request.options.get(OPTION), **request.limits)

    def _connect(self) -> Functions:
        return Library(self._path).open(self._serial)

    def _prepare(self, connection: Functions) -> dict[str, Any]:
        """Check the device and enable its force; a device without a watchdog gets a guard."""
        facts = connection.prepare(self.force_limit_n)
        serial = facts.get("serial")
        dynamics = (facts.pop(name) for name in ("delay_s", "count_m", "mass_kg"))
        self._dynamics = dynamics_of(*dynamics, name=self.name, serial=serial)
        self.memory[:] = new_exchange(self.force_limit_n)
        for field, name in FUNCTIONS.items():
            self.exchange[field] = connection.address(name)
        self.exchange.id = connection.id
        self.exchange.wrist, self.exchange.gripper = facts["wrist"], facts["gripper"]
        self.exchange.active = facts["active_wrist"] or facts["active_gripper"]
        path = "" if self._path is None else str(self._path)
        self._start_guard(path, serial or "", needed=facts.get("watchdog_s") is None)
        return {"guard": self.guard is not None} | facts

    def _finish(self, connection: Functions) -> AtClose:
        """Send zero force and switch off the motors' current."""
        if self.exchange.ended == RELEASED:
            finish(self.exchange, self.context)
        return "leave" if self.exchange.pushes else "stand_down"

    def _detail(self, mode: str) -> str:
        return CAUSES.get(int(self.exchange.off_cause), "") if mode == "force-off" else ""

    def observed(self) -> tuple[str, ...]:
        facts, counters = self.found, self.counters
        watchdog_s = facts.get("watchdog_s")
        return (
            f"opened: {facts['system']}, serial number {facts.get('serial')}, SDK {facts['sdk']}",
            f"velocity threshold {facts.get('velocity_threshold')}, "
            f"watchdog {'none' if watchdog_s is None else f'{1000 * watchdog_s:.1f} ms'}",
            f"readings rejected by the library's timing check: {counters['guarded']}",
            f"forces beyond the motors' capacity: {counters['saturated']}",
        )
