"""Whether an Inverse Service answers here and which Inverse3 it lists. Opens no session; loads no compiler."""

import contextlib
import json
import reprlib
import urllib.request
from http.client import HTTPException
from typing import Any, Final

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.devices.inverse3.failures import FAILURES

PORTS: Final = (10001, 10000)
"""Of HTTP: docs.haply.co 3.5.x, "Device Configuration" uses the first, "Settings Reference" names the second."""
ANSWER_S: Final = 0.5
LONGEST: Final = 80
_DIRECT: Final = urllib.request.build_opener(urllib.request.ProxyHandler({}))
"""Opens without a proxy of the system: the service is in the local network."""
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


def force_scale(host: str, ports: tuple[int, ...] = PORTS) -> Any:
    """Return the service's answer about the setting devices/force_scale, the multiplier of all forces; None without.

    Documented: "Filters" 3.5.x (the key), "Settings Reference" 3.5.x (GET /settings/KEY).
    """
    return ask(host, "/settings/devices/force_scale", ports)


def check_force_scale(answer: Any) -> float:
    """Return the multiplier of all forces in an answer, which is 1.

    The shape of the answer is not documented: a bare number, or an object with the number as ``value`` or under the
    key, are understood.
    """
    scale = answer.get("value", answer.get("devices/force_scale")) if isinstance(answer, dict) else answer
    if type(scale) not in {int, float}:  # a bool is none
        where = f"within {ANSWER_S:g} s" if answer is None else f"in {reprlib.repr(answer)[:LONGEST]}"
        raise FAILURES.failure("unknown-scale", f"no number {where}")
    if scale != 1:
        raise FAILURES.failure("settings", f"devices/force_scale is {reprlib.repr(scale)}, and 1 is required")
    return 1.0


def ask(host: str, path: str, ports: tuple[int, ...] = PORTS) -> Any:
    """Return what the service answers to a GET as JSON; None where nothing at these ports does."""
    for port in ports:
        with contextlib.suppress(OSError, HTTPException, ValueError, RecursionError):
            request = f"http://{host}:{port}{path}"
            with _DIRECT.open(request, timeout=ANSWER_S) as answer:
                return json.loads(answer.read(1 << 20))
    return None
