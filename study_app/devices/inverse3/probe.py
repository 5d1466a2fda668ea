"""Whether an Inverse Service answers here and which Inverse3 it lists. Opens no session; loads no compiler."""

import contextlib
import json
import urllib.request
from typing import Any, Final

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.devices.inverse3.failures import FAILURES

PORTS: Final = (10001, 10000)
"""Of HTTP: docs.haply.co 3.5.x, "Device Configuration" uses the first, "Settings Reference" names the second."""
ANSWER_S: Final = 0.5
CAN: Final = "force as commanded by the Inverse Service 3.5 or later (Haply Hub); not proved on hardware"


def probe(host: str = "127.0.0.1", ports: tuple[int, ...] = PORTS) -> Backend:
    """Return what the service at ``host`` lists (docs.haply.co 3.4.x, "HTTP", Devices: GET /devices)."""
    found = ask(host, "/devices", ports)
    by = "Inverse Service"
    if not isinstance(found, dict):
        return Backend("inverse3", by, NOT_AVAILABLE, CAN, FAILURES.sentence("no-service"))
    listed = found.get("inverse3", [])
    names = [str(entry.get("device_id")) for entry in listed if isinstance(entry, dict)]
    if not names:
        return Backend("inverse3", by, NONE, CAN, FAILURES.sentence("no-device"))
    return Backend("inverse3", by, "connected: " + ", ".join(names), CAN)


def force_scale(host: str, ports: tuple[int, ...] = PORTS) -> float | None:
    """Return the setting devices/force_scale, the multiplier of all forces; None where no answer has a number.

    Documented: "Filters" 3.5.x (the key), "Settings Reference" 3.5.x (GET /settings/KEY). The shape of the answer is
    not: a bare number, or an object with the number as ``value`` or under the key, are understood.
    """
    found = ask(host, "/settings/devices/force_scale", ports)
    if isinstance(found, dict):
        found = found.get("value", found.get("devices/force_scale"))
    return float(found) if isinstance(found, int | float) and not isinstance(found, bool) else None


def ask(host: str, path: str, ports: tuple[int, ...] = PORTS) -> Any:
    """Return what the service answers to a GET as JSON; None where nothing at these ports does."""
    for port in ports:
        with contextlib.suppress(OSError, ValueError, RecursionError):
            request = f"http://{host}:{port}{path}"
            with urllib.request.urlopen(request, timeout=ANSWER_S) as answer:
                return json.loads(answer.read(1 << 20))
    return None
