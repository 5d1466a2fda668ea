"""The meaning of libusb's errors: class, failure mode and text of each, on each system."""

import pytest

from study_app.devices.falcon import failures
from study_app.devices.falcon.constants import (
    ERROR_ACCESS,
    ERROR_BUSY,
    ERROR_IO,
    ERROR_NO_DEVICE,
    ERROR_NOT_FOUND,
    ERROR_NOT_SUPPORTED,
    ERROR_OVERFLOW,
    ERROR_PIPE,
    ERROR_TIMEOUT,
)
from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure, failures_on, usb_failure
from study_app.errors import DeviceLost, DeviceNotFound


@pytest.mark.parametrize(
    ("code", "kind", "mode", "of"),
    [
        (ERROR_IO, "io", "transfer", UsbFailure),
        (ERROR_TIMEOUT, "timeout", "transfer", UsbFailure),
        (ERROR_OVERFLOW, "overflow", "transfer", UsbFailure),
        (ERROR_PIPE, "pipe", "transfer", UsbFailure),
        (ERROR_ACCESS, "access", "permission", UsbFailure),
        (ERROR_BUSY, "busy", "busy", UsbFailure),
        (ERROR_NO_DEVICE, "no-device", "unplugged", FalconLost),
        (ERROR_NOT_FOUND, "not-found", "not-connected", FalconNotFound),
        (ERROR_NOT_SUPPORTED, "not-supported", "driver", UsbFailure),
        (-99, "io", "transfer", UsbFailure),
    ],
)
def test_each_error_of_a_transfer_has_its_mode_of_failure(
    code: int, kind: str, mode: str, of: type[UsbFailure], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr(failures, "FAILURES", failures_on("linux"))
    error = usb_failure(code, "reading encoders")
    assert (type(error), error.kind, error.code, error.mode) == (of, kind, code, mode)
    assert f"while reading encoders, libusb error {code}" in str(error)
    assert failures_on("linux").mode(mode).cure in str(error)
    assert isinstance(error, DeviceLost) == (kind == "no-device")
    assert isinstance(error, DeviceNotFound) == (kind == "not-found")


def test_without_a_transfer_no_code_is_stated_and_each_system_has_its_own_text(monkeypatch: pytest.MonkeyPatch) -> None:
    windows, linux = failures_on("win32"), failures_on("linux")
    monkeypatch.setattr(failures, "FAILURES", linux)
    error = UsbFailure("kernel-driver", "opening")
    assert (error.kind, error.code, error.mode) == ("kernel-driver", None, "kernel-driver")
    assert ("while opening" in str(error), "libusb error" in str(error)) == (True, False)
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.setattr(failures, "FAILURES", windows)
    denied = usb_failure(ERROR_ACCESS, "opening")
    assert (denied.kind, denied.mode) == ("access", "busy"), "Windows lets one program open a device"
    assert windows.mode("busy").cure in str(denied)
    assert {mode.id for mode in linux.modes} - {mode.id for mode in windows.modes} == {"kernel-driver"}
    assert UsbFailure("kernel-driver", "opening").mode == "kernel-driver", "a mode of another system has its words too"


def test_stated_numbers_and_files_equal_those_of_the_program() -> None:
    linux = failures_on("linux")
    rule = 'SUBSYSTEM=="usb", ATTR{idVendor}=="0403", ATTR{idProduct}=="cb48", TAG+="uaccess"'
    file, reload = "/etc/udev/rules.d/60-falcon.rules", "sudo udevadm control --reload"
    assert linux.mode("permission").paste == f"echo '{rule}' | sudo tee {file} && {reload}"
    assert linux.mode("permission").cure.startswith(f"put the line '{rule}' into {file}, run '{reload}'")
    assert "a reply takes 2 ms or longer" in linux.mode("slow").cause
