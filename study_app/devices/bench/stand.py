"""A device on the bench: the servo's own loop around it, excitations for a time, and the samples of that time."""

import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Final, Self

import numpy as np

from study_app.devices.base import Device
from study_app.devices.bench.excitation import ENDED, RUNNING, BenchDriver, Excitation
from study_app.errors import DeviceError
from study_app.haptics.runtime.clocks.clock import Clock, SystemClock
from study_app.haptics.runtime.servo import Servo

RATE_HZ: Final = 1000.0
GREATEST_N: Final = 4.0
"""Greatest force of an excitation, even if the device permits more."""
_LOOK_S: Final = 0.02
_ALIVE_NS: Final = 500_000_000


class Stand:
    """The servo around a device that is measured; as a context manager it ends with zero force.

    Parameters
    ----------
    device : opened
    clock : default: the system's; a virtual one runs as fast as the computation
    """

    def __init__(self, device: Device, clock: Clock | None = None) -> None:
        self.device = device
        self.clock = clock or SystemClock()
        self.limit_n = min(device.force_limit_n, GREATEST_N)
        self._driver = BenchDriver(device, self.limit_n)
        self._servo = Servo(self._driver, clock=self.clock, rate_hz=RATE_HZ, elements=0)
        self._reader = self._servo.telemetry.reader()

    @property
    def position_m(self) -> Any:
        """The place of the handle (3,) [m, hand frame]."""
        return self._driver.state.position_m.copy()

    @property
    def damper_nspm(self) -> float:
        """The present damping of the damper."""
        return float(self._driver.state.damper_nspm)

    @property
    def ended(self) -> str | None:
        """Why the excitation ended by itself, in words; None while it acts."""
        return ENDED.get(int(self._driver.state.ended))

    @property
    def overruns(self) -> int:
        """The number of deadlines that the servo skipped."""
        return self._servo.overruns

    def excite(self, what: Excitation) -> None:
        """Apply this from the next tick on."""
        self._live()
        self._driver.excite(what)

    def run(
        self, seconds: float, *, answered: Callable[[], str | None] | None = None, may_end: bool = False
    ) -> tuple[Any, str | None]:
        """Wait; return the samples of that time and the operator's answer during it, if any.

        Parameters
        ----------
        answered : returns the operator's input, None without one may_end : whether an excitation may end by itself;
        then this returns at once

        Raises
        ------
        DeviceError
            The excitation ended by itself and may not; or the device was lost.
        """
        self._reader.read()
        taken, left = [], round(seconds * RATE_HZ)
        answer: str | None = None
        while left > 0 and answer is None:
            ticks = min(left, round(_LOOK_S * RATE_HZ))
            self._live()
            if self.clock.runs:
                time.sleep(ticks / RATE_HZ)
            else:
                self._servo.advance(ticks)
            left -= ticks
            taken.append(self._reader.read())
            self._servo.check()
            answer = None if answered is None else answered()
            if self._driver.state.ended != RUNNING:
                if may_end:
                    break
                raise DeviceError(
                    f"the bench was ended, since {self.ended}; the force is zero: check the device, then start again"
                )
        return np.concatenate(taken).view(np.recarray) if taken else self._reader.read(), answer

    def rest(self) -> None:
        """End the force."""
        self._driver.end()

    def _live(self) -> None:
        self._driver.state.alive_ns = self._servo.now_ns() + _ALIVE_NS

    def __enter__(self) -> Self:
        if self.clock.runs:
            self._servo.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._driver.end()
        self._servo.stop()
