"""The USB bus of emulated Falcons rejects what libusb rejects: calls without a claim, a cable or an open handle."""

from collections.abc import Callable
from typing import Any

import numba
import pytest
import usb.core

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

from study_app.devices.emulators.falcon import EmulatedBackend
from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.falcon import constants


@pytest.fixture
def emulator() -> Emulator:
    return Emulator(running=True)


@pytest.fixture
def bus(emulator: Emulator) -> EmulatedBackend:
    return EmulatedBackend(emulator)


def error_code(call: Callable[..., object], *arguments: Any) -> int:
    """Return the libusb code of the error that the call raises."""
    with pytest.raises(usb.core.USBError) as caught:
        call(*arguments)
    return int(caught.value.backend_error_code)


def calls(bus: EmulatedBackend) -> dict[str, Callable[[Any], object]]:
    """Return the calls that need an open handle and a cable."""
    return {
        "set configuration": lambda handle: bus.set_configuration(handle, 1),
        "get configuration": bus.get_configuration,
        "claim": lambda handle: bus.claim_interface(handle, 0),
        "release": lambda handle: bus.release_interface(handle, 0),
        "kernel driver": lambda handle: bus.is_kernel_driver_active(handle, 0),
        "detach": lambda handle: bus.detach_kernel_driver(handle, 0),
        "write": lambda handle: bus.bulk_write(handle, constants.ENDPOINT_OUT, 0, constants.PING, 20),
        "clear halt": lambda handle: bus.clear_halt(handle, constants.ENDPOINT_IN),
        "reset": bus.reset_device,
    }


def test_an_interface_is_released_once_and_by_the_handle_that_claimed_it(
    bus: EmulatedBackend, emulator: Emulator
) -> None:
    owner, other = bus.open_device(emulator), bus.open_device(emulator)
    assert error_code(bus.release_interface, owner, 0) == constants.ERROR_NOT_FOUND
    bus.claim_interface(owner, 0)
    assert error_code(bus.claim_interface, other, 0) == constants.ERROR_BUSY
    assert error_code(bus.release_interface, other, 0) == constants.ERROR_NOT_FOUND
    assert error_code(bus.claim_interface, other, 0) == constants.ERROR_BUSY
    bus.release_interface(owner, 0)
    assert error_code(bus.release_interface, owner, 0) == constants.ERROR_NOT_FOUND
    bus.claim_interface(other, 0)


@pytest.mark.parametrize("closed", ["owner", "other"])
def test_closing_a_handle_releases_its_own_claim_only(bus: EmulatedBackend, emulator: Emulator, closed: str) -> None:
    handles = {"owner": bus.open_device(emulator), "other": bus.open_device(emulator)}
    bus.claim_interface(handles["owner"], 0)
    bus.close_device(handles[closed])
    third = bus.open_device(emulator)
    if closed == "owner":
        bus.claim_interface(third, 0)
    else:
        assert error_code(bus.claim_interface, third, 0) == constants.ERROR_BUSY


def test_only_the_handle_with_the_claim_transfers_bytes(bus: EmulatedBackend, emulator: Emulator) -> None:
    owner, other = bus.open_device(emulator), bus.open_device(emulator)
    bus.claim_interface(owner, 0)
    write = calls(bus)["write"]
    assert write(owner) == len(constants.PING)
    assert error_code(write, other) == constants.ERROR_IO


@pytest.mark.parametrize("reason", ["closed", "unplugged"])
@pytest.mark.parametrize("name", calls(EmulatedBackend()))
def test_a_closed_handle_and_one_without_a_cable_reject_every_call(
    bus: EmulatedBackend, emulator: Emulator, name: str, reason: str
) -> None:
    handle = bus.open_device(emulator)
    bus.claim_interface(handle, 0)
    if reason == "closed":
        bus.close_device(handle)
    else:
        emulator.faults.on("unplugged")
    assert error_code(calls(bus)[name], handle) == constants.ERROR_NO_DEVICE
