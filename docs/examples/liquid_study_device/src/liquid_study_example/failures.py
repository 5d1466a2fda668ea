"""What can go wrong with the device, in the order in which it is tested. This module loads no driver."""

from study_app.devices.doctor import FailureMode, FailureTable

FAILURES = FailureTable(
    "the example device",
    (
        FailureMode(
            id="not-found",
            tested="a device is connected",
            symptom="no device is found",
            cause="none is connected, or it has no power",
            cure="check its cable and its power supply",
            known_by="maker_open returns an error",
        ),
        FailureMode(
            id="lost",
            tested="it stays connected",
            symptom="it was disconnected during use",
            cause="its cable or its power supply was pulled out",
            cure="connect it again",
            known_by="maker_get or maker_set_force returns an error",
        ),
        FailureMode(
            id="rate",
            tested="it maintains a rate of 1 kHz",
            symptom="it delivers fewer than 900 new positions per second",
            cause="the computer is too slow",
            cure="close other programs",
            known_by="new positions per second while it runs",
        ),
    ),
    frozenset({"not-found"}),
)
