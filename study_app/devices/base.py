"""The interface of a device to the servo: two C functions, their memory, a workspace and a force limit."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Protocol, Self

from study_app.haptics.kernels import Driver


class Device(Driver, Protocol):
    """A haptic, input or simulated device.

    Opened before a servo uses it and closed after the servo has stopped; in between only the servo calls ``read`` and
    ``write``. Positions and forces are in the hand frame (x right, y up, z toward the participant), SI.
    ``workspace_m`` are the half extents of its workspace, about the origin [m].
    """

    workspace_m: tuple[float, float, float]

    def open(self) -> None:
        """Prepare the device; raise ``DeviceNotFound`` if there is none."""

    def close(self) -> None:
        """Release the device; a second call does nothing."""

    def describe(self) -> dict[str, Any]:
        """Return the description for receipts: names and numbers, without paths of this computer."""

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
