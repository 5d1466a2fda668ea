"""How a session is opened: the handshake of RFC 6455, the service's inventory, and the settings that change the force.

Documents: docs.haply.co 3.5.x, "Device Configuration" (availability matrix, preset, basis, damping), "Filters" (force
pipeline), "Mount & Workspace Transforms" (presets), "WebSocket Protocol" step 1 (shape of ``config``).
"""

import base64
import hashlib
import json
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.devices.inverse3.service import FAILURES, ID, LONGEST, Link, shortened
from study_app.devices.inverse3.wire import CLOSE, INCOMPLETE, TEXT, VIOLATION, build_frame, parse_header
from study_app.errors import DeviceError

_PROFILE: Final = "liquid-study:study"
_PRESET: Final = "arm_front_centered"
"""Origin in the middle of the workspace ("Mount & Workspace Transforms", presets)."""
_BASIS: Final = "XYZ"
_FORCE_GATE_GAIN: Final = 0.0
"""Attenuation of the force when the service detects an oscillation; the default is 0.3. That 0 disables it is not
documented and must be tested on a device."""

_SESSION_SCOPED: Final[Mapping[str, Any]] = {
    "preset": _PRESET,
    "basis": {"permutation": _BASIS},
    "filters": {"force_gate": {"gain": _FORCE_GATE_GAIN}, "damping": {"scalar": 0.0}},
}
"""The settings of `_first_message` as shown in a snapshot of the configuration."""

_DEVICE_GLOBAL: Final[Mapping[str, Any]] = {
    "gravity_compensation": {"enabled": True, "scaling_factor": 1.0},
    "torque_scaling": {"enabled": True},
}
"""Factory values, which a message cannot set ("Device Configuration": HTTP only, device-global). They hold for every
program on the computer, so they are required, not changed."""

_RECEIPT_KEYS: Final = (*_SESSION_SCOPED, *_DEVICE_GLOBAL, "mount", "handedness", "home_return", "streaming_mode")
_ZERO: Final = {"x": 0.0, "y": 0.0, "z": 0.0}


def _first_message(device_id: str) -> dict[str, Any]:
    """Return the message that opens a session: profile, neutral settings and zero force.

    ``session.configure`` and a device's ``configure`` are sent once, with the first message ("WebSocket Protocol" and
    tutorial 01, "first-message-only handshake"); a command goes with it to keep the state coming.
    """
    configure = {
        "preset": {"preset": _PRESET},
        "damping": {"scalar": 0.0, "vector": _ZERO},
        "force_gate": {"gain": _FORCE_GATE_GAIN},
    }
    session = {"configure": {"profile": {"name": _PROFILE}, "basis": {"permutation": _BASIS}}}
    return {"session": session, **_command_message(device_id, configure=configure)}


def full_state_request(device_id: str) -> dict[str, Any]:
    """Return a message whose answer includes the configuration ("Simulation Channel", configuration vs state)."""
    return {"session": {"force_render_full_state": {}}, **_command_message(device_id)}


def _zero_force(device_id: str) -> dict[str, Any]:
    """Return a command of zero force ("Control Commands", set_cursor_force)."""
    return _command_message(device_id)


def _command_message(device_id: str, **more_fields: Any) -> dict[str, Any]:
    return {
        "inverse3": [{"device_id": device_id, **more_fields, "commands": {"set_cursor_force": {"vector": dict(_ZERO)}}}]
    }


