"""The Haply Inverse3: behind its maker's Inverse Service, or emulated in this program."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from study_app.devices.descriptor import READY, Backend, DeviceDescriptor, OpenRequest, doctor_at, opened

if TYPE_CHECKING:
    from study_app.devices.base import Device


def _open(request: OpenRequest) -> Device:
    from study_app.devices.inverse3.device import Inverse3Device  # noqa: PLC0415 - the compiler

    return opened(Inverse3Device(request.argument, progress=request.progress, **request.limits))


def _open_emulated(request: OpenRequest) -> Device:
    from study_app.devices.inverse3.doctor import EmulatedInverse3  # noqa: PLC0415 - the compiler

    return opened(EmulatedInverse3(request.random, progress=request.progress, **request.limits))


def _probe() -> list[Backend]:
    from study_app.devices.inverse3.probe import probe  # noqa: PLC0415 - asks the service

    return [probe()]


def _probe_emulated() -> list[Backend]:
    can = "simulated hand; the Inverse3's own driver with an emulated Inverse Service"
    return [Backend("inverse3-emulated", "the program", READY, can)]


_DOCTOR: Final = doctor_at(
    "study_app.devices.inverse3.failures:FAILURES.findings", "study_app.devices.inverse3.doctor:examine"
)

DEVICES: Final = (
    DeviceDescriptor(
        name="inverse3",
        title="Haply Inverse3",
        icon="device",
        kind="felt",
        degrees_of_freedom=3,
        open=_open,
        probe=_probe,
        argument="HOST:PORT",
        motion_shows_force=False,
        doctor=_DOCTOR,
    ),
    DeviceDescriptor(
        name="inverse3-emulated",
        title="Emulated Inverse3",
        icon="fast_forward",
        kind="simulated",
        degrees_of_freedom=3,
        open=_open_emulated,
        probe=_probe_emulated,
        moves_by_itself=True,
        motion_shows_force=False,
        doctor=_DOCTOR,
    ),
)
