"""The mouse."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from study_app.devices.descriptor import READY, Backend, DeviceDescriptor, OpenRequest, opened

if TYPE_CHECKING:
    from study_app.devices.base import Device


def _open(request: OpenRequest) -> Device:
    from study_app.devices.simulated.simulated_device import MouseDevice  # noqa: PLC0415 - the compiler

    return opened(MouseDevice(**request.limits))


def _probe() -> list[Backend]:
    return [Backend("mouse", "the window", READY, "visual only, no force: the ball moves as it would in the liquid")]


DEVICES: Final = (
    DeviceDescriptor(
        name="mouse",
        title="Mouse",
        icon="mouse",
        kind="seen",
        degrees_of_freedom=3,
        open=_open,
        probe=_probe,
        pointer=True,
    ),
)
