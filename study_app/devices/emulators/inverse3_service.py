"""An emulated Inverse Service with one Inverse3, whose handle is held by a simulated hand.

Written from docs.haply.co: "WebSocket Protocol" 3.5.x, step 1 (inventory) and core rule; "Simulation Channel" 3.5.x (a
state update has ``state`` and ``status``; a full state also has ``config``); "HTTP" 3.4.x, Devices (``status``, grips).
Not documented there, and therefore guessed: that a state update has a ``session_id``, and all values of
``control_mode`` except "idle".

The messages that open a session are parsed with the standard library's JSON; the later commands are processed by
compiled code (``inverse3_stream``). Documents: "Device Configuration" 3.5.x for what ``configure`` takes, "Simulation
Channel" 3.5.x for ``session.force_render_full_state``, "Filters" and "Settings Reference" for the force scale, RFC 6455
§4.2 for the handshake.
"""

import base64
import copy
import hashlib
import json
import struct
from random import Random
from typing import Any, Final

import numpy as np

from study_app.devices.emulators import inverse3_stream
from study_app.devices.emulators.inverse3_stream import SERVICE
from study_app.devices.hand import HandOrders
from study_app.devices.inverse3.service import TransferCalls
from study_app.devices.simulated import QUANTUM_M, TREMOR_M, new_scripted_handle
from study_app.errors import DeviceError
from study_app.haptics.model.layout import records

