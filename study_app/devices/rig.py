"""Device and servo, which only this module opens together and closes in a safe order."""

from __future__ import annotations

import atexit
import weakref
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

from study_app.devices.registry import open_device
from study_app.errors import DeviceError
from study_app.protocol.model import Protocol

if TYPE_CHECKING:
    from study_app.devices.base import Device
    from study_app.haptics.runtime.clocks import Clock
    from study_app.haptics.runtime.servo import Servo


_open_rigs: Final = weakref.WeakSet["Rig"]()


@atexit.register
def _stop_open_rigs() -> None:
    """Stop all rigs that the program left open at its end, even if some of them fail to stop."""
    with ExitStack() as stops:
        for rig in tuple(_open_rigs):
            stops.callback(rig.stop)


@dataclass(frozen=True, slots=True, weakref_slot=True, eq=False)
class Rig:
    """Device and servo; as a context manager it stops them at the end."""

    device: Device
    servo: Servo

    @property
    def described(self) -> dict[str, Any]:
        return self.device.describe() | self.servo.describe()

    def reconnect(self) -> dict[str, Any]:
        """Reopen a failed device, home it, and start the servo at zero force; return its new description.

        The force stays off until the servo's `fade_in`. Takes as long as opening did.

        Raises
        ------
        StudyError
            The device is missing, cannot be opened, or hangs; the force is zero, and the call may be repeated.
        """
        self.servo.stop_force()
        self.servo.stop()
        self.device.close()
        self.device.open()
        self.servo.start()
        return self.described

    def stop(self) -> None:
        """Send zero force, then close the device."""
        _open_rigs.discard(self)
        try:
            self.servo.stop()
        finally:
            self.device.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


@dataclass(frozen=True, slots=True, kw_only=True)
class RigSettings:
    """The settings for opening device and servo.

    Attributes
    ----------
    workspace_m : full extents of the hand's workspace [m]
    force_limit_n : the greatest force that may be commanded [N]
    rate_hz : ticks per second
    elements : the greatest number of wake elements of a scene
    random : random numbers for the tremor of a simulated device
    options : values of the device's options, by name
    """

    workspace_m: tuple[float, float, float]
    force_limit_n: float
    rate_hz: float = 1000.0
    elements: int
    random: Random
    options: Mapping[str, str | Path] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.force_limit_n > 0:  # with a negative limit the safety layer would push
            raise DeviceError(f"the force limit must be greater than 0 N, not {self.force_limit_n:g} N")


def study_settings(study: Protocol, random: Random, options: Mapping[str, str | Path] | None = None) -> RigSettings:
    """Return the settings for the sessions of a protocol."""
    from study_app.haptics.runtime.pack import elements_needed  # noqa: PLC0415 - the compiler: only once it is needed

    return RigSettings(
        workspace_m=study.device.workspace_m,
        force_limit_n=study.device.force_limit_n,
        rate_hz=study.device.rate_hz,
        elements=max(elements_needed(study.scene_for(condition)) for condition in study.conditions),
        random=random,
        options=options or {},
    )


def open_rig(
    name: str,
    settings: RigSettings,
    *,
    clock: Clock | None = None,
    progress: Callable[[str], object] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Rig:
    """Open the device and start the servo at rest; compiling takes a minute the first time.

    Parameters
    ----------
    clock : default: the system's; on a virtual one the servo is not started, but advanced by the caller
    progress : receives the device's instructions while it is opened, one line at a time
    cancelled : returns whether to stop opening it

    Raises
    ------
    StudyError
        The device cannot be opened; nothing is left open.
    """
    from study_app.haptics.runtime.servo import Servo  # noqa: PLC0415 - the compiler: only once it is needed

    x, y, z = settings.workspace_m
    device = open_device(
        name,
        workspace_m=(x / 2, y / 2, z / 2),
        force_limit_n=settings.force_limit_n,
        random=settings.random,
        progress=progress,
        cancelled=cancelled,
        options=settings.options,
    )
    try:
        _check_not_cancelled(name, cancelled)
        rig = Rig(device, Servo(device, clock=clock, rate_hz=settings.rate_hz, elements=settings.elements))
        if clock is None or clock.runs:
            _open_rigs.add(rig)
            rig.servo.start()
    except BaseException:
        device.close()
        raise
    return rig


def _check_not_cancelled(name: str, cancelled: Callable[[], bool] | None) -> None:
    if cancelled is not None and cancelled():
        raise DeviceError(f"opening the device '{name}' was cancelled")
