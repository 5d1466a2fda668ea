"""What can go wrong with a Falcon: the failure modes as data, what was observed, and the errors.

A mode has symptom, cause, cure on each system, and which observed facts show it. `Facts` are what a transport, the
boot, homing or a test run saw; errors carry theirs. `diagnose` names the modes that the facts show. Errors take their
words from here; ``doctor`` walks all modes. Collected from what owners of Falcons reported of other drivers, and from
the documentation of FTDI, libusb and systemd; none was seen by us on a Falcon. Loads neither the compiler nor a driver.
"""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from study_app.devices.falcon.wire import constants
from study_app.devices.falcon.wire.constants import PRODUCT_ID, VENDOR_ID
from study_app.errors import DeviceError, DeviceLost, DeviceNotFound

OPEN: Final = "open"
ALL_HOMED: Final = 0b111
OTHER: Final = ""
"""Key of the cure on every platform that has none of its own."""
RULES_FILE: Final = "/etc/udev/rules.d/60-falcon.rules"
UDEV_RULE: Final = (
    f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{VENDOR_ID:04x}", ATTR{{idProduct}}=="{PRODUCT_ID:04x}", TAG+="uaccess"'
)
MOST_BROKEN: Final = 0.005
LEAST_HZ: Final = 800.0
LONGEST_ROUND_TRIP_S: Final = 0.002
LARGEST_STEP_N: Final = 0.5
_PORT: Final = {
    OTHER: "unplug cable and power adapter for ten seconds, then use another port of the computer itself, not of a hub",
    "darwin": "unplug cable and power adapter for ten seconds, then connect it through a powered hub",
}
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
FURTHER_KINDS: Final = ("kernel-driver", "no-backend", "no-ftd2xx")
"""What keeps it from being opened before libusb has a code for it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """What was observed; None is "not checked".

    Attributes
    ----------
    platform : as ``sys.platform`` says it
    usb : the kind of ``failures.UsbFailure``, or ``OPEN``: the bridge could be opened and claimed
    listed : the list of USB devices shows it
    ftdi_sees : FTDI's driver (D2XX) shows it
    program : "running", "loaded", "needed" (no file was given), "refused" (the file is none)
    boot_step : where loading it ended: "ping", "autobaud", "echo", "start"
    replies : it answers packets
    homed : bits of the arms that are
    moved : its encoders changed while the grip was to be moved
    pulled_out : the grip was pulled out after homing
    round_trip_s : median time from a packet to its reply [s]
    broken_share : share of packets without a whole reply
    rate_hz : ticks of the servo a second
    step_n : largest step of the force between two ticks [N]
    """

    platform: str = field(default_factory=lambda: sys.platform)
    usb: str | None = None
    listed: bool | None = None
    ftdi_sees: bool | None = None
    program: str | None = None
    boot_step: str | None = None
    replies: bool | None = None
    homed: int | None = None
    moved: bool | None = None
    pulled_out: bool | None = None
    round_trip_s: float | None = None
    broken_share: float | None = None
    rate_hz: float | None = None
    step_n: float | None = None


Shows = Callable[[Facts], bool | None]
"""True: the facts show this mode; False: they rule it out; None: they do not tell."""


@dataclass(frozen=True, slots=True)
class Mode:
    """One way to fail.

    ``tested`` is what holds where it is not there, ``symptom`` what a user sees where it is, ``cause`` a clause that
    fits after "because", ``cures`` what to do by platform ("" for all others), ``detected`` by what it is known,
    ``paste`` what a terminal on Linux takes.
    """

    id: str
    tested: str
    symptom: str
    cause: str
    cures: Mapping[str, str]
    detected: str
    shown_by: Shows
    paste: str = ""

    def cure(self, platform: str) -> str:
        """Return what to do on this system."""
        return self.cures.get(platform, self.cures.get(OTHER, ""))


def _usb(*kinds: str, platform: str | None = None, but: str | None = None) -> Shows:
    """Return the signs that opening failed in one of these ways, on this system or on any other ``but`` those."""

    def shown(facts: Facts) -> bool | None:
        if facts.usb is None:
            return None
        here = platform in {None, facts.platform} and facts.platform not in (but or "").split()
        if facts.usb in kinds:
            return here
        return False if facts.usb == OPEN or not here else None

    return shown


def _upload(facts: Facts) -> bool | None:
    if facts.boot_step is not None:
        return True
    return False if facts.program in {"running", "loaded"} else None


def _file(facts: Facts) -> bool | None:
    return None if facts.program is None else facts.program in {"needed", "refused"}


def _not_supported(facts: Facts) -> bool | None:
    if facts.usb == "not-supported":
        return facts.ftdi_sees is not False
    return _usb("not-supported")(facts)


def _two_drivers(facts: Facts) -> bool | None:
    if facts.platform != "win32" or facts.usb == OPEN:
        return False
    if facts.usb not in {"not-supported", "not-found"} or facts.listed is None or facts.ftdi_sees is None:
        return None
    return facts.listed and not facts.ftdi_sees


def _busy(facts: Facts) -> bool | None:
    if facts.usb == "access" and facts.platform == "win32":
        return True
    return _usb("busy")(facts)


def _stroke_in(facts: Facts) -> bool | None:
    if facts.homed == ALL_HOMED:
        return False
    return None if facts.homed is None or facts.moved is None else facts.moved


def _stroke_out(facts: Facts) -> bool | None:
    return None if facts.pulled_out is None else facts.homed == ALL_HOMED and not facts.pulled_out


def _power(facts: Facts) -> bool | None:
    return None if facts.replies is None else not facts.replies


def _frozen(facts: Facts) -> bool | None:
    return None if facts.moved is None or not facts.replies else not facts.moved


def _broken(facts: Facts) -> bool | None:
    return None if facts.broken_share is None else facts.broken_share > MOST_BROKEN


def _shaking(facts: Facts) -> bool | None:
    if facts.rate_hz is None and facts.step_n is None:
        return None
    slow = facts.rate_hz is not None and facts.rate_hz < LEAST_HZ
    return slow or (facts.step_n is not None and facts.step_n > LARGEST_STEP_N)


def _late(facts: Facts) -> bool | None:
    return None if facts.round_trip_s is None else facts.round_trip_s >= LONGEST_ROUND_TRIP_S


MODES: Final = (
    Mode(
        "upload",
        "its firmware loads (several attempts are normal)",
        "its firmware could not be loaded (several attempts are normal)",
        "the handshake with its boot loader or its echo was disturbed",
        {
            OTHER: f"check that its power adapter is plugged in, then {_PORT[OTHER]}",
            "darwin": f"check that its power adapter is plugged in, then {_PORT['darwin']}",
        },
        "the step at which loading ended, in ten attempts that each open it anew",
        _upload,
    ),
    Mode(
        "permission",
        "it is accessible without administrator rights",
        "only the administrator can open it",
        "this account may not open it",
        {
            "linux": f"put the line '{UDEV_RULE}' into {RULES_FILE}, run 'sudo udevadm control --reload', then plug "
            "the Falcon in again",
            OTHER: "give this account the permission to use USB devices, then plug the Falcon in again",
        },
        "libusb's error -3",
        _usb("access", but="darwin win32"),
        paste=f"echo '{UDEV_RULE}' | sudo tee {RULES_FILE} && sudo udevadm control --reload",
    ),
    Mode(
        "windows-driver",
        "its driver lets programs open it",
        "Windows lists it, but it cannot be opened",
        "its present driver does not let programs open it, and FTDI's library (ftd2xx) is not installed",
        {
            "win32": "install FTDI's D2XX driver; or replace the driver by WinUSB with Zadig, after which Novint's and "
            "Force Dimension's programs do not work until you select the old driver again in the Device Manager",
            OTHER: "remove the driver that was installed for it, so that libusb can open it",
        },
        "libusb's error -12",
        _not_supported,
    ),
    Mode(
        "two-drivers",
        "only one driver is bound to it",
        "Windows lists it, FTDI's driver shows none",
        "Force Dimension's driver is bound to it, which FTDI's D2XX cannot share",
        {
            "win32": "in the Device Manager choose Update driver, Let me pick, then FTDI's (or Novint's) driver; or "
            "replace the driver by WinUSB with Zadig",
            OTHER: "",
        },
        "it is in the list of USB devices and not in that of D2XX",
        _two_drivers,
    ),
    Mode(
        "firmware-file",
        "its firmware is available",
        "there is no firmware for it",
        "it lost its firmware when it was turned off, and the licence does not permit us to include it",
        {
            OTHER: "give --firmware PATH, the file nvent_firmware.bin (8492 bytes, SHA-256 1119e39c39fab1f3…) that "
            "came with your Falcon's software; if another program has just loaded it, check the power adapter"
        },
        "it answers no packet, and no file was given, or the file is not its firmware",
        _file,
    ),
    Mode(
        "stroke-in",
        "it homes: every arm has passed its index",
        "it does not home: its arms do not lock",
        "not every arm has passed its index",
        {OTHER: "push the grip fully in, as far as it goes, then pull it out"},
        "its encoders change, and the homed bit of an arm stays 0",
        _stroke_in,
    ),
    Mode(
        "stroke-out",
        "its grip was pulled out after homing",
        "it is homed, but gives no force",
        "its grip was not pulled out after homing",
        {OTHER: "pull it fully out, toward you"},
        "all arms are homed, and the grip was never beyond 170 mm",
        _stroke_out,
    ),
    Mode(
        "power",
        "it responds",
        "its bridge is found, but its arms are limp",
        "it does not answer",
        {OTHER: "check its power adapter, then unplug it, plug it in and start again"},
        "the bridge accepts packets, but no reply comes back",
        _power,
    ),
    Mode(
        "frozen",
        "its encoder counts change",
        "its positions do not change",
        "its encoder counts do not change",
        {OTHER: "check its power adapter; if the grip was moved, turn it off and on, then load its firmware again"},
        "all replies have the same encoder counts while the grip is moved",
        _frozen,
    ),
    Mode(
        "broken-packets",
        "every packet gets a complete reply",
        "it trembles, or it reports buttons that are not pressed",
        f"more than {MOST_BROKEN:.1%} of its packets get no complete reply",
        {OTHER: f"try another cable, then {_PORT[OTHER]}", "darwin": f"try another cable, then {_PORT['darwin']}"},
        "numbers of packets sent and of complete replies",
        _broken,
    ),
    Mode(
        "shaking",
        "the servo keeps its rate, and the force does not jump",
        "it shakes or twitches",
        f"the servo runs below {LEAST_HZ:.0f} ticks per second, or the force jumps by more than {LARGEST_STEP_N} N",
        {
            OTHER: "close other programs, connect the computer to mains power, turn power saving off, and run "
            "`liquid-study soak`"
        },
        "number of ticks per second; largest step of the force between two ticks",
        _shaking,
    ),
    Mode(
        "slow",
        "its replies come in time",
        "it feels coarse, as at 60 or 300 Hz",
        f"a reply takes {1000 * LONGEST_ROUND_TRIP_S:.0f} ms or longer: the bridge's latency timer delays it",
        {
            OTHER: f"close programs that use other serial adapters of FTDI, then {_PORT[OTHER]}",
            "win32": "set the latency timer of its port to 1 ms in the Device Manager, under Advanced",
        },
        "median of fifty round trips, with and without the bridge's event character",
        _late,
    ),
    Mode(
        "mac-driver",
        "no macOS driver has claimed it",
        "macOS denies access to it",
        "an FTDI driver has claimed it",
        {
            "darwin": "remove FTDIUSBSerialDriver.kext from /Library/Extensions, or D2xxHelper, then restart the Mac",
            OTHER: "",
        },
        "libusb's error -3 on macOS",
        _usb("access", platform="darwin"),
    ),
    Mode(
        "kernel-driver",
        "no Linux driver has claimed it",
        "Linux uses it as a serial port",
        "a driver of the system has claimed it and does not release it",
        {
            "linux": "run 'sudo modprobe -r ftdi_sio', and remove '0403 cb48' from the rule that writes to new_id",
            OTHER: "",
        },
        "the kernel's driver is active on its interface and cannot be detached",
        _usb("kernel-driver"),
        paste="sudo modprobe -r ftdi_sio",
    ),
    Mode(
        "busy",
        "no other program uses it",
        "it cannot be claimed",
        "another program uses it",
        {OTHER: "close that program: another liquid-study, findfalcons, H3DViewer, a game, or Force Dimension's tools"},
        "libusb's error -6, or -3 on Windows",
        _busy,
    ),
    Mode(
        "unplugged",
        "it stayed connected",
        "it was disconnected during use",
        "it is no longer there",
        {
            OTHER: "turn it off if it pushes; check the cable, plug it in again, home it and resume: the trial is "
            "marked, and its recording is kept"
        },
        "libusb's error -4",
        _usb("no-device"),
    ),
    Mode(
        "not-connected",
        "it is connected",
        "it is not found",
        "none is connected",
        {
            OTHER: "connect the USB cable and the power adapter",
            "win32": "connect the USB cable directly to the machine, and the power adapter",
            "darwin": "connect the USB cable through a powered hub, and the power adapter",
        },
        "no USB device 0403:cb48",
        _usb("not-found"),
    ),
    Mode(
        "no-libusb",
        "libusb is loaded",
        "no USB device is found at all",
        "libusb cannot be loaded",
        {OTHER: "install libusb-package again: pip install --force-reinstall libusb-package"},
        "libusb does not load",
        _usb("no-backend"),
    ),
    Mode(
        "no-ftd2xx",
        "FTDI's driver library is loaded where it is needed",
        "FTDI's driver cannot be used",
        "FTDI's driver library (ftd2xx) cannot be loaded",
        {OTHER: "install FTDI's D2XX driver"},
        "neither ftd2xx64.dll nor ftd2xx.dll loads",
        _usb("no-ftd2xx"),
    ),
    Mode(
        "transfer",
        "its transfers succeed",
        "a transfer failed",
        "the bridge did not carry out a transfer, or not in time",
        {OTHER: f"check cable and power adapter, then {_PORT[OTHER]}"},
        "another error of libusb, named in the message",
        _usb("io", "timeout", "overflow", "pipe"),
    ),
)


BY_ID: Final = {mode.id: mode for mode in MODES}


def diagnose(facts: Facts) -> list[Mode]:
    """Return the modes that the facts show, in their order."""
    return [mode for mode in MODES if mode.shown_by(facts)]


def sentence(facts: Facts) -> str:
    """Return cause and cure of what the facts show, in a line; "" where they show nothing wrong."""
    return "; ".join(f"{mode.cause}: {mode.cure(facts.platform)}" for mode in diagnose(facts)[:1])


class FalconFailure(DeviceError):
    """Something keeps the Falcon from being used; ``facts`` are what was seen of it."""

    def __init__(self, message: str, facts: Facts) -> None:
        self.facts = facts
        super().__init__(message)


class ProgramMissing(FalconFailure):
    """It needs its firmware, and none was given, or what was given is none."""


class UsbFailure(FalconFailure):
    """A transfer, or the way to it, failed.

    ``kind`` is the word by which `failure_modes` knows it (of ``KINDS`` or ``FURTHER_KINDS``), ``where`` what was being
    done, ``code`` libusb's error, None where no transfer was tried.
    """

    def __init__(self, kind: str, where: str, code: int | None = None) -> None:
        self.kind = kind
        self.where = where
        self.code = code
        libusb = "" if code is None else f", libusb error {code}"
        facts = Facts(usb=kind)
        super().__init__(f"the Falcon cannot be used ({where}{libusb}): {sentence(facts)}", facts)


class FalconNotFound(UsbFailure, DeviceNotFound):
    """There is none."""


class FalconLost(UsbFailure, DeviceLost):
    """It was there."""


def usb_failure(code: int, where: str) -> UsbFailure:
    """Return the error to raise for libusb's ``code``, which came while doing ``where``."""
    kind = KINDS.get(code, "io")
    classes: dict[str, type[UsbFailure]] = {"no-device": FalconLost, "not-found": FalconNotFound}
    return classes.get(kind, UsbFailure)(kind, where, code)
