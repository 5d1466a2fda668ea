"""What can go wrong with an Inverse3, as data: what is tested, the symptom, cause and cure. Loads no compiler.

The causes follow from docs.haply.co, versions 3.4.x and 3.5.x; none was seen by us on a device.
"""

from typing import Final

from study_app.devices.failure_table import FailureMode, FailureTable

_MODES: Final = (
    FailureMode(
        "no-service",
        "the Inverse Service answers",
        "the Inverse Service does not answer",
        "Haply Hub is not running, or its service uses another port",
        "start Haply Hub (or the service haply-inverse-service), or name its address: --device inverse3:HOST:PORT",
        "the TCP connection is refused or times out",
    ),
    FailureMode(
        "not-websocket",
        "the address is that of the simulation channel",
        "something else answers at the address of the Inverse Service",
        "another program uses the port",
        "name the port of the simulation channel (10001 unless changed in Haply Hub): --device inverse3:HOST:PORT",
        "the answer to the WebSocket handshake is not that of RFC 6455",
    ),
    FailureMode(
        "version",
        "the service is version 3.5 or later",
        "the Inverse Service speaks an older format",
        "the service is older than 3.5",
        "update it with Haply Hub",
        "its first message has no filters in the device's configuration",
    ),
    FailureMode(
        "no-device",
        "an Inverse3 is connected",
        "the Inverse Service lists no such Inverse3",
        "no Inverse3 is connected, or another one than was named",
        "connect its USB cable and its power supply, wait until Haply Hub shows it, and check its id",
        "the list 'inverse3' of the first message",
    ),
    FailureMode(
        "not-ready",
        "the device has power and is ready",
        "the Inverse3 is not ready",
        "its power supply is off, or it is still starting",
        "connect its power supply and wait until its light is steady",
        "status.ready and status.power_supply",
    ),
    FailureMode(
        "uncalibrated",
        "the device is calibrated",
        "the Inverse3 is not calibrated",
        "it was not calibrated since it was turned on",
        "put the handle onto its rest (inkwell) and wait until Haply Hub shows that the device is calibrated",
        "status.calibrated",
    ),
    FailureMode(
        "in-use",
        "no other program uses the device",
        "another program uses the Inverse3",
        "forces of several programs add up in the service",
        "close the other program, demos of Haply Hub included",
        "status.in_use",
    ),
    FailureMode(
        "settings",
        "the service's own settings are neutral",
        "a setting of the service changes the force",
        "gravity compensation, torque scaling or force scale was changed for the device, or the service refused ours",
        "reset the setting in Haply Hub to its factory value",
        "config of a full state, and the setting devices/force_scale",
    ),
    FailureMode(
        "unknown-scale",
        "the service reports its force scale",
        "the multiplier of all forces is not known",
        "the service does not report its setting devices/force_scale, or in a form that this program does not know",
        "restart Haply Hub; if it stays, use version 3.5 of the service, or update this program",
        "the answer to GET /settings/devices/force_scale",
    ),
    FailureMode(
        "no-reply",
        "every command is answered",
        "the Inverse Service stopped answering",
        "the service hangs, or the computer is overloaded",
        "restart Haply Hub, and close other programs",
        "no state for 50 ms",
    ),
    FailureMode(
        "closed",
        "the connection stays open",
        "the Inverse Service closed the connection",
        "the service was stopped or restarted",
        "start Haply Hub and connect the device again",
        "a close frame, or the end of the stream",
    ),
    FailureMode(
        "protocol",
        "the service keeps to RFC 6455",
        "the Inverse Service sent something that is not a WebSocket text message",
        "the service is of a version that this program does not know",
        "update this program, or use version 3.5 of the service",
        "the header of a frame",
    ),
    FailureMode(
        "not-json",
        "every state is JSON",
        "the Inverse Service sent a state that is not valid JSON",
        "the service is faulty, or of a version that this program does not know",
        "restart Haply Hub; if it stays, use version 3.5 of the service",
        "the grammar of RFC 8259",
    ),
    FailureMode(
        "no-position",
        "every state has a position",
        "the Inverse Service sent a state without the device's position",
        "the service is of a version that this program does not know",
        "update this program, or use version 3.5 of the service",
        "inverse3[].state.cursor_position",
    ),
    FailureMode(
        "not-finite",
        "every position is a finite number",
        "the Inverse Service sent a position that is not a finite number",
        "the device lost its calibration, or an encoder failed",
        "turn the device off and on, and calibrate it",
        "null or a number beyond what a float64 holds",
    ),
    FailureMode(
        "rate",
        "the device keeps up with 1 kHz",
        "the Inverse3 gives fewer than 900 new positions per second",
        "the service or the computer is too slow",
        "close other programs, and set the service's streaming mode to USB",
        "new positions per second while it runs",
    ),
)
FAILURES: Final = FailureTable("the Inverse3", _MODES, frozenset({"no-service", "no-device"}))
