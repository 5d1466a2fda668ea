"""The devices of the program; a device of another package has its descriptor at an entry point."""

from __future__ import annotations

from dataclasses import replace
from pkgutil import resolve_name
from typing import Final

from study_app.devices import WITHOUT_FORCE
from study_app.devices.descriptor import READY, Backend, DeviceDescriptor, DeviceOption, framed, loaded_on_call, opened

_FIRMWARE: Final = DeviceOption(
    name="firmware",
    title="Falcon's firmware",
    help="The Falcon's firmware file, needed if the Falcon has been switched off since its last use. The file came "
    "with the Falcon's software.",
    about="A Falcon needs its firmware each time it is turned on, and the licence does not allow us to supply it. "
    "Choose the file that came with your Falcon; it is loaded only if the Falcon needs it.",
    hint="loaded only if the Falcon needs it",
    placeholder="Not needed if the firmware is already loaded",
    file_filter="Firmware (*.bin);;All files (*)",
)
BY_COMMAND: Final = replace(_FIRMWARE, in_windows=False)
_DHD_LIBRARY: Final = DeviceOption(
    name="dhd-library",
    title="Force Dimension's library",
    help="Path of the Force Dimension SDK's library (libdrd.so, libdrd.dylib or drd64.dll).",
    about="You must install the Force Dimension SDK yourself. Choose its library here if it is not found "
    "automatically.",
    hint="only if it is not found automatically",
    placeholder="Not needed if the library is in its usual location",
    file_filter="Libraries (*.so* *.dylib *.dll);;All files (*)",
)


def _felt_and_emulated(
    name: str,
    title: str,
    driver: str,
    emulated: str,
    failures: str,
    probes: tuple[str, ...],
    can: str,
    *,
    argument: str = "SERIAL",
    stop_button: str = "device button 4",
    options: tuple[DeviceOption, ...] = (),
    emulated_options: tuple[DeviceOption, ...] = (),
) -> tuple[DeviceDescriptor, DeviceDescriptor]:
    """Return the descriptors of a device with force and of its emulation, whose capabilities ``can`` describes."""
    package, emulated_name = "study_app.devices.", f"{name}-emulated"
    failures = package + failures
    return (
        framed(
            name,
            title,
            package + driver,
            failures,
            icon="device",
            kind="felt",
            probe=lambda: [resolve_name(package + probe)() for probe in probes],
            argument=argument,
            stop_button=stop_button,
            options=options,
        ),
        framed(
            emulated_name,
            f"Emulated {title.removeprefix('Haply ').removeprefix('Novint ')}",
            package + emulated,
            failures,
            icon="fast_forward",
            kind="simulated",
            probe=lambda: [Backend(emulated_name, "the program", state=READY, can=can)],
            moves_by_itself=True,
            stop_button=stop_button,
            options=emulated_options,
        ),
    )


DEVICES: Final = (
    *_felt_and_emulated(
        "falcon",
        "Novint Falcon",
        "falcon.device:FalconDevice",
        "emulators.falcon:EmulatedFalcon",
        "falcon.failures:FAILURES",
        ("falcon.transport:probe", "falcon.transport:probe_ftdi"),
        "simulated hand; the Falcon's own driver with an emulated Falcon",
        options=(_FIRMWARE,),
        emulated_options=(BY_COMMAND,),
    ),
    *_felt_and_emulated(
        "force-dimension",
        "Force Dimension",
        "force_dimension.device:ForceDimensionDevice",
        "emulators.force_dimension:EmulatedForceDimension",
        "force_dimension.library:FAILURES",
        ("force_dimension.library:probe",),
        "simulated hand; the Force Dimension driver with emulated library functions; does not need a C compiler",
        options=(_DHD_LIBRARY,),
    ),
    *_felt_and_emulated(
        "inverse3",
        "Haply Inverse3",
        "inverse3.device:Inverse3Device",
        "emulators.inverse3:EmulatedInverse3",
        "inverse3.service:FAILURES",
        ("inverse3.service:probe",),
        "simulated hand; the Inverse3's own driver with an emulated Inverse Service",
        argument="HOST:PORT",
        stop_button="",  # the grip has three buttons
    ),
    DeviceDescriptor(
        name="mouse",
        title=WITHOUT_FORCE["mouse"],
        icon="mouse",
        kind="seen",
        degrees_of_freedom=3,
        open=lambda request: opened(resolve_name("study_app.devices.simulated:MouseDevice")(**request.limits)),
        probe=lambda: [
            Backend(
                "mouse",
                "the window",
                state=READY,
                can="visual only, no force: the ball moves as it would in the liquid",
            )
        ],
        pointer=True,
    ),
    DeviceDescriptor(
        name="scripted",
        title="Scripted hand",
        icon="fast_forward",
        kind="simulated",
        degrees_of_freedom=3,
        open=lambda request: opened(
            resolve_name("study_app.devices.simulated:ScriptedDevice")(request.random, **request.limits)
        ),
        probe=lambda: [
            Backend(
                "scripted", "the program", state=READY, can="simulated hand, no force; every row is marked as simulated"
            )
        ],
        moves_by_itself=True,
    ),
    DeviceDescriptor(
        name="spacemouse",
        title=WITHOUT_FORCE["spacemouse"],
        icon="mouse",
        kind="seen",
        degrees_of_freedom=3,
        open=lambda request: opened(
            resolve_name("study_app.devices.spacemouse.device:SpaceMouseDevice")(**request.limits)
        ),
        probe=loaded_on_call("study_app.devices.spacemouse.hid:probe"),
        stop_button="buttons 1 and 2",
    ),
)
