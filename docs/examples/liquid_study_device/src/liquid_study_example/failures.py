"""What can go wrong with the device, in the order in which it is tested. This module loads no driver."""

from study_app.devices.doctor import FailureMode, FailureTable

FAILURES = FailureTable(
    "the example device",
    (
        FailureMode(
            "not-found",
            "a device is connected",
            "no device is found",
            "none is connected, or it has no power",
            "check its cable and its power supply",
            "maker_open returns an error",
        ),
        FailureMode(
            "lost",
            "it stays connected",
            "it was disconnected during use",
            "its cable or its power supply was pulled out",
            "connect it again",
            "maker_get or maker_set_force returns an error",
        ),
        FailureMode(
            "rate",
            "it keeps up with 1 kHz",
            "it gives fewer than 900 new positions per second",
            "the computer is too slow",
            "close other programs",
            "new positions per second while it runs",
        ),
    ),
    frozenset({"not-found"}),
)
