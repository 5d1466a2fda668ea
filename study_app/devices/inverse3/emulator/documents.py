"""The messages of the emulated service, as its documentation shows them.

Written from docs.haply.co: "WebSocket Protocol" 3.5.x, step 1 (inventory) and core rule; "Simulation Channel" 3.5.x
(a state update has ``state`` and ``status``, a full state ``config``, too); "HTTP" 3.4.x, Devices (``status``, grips).
Not shown there, so a guess: that a state update has a ``session_id``, and the values of ``control_mode`` but "idle".
"""

import copy
import json
import struct
from typing import Any, Final

DEVICE_ID: Final = "EMU1"
SLOTS: Final = tuple(f"{name}_{axis}" for name in ("position", "velocity", "force") for axis in "xyz")
SLOT_WIDTH: Final = 14
_UNIT: Final = {"x": 0, "y": 0, "z": 0}
FACTORY_CONFIG: Final[dict[str, Any]] = {
    "type": "inverse3",
    "port": "EMULATED",
    "device_info": {"major_version": 7, "minor_version": 4, "id": DEVICE_ID, "device_type": 4, "uuid": "00" * 16},
    "extended_device_id": "00" * 16,
    "extended_firmware_version": "00" * 16,
    "gravity_compensation": {"enabled": True, "scaling_factor": 1.0},
    "handedness": "right",
    "streaming_mode": "USB",
    "torque_scaling": {"enabled": True},
    "home_return": {"enabled": False},
    "preset": "defaults",
    "basis": {"permutation": "XYZ"},
    "mount": {"position": dict(_UNIT), "rotation": {"w": 1, "x": 0, "y": 0, "z": 0}, "scale": {"x": 1, "y": 1, "z": 1}},
    "filters": {"force_gate": {"gain": 0.3}, "damping": {"scalar": 0.0}},
}
STATUS: Final = {"calibrated": True, "in_use": False, "power_supply": True, "ready": True, "started": True}
LEGACY_STATE: Final[dict[str, Any]] = {
    "inverse3": {DEVICE_ID: {"config": {"device_info": {"id": DEVICE_ID}}, "state": {}, "status": {}}}
}
"""Format 3.0: an object by device id ("Haply Inverse Service" 3.0.x, Devices)."""
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


def config() -> dict[str, Any]:
    """Return a new configuration with factory values."""
    return copy.deepcopy(FACTORY_CONFIG)


def state_message(
    status: dict[str, Any], buttons: int, full: dict[str, Any] | None = None, session_id: int = 7
) -> dict[str, Any]:
    """Return a state whose numbers are the words of `SLOTS`.

    Parameters
    ----------
    buttons : of the wireless grip: a is bit 0
    full : its configuration, for an inventory or a full state
    """

    def vector(name: str) -> dict[str, str]:
        return {axis: f"{name}_{axis}" for axis in "xyz"}

    angles = {"a0": 0.0, "a1": 0.0, "a2": 0.0}
    state = {
        "cursor_position": vector("position"),
        "cursor_velocity": vector("velocity"),
        "angular_position": angles,
        "angular_velocity": angles,
        "body_orientation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0},
        "current_cursor_force": vector("force"),
        "current_cursor_position": dict(_UNIT),
        "current_angular_torques": angles,
        "current_angular_position": angles,
        "control_domain": "cartesian",
        "control_mode": "idle",
    }
    device: dict[str, Any] = {"device_id": DEVICE_ID}
    if full is not None:
        device["config"] = full
    grip = {
        "device_id": "0",
        "state": {"battery_level": 0.8, "buttons": {name: bool(buttons >> k & 1) for k, name in enumerate("abc")}},
    }
    return {"session_id": session_id, "inverse3": [device | {"state": state, "status": status}],
            "wireless_verse_grip": [grip]}  # fmt: skip


def template(message: dict[str, Any]) -> tuple[bytes, list[int]]:
    """Return a message as text with room for its numbers, and where each of `SLOTS` begins; -1 where it is not."""
    text = json.dumps(message)
    for slot in SLOTS:
        text = text.replace(f'"{slot}"', "#" + slot.ljust(SLOT_WIDTH - 1))
    places = [text.find(f"#{slot}") for slot in SLOTS]
    for slot in SLOTS:
        text = text.replace("#" + slot.ljust(SLOT_WIDTH - 1), "0.0".ljust(SLOT_WIDTH))
    return text.encode(), places


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
