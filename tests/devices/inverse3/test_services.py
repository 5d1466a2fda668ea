"""Services that hang or answer incorrectly: opening, probe and doctor end with one line within three seconds."""

import base64
import hashlib
import itertools
import json
import re
import socket
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, Final, NamedTuple

import pytest

from study_app.devices.driver import examine
from study_app.devices.emulators.inverse3_service import Service
from study_app.devices.inverse3.service import probe, request_force_scale, shortened
from tests.compiled import needs_servo
from tests.strangers import CLOSE, HTTP_OK, STRANGERS, Parts, dripped, flooded, http_answer, sent, serving

pytestmark = [needs_servo, pytest.mark.slow]
MOST_S: Final = 3.0
NEUTRAL: Final = {
    "preset": "arm_front_centered",
    "basis": {"permutation": "XYZ"},
    "filters": {"force_gate": {"gain": 0.0}, "damping": {"scalar": 0.0}},
}
CONFIG: Final = Service().inventory()["inverse3"][0]["config"] | NEUTRAL
STATUS: Final = {"power_supply": True, "ready": True, "calibrated": True, "in_use": False}


def message_of(**changed: Any) -> dict[str, Any]:
    """Return a full state, with other values of its device."""
    position = dict.fromkeys("xyz", 0.0)
    return {"inverse3": [{"device_id": "A1", "config": CONFIG, "status": STATUS,
                          "state": {"cursor_position": position}} | changed]}  # fmt: skip


def frame(message: Any, first: int = 0x81) -> bytes:
    text = message if isinstance(message, bytes) else json.dumps(message).encode()
    size = bytes([len(text)]) if len(text) < 126 else b"\x7e" + len(text).to_bytes(2, "big")
    if len(text) >= 1 << 16:
        size = b"\x7f" + len(text).to_bytes(8, "big")
    return bytes([first]) + size + text


