"""The Falcon's driver with an emulated Falcon, whose grip a simulated hand holds.

The driver is the real one, including pyusb and the C function; the emulator replaces the USB bus. Once it is open, the
emulator's time is that of the servo's ticks, so that it runs as fast as a rehearsal.
"""

from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from study_app.devices.falcon.device import FalconDevice
from study_app.devices.falcon.emulator.emulator import Emulator
from study_app.devices.falcon.emulator.usb_backend import EmulatedBackend
from study_app.devices.falcon.exchange import FORCE_LIMIT_N
from study_app.devices.falcon.mechanics.geometry import WORKSPACE_M
from study_app.devices.falcon.transport.transport import Transport
from study_app.devices.falcon.transport.usb import PyUsbTransport

_STILL_TICKS = 10  # longer than the pause between two strokes of homing


class EmulatedFalcon(FalconDevice):
    """An emulated Falcon; ``hand`` takes the orders of a simulated participant.

    Parameters
    ----------
    random : random numbers for the hand's tremor and the emulator's faults; None: always the same ones
    firmware : file to load into it; without one its program runs already
    workspace_m : half extents of the grip's workspace [m]
    force_limit_n : the greatest force that may be commanded [N]
    progress : receives instructions while it is opened
    emulator : an existing one to use options : of ``FalconDevice``
    """

    guarded = False  # it ends with the program

    def __init__(
        self,
        random: Random | None = None,
        *,
        firmware: str | Path | None = None,
        workspace_m: tuple[float, float, float] = WORKSPACE_M,
        force_limit_n: float = FORCE_LIMIT_N,
        progress: Callable[[str], object] | None = None,
        emulator: Emulator | None = None,
        **options: Any,
    ) -> None:
        super().__init__(
            "falcon-emulated",
            firmware=firmware,
            workspace_m=workspace_m,
            force_limit_n=force_limit_n,
            progress=progress,
            **options,
        )
        self.hand = emulator if emulator is not None else new_emulator(random, firmware, workspace_m)
        self._backend = EmulatedBackend(self.hand)

    def open(self) -> None:
        """Open it, and wait until the hand has moved the grip to the middle after homing."""
        super().open()
        still = 0
        while still < _STILL_TICKS:
            self._tick()
            still = 0 if self.hand.moving else still + 1
        self._begin_anew()
        self._backend.follow_clock(self.context)  # FALCON begins with the time of the tick

    def close(self) -> None:
        """Send zero torque several times and close it; a second call does nothing."""
        self._backend.follow_clock(0)
        super().close()

    def _open_bridge(self) -> Transport:
        return PyUsbTransport(self._backend)


def new_emulator(
    random: Random | None, firmware: str | Path | None, workspace_m: tuple[float, float, float]
) -> Emulator:
    """Return an emulator after power-up, with its program running unless it is to be loaded."""
    return Emulator(random, running=firmware is None, workspace_m=workspace_m)
