"""What can go wrong with a Force Dimension device. None of it was seen by us on a device."""

from typing import Final

from study_app.devices.failure_table import FailureMode, FailureTable

VARIABLE: Final = "LIQUID_STUDY_DHD_LIBRARY"
OPTION: Final = "dhd-library"

FAILURES: Final = FailureTable(
    "the Force Dimension device",
    (
        FailureMode(
            "no-library",
            "the maker's library is installed",
            "Force Dimension's library cannot be loaded",
            "the Force Dimension SDK is not installed, is for another processor, or is at an unusual place",
            f"install it from forcedimension.com, or give the path of libdrd or drd64.dll by --{OPTION} or {VARIABLE}",
            "the operating system's loader finds no library",
        ),
        FailureMode(
            "old-library",
            "the library has every function that is used",
            "Force Dimension's library lacks functions",
            "it is older than SDK 3.17, or it is libdhd, which is a part of libdrd only",
            f"install SDK 3.17.5 or later, and give the path of libdrd or drd64.dll by --{OPTION} or {VARIABLE}",
            "symbols that the loaded library does not export",
        ),
        FailureMode(
            "no-device",
            "a device is connected and can be opened",
            "the library opens no such device",
            "none is connected, it has no power, another program uses it, or the user may not access USB",
            "connect cable and power, close other programs, check the serial number, on Linux install the maker's udev "
            "rules",
            "dhdOpen or dhdOpenSerial returns -1",
        ),
        FailureMode(
            "uncalibrated",
            "the device is calibrated",
            "the device is not calibrated",
            "it was not calibrated since it was turned on",
            "put the handle's calibration pole into its pit (or at its rest position) until the light stops blinking",
            "drdIsInitialized, or the device's status RESET",
        ),
        FailureMode(
            "safety",
            "the controller's own safety functions are on",
            "a safety function of the controller is off",
            "another program turned it off",
            "turn the device off and on, and calibrate it",
            "dhdGetVelocityThreshold returns an error or 0, or dhdSetTimeGuard returns an error",
        ),
        FailureMode(
            "max-force",
            "the library permits the force limit of the study",
            "the library limits the force to less than the study needs",
            "another program set the limit, or the device is weaker",
            "turn the device off and on, or lower force_limit_n in the protocol",
            "dhdGetMaxForce",
        ),
        FailureMode(
            "force-off",
            "the device's force is enabled",
            "the device turned its force off",
            "its force button, its velocity threshold, its watchdog or a USB error ended the force",
            "let the handle rest, press the device's force button, close other programs, and connect again",
            "status FORCE is 0; the device states the cause",
        ),
        FailureMode(
            "error",
            "every call of the library succeeds",
            "the library reports an error",
            "the device was disconnected or lost power, or USB failed",
            "check cable and power, and connect again",
            "a negative result of dhdGetPosition, dhdSetForce or dhdGetStatus",
        ),
        FailureMode(
            "not-finite",
            "every position is a finite number",
            "the library gave a position that is not a finite number",
            "the device lost its calibration, or an encoder failed",
            "turn the device off and on, and calibrate it",
            "dhdGetPosition",
        ),
        FailureMode(
            "unguarded",
            "the guard process of a device without a watchdog runs",
            "the guard process has died, so the force was turned off",
            "another program ended it",
            "start this program again",
            "the guard process ends before it is dismissed",
        ),
        FailureMode(
            "hangs",
            "every call of the library returns",
            "a call of the library does not return",
            "the USB connection is disturbed, or the device stopped responding",
            "turn the device off, and start this program again",
            "a call that lasts longer than half a second",
        ),
        FailureMode(
            "rate",
            "the device keeps up with 1 kHz",
            "the device gives fewer than 900 new positions per second",
            "the USB connection or the computer is too slow, or the library's time guard refuses most readings",
            "connect the device directly to the computer, and close other programs",
            "new positions per second while it runs",
        ),
    ),
    frozenset({"no-library", "no-device"}),
)
CAUSES: Final = {
    1: "force button",
    2: "velocity threshold",
    3: "watchdog",
    4: "software",
    5: "USB disconnected",
    6: "dead-man switch",
}
"""Of status FORCE_OFF_CAUSE: dhdc.h 3.17.5, lines 199 to 206."""
