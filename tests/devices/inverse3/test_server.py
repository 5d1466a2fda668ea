"""The driver over a real TCP connection to the emulated service, in real time."""

import socket
import threading
from collections.abc import Iterator

import numpy as np
import pytest

from study_app.devices.descriptor import NONE, NOT_AVAILABLE
from study_app.devices.doctor import DeviceFailure
from study_app.devices.emulators.inverse3_service import Service
from study_app.devices.inverse3.service import SocketLink, check_force_scale, probe, request_force_scale
from study_app.devices.registry import open_device
from study_app.errors import DeviceLost
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load
from tests.compiled import needs_servo
from tests.devices.inverse3.server import ServiceServer
from tests.devices.subjects import PATIENCE_S, until
from tests.strangers import http_answer, serving

pytestmark = [needs_servo, pytest.mark.slow]


@pytest.fixture
def service() -> Service:
    return Service(tremor_m=0.0)


@pytest.fixture
def server(service: Service) -> Iterator[ServiceServer]:
    with ServiceServer(service) as serving:
        yield serving


def moved_by(service: Service) -> bool:
    """Return whether a force acts on the hand; continue reaching from side to side."""
    if not service.moving:
        service.reach_to(-0.03 if service.aim_m[0] > 0.0 else 0.03, 0.0, 0.0, duration_s=0.4)
    return bool(np.linalg.norm(service.force_n) > 0.5)


def test_a_servo_reads_positions_and_sends_forces_and_ends_with_zero(service: Service, server: ServiceServer) -> None:
    with open_device(f"inverse3:127.0.0.1:{server.port}") as device:
        assert device.describe()["force_scale"] == 1.0
        with Servo(device) as servo:
            servo.load(load("rek2024").scene_for("honey"))
            until(lambda: moved_by(service), "it does not happen")
            servo.check()
            counters = device.counters
            assert counters["fresh"] > 10
            assert counters["unasked"] == 0
        until(lambda: service.force_n == (0.0, 0.0, 0.0), "the force stays", 1.0)
    until(lambda: service.state.close_frames == 1, "it does not happen")


def test_a_service_that_is_killed_in_a_stroke_ends_in_its_message(service: Service, server: ServiceServer) -> None:
    with open_device(f"inverse3:127.0.0.1:{server.port}") as device, Servo(device) as servo:
        servo.load(load("rek2024").scene_for("honey"))
        until(lambda: moved_by(service), "it does not happen")
        server.drop()
        until(lambda: servo.fault is not None, "it does not happen")
        with pytest.raises(DeviceLost, match=r"closed the connection.*start Haply Hub.*the force is zero"):
            servo.check()
        until(lambda: service.force_n == (0.0, 0.0, 0.0), "it does not happen")


def test_closing_a_connection_with_unread_replies_does_not_reset_it() -> None:
    """A reset may discard the zero force that was sent last."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        link = SocketLink("127.0.0.1", listener.getsockname()[1])
        connection, _ = listener.accept()
        with connection:
            connection.sendall(b"an unread reply")
            link.send(b"zero force")
            link.close()
            assert connection.recv(64) == b"zero force"
            assert connection.recv(64) == b""


def test_a_device_is_probed_without_a_session(service: Service, server: ServiceServer) -> None:
    backend = probe(ports=(server.port,))
    assert backend.state == "connected: EMU1"
    assert backend.why == ""
    assert check_force_scale(request_force_scale("127.0.0.1", (server.port,))) == 1.0
    service.set_fault("no-device")
    assert probe(ports=(server.port,)).state == NONE


def test_without_a_service_the_probe_recommends_starting_haply_hub() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    backend = probe(ports=(port,))
    assert backend.state == NOT_AVAILABLE
    assert "start Haply Hub" in backend.why


@pytest.mark.parametrize("answer", [b"1", b"1.0", b'{"value": 1}', b'{"devices/force_scale": 1.0}'])
def test_a_force_scale_of_1_is_understood_in_each_shape(answer: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:9")  # where nothing answers
    monkeypatch.setattr("urllib.request._opener", None)
    with serving(http_answer(answer)) as port:
        assert check_force_scale(request_force_scale("127.0.0.1", (port,))) == 1.0


HUGE = b"1" + b"0" * 400
NOT_1 = (b"2.5", b'{"value": 2.5}', b'{"devices/force_scale": 2.5}', b"0", b"-1", b"NaN", b"Infinity", b"1e999", HUGE)
UNKNOWN = (
    *(b"", b"not json", b"null", b"true", b'"1"', b"[1]", b"{}", b'{"scale": 1}', b'{"value": true}'),
    *(b'{"value": "1"}', b'{"value": null}', b'{"value": {"value": 1}}', b"9" * 5000, b"[" * 100_000),
    b'["' + b"many\\n" * 1000 + b'"]',
)


@pytest.mark.parametrize(
    ("answer", "mode"),
    [*((answer, "settings") for answer in NOT_1), *((answer, "unknown-scale") for answer in UNKNOWN)],
)
def test_any_other_answer_about_the_force_scale_is_refused_in_a_line(answer: bytes, mode: str) -> None:
    with serving(http_answer(answer)) as port, pytest.raises(DeviceFailure) as refused:
        check_force_scale(request_force_scale("127.0.0.1", (port,)))
    assert refused.value.mode == mode
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 400


@pytest.mark.parametrize("answer", [b"", b"not HTTP\r\n\r\n"], ids=["late", "not HTTP"])
def test_a_service_that_does_not_answer_about_its_force_scale_moves_nothing(
    answer: bytes, service: Service, server: ServiceServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    late = threading.Event()
    monkeypatch.setattr(server, "_answer_http", lambda _head: answer or str(late.wait(PATIENCE_S)).encode())
    with pytest.raises(
        DeviceFailure, match=r"service multiplies all forces is unknown \(no number within 0\.5 s\).*restart"
    ):
        open_device(f"inverse3:127.0.0.1:{server.port}")
    late.set()
    assert service.state.pushes == 0
    until(lambda: service.state.ended == 1, "it does not happen")
