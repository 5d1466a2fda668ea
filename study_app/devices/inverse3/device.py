"""The Inverse3 as a device: its session opened with neutral settings, and ended with zero force and silence."""

import math
import secrets
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from study_app.devices.base import Device
from study_app.devices.bench.kept import dynamics_of
from study_app.devices.call_gate import LET_GO, RUNS, check_left, let_go
from study_app.devices.inverse3 import exchange
from study_app.devices.inverse3.exchange import COUNTERS, exchange_functions, finish, new_exchange
from study_app.devices.inverse3.failures import FAILURES
from study_app.devices.inverse3.json_scan import text_hash
from study_app.devices.inverse3.link import HOST, PORT, Link, SocketLink
from study_app.devices.inverse3.opening import Messages, open_session
from study_app.devices.inverse3.probe import PORTS, check_force_scale, force_scale
from study_app.errors import DeviceError
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics

REACH_M: Final = 0.10
"""Radius of the workspace about its middle: docs.haply.co 3.5.x, tutorial 05 (Inverse3; a Minverse reaches 0.04 m)."""
WORKSPACE_M: Final = (0.05, 0.05, 0.05)
FORCE_LIMIT_N: Final = 8.0
_SILENT_NS: Final = 40_000_000
_ENDED: Final = {
    exchange.CLOSED: "closed",
    exchange.BROKE_PROTOCOL: "protocol",
    exchange.TOO_LONG: "protocol",
    exchange.NOT_A_STATE: "not-json",
    exchange.DEVICE_GONE: "no-device",
    exchange.NO_POSITION: "no-position",
    exchange.BAD_NUMBER: "not-finite",
    exchange.NOT_READY: "not-ready",
    exchange.UNCALIBRATED: "uncalibrated",
}


class Inverse3Device(Device):
    """An Inverse3 behind the Inverse Service.

    Parameters
    ----------
    where : "", "ID", "HOST:PORT" or "HOST:PORT:ID"
    workspace_m : half extents of where the handle shall reach [m]
    force_limit_n : the greatest force it may be asked for [N]
    progress : is given what to do while it is opened, a line at a time
    """

    name = "inverse3"

    def __init__(
        self,
        where: str = "",
        *,
        workspace_m: tuple[float, float, float] = WORKSPACE_M,
        force_limit_n: float = FORCE_LIMIT_N,
        progress: Callable[[str], object] | None = None,
    ) -> None:
        if math.hypot(*workspace_m) > REACH_M:
            asked = " x ".join(f"{2000 * half:g}" for half in workspace_m)
            raise DeviceError(
                f"a workspace of {asked} mm is more than an Inverse3 reaches, whose workspace is a ball of "
                f"{2000 * REACH_M:g} mm: make the protocol's workspace_mm smaller"
            )
        self.workspace_m = workspace_m
        self.force_limit_n = force_limit_n
        self._host, self._port, self._wanted_id = address(where)
        self._progress = progress
        self._link: Link | None = None
        self._found: dict[str, Any] = {}
        self._dynamics = UNKNOWN
        self.memory = new_exchange("", force_limit_n, 1)
        self.exchange = self.memory[0]
        self.context = int(self.memory.ctypes.data)
        self.read, self.write = exchange_functions()

    def open(self) -> None:
        """Connect, choose the device, and neutralise the service's settings; the force is zero meanwhile.

        Raises
        ------
        DeviceFailure
            There is no service or device, it cannot be used, or its settings are not neutral.
        """
        if self._link is not None:
            if self.exchange.ended == RUNS:
                return
            self.close()
        check_left(self.exchange, self.name)
        link = self._connect()
        try:
            messages = Messages(link)
            messages.upgrade(f"{self._host}:{self._port}")
            session = open_session(messages, link, self._wanted_id)
            self._found = session.described | {"force_scale": check_force_scale(self._force_scale())}
            self._dynamics = dynamics_of(session.round_trip_s, None, None, name=self.name, serial=session.device_id)
            self.memory[:] = new_exchange(session.device_id, self.force_limit_n, secrets.randbits(64))
            self.exchange.scan.own_id = text_hash(session.device_id.encode())
            left = np.frombuffer(messages.left, np.uint8)
            self.exchange.inbox[: left.size] = left
            self.exchange.filled = left.size
            self.exchange.handle, self.exchange.send, self.exchange.receive = link.calls()
        except BaseException:
            link.close()
            raise
        self._link = link
        self.exchange.ended = RUNS
        if not self._found["service_settings"]["confirmed"] and self._progress is not None:
            self._progress("The service did not confirm its settings: compare them in Haply Hub.")

    def close(self) -> None:
        """Send zero force and a close frame, and close the connection; a second call does nothing.

        A call of the servo that does not return does the first two once it does; closing again closes the connection.
        """
        link = self._link
        if link is None or not let_go(self.exchange):
            return
        self._link = None
        try:
            if self.exchange.ended == LET_GO:
                finish(self.exchange, self.context)
        finally:
            link.close()

    @property
    def dynamics(self) -> Dynamics:
        """The round trip measured when it was opened; count and mass, which are not published, as benched."""
        return self._dynamics

    @property
    def counters(self) -> dict[str, int]:
        """How many ticks, commands and replies there were since it was opened: see ``exchange.INVERSE3``."""
        return {name: int(self.exchange[name]) for name in COUNTERS}

    @property
    def age_s(self) -> float:
        """How long before the tick that used it the last position was asked for [s]."""
        return 1e-9 * float(self.exchange.age_ns)

    @property
    def failure_mode(self) -> str | None:
        """The id of what ended the stream in ``failures.MODES``; None while nothing did."""
        state = self.exchange
        if state.ended in _ENDED:
            return _ENDED[int(state.ended)]
        silent = state.now_ns - state.fresh_ns > _SILENT_NS
        return "no-reply" if state.ended == RUNS and state.ticks and silent else None

    @property
    def failure(self) -> str | None:
        """Symptom, cause and cure of what ended the stream in a sentence; None while nothing did."""
        mode = self.failure_mode
        return None if mode is None else FAILURES.sentence(mode)

    def describe(self) -> dict[str, Any]:
        """Return what the receipt says of it."""
        return {
            "name": self.name,
            "workspace_m": list(self.workspace_m),
            "force_limit_n": self.force_limit_n,
            "dynamics": self.dynamics.describe(),
            **self._found,
        }

    def _connect(self) -> Link:
        return SocketLink(self._host, self._port)

    def _force_scale(self) -> Any:
        return force_scale(self._host, (self._port, *PORTS))


def address(where: str) -> tuple[str, int, str]:
    """Return host, port and device id of what follows the device's name: "", "ID", "HOST:PORT" or "HOST:PORT:ID"."""
    parts = where.split(":")
    if len(parts) == 1:
        return HOST, PORT, parts[0]
    host, port = parts[:2]
    if len(parts) > 3 or not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise DeviceError(
            f"'{where}' is not an address of the Inverse Service: give inverse3, inverse3:ID, inverse3:HOST:PORT or "
            "inverse3:HOST:PORT:ID, with a port from 1 to 65535"
        )
    return host, int(port), parts[2] if len(parts) == 3 else ""
