"""What can go wrong with a Falcon, on each system.

Collected from what owners of Falcons reported of other drivers, and from the documentation of FTDI, libusb and systemd;
none was seen by us on a Falcon. Loads neither the compiler nor a driver.
"""

import sys
from typing import Final

from study_app.devices.doctor import DeviceFailure, FailureMode, FailureTable
from study_app.devices.falcon import constants
from study_app.devices.falcon.constants import PRODUCT_ID, VENDOR_ID
from study_app.errors import DeviceLost, DeviceNotFound

RULES_FILE: Final = "/etc/udev/rules.d/60-falcon.rules"
UDEV_RULE: Final = (
    f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{VENDOR_ID:04x}", ATTR{{idProduct}}=="{PRODUCT_ID:04x}", TAG+="uaccess"'
)
MOST_BROKEN: Final = 0.005
LONGEST_ROUND_TRIP_S: Final = 0.002
KINDS: Final = {
    constants.ERROR_IO: "io",
    constants.ERROR_ACCESS: "access",
    constants.ERROR_NO_DEVICE: "no-device",
    constants.ERROR_NOT_FOUND: "not-found",
    constants.ERROR_BUSY: "busy",
    constants.ERROR_TIMEOUT: "timeout",
    constants.ERROR_OVERFLOW: "overflow",
    constants.ERROR_PIPE: "pipe",
    constants.ERROR_NOT_SUPPORTED: "not-supported",
}
FURTHER_KINDS: Final = ("kernel-driver", "no-libusb", "no-ftd2xx", "two-drivers")
"""What keeps it from being opened before libusb has a code for it."""