def _receipt_settings(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a configuration that change the force, for the receipt."""
    return {key: config[key] for key in _RECEIPT_KEYS if key in config}


def _differing_settings(config: Mapping[str, Any], required: Mapping[str, Any]) -> list[str]:
    """Return a text for each setting that is not as required; numbers are compared as floats."""
    return list(_find_differences("", config, required))


def _find_differences(path: str, value: Any, required: Any) -> list[str]:
    if isinstance(required, Mapping):
        paths: list[str] = []
        for key, wanted in required.items():
            name = f"{path}.{key}" if path else key
            inner = value.get(key) if isinstance(value, Mapping) else None
            paths += _find_differences(name, inner, wanted)
        return paths
    return [] if value == required else [f"{path} is {shortened(value)}, but must be {required!r}"]


_ROUND_TRIPS: Final = 50
_WEBSOCKET_GUID: Final = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"  # RFC 6455 §1.3


@dataclass(frozen=True, slots=True)
class Session:
    """An open session: the device's id, the fields for the receipt, and the round trip [s]."""

    device_id: str
    described: dict[str, Any]
    round_trip_s: float


class Messages:
    """Text messages over a link, used while a device is opened."""

    @staticmethod
    def compile() -> None:
        """Compile the functions of messages, or load them from the cache, before the time for opening begins."""
        text = np.frombuffer(b"{}", np.uint8)
        build_frame(np.zeros(16, np.uint8), TEXT, text, text.size, 0)
        parse_header(text, 0, text.size, np.zeros(2, np.int64))

    def __init__(self, link: Link) -> None:
        self._link = link
        self._received = b""
        self._header = np.zeros(2, np.int64)

    def upgrade(self, host: str) -> None:
        """Upgrade the link to a WebSocket (RFC 6455 §4.1)."""
        key = base64.b64encode(secrets.token_bytes(16))
        self._link.send(
            b"GET / HTTP/1.1\r\nHost: %b\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Key: %b\r\nSec-WebSocket-Version: 13\r\n\r\n" % (host.encode(), key)
        )
        while b"\r\n\r\n" not in self._received:
            self._receive_more("not-websocket")
        head, _, self._received = self._received.partition(b"\r\n\r\n")
        status, *lines = head.split(b"\r\n")
        fields = dict(line.lower().partition(b":")[::2] for line in lines)
        accept = dict(line.partition(b":")[::2] for line in lines if line.lower().startswith(b"sec-websocket-accept"))
        # RFC 6455 §4.2.2
        expected = base64.b64encode(hashlib.sha1(key + _WEBSOCKET_GUID, usedforsecurity=False).digest())
        if (
            status.split(b" ")[1:2] != [b"101"]
            or fields.get(b"upgrade", b"").strip() != b"websocket"
            or [value.strip() for value in accept.values()] != [expected]
        ):
            raise FAILURES.failure("not-websocket", shortened(status.decode("latin-1")))

    def _receive_more(self, mode: str) -> None:
        """Receive more of a message; if it is longer than `LONGEST`, raise the failure of this ``mode``."""
        if len(self._received) >= LONGEST:
            raise FAILURES.failure(mode, f"a message of more than {LONGEST:,} bytes")
        more = self._link.receive(LONGEST - len(self._received))
        if not more:
            raise FAILURES.failure("closed", "while it was being opened")
        self._received += more

    def send(self, message: Mapping[str, Any]) -> None:
        text = np.frombuffer(json.dumps(message, separators=(",", ":")).encode(), np.uint8)
        out = np.zeros(text.size + 8, np.uint8)
        size = build_frame(out, TEXT, text, text.size, secrets.randbits(32))
        self._link.send(out[:size].tobytes())

    def receive(self) -> dict[str, Any]:
        while True:
            data = np.frombuffer(self._received, np.uint8)
            size = parse_header(data, 0, data.size, self._header)
            if size == VIOLATION:
                raise FAILURES.failure("protocol")
            opcode, length = (int(value) for value in self._header)
            if length > LONGEST:
                raise FAILURES.failure("protocol", f"a message of {length:,} bytes; at most {LONGEST:,} are permitted")
            if size != INCOMPLETE and len(self._received) >= size + length:
                text, self._received = self._received[size : size + length], self._received[size + length :]
                if opcode == CLOSE:
                    raise FAILURES.failure("closed", "while it was being opened")
                if opcode == TEXT:
                    return _parse_object(text)
                continue
            self._receive_more("protocol")

    def ask(self, message: Mapping[str, Any]) -> dict[str, Any]:
        self.send(message)
        return self.receive()

    @property
    def left(self) -> bytes:
        """The bytes received after the last message."""
        return self._received


def _parse_object(text: bytes) -> dict[str, Any]:
    try:
        message = json.loads(text)
        json.dumps(
            message, ensure_ascii=False, allow_nan=False
        ).encode()  # it must be possible to write it to a receipt
    except (ValueError, RecursionError) as error:
        raise FAILURES.failure("not-json", shortened(str(error))) from None
    if not isinstance(message, dict):
        raise FAILURES.failure("not-json", "it is not a JSON object")
    return message


def open_session(messages: Messages, link: Link, wanted_id: str = "") -> Session:
    """Choose the device ("": the first), send the neutral settings with the first message, and confirm them."""
    entry = _find_device(messages.receive(), wanted_id)
    device_id, config = entry["device_id"], entry["config"]
    _check_status(entry.get("status", {}), at_opening=True)
    messages.ask(_first_message(device_id))
    entry = _find_device(messages.ask(full_state_request(device_id)), device_id, inventory=False)
    in_force = entry.get("config")
    snapshot = config if in_force is None else in_force
    differences = _differing_settings(snapshot, _DEVICE_GLOBAL)
    if in_force is not None:
        differences += _differing_settings(in_force, _SESSION_SCOPED)
    if differences:
        raise FAILURES.failure("settings", "; ".join(differences))
    round_trip_s = _measure_round_trip(messages, link, device_id)
    described = {
        "device_id": device_id,
        "serial": device_id,
        "device_info": config.get("device_info"),
        "firmware": config.get("extended_firmware_version"),
        "service_settings": {
            "found": _receipt_settings(config),
            "in_force": _receipt_settings(snapshot),
            "confirmed": in_force is not None,
        },
        "round_trip_ms": round(1000 * round_trip_s, 3),
    }
    return Session(device_id, described, round_trip_s)


def _find_device(message: Mapping[str, Any], wanted_id: str = "", *, inventory: bool = True) -> dict[str, Any]:
    """Return the entry in a message of the device with this id, or of the first one."""
    devices = message.get("inverse3", [])
    if not isinstance(devices, list):
        raise FAILURES.failure("version", "format 3.0")
    entries = {str(entry["device_id"]): entry for entry in devices if isinstance(entry, dict) and "device_id" in entry}
    for name, entry in entries.items():
        if not wanted_id or name == wanted_id:
            if not ID.fullmatch(name):
                raise DeviceError(
                    f"the Inverse Service lists a device with the ID {name[:16]!r} ({len(name)} characters); an ID "
                    "must have "
                    "1 to 64 printable ASCII characters, without spaces, quotes or backslashes: update this program"
                )
            config, status = entry.get("config"), entry.get("status", {})
            if inventory and not (isinstance(config, dict) and "filters" in config):
                raise FAILURES.failure("version", "format 3.1")
            if not isinstance(status, dict):
                raise FAILURES.failure("version", f"status is {shortened(status)}")
            return entry
    raise FAILURES.failure("no-device", f"listed: {shortened(list(entries)) if entries else 'none'}")


def _check_status(status: Mapping[str, Any], *, at_opening: bool) -> None:
    """Raise an error for a device that has no power, is not calibrated, or is used by another program."""
    for key, mode in (("power_supply", "not-ready"), ("ready", "not-ready"), ("calibrated", "uncalibrated")):
        if status.get(key) is False:
            raise FAILURES.failure(mode, f"status.{key} is false")
    if at_opening and status.get("in_use") is True:
        raise FAILURES.failure("in-use")


def _measure_round_trip(messages: Messages, link: Link, device_id: str) -> float:
    """Return the 90th percentile of the round trip of a command of zero force [s]."""
    times_s = []
    for _ in range(_ROUND_TRIPS):
        began_s = link.now_s()
        messages.ask(_zero_force(device_id))
        times_s.append(link.now_s() - began_s)
    return sorted(times_s)[int(0.9 * len(times_s))]
