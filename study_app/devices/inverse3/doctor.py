"""An Inverse3 looked over: its service and device found, opened with neutral settings, run at 1 kHz, and let go of.

Everything is done by the driver that a session uses, so what fails there fails here; `failures` has cause and cure. The
driver can stand in front of an emulated Inverse Service, whose handle a simulated hand holds: all of the driver is the
real one, down to the bytes of the WebSocket; in place of the socket's functions it calls those of the emulator. Once it
is open, the emulator's time is that of the servo's ticks.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from study_app.devices.doctor_report import Report
from study_app.devices.doctor_run import SECONDS, examine_by_table
from study_app.devices.inverse3.device import FORCE_LIMIT_N, WORKSPACE_M, Inverse3Device
from study_app.devices.inverse3.emulator.service import Service, service_calls
from study_app.devices.inverse3.failures import FAILURES
from study_app.devices.inverse3.link import Link, TransferCalls
from study_app.errors import DeviceError

_FAULT_AFTER = 1000  # commands


class EmulatedLink:
    """The byte stream to an emulated service: nothing waits, since each command is carried out at once."""

    emulated = True

    def __init__(self, service: Service) -> None:
        self._service = service
        service.connected()

    def calls(self) -> TransferCalls:
        """Return it as compiled code sees it."""
        return TransferCalls(*service_calls(self._service))

    def send(self, data: bytes) -> None:
        """Send all of it."""
        self._service.take_bytes(data)

    def receive(self, timeout_s: float) -> bytes:
        """Return what came."""
        return self._service.give_bytes() or self._nothing(timeout_s)

    def now_s(self) -> float:
        """Return the emulated time [s]."""
        return 1e-9 * float(self._service.state.now_ns)

    def close(self) -> None:
        """Let the service see the end of the stream."""
        self._service.disconnected()

    def _nothing(self, timeout_s: float) -> bytes:
        if self._service.state.ended:
            raise FAILURES.failure("closed", "while it was opened")
        raise FAILURES.failure("no-reply", f"nothing within {timeout_s:g} s")


class EmulatedInverse3(Inverse3Device):
    """An Inverse3 of numbers; ``hand`` takes the orders of whoever simulates a participant.

    Parameters
    ----------
    random : where the hand's tremor is drawn from; None: always the same one
    workspace_m : half extents of where the handle shall reach, and can be sent [m]
    force_limit_n : the greatest force it may be asked for [N]
    progress : is given what to do while it is opened
    service : another than a new one
    """

    name = "inverse3-emulated"

    def __init__(
        self,
        random: Random | None = None,
        *,
        workspace_m: tuple[float, float, float] = WORKSPACE_M,
        force_limit_n: float = FORCE_LIMIT_N,
        progress: Callable[[str], object] | None = None,
        service: Service | None = None,
    ) -> None:
        super().__init__(workspace_m=workspace_m, force_limit_n=force_limit_n, progress=progress)
        self.hand = service if service is not None else Service(random, workspace_m=workspace_m)

    def open(self) -> None:
        """Open the session; from then on the emulator's time is that of the ticks."""
        super().open()
        self.exchange.now_ns = np.int64(self.hand.state.now_ns)
        self.hand.follow_clock(self.context)  # INVERSE3 begins with the time of the tick

    def close(self) -> None:
        """Send zero force and a close frame, and close the connection; a second call does nothing."""
        super().close()
        self.hand.follow_clock(0)

    def _connect(self) -> Link:
        return EmulatedLink(self.hand)

    def _force_scale(self) -> Any:
        return self.hand.force_scale


def examine(
    name: str,
    *,
    options: Mapping[str, str | Path] | None = None,
    faults: Sequence[str] = (),
    progress: Callable[[str], object],
    seconds: float = SECONDS,
) -> Report:
    """Look an Inverse3 over.

    Parameters
    ----------
    name : "inverse3", "inverse3:…" or "inverse3-emulated"
    faults : of an emulated one: words of ``emulator.faults.FAULTS``
    progress : is given what to do, a line at a time
    seconds : how long it is run
    """
    device = _device(name, faults, progress)
    return examine_by_table(device, FAILURES, _words, running="no-reply", progress=progress, seconds=seconds)


def _device(name: str, faults: Sequence[str], progress: Callable[[str], object]) -> Inverse3Device:
    if name != "inverse3-emulated":
        if faults:
            raise DeviceError(f"'{name}' cannot be given faults: only inverse3-emulated can")
        return Inverse3Device(name.partition(":")[2], progress=progress)
    service = Service()
    for fault in faults:
        service.take(fault, _FAULT_AFTER)
    return EmulatedInverse3(progress=progress, service=service)


def _words(device: Inverse3Device, fresh_hz: float) -> tuple[str, ...]:
    """Return what is worth reading of what was seen."""
    found = device.describe()
    settings = found["service_settings"]
    return (
        f"opened, device {found['device_id']}, round trip {found['round_trip_ms']:.2f} ms",
        f"settings {'confirmed' if settings['confirmed'] else 'not confirmed by the service'}",
        f"force scale: {found['force_scale']:g}",
        f"new positions per second: {fresh_hz:.0f}",
    )