def upgraded(head: bytes) -> bytes:
    (key,) = re.findall(rb"(?i)sec-websocket-key: (\S+)", head)
    accept = base64.b64encode(hashlib.sha1(key + b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11").digest())  # noqa: S324 - RFC 6455
    answer = b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    return answer + b"Sec-WebSocket-Accept: %b\r\n\r\n" % accept


class Kind(NamedTuple):
    """A kind of service: its output at each stage, and the failure mode of opening it.

    A stage that is omitted is that of a working service. ``answer`` maps the number of a message to its answer.
    """

    mode: str
    handshake: Callable[[], Parts] | None = None
    first: Callable[[], Parts] | None = None
    answer: Callable[[int], Parts] | None = None
    http: Callable[[], Parts] | None = None


def first(mode: str, message: Any) -> Kind:
    return Kind(mode, first=sent(frame(message)))


def http(body: bytes, mode: str = "unknown-scale") -> Kind:
    return Kind(mode, http=http_answer(body))


HUGE: Final = b"\x81\x7f" + (1 << 62).to_bytes(8, "big")
ANSWERS: Final[Mapping[str, Kind]] = {
    "ends at once": Kind("closed", sent(CLOSE)),
    "another program": Kind("not-websocket", sent(HTTP_OK + b"Content-Length: 2\r\n\r\n{}")),
    "status with a bell": Kind("not-websocket", sent(b"HTTP/1.1 200 \x07\x1b[2J\nmore\r\n\r\n")),
    "long status": Kind("not-websocket", sent(b"HTTP/1.1 200 " + b"x" * 60_000 + b"\r\n\r\n")),
    "another key": Kind("not-websocket", lambda: iter([upgraded(b"Sec-WebSocket-Key: other")])),
    "head without end": Kind("not-websocket", lambda: flooded(b"HTTP/1.1 101 Switching\r\n", b"x")),
    "lines without end": Kind("not-websocket", lambda: flooded(b"HTTP/1.1 101 Switching\r\n", b"name: value\r\n")),
    "huge frame flooded": Kind("protocol", first=lambda: flooded(HUGE, b"x")),
    "long frame flooded": Kind("protocol", first=lambda: flooded(b"\x81\x7f" + (1 << 20).to_bytes(8, "big"), b"x")),
    "masked": Kind("protocol", first=sent(b"\x81\x84\0\0\0\0null")),
    "fragment": Kind("protocol", first=sent(frame({}, 0x01))),
    "long ping": Kind("protocol", first=sent(frame(b"x" * 126, 0x89))),
    "close frame": Kind("closed", first=sent(frame(b"\x03\xe9", 0x88))),
    "ends in a frame": Kind("closed", first=sent(b"\x81\x7e\x10", CLOSE)),
    "not UTF-8": first("not-json", b'{"inverse3": "\xff"}'),
    "nested": first("not-json", b"[" * 60_000),
    "5000 digits": first("not-json", b"9" * 5000),
    "a list": first("not-json", []),
    "not a number of JSON": first("not-json", message_of(config=CONFIG | {"device_info": float("nan")})),
    "beyond a number": first("not-json", json.dumps(message_of()).replace("0.0", "1e999").encode()),
    "incomplete character": first("not-json", message_of(config=CONFIG | {"device_info": "\ud800"})),
    "inverse3 a number": first("version", {"inverse3": 5}),
    "devices are numbers": first("no-device", {"inverse3": [5, None]}),
    "ids with lines": first("no-device", {"inverse3": []} | {"inverse3": [{"id": "a\nb"}]}),
    "config a number": first("version", message_of(config=5)),
    "config a list": first("version", message_of(config=["filters"])),
    "config a text": first("version", message_of(config="filters")),
    "status a list": first("version", message_of(status=[])),
    "status null": first("version", message_of(status=None)),
    "400 digits": Kind("settings", answer=sent(frame(message_of(config=CONFIG | {"torque_scaling": 10**400})))),
    "scale a list": http(b"[1]"),
    "scale of 400 digits": http(b"1" + b"0" * 400, "settings"),
    "redirected for ever": Kind("unknown-scale", http=sent(b"HTTP/1.1 302 Found\r\nLocation: /\r\n\r\n")),
}  # fmt: skip
HANGS: Final[Mapping[str, Kind]] = {
    "silent": Kind("no-reply", sent()),
    "head dripped": Kind("no-reply", lambda: dripped(b"HTTP/1.1 101 x")),
    "no first message": Kind("no-reply", first=sent()),
    "pings flooded": Kind("no-reply", first=lambda: flooded(b"", frame(b"x", 0x89))),
    "pings dripped": Kind("no-reply", first=lambda: (part for part in dripped(frame(b"", 0x89) * 10_000))),
    "pongs flooded": Kind("no-reply", first=lambda: flooded(b"", frame(b"x" * 125, 0x8A))),
    "frame dripped": Kind("no-reply", first=lambda: dripped(b"\x81\x7e\xff\xffx")),
    "header cut": Kind("no-reply", first=sent(b"\x81\x7e\x10")),
    "no answer": Kind("no-reply", answer=sent()),
    "answers slowly": Kind("no-reply", answer=lambda _: slowly(0.2)),
    "pings for an answer": Kind("no-reply", answer=lambda _: flooded(b"", frame(b"", 0x89))),
    **{
        name: Kind("unknown-scale", http=partial(respond, b"", None))
        for name, respond in STRANGERS.items() if "HTTP" in name
    },
}  # fmt: skip


def slowly(pause_s: float) -> Parts:
    time.sleep(pause_s)
    yield frame(message_of())


def answers(kind: Kind, head: bytes, connection: socket.socket) -> Parts:
    """Yield the parts that a service sends over a connection."""
    if b"upgrade: websocket" not in head.lower():
        yield from kind.http() if kind.http else http(b'{"value": 1, "inverse3": []}').http()
        return
    if kind.handshake:
        yield from kind.handshake()
        return
    yield upgraded(head)
    yield from kind.first() if kind.first else [frame(message_of())]
    for number in itertools.count():
        if not connection.recv(1 << 16):
            return
        yield from kind.answer(number) if kind.answer else [frame(message_of())]


def test_data_in_a_message_are_cut_at_80_characters() -> None:
    assert shortened([1, None]) == "[1, None]"
    assert len(shortened(["x" * 40] * 6)) == 80  # of 6 texts, each shortened to 30 characters


@pytest.fixture(scope="module")
def compiled() -> None:
    """Compile the driver: the first start takes longer."""
    with serving(partial(answers, next(iter(ANSWERS.values())))) as port:
        examine(f"inverse3:127.0.0.1:{port}", progress=str)


@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize(
    "kind",
    [
        *(pytest.param(kind, id=name) for name, kind in ANSWERS.items()),
        *(pytest.param(kind, id=name, marks=pytest.mark.nightly) for name, kind in HANGS.items()),
    ],
)
def test_every_kind_of_service_ends_in_its_failure_within_three_seconds(kind: Kind) -> None:
    with serving(partial(answers, kind)) as port:
        began_s = time.perf_counter()
        report = examine(f"inverse3:127.0.0.1:{port}", progress=str)
        assert time.perf_counter() - began_s < MOST_S
        assert [finding.id for finding in report.found] == [kind.mode]
        assert report.failure is not None
        assert report.failure.isprintable()
        assert len(report.failure) < 450


def test_a_probe_of_a_service_that_hangs_ends_soon() -> None:
    def end(kind: Kind) -> tuple[float | None, bool, bool]:
        with serving(partial(answers, kind)) as port:
            began_s = time.perf_counter()
            scale, why = request_force_scale("127.0.0.1", (port, port, port)), probe(ports=(port,)).why
            return scale, "start Haply Hub" in why, time.perf_counter() - began_s < MOST_S

    kinds = {name: kind for name, kind in HANGS.items() if kind.http}
    with ThreadPoolExecutor(4) as pool:
        ends = dict(zip(kinds, pool.map(end, kinds.values()), strict=True))
    assert ends == dict.fromkeys(kinds, (None, True, True))


@pytest.mark.parametrize(
    "listed", ["5", "null", '{"a": 5}', "[5, null]", '[{"device_id": {"a": 1}}]', '[{"device_id": "a\\nb"}]']
)
def test_a_probe_of_an_invalid_list_finds_no_device(listed: str) -> None:
    with serving(partial(answers, http(b'{"inverse3": %b}' % listed.encode()))) as port:
        assert "does not list this Inverse3" in probe(ports=(port,)).why
