"""The Novint Falcon: connected by USB, emulated in this program, or emulated by another one behind a socket."""

from __future__ import annotations

import socket
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from study_app.devices.descriptor import (
    NOT_AVAILABLE,
    READY,
    Backend,
    DeviceDescriptor,
    DeviceOption,
    OpenRequest,
    doctor_at,
    opened,
)

if TYPE_CHECKING:
    from study_app.devices.base import Device

FIRMWARE: Final = DeviceOption(
    name="firmware",
    title="Falcon's firmware",
    help="Program of a Falcon that was switched on since it last ran: its owner has the file.",
    about="A Falcon needs its firmware after it was turned on, and the licence does not allow us to include it. "
    "Choose your own firmware file; it is loaded only if the Falcon needs it.",
    hint="loaded only if the Falcon needs it",
    placeholder="Not needed if the firmware is already loaded",
    file_filter="Firmware (*.bin);;All files (*)",
)
BY_COMMAND: Final = replace(FIRMWARE, in_windows=False)


def _open_bridge(bridge: str, request: OpenRequest) -> Device:
    from study_app.devices.falcon.device import FalconDevice  # noqa: PLC0415 - the compiler

    falcon = FalconDevice(
        bridge,
        firmware=request.options.get("firmware"),
        progress=request.progress,
        cancelled=request.cancelled,
        **request.limits,
    )
    return opened(falcon)


def _open(request: OpenRequest) -> Device:
    return _open_bridge(f"falcon:{request.argument}" if request.argument else "falcon", request)


def _open_socket(request: OpenRequest) -> Device:
    return _open_bridge(f"falcon-socket:{request.argument}", request)


def _open_emulated(request: OpenRequest) -> Device:
    from study_app.devices.falcon.emulated import EmulatedFalcon  # noqa: PLC0415 - the compiler

    falcon = EmulatedFalcon(
        request.random,
        firmware=request.options.get("firmware"),
        progress=request.progress,
        cancelled=request.cancelled,
        **request.limits,
    )
    return opened(falcon)


def _probe() -> list[Backend]:
    from study_app.devices.falcon.probe import probe, probe_ftdi  # noqa: PLC0415 - libusb

    return [probe(), probe_ftdi()]


def _probe_emulated() -> list[Backend]:
    can = "simulated hand; the Falcon's own driver with an emulated Falcon"
    return [Backend("falcon-emulated", "the program", READY, can)]


def _probe_socket() -> list[Backend]:
    can = "a Falcon that another program emulates: liquid-study emulate-falcon --socket PATH"
    missing = "" if hasattr(socket, "AF_UNIX") else "this system's Python has no Unix sockets"
    return [Backend("falcon-socket:PATH", "a Unix socket", NOT_AVAILABLE if missing else READY, can, missing)]


_DOCTOR: Final = doctor_at(
    "study_app.devices.falcon.doctor.failure_report:findings_of",
    "study_app.devices.falcon.doctor.examine:examine_device",
)

DEVICES: Final = (
    DeviceDescriptor(
        name="falcon",
        title="Novint Falcon",
        icon="device",
        kind="felt",
        degrees_of_freedom=3,
        open=_open,
        probe=_probe,
        argument="SERIAL",
        motion_shows_force=False,
        options=(FIRMWARE,),
        doctor=_DOCTOR,
    ),
    DeviceDescriptor(
        name="falcon-emulated",
        title="Emulated Falcon",
        icon="fast_forward",
        kind="simulated",
        degrees_of_freedom=3,
        open=_open_emulated,
        probe=_probe_emulated,
        moves_by_itself=True,
        motion_shows_force=False,
        options=(BY_COMMAND,),
        doctor=_DOCTOR,
    ),
    DeviceDescriptor(
        name="falcon-socket",
        title="Falcon behind a socket",
        icon="fast_forward",
        kind="simulated",
        degrees_of_freedom=3,
        open=_open_socket,
        probe=_probe_socket,
        argument="PATH",
        argument_required=True,
        motion_shows_force=False,
        options=(BY_COMMAND,),
        doctor=_DOCTOR,
    ),
)
