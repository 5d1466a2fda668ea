"""Device and servo of a session, opened at rest and let go of in the order of safety."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

from study_app.devices.registry import is_falcon, moves_by_itself, open_device
from study_app.protocol.model import Protocol

if TYPE_CHECKING:
    from study_app.devices.base import Device
    from study_app.haptics.runtime.servo import Servo


@dataclass(frozen=True, slots=True)
class Rig:
    """Device and servo, running at rest."""

    device: Device
    servo: Servo

    @property
    def described(self) -> dict[str, Any]:
        """What the receipt may say: the size of the servo's wake would name a parameter of a liquid."""
        told = {name: value for name, value in self.servo.describe().items() if name != "elements"}
        return self.device.describe() | told

    def reconnect(self) -> dict[str, Any]:
        """Open a device that failed again, home it, and start the servo at zero force; return what describes it now.

        The force stays off until the servo's `fade_in`. Takes as long as opening did.

        Raises
        ------
        StudyError
            It is not there, cannot be opened, or hangs; the force is zero, and this may be called again.
        """
        self.servo.stop_force()
        self.servo.stop()
        self.device.close()
        self.device.open()
        self.servo.start()
        return self.described

    def stop(self) -> None:
        """Zero force, then let go of the device."""
        try:
            self.servo.stop()
        finally:
            self.device.close()


def open_rig(
    name: str,
    study: Protocol,
    *,
    random: Random,
    firmware: Path | None = None,
    tell: Callable[[str], object] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Rig:
    """Open the device and start the servo at rest; compiling takes a minute the first time.

    ``random`` draws the tremor of a device that moves by itself; ``firmware`` is the file of a Falcon's program.
    ``tell`` is given what a device asks for while it is opened, a line at a time; it gives up when ``cancelled``.
    """
    from study_app.haptics.runtime.pack import elements_needed  # noqa: PLC0415 - the compiler: only once it is needed
    from study_app.haptics.runtime.servo import Servo  # noqa: PLC0415

    x, y, z = study.device.workspace_m
    options: dict[str, Any] = {"workspace_m": (x / 2, y / 2, z / 2), "force_limit_n": study.device.force_limit_n}
    if moves_by_itself(name):
        options["random"] = random
    if is_falcon(name):
        options |= {"firmware": firmware, "tell": tell, "cancelled": cancelled}
    device = open_device(name, **options)
    try:
        elements = max(elements_needed(study.scene_for(condition)) for condition in study.conditions)
        servo = Servo(device, rate_hz=study.device.rate_hz, elements=elements)
        servo.start()
    except BaseException:
        device.close()
        raise
    return Rig(device, servo)
