"""The Inverse3's driver with an emulated Inverse Service, whose handle is held by a simulated hand.

The driver is the real one, down to the bytes of the WebSocket; it calls functions of the emulator in place of the
socket's. Once the device is open, the emulator's time is that of the servo's ticks.
"""

from random import Random
from typing import Any, Self

import numpy as np

from study_app.devices.descriptor import OpenRequest
from study_app.devices.emulators.inverse3_service import Service, service_calls
from study_app.devices.inverse3.device import Inverse3Device
from study_app.devices.inverse3.service import FAILURES, LONGEST, Link, TransferCalls

_FAULT_AFTER = 1000  # commands


class _EmulatedLink:
    """The byte stream to an emulated service, which executes each command at once."""

    def __init__(self, service: Service) -> None:
        self._service = service
        service.connected()

    def calls(self) -> TransferCalls:
        return service_calls(self._service)

    def send(self, data: bytes) -> None:
        self._service.take_bytes(data)

    def receive(self, most: int = LONGEST) -> bytes:
        data = self._service.give_bytes()
        if not data and not self._service.state.ended:
            raise FAILURES.failure("no-reply")
        return data

    def now_s(self) -> float:
        return 1e-9 * float(self._service.state.now_ns)

    def close(self) -> None:
        self._service.disconnected()


class EmulatedInverse3(Inverse3Device):
    """An emulated Inverse3; ``hand`` takes the orders of a simulated participant.

    Parameters
    ----------
    random : random numbers for the hand's tremor; None: fixed ones
    service : an existing service; by default a new one
    given : further arguments of `Inverse3Device`
    """

    name = "inverse3-emulated"

    def __init__(self, random: Random | None = None, *, service: Service | None = None, **given: Any) -> None:
        super().__init__(**given)
        self.hand = service if service is not None else Service(random, workspace_m=self.workspace_m)

    @classmethod
    def of(cls, request: OpenRequest) -> Self:
        return cls(request.random, progress=request.progress, **request.limits)

    def take_fault(self, fault: str) -> None:
        self.hand.set_fault(fault, _FAULT_AFTER)

    def open(self) -> None:
        """Open the session; from then on the emulator's time is that of the ticks."""
        super().open()
        self.exchange.now_ns = np.int64(self.hand.state.now_ns)
        self.hand.follow_clock(self.context)  # the record begins with the time of the tick

    def close(self) -> None:
        super().close()
        self.hand.follow_clock(0)

    def _connect(self) -> Link:
        return _EmulatedLink(self.hand)

    def _force_scale(self) -> Any:
        return self.hand.force_scale