_DEVICE_ID: Final = "EMU1"
_SLOT_NAMES: Final = tuple(f"{name}_{axis}" for name in ("position", "velocity", "force") for axis in "xyz")
_SLOT_WIDTH: Final = 14
_UNIT: Final = {"x": 0, "y": 0, "z": 0}
_FACTORY_CONFIG: Final[dict[str, Any]] = {
    "type": "inverse3",
    "port": "EMULATED",
    "device_info": {"major_version": 7, "minor_version": 4, "id": _DEVICE_ID, "device_type": 4, "uuid": "00" * 16},
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
_STATUS: Final = {"calibrated": True, "in_use": False, "power_supply": True, "ready": True, "started": True}
_LEGACY_STATE: Final[dict[str, Any]] = {
    "inverse3": {_DEVICE_ID: {"config": {"device_info": {"id": _DEVICE_ID}}, "state": {}, "status": {}}}
}
"""Message in format 3.0: devices as an object by device id ("Haply Inverse Service" 3.0.x, Devices)."""
_OPENING_FAULTS: Final = (
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
_TIMING_FAULTS: Final = (
    "late",  # each state 30 ms late
    "slow",  # each state 1.5 ms late, with which the servo is still stable
    "torn",  # each state in pieces of 300 bytes
)
_STREAM_FAULTS: Final = (
    "silent",  # no more states
    "closes",  # a close frame (RFC 6455 §5.5.1, status 1001), and the end
    "drops",  # the end of the stream without a close frame
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
    "too-long",  # a frame with a stated length of 2^63 - 1 bytes, the most that RFC 6455 permits
)
FAULTS: Final = (*_OPENING_FAULTS, *_TIMING_FAULTS, *_STREAM_FAULTS)
_FAULT_STATUS: Final = {
    "off": {"power_supply": False},
    "uncalibrated": {"calibrated": False},
    "in-use": {"in_use": True},
}


def new_config() -> dict[str, Any]:
    """Return a new configuration with factory values."""
    return copy.deepcopy(_FACTORY_CONFIG)


def _state_message(
    status: dict[str, Any], buttons: int, full: dict[str, Any] | None = None, session_id: int = 7
) -> dict[str, Any]:
    """Return a state message with the names in `_SLOT_NAMES` in place of its numbers.

    Parameters
    ----------
    buttons : pressed buttons of the wireless grip; a is bit 0
    full : the configuration, for an inventory or a full state
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
    device: dict[str, Any] = {"device_id": _DEVICE_ID}
    if full is not None:
        device["config"] = full
    grip = {
        "device_id": "0",
        "state": {"battery_level": 0.8, "buttons": {name: bool(buttons >> k & 1) for k, name in enumerate("abc")}},
    }
    return {"session_id": session_id, "inverse3": [device | {"state": state, "status": status}],
            "wireless_verse_grip": [grip]}  # fmt: skip


def message_template(message: dict[str, Any]) -> tuple[bytes, list[int]]:
    """Return a message as text with space for its numbers, and the offset of each number; -1 if it is missing."""
    text = json.dumps(message)
    for slot in _SLOT_NAMES:
        text = text.replace(f'"{slot}"', "#" + slot.ljust(_SLOT_WIDTH - 1))
    offsets = [text.find(f"#{slot}") for slot in _SLOT_NAMES]
    for slot in _SLOT_NAMES:
        text = text.replace("#" + slot.ljust(_SLOT_WIDTH - 1), "0.0".ljust(_SLOT_WIDTH))
    return text.encode(), offsets


def faulty_bytes(fault: str, message: dict[str, Any]) -> bytes:
    """Return the bytes sent instead of a state for a fault of `_STREAM_FAULTS`."""
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
    text = text.replace(f'"{_SLOT_NAMES[0]}"', number)
    for slot in _SLOT_NAMES:
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


_STOPS_M: Final = (0.10, 0.10, 0.10)
_ZERO: Final = {"x": 0.0, "y": 0.0, "z": 0.0}
_GUID: Final = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


class Service(HandOrders):
    """The emulated service; orders go to the hand at the handle.

    Parameters
    ----------
    random : random numbers for the hand's tremor; None: fixed ones
    workspace_m : half extents of the hand's range [m]
    tremor_m : amplitude of the tremor's waves [m]
    quantum_m : one count of the encoders [m]

    Attributes
    ----------
    config, status : the device's state as documented; may be changed before a client connects
    force_scale : the answer about the setting devices/force_scale; None: no answer
    """

    def __init__(
        self,
        random: Random | None = None,
        *,
        workspace_m: tuple[float, float, float] = (0.05, 0.05, 0.05),
        tremor_m: float = TREMOR_M,
        quantum_m: float = QUANTUM_M,
    ) -> None:
        self.memory = records(SERVICE, 1)
        super().__init__(self.memory[0], workspace_m)
        self.state.handle = new_scripted_handle(quantum_m)
        self.state.handle.stop_m = _STOPS_M
        self._tremble(random, tremor_m)
        self.config = new_config()
        self.status = dict(_STATUS)
        self.force_scale: Any = {"value": 1.0}
        self.version = "3.5"
        self.obeys = True
        quoted = np.frombuffer(f'"{_DEVICE_ID}"'.encode(), np.uint8)
        self.state.id[: quoted.size] = quoted
        self.state.id_size = quoted.size
        self._upgraded = False
        self._handshake = b""
        self._fault: tuple[str, int] | None = None
        self.hold(0.0, 0.0, 0.0)

    @property
    def handle(self) -> int:
        """The handle for its ``send`` and ``recv``."""
        return int(self.memory.ctypes.data)

    def compile(self) -> None:
        """Compile all functions that answer a client, or load them from the cache: a client waits only seconds."""
        self.connected()
        self._answer_message(
            {"inverse3": [{"device_id": _DEVICE_ID, "commands": {"set_cursor_force": {"vector": _ZERO}}}]}
        )
        inverse3_stream.take_frames(self.state)
        self.give_bytes()
        self.disconnected()

    def follow_clock(self, address: int) -> None:
        """Use the int64 [ns] at this address as the time; 0: one millisecond per command."""
        self.state.clock = address

    def press(self, buttons: int) -> None:
        """Hold down exactly these buttons of the grip: button 1 (a) is bit 0."""
        super().press(buttons)
        self._update_text()

    def set_fault(self, fault: str, after: int = 0) -> None:
        """Simulate a fault: at once if it concerns opening or timing, else after ``after`` commands.

        Raises
        ------
        DeviceError
            There is no such fault.
        """
        if fault not in FAULTS:
            raise DeviceError(f"fault '{fault}' is not known; choose from: {', '.join(FAULTS)}")
        versions = {"version-3.0": "3.0", "version-3.1": "3.1", "not-websocket": "http", "no-device": "empty"}
        self.version = versions.get(fault, self.version)
        if fault in _FAULT_STATUS:
            self.status |= _FAULT_STATUS[fault]
            self._update_text()
        elif fault == "gravity-off":
            self.config["gravity_compensation"]["enabled"] = False
        elif fault == "disobeys":
            self.obeys = False
        elif fault in {"force-scale", "unknown-scale"}:
            self.force_scale = {"value": 2.0} if fault == "force-scale" else None
        elif fault == "torn":
            self.state.portion = 300
        elif fault in _TIMING_FAULTS:
            self.state.lag_ns = 30_000_000 if fault == "late" else 1_500_000
        elif fault in _STREAM_FAULTS:
            self._fault = (fault, after)
            if self._upgraded:
                self._schedule_fault()

    def _schedule_fault(self) -> None:
        if self._fault is None:
            return
        (fault, after), state = self._fault, self.state
        data = np.frombuffer(faulty_bytes(fault, self._message()), np.uint8)
        state.faulty[: data.size] = data
        state.faulty_size = data.size
        state.silent = int(fault in {"silent", "drops"})
        state.ends = int(fault in {"drops", "closes"})
        state.fault_at = state.commands + 1 + after

    def connected(self) -> None:
        state = self.state
        for name in ("in_size", "written", "visible", "read", "queue_first", "queue_next", "complex_size", "ended"):
            setattr(state, name, 0)
        self._upgraded, self._handshake = False, b""
        self._update_text()

    def take_bytes(self, data: bytes) -> None:
        """Process bytes from the client."""
        state = self.state
        if not self._upgraded:
            self._handshake += data
            if b"\r\n\r\n" in self._handshake:
                self._answer_handshake(self._handshake)
            return
        received = np.frombuffer(data, np.uint8)
        state.inbox[state.in_size : state.in_size + received.size] = received
        state.in_size += received.size
        self.process_inbox()

    def give_bytes(self) -> bytes:
        """Return all bytes that are due for the client."""
        state = self.state
        if state.clock == 0 and state.visible == state.read and state.queue_first < state.queue_next:
            # reading waits until then
            state.now_ns = max(state.now_ns, state.queue_ns[state.queue_first % state.queue_ns.size])
        inverse3_stream.release_due_frames(state)
        indices = np.arange(state.read, state.visible) % state.outbox.size
        state.read = state.visible
        return bytes(state.outbox[indices].tobytes())

    def disconnected(self) -> None:
        """Handle the end of the stream: the session ends and the device becomes idle."""
        inverse3_stream.remove_force(self.state)
        self.state.ended = 1

    def process_inbox(self) -> None:
        inverse3_stream.take_frames(self.state)
        while self.state.complex_size:
            state = self.state
            text = state.inbox[state.complex_at : state.complex_at + state.complex_size].tobytes()
            self._answer_message(json.loads(text))
            inverse3_stream.drop_frame(state, int(state.complex_end))
            state.complex_size = 0
            inverse3_stream.take_frames(state)

    def _answer_handshake(self, request: bytes) -> None:
        """Answer RFC 6455's opening handshake (§4.2.2), then send the inventory."""
        lines = request.decode("latin-1").split("\r\n")
        fields = {name.strip().lower(): value.strip() for name, _, value in (line.partition(":") for line in lines[1:])}
        if self.version == "http" or fields.get("upgrade", "").lower() != "websocket":
            self._send_raw(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n")
            return
        key = (fields["sec-websocket-key"] + _GUID).encode()
        digest = hashlib.sha1(key, usedforsecurity=False).digest()  # RFC 6455
        accept = base64.b64encode(digest).decode()
        self._send_raw(
            b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Accept: %b\r\n\r\n" % accept.encode()
        )
        self._upgraded = True
        self._send(self.inventory())

    def inventory(self) -> dict[str, Any]:
        """Return the first message of a session, with the names in `_SLOT_NAMES` in place of its numbers."""
        if self.version == "3.0":
            return _LEGACY_STATE
        message = self._message(full=True)
        if self.version == "empty":
            message["inverse3"] = []
        if self.version == "3.1":
            for key in ("filters", "preset", "basis", "mount"):
                del message["inverse3"][0]["config"][key]
        return message

    def _message(self, *, full: bool = False) -> dict[str, Any]:
        return _state_message(
            self.status, int(self.state.buttons), json.loads(json.dumps(self.config)) if full else None
        )

    def _answer_message(self, message: dict[str, Any]) -> None:
        """Apply settings and command of a message, and answer with a state, including the configuration on request."""
        session = message.get("session", {})
        for entry in message.get("inverse3", []):
            if entry.get("device_id") == _DEVICE_ID:
                if self.obeys:
                    self._configure(entry.get("configure", {}), session.get("configure", {}))
                inverse3_stream.advance_handle(self.state)
                force = entry.get("commands", {}).get("set_cursor_force", {}).get("vector")
                if force is not None:
                    inverse3_stream.apply_force(self.state, float(force["x"]), float(force["y"]), float(force["z"]))
        self._send(self._message(full="force_render_full_state" in session))
        if "configure" in session:
            self._schedule_fault()

    def _configure(self, device: dict[str, Any], session: dict[str, Any]) -> None:
        """Apply the settings that "Device Configuration" lists for WebSocket ``configure``."""
        filters = self.config["filters"]
        if "preset" in device:
            self.config["preset"] = device["preset"]["preset"]
        if "damping" in device:
            filters["damping"] |= device["damping"]
        if "force_gate" in device:
            filters["force_gate"] |= device["force_gate"]
        if "basis" in session:
            self.config["basis"] = session["basis"]

    def _send(self, message: dict[str, Any]) -> None:
        text, slots = message_template(message)
        data, offsets = np.frombuffer(text, np.uint8).copy(), np.array(slots, np.int64)
        inverse3_stream.fill_numbers(self.state, data, offsets)
        inverse3_stream.put_frame(self.state, 1, data, data.size, 0)
        inverse3_stream.release_due_frames(self.state)

    def _send_raw(self, data: bytes) -> None:
        inverse3_stream.put_bytes(self.state, np.frombuffer(data, np.uint8), len(data))
        inverse3_stream.release_due_frames(self.state)

    def _update_text(self) -> None:
        text, slots = message_template(self._message())
        data = np.frombuffer(text, np.uint8)
        self.state.text[: data.size] = data
        self.state.slots[:] = slots
        self.state.text_size = data.size


def service_calls(service: Service) -> TransferCalls:
    """Return the functions of the emulated service that replace the system's ``send`` and ``recv``."""
    send, receive = inverse3_stream.stream_functions()
    return TransferCalls(handle=service.handle, send=int(send.address), receive=int(receive.address))
