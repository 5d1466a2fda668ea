"""What can go wrong with an emulated Inverse Service, on purpose."""

import json
import struct
from typing import Any, Final

from study_app.devices.inverse3.emulator.documents import SLOTS

OF_OPENING: Final = (
    "not-websocket",
    "version-3.0",
    "version-3.1",
    "no-device",
    "off",  # no power supply
    "uncalibrated",
    "in-use",
    "gravity-off",  # gravity compensation was turned off for the device
    "disobeys",  # keeps its own settings
    "force-scale",
    "unknown-scale",  # no answer about the force scale
)
OF_TIME: Final = (
    "late",  # each state 30 ms late
    "slow",  # each state 1.5 ms late: within what the servo is stable with
    "torn",  # each state in pieces of 300 bytes
)
OF_STREAM: Final = (
    "silent",  # no more states
    "closes",  # a close frame (RFC 6455 §5.5.1, status 1001), and the end
    "drops",  # the end of the stream without one
    "nan",  # a position NaN, which JSON does not have
    "null",  # a position null
    "infinite",  # a position 1e999
    "bad-json",
    "no-position",
    "gone",  # the device is no longer listed
    "power-off",
    "calibration-lost",
    "binary",  # a binary frame
    "masked",  # a masked frame
    "fragment",  # a message in two frames
    "too-long",  # a frame that says it is 2^63 - 1 bytes long, the most that RFC 6455 permits
)
FAULTS: Final = (*OF_OPENING, *OF_TIME, *OF_STREAM)


def faulty_bytes(fault: str, message: dict[str, Any]) -> bytes:
    """Return what is sent for a fault of `OF_STREAM` in place of a state, whose numbers are the words of ``SLOTS``."""
    device = message["inverse3"][0]
    if fault == "no-position":
        del device["state"]["cursor_position"]
    elif fault == "gone":
        message["inverse3"] = []
    elif fault == "power-off":
        device["status"] = device["status"] | {"power_supply": False, "ready": False}
    elif fault == "calibration-lost":
        device["status"] = device["status"] | {"calibrated": False}
    text = json.dumps(message)
    number = {"nan": "NaN", "null": "null", "infinite": "1e999"}.get(fault, "0.01")
    text = text.replace(f'"{SLOTS[0]}"', number)
    for slot in SLOTS:
        text = text.replace(f'"{slot}"', "0.0")
    if fault == "bad-json":
        text = text[:-2]
    data = text.encode()
    if fault == "closes":
        return b"\x88\x02" + struct.pack(">H", 1001)
    if fault == "too-long":
        return b"\x81\x7f" + struct.pack(">Q", (1 << 63) - 1)
    first = {"binary": 0x82, "fragment": 0x01}.get(fault, 0x81)
    mask = 0x80 if fault == "masked" else 0
    return bytes([first, mask | 126]) + struct.pack(">H", len(data)) + (b"\0\0\0\0" if mask else b"") + data
