"""3Dconnexion's SpaceMouse."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from study_app.devices.descriptor import Backend, DeviceDescriptor, OpenRequest, opened

if TYPE_CHECKING:
    from study_app.devices.base import Device


def _open(request: OpenRequest) -> Device:
    from study_app.devices.spacemouse.device import SpaceMouseDevice  # noqa: PLC0415 - the compiler

    return opened(SpaceMouseDevice(**request.limits))


def _probe() -> list[Backend]:
    from study_app.devices.spacemouse.hid import probe  # noqa: PLC0415 - numpy

    return probe()


DEVICES: Final = (
    DeviceDescriptor(
        name="spacemouse", title="SpaceMouse", icon="mouse", kind="seen", degrees_of_freedom=3, open=_open, probe=_probe
    ),
)
