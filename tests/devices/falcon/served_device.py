"""The Falcon's driver over a `served` bridge, as a device of another package: "falcon-socket:PATH"."""

from typing import Any

from study_app.devices.descriptor import READY, Backend, framed
from study_app.devices.descriptors import BY_COMMAND
from study_app.devices.falcon.device import FalconDevice
from tests.devices.falcon.served import ServedTransport, end_torque


class ServedFalcon(FalconDevice):
    name = "falcon-socket"
    ends_force = f"{end_torque.__module__}:{end_torque.__name__}"

    def _connect(self) -> Any:
        return ServedTransport(self._serial)


FALCON_SOCKET = framed(
    "falcon-socket",
    "Falcon behind a socket",
    f"{__name__}:ServedFalcon",
    "study_app.devices.falcon.failures:FAILURES",
    icon="fast_forward",
    kind="simulated",
    probe=lambda: [Backend("falcon-socket:PATH", "a Unix socket", state=READY, can="an emulated Falcon")],
    argument="PATH",
    argument_required=True,
    options=(BY_COMMAND,),
)
