"""The scripted hand."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from study_app.devices.descriptor import READY, Backend, DeviceDescriptor, OpenRequest, opened

if TYPE_CHECKING:
    from study_app.devices.base import Device


def _open(request: OpenRequest) -> Device:
    from study_app.devices.scripted import ScriptedDevice  # noqa: PLC0415 - the compiler

    return opened(ScriptedDevice(request.random, **request.limits))


def _probe() -> list[Backend]:
    return [Backend("scripted", "the program", READY, "simulated hand, no force; every row is marked as simulated")]


DEVICES: Final = (
    DeviceDescriptor(
        name="scripted",
        title="Scripted hand",
        icon="fast_forward",
        kind="simulated",
        degrees_of_freedom=3,
        open=_open,
        probe=_probe,
        moves_by_itself=True,
    ),
)