def failures_on(platform: str) -> FailureTable:
    """Return the modes of failure on a system, which is named as by ``sys.platform``."""
    windows, mac, linux = platform == "win32", platform == "darwin", platform.startswith("linux")
    port = "unplug cable and power adapter for ten seconds, then " + (
        "connect it through a powered hub" if mac else "use another port of the computer itself, not of a hub"
    )
    access = FailureMode(
        "permission",
        "it is accessible without administrator rights",
        "only the administrator can open it",
        "this account may not open it",
        (
            f"put the line '{UDEV_RULE}' into {RULES_FILE}, run 'sudo udevadm control --reload', then plug the Falcon "
            "in again"
            if linux
            else "give this account the permission to use USB devices, then plug the Falcon in again"
        ),
        "libusb's error -3",
        f"echo '{UDEV_RULE}' | sudo tee {RULES_FILE} && sudo udevadm control --reload" if linux else "",
    )
    if mac:
        access = FailureMode(
            "permission",
            "no macOS driver has claimed it",
            "macOS denies access to it",
            "an FTDI driver has claimed it",
            "remove FTDIUSBSerialDriver.kext from /Library/Extensions, or D2xxHelper, then restart the Mac",
            "libusb's error -3 on macOS",
        )
    of_windows = (
        FailureMode(
            "two-drivers",
            "only one driver is bound to it",
            "Windows lists it, FTDI's driver shows none",
            "Force Dimension's driver is bound to it, which FTDI's D2XX cannot share",
            "in the Device Manager choose Update driver, Let me pick, then FTDI's (or Novint's) driver; or replace the "
            "driver by WinUSB with Zadig",
            "it is in the list of USB devices and not in that of D2XX",
        ),
        FailureMode(
            "no-ftd2xx",
            "FTDI's driver library is loaded where it is needed",
            "FTDI's driver cannot be used",
            "FTDI's driver library (ftd2xx) cannot be loaded",
            "install FTDI's D2XX driver",
            "neither ftd2xx64.dll nor ftd2xx.dll loads",
        ),
    )
    of_linux = FailureMode(
        "kernel-driver",
        "no Linux driver has claimed it",
        "Linux uses it as a serial port",
        "a driver of the system has claimed it and does not release it",
        "run 'sudo modprobe -r ftdi_sio', and remove '0403 cb48' from the rule that writes to new_id",
        "the kernel's driver is active on its interface and cannot be detached",
        "sudo modprobe -r ftdi_sio",
    )
    cable = {"win32": " directly to the machine,", "darwin": " through a powered hub,"}.get(platform, "")
    modes = (
        FailureMode(
            "no-libusb",
            "libusb is loaded",
            "no USB device is found at all",
            "libusb cannot be loaded",
            "install libusb-package again: pip install --force-reinstall libusb-package",
            "libusb does not load",
        ),
        FailureMode(
            "not-connected",
            "it is connected",
            "it is not found",
            "none is connected",
            f"connect the USB cable{cable} and the power adapter",
            "no USB device 0403:cb48",
        ),
        access,
        FailureMode(
            "driver",
            "its driver lets programs open it",
            "it is listed, but cannot be opened",
            "its present driver does not let programs open it, and FTDI's library (ftd2xx) is not installed",
            (
                "install FTDI's D2XX driver; or replace the driver by WinUSB with Zadig, after which Novint's and "
                "Force Dimension's programs do not work until you select the old driver again in the Device Manager"
                if windows
                else "remove the driver that was installed for it, so that libusb can open it"
            ),
            "libusb's error -12",
        ),
        *(of_windows if windows else ()),
        *((of_linux,) if linux else ()),
        FailureMode(
            "busy",
            "no other program uses it",
            "it cannot be claimed",
            "another program uses it",
            "close that program: another liquid-study, findfalcons, H3DViewer, a game, or Force Dimension's tools",
            "libusb's error -6, or -3 on Windows",
        ),
        FailureMode(
            "transfer",
            "its transfers succeed",
            "a transfer failed",
            "the bridge did not carry out a transfer, or not in time",
            f"check cable and power adapter, then {port}",
            "another error of libusb, named in the message",
        ),
        FailureMode(
            "firmware-file",
            "its firmware is available",
            "there is no firmware for it",
            "it lost its firmware when it was turned off, and the licence does not permit us to include it",
            "give --firmware PATH, the file nvent_firmware.bin (8492 bytes, SHA-256 1119e39c39fab1f3…) that came with "
            "your Falcon's software; if another program has just loaded it, check the power adapter",
            "it answers no packet, and no file was given",
        ),
        FailureMode(
            "not-firmware",
            "the file is its firmware",
            "the file is not a Falcon's firmware",
            "it is another file, or was not copied as a whole",
            "the usual one is nvent_firmware.bin, 8492 bytes, from the software of your Falcon",
            "the blocks of the file, before a byte of it is sent",
        ),
        FailureMode(
            "upload",
            "its firmware loads (several attempts are normal)",
            "its firmware could not be loaded (several attempts are normal)",
            "the handshake with its boot loader or its echo was disturbed",
            f"check that its power adapter is plugged in, then {port}",
            "the step at which loading ended, in ten attempts that each open it anew",
        ),
        FailureMode(
            "slow",
            "its replies come in time",
            "it feels coarse, as at 60 or 300 Hz",
            f"a reply takes {1000 * LONGEST_ROUND_TRIP_S:.0f} ms or longer: the bridge's latency timer delays it",
            (
                "set the latency timer of its port to 1 ms in the Device Manager, under Advanced"
                if windows
                else f"close programs that use other serial adapters of FTDI, then {port}"
            ),
            "median of fifty round trips, with and without the bridge's event character",
        ),
        FailureMode(
            "power",
            "it responds",
            "its bridge is found, but its arms are limp",
            "it does not answer",
            "check its power adapter, then unplug it, plug it in and start again",
            "the bridge accepts packets, but no reply comes back",
        ),
        FailureMode(
            "frozen",
            "its encoder counts change",
            "its positions do not change",
            "its encoder counts do not change",
            "check its power adapter; if the grip was moved, turn it off and on, then load its firmware again",
            "all replies have the same encoder counts while the grip is moved",
        ),
        FailureMode(
            "stroke-in",
            "it homes: every arm has passed its index",
            "it does not home: its arms do not lock",
            "not every arm has passed its index",
            "push the grip fully in, as far as it goes, then pull it out",
            "its encoders change, and the homed bit of an arm stays 0",
        ),
        FailureMode(
            "stroke-out",
            "its grip was pulled out after homing",
            "it is homed, but gives no force",
            "its grip was not pulled out after homing",
            "pull it fully out, toward you",
            "all arms are homed, and the grip was never beyond 170 mm",
        ),
        FailureMode(
            "unplugged",
            "it stayed connected",
            "it was disconnected during use",
            "it is no longer there",
            "turn it off if it pushes; check the cable, plug it in again, home it and resume: the trial is marked, and "
            "its recording is kept",
            "libusb's error -4",
        ),
        FailureMode(
            "unhomed",
            "it stays homed",
            "it is no longer homed",
            "its power was interrupted",
            "check its power adapter, then unplug it, plug it in and start again",
            "the homed bit of an arm",
        ),
        FailureMode(
            "broken-packets",
            "every packet gets a complete reply",
            "it trembles, or it reports buttons that are not pressed",
            f"more than {MOST_BROKEN:.1%} of its packets get no complete reply",
            f"try another cable, then {port}",
            "numbers of packets sent and of complete replies",
        ),
        FailureMode(
            "unguarded",
            "its guard process runs",
            "its guard process has died, so the force was turned off",
            "another program ended it",
            "start this program again",
            "the guard process ends before it is dismissed",
        ),
        FailureMode(
            "rate",
            "it keeps up with 1 kHz",
            "it shakes or twitches",
            "it gives fewer than 900 new positions per second",
            "close other programs, connect the computer to mains power, turn power saving off, and run `liquid-study "
            "soak`",
            "new positions per second while it runs",
        ),
    )
    return FailureTable("the Falcon", modes, frozenset({"no-libusb", "not-connected"}))


FAILURES: Final = failures_on(sys.platform)


class UsbFailure(DeviceFailure):
    """A transfer, or the way to it, failed.

    ``kind`` is one of ``KINDS`` or ``FURTHER_KINDS``, ``where`` what was being done, ``code`` libusb's error, None
    where no transfer was tried.
    """

    def __init__(self, kind: str, where: str, code: int | None = None) -> None:
        self.kind, self.code = kind, code
        modes = {
            "access": "busy" if sys.platform == "win32" else "permission",
            "no-device": "unplugged",
            "not-found": "not-connected",
            "not-supported": "driver",
        }
        mode = modes.get(kind, "transfer" if kind in KINDS.values() and kind != "busy" else kind)
        libusb = "" if code is None else f", libusb error {code}"
        tables = FAILURES, failures_on("win32"), failures_on("linux")
        table = next(one for one in tables if mode in {known.id for known in one.modes})
        super().__init__(mode, str(table.failure(mode, where + libusb)))


class FalconNotFound(UsbFailure, DeviceNotFound):
    """There is none."""


class FalconLost(UsbFailure, DeviceLost):
    """It was there."""


def usb_failure(code: int, where: str) -> UsbFailure:
    """Return the error to raise for libusb's ``code``, which came while doing ``where``."""
    kind = KINDS.get(code, "io")
    classes: dict[str, type[UsbFailure]] = {"no-device": FalconLost, "not-found": FalconNotFound}
    return classes.get(kind, UsbFailure)(kind, where, code)
