"""The Inverse3's driver, which opens a session with neutral settings and ends it with zero force."""

import math
import secrets
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final, Self

import numpy as np

from study_app.devices.descriptor import OpenRequest
from study_app.devices.driver import RELEASED, AtClose, FramedDevice, dynamics_of
from study_app.devices.inverse3 import exchange, service
from study_app.devices.inverse3.exchange import COUNTERS, exchange_functions, finish, new_exchange
from study_app.devices.inverse3.opening import Messages, open_session
from study_app.devices.inverse3.wire import text_hash
from study_app.errors import DeviceError

_REACH_M: Final = 0.10
"""Radius of the workspace about its middle: docs.haply.co 3.5.x, tutorial 05 (Inverse3; a Minverse reaches 0.04 m)."""
_WORKSPACE_M: Final = (0.05, 0.05, 0.05)
_FORCE_LIMIT_N: Final = 8.0


class Inverse3Device(FramedDevice):
    """An Inverse3 behind the Inverse Service.

    Parameters
    ----------
    where : "", "ID", "HOST:PORT" or "HOST:PORT:ID"
    progress : receives instructions while it is opened, one line at a time
    """

    name = "inverse3"
    failures, counted, silent, running = service.FAILURES, COUNTERS, "no-reply", "no-reply"
    causes: ClassVar[Mapping[int, str]] = {
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

    def __init__(
        self,
        where: str = "",
        *,
        workspace_m: tuple[float, float, float] = _WORKSPACE_M,
        force_limit_n: float = _FORCE_LIMIT_N,
        progress: Callable[[str], object] | None = None,
    ) -> None:
        if math.hypot(*workspace_m) > _REACH_M:
            size = " x ".join(f"{2000 * half:g}" for half in workspace_m)
            raise DeviceError(
                f"a workspace of {size} mm exceeds an Inverse3's reach (a sphere {2000 * _REACH_M:g} mm in diameter): "
                f"reduce the protocol's workspace_mm"
            )
        super().__init__(new_exchange("", force_limit_n, 1), workspace_m, force_limit_n, exchange_functions())
        self._host, self._port, self._wanted_id = address(where)
        self._progress = progress

    @classmethod
    def of(cls, request: OpenRequest) -> Self:
        return cls(request.argument, progress=request.progress, **request.limits)

    def _connect(self) -> service.Link:
        Messages.compile()
        return service.SocketLink(self._host, self._port)

    def _prepare(self, connection: service.Link) -> dict[str, Any]:
        """Choose the device and neutralise the service's settings, at zero force."""
        messages = Messages(connection)
        messages.upgrade(f"{self._host}:{self._port}")
        session = open_session(messages, connection, self._wanted_id)
        facts = session.described | {"force_scale": service.check_force_scale(self._force_scale())}
        self._dynamics = dynamics_of(session.round_trip_s, None, None, name=self.name, serial=session.device_id)
        self.memory[:] = new_exchange(session.device_id, self.force_limit_n, secrets.randbits(64))
        self.exchange.scan.own_id = text_hash(session.device_id.encode())
        received = np.frombuffer(messages.left, np.uint8)
        self.exchange.inbox[: received.size] = received
        self.exchange.filled = received.size
        self.exchange.handle, self.exchange.send, self.exchange.receive = connection.calls()
        if not facts["service_settings"]["confirmed"] and self._progress is not None:
            self._progress("The service did not confirm its settings: check them in Haply Hub.")
        return facts

    def _finish(self, connection: service.Link) -> AtClose:
        """Send zero force and a close frame."""
        if self.exchange.ended == RELEASED:
            finish(self.exchange, self.context)
        return "stand_down"

    @property
    def age_s(self) -> float:
        """The age of the last position in the tick that used it: time since its request [s]."""
        return 1e-9 * float(self.exchange.age_ns)

    def observed(self) -> tuple[str, ...]:
        facts = self.found
        return (
            f"opened, device {facts['device_id']}, round trip {facts['round_trip_ms']:.2f} ms",
            f"settings {'confirmed' if facts['service_settings']['confirmed'] else 'not confirmed by the service'}",
            f"force scale: {facts['force_scale']:g}",
        )

    def _force_scale(self) -> Any:
        return service.request_force_scale(self._host, (self._port, *service.PORTS))


def address(where: str) -> tuple[str, int, str]:
    """Return host, port and device id of a device argument: "", "ID", "HOST:PORT" or "HOST:PORT:ID"."""
    parts = where.split(":")
    if len(parts) == 1:
        return service.HOST, service.PORT, parts[0]
    host, port = parts[:2]
    if len(parts) > 3 or not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise DeviceError(
            f"'{where}' is not a valid address for the Inverse Service: specify inverse3, inverse3:ID, "
            "inverse3:HOST:PORT or "
            "inverse3:HOST:PORT:ID, with a port from 1 to 65535"
        )
    return host, int(port), parts[2] if len(parts) == 3 else ""
