"""What can go wrong with an Inverse3, as data: what is tested, the symptom, cause and cure. Loads no compiler.

The causes follow from docs.haply.co, versions 3.4.x and 3.5.x; none was seen by us on a device.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from study_app.devices.doctor_report import Finding, State
from study_app.errors import DeviceError, DeviceLost, DeviceNotFound


@dataclass(frozen=True, slots=True)
class Mode:
    """A way to fail: what holds where it does not, what a user sees where it does, cause, cure, and its sign."""

    id: str
    tested: str
    symptom: str
    cause: str
    cure: str
    known_by: str


MODES: Final = (
    Mode(
        "no-service",
        "the Inverse Service answers",
        "the Inverse Service does not answer",
        "Haply Hub is not running, or its service uses another port",
        "start Haply Hub (or the service haply-inverse-service), or name its address: --device inverse3:HOST:PORT",
        "the TCP connection is refused or times out",
    ),
    Mode(
        "not-websocket",
        "the address is that of the simulation channel",
        "something else answers at the address of the Inverse Service",
        "another program uses the port",
        "name the port of the simulation channel (10001 unless changed in Haply Hub): --device inverse3:HOST:PORT",
        "the answer to the WebSocket handshake is not that of RFC 6455",
    ),
    Mode(
        "version",
        "the service is version 3.5 or later",
        "the Inverse Service speaks an older format",
        "the service is older than 3.5",
        "update it with Haply Hub",
        "its first message has no filters in the device's configuration",
    ),
    Mode(
        "no-device",
        "an Inverse3 is connected",
        "the Inverse Service lists no such Inverse3",
        "no Inverse3 is connected, or another one than was named",
        "connect its USB cable and its power supply, wait until Haply Hub shows it, and check its id",
        "the list 'inverse3' of the first message",
    ),
    Mode(
        "not-ready",
        "the device has power and is ready",
        "the Inverse3 is not ready",
        "its power supply is off, or it is still starting",
        "connect its power supply and wait until its light is steady",
        "status.ready and status.power_supply",
    ),
    Mode(
        "uncalibrated",
        "the device is calibrated",
        "the Inverse3 is not calibrated",
        "it was not calibrated since it was turned on",
        "put the handle onto its rest (inkwell) and wait until Haply Hub shows that the device is calibrated",
        "status.calibrated",
    ),
    Mode(
        "in-use",
        "no other program uses the device",
        "another program uses the Inverse3",
        "forces of several programs add up in the service",
        "close the other program, demos of Haply Hub included",
        "status.in_use",
    ),
    Mode(
        "settings",
        "the service's own settings are neutral",
        "a setting of the service changes the force",
        "gravity compensation, torque scaling or force scale was changed for the device, or the service refused ours",
        "reset the setting in Haply Hub to its factory value",
        "config of a full state, and the setting devices/force_scale",
    ),
    Mode(
        "no-reply",
        "every command is answered",
        "the Inverse Service stopped answering",
        "the service hangs, or the computer is overloaded",
        "restart Haply Hub, and close other programs",
        "no state for 50 ms",
    ),
    Mode(
        "closed",
        "the connection stays open",
        "the Inverse Service closed the connection",
        "the service was stopped or restarted",
        "start Haply Hub and connect the device again",
        "a close frame, or the end of the stream",
    ),
    Mode(
        "protocol",
        "the service keeps to RFC 6455",
        "the Inverse Service sent something that is not a WebSocket text message",
        "the service is of a version that this program does not know",
        "update this program, or use version 3.5 of the service",
        "the header of a frame",
    ),
    Mode(
        "not-json",
        "every state is JSON",
        "the Inverse Service sent a state that is not valid JSON",
        "the service is faulty, or of a version that this program does not know",
        "restart Haply Hub; if it stays, use version 3.5 of the service",
        "the grammar of RFC 8259",
    ),
    Mode(
        "no-position",
        "every state has a position",
        "the Inverse Service sent a state without the device's position",
        "the service is of a version that this program does not know",
        "update this program, or use version 3.5 of the service",
        "inverse3[].state.cursor_position",
    ),
    Mode(
        "not-finite",
        "every position is a finite number",
        "the Inverse Service sent a position that is not a finite number",
        "the device lost its calibration, or an encoder failed",
        "turn the device off and on, and calibrate it",
        "null or a number beyond what a float64 holds",
    ),
    Mode(
        "rate",
        "the device keeps up with 1 kHz",
        "the Inverse3 gives fewer than 900 new positions per second",
        "the service or the computer is too slow",
        "close other programs, and set the service's streaming mode to USB",
        "new positions per second while it runs",
    ),
)
BY_ID: Final = {mode.id: mode for mode in MODES}
_AT_OPENING: Final = frozenset({"no-service", "no-device"})


class Inverse3Failure(DeviceError):
    """Something keeps the Inverse3 from being used; ``mode`` is its id in `MODES`."""

    def __init__(self, mode: str, message: str) -> None:
        self.mode = mode
        super().__init__(message)


class Inverse3NotFound(Inverse3Failure, DeviceNotFound):
    """There is none, or no service."""


class Inverse3Lost(Inverse3Failure, DeviceLost):
    """It was there."""


def sentence(mode: str, seen: str = "") -> str:
    """Return symptom, what was ``seen``, cause and cure of a mode in a line."""
    known = BY_ID[mode]
    detail = f" ({seen})" if seen else ""
    return f"{known.symptom}{detail}: {known.cause}; {known.cure}"


def failure(mode: str, seen: str = "") -> Inverse3Failure:
    """Return the error to raise for a mode."""
    kind = Inverse3NotFound if mode in _AT_OPENING else Inverse3Failure
    return kind(mode, f"the Inverse3 cannot be used: {sentence(mode, seen)}")


def findings(found: str | None = None, passed: Iterable[str] = ()) -> tuple[Finding, ...]:
    """Return every mode in its order.

    Parameters
    ----------
    found : id of the mode that was found, None where none was
    passed : ids of those that were tested and not found; others count as not checked
    """
    fine = set(passed)

    def state(mode: Mode) -> State:
        return "found" if mode.id == found else "ok" if mode.id in fine else "not checked"

    return tuple(
        Finding(number, mode.id, mode.tested, mode.symptom, state(mode), mode.cause, mode.cure, mode.known_by)
        for number, mode in enumerate(MODES, start=1)
    )
