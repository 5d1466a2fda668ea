"""Force Dimension's devices: through the maker's installed library, or emulated in this program."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from study_app.devices.descriptor import READY, Backend, DeviceDescriptor, DeviceOption, OpenRequest, doctor_at, opened

if TYPE_CHECKING:
    from study_app.devices.base import Device

_LIBRARY: Final = DeviceOption(
    name="dhd-library",
    title="Force Dimension's library",
    help="Path of the Force Dimension SDK's library (libdrd.so, libdrd.dylib, drd64.dll).",
    about="The Force Dimension SDK is installed by its user. Choose its library if it is not found by itself.",
    hint="only if it is not found by itself",
    placeholder="Not needed if the library is at its usual place",
    file_filter="Libraries (*.so* *.dylib *.dll);;All files (*)",
)


def _open(request: OpenRequest) -> Device:
    from study_app.devices.force_dimension.device import ForceDimensionDevice  # noqa: PLC0415 - the compiler

    library = request.options.get(_LIBRARY.name)
    return opened(ForceDimensionDevice(request.argument, library=library, **request.limits))


def _open_emulated(request: OpenRequest) -> Device:
    from study_app.devices.force_dimension.emulated import EmulatedForceDimension  # noqa: PLC0415 - the compiler

    return opened(EmulatedForceDimension(request.random, **request.limits))


def _probe() -> list[Backend]:
    from study_app.devices.force_dimension.library import probe  # noqa: PLC0415 - loads the maker's library

    return [probe()]


def _probe_emulated() -> list[Backend]:
    can = "simulated hand; the Force Dimension driver with emulated library functions; needs no C compiler"
    return [Backend("force-dimension-emulated", "the program", READY, can)]


_DOCTOR: Final = doctor_at(
    "study_app.devices.force_dimension.failures:FAILURES.findings", "study_app.devices.force_dimension.doctor:examine"
)

DEVICES: Final = (
    DeviceDescriptor(
        name="force-dimension",
        title="Force Dimension",
        icon="device",
        kind="felt",
        degrees_of_freedom=3,
        open=_open,
        probe=_probe,
        argument="SERIAL",
        motion_shows_force=False,
        options=(_LIBRARY,),
        doctor=_DOCTOR,
    ),
    DeviceDescriptor(
        name="force-dimension-emulated",
        title="Emulated Force Dimension",
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
