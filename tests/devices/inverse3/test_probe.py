"""The description of a service by its list of devices, for each kind of answer."""

import socket
from collections.abc import Iterator
from typing import Any

import pytest

from study_app.devices.doctor import DeviceFailure
from study_app.devices.inverse3 import service
from study_app.devices.inverse3.opening import FAILURES
from study_app.devices.inverse3.service import SocketLink, probe, request_force_scale, shortened


@pytest.mark.parametrize(
    ("answer", "state", "why"),
    [
        (None, "not available", "no-service"),
        (["inverse3"], "not available", "no-service"),
        ({}, "none connected", "no-device"),
        ({"inverse3": {"device_id": "A1"}}, "none connected", "no-device"),
        ({"inverse3": ["A1", {"device_id": 7}, {}]}, "none connected", "no-device"),
        ({"inverse3": [{"device_id": "a b"}, {"device_id": 'a"b'}]}, "none connected", "no-device"),
        ({"inverse3": [{"device_id": 65 * "a"}]}, "none connected", "no-device"),
        ({"inverse3": [{"device_id": 64 * "a"}]}, f"connected: {64 * 'a'}", None),
        ({"inverse3": [{"device_id": "A1"}, {"device_id": ""}, {"device_id": "B-2"}]}, "connected: A1, B-2", None),
    ],
)
def test_a_service_is_described_with_its_devices(
    answer: Any, state: str, why: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    requests: list[tuple[Any, ...]] = []
    monkeypatch.setattr(service, "_get_json", lambda *request: requests.append(request) or answer)
    backend = probe("there", (1, 2))
    assert requests == [("there", "/devices", (1, 2))]
    assert (backend.name, backend.by, backend.state) == ("inverse3", "Inverse Service", state)
    assert backend.why == ("" if why is None else FAILURES.sentence(why))
    assert backend.can.startswith("force through Inverse Service 3.5 or later")


def test_the_force_scale_is_asked_by_its_key(monkeypatch: pytest.MonkeyPatch) -> None:
    requests: list[tuple[Any, ...]] = []
    monkeypatch.setattr(service, "_get_json", lambda *request: requests.append(request) or 1.5)
    assert request_force_scale("there", (1, 2)) == 1.5
    assert requests == [("there", "/settings/devices/force_scale", (1, 2))]


def test_data_of_a_service_are_shortened_to_eighty_characters() -> None:
    assert shortened({"a": 1}) == "{'a': 1}"
    assert shortened("a\nb") == r"'a\nb'"
    long = shortened(dict.fromkeys(range(9), 40 * "x"))
    assert (len(long), "\n" in long) == (80, False)


@pytest.fixture
def peer() -> Iterator[tuple[SocketLink, socket.socket]]:
    """A link, and the socket at the other end of its connection."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = SocketLink("127.0.0.1", server.getsockname()[1], 5.0)
        other, _ = server.accept()
        other.settimeout(5.0)
        with other:
            yield link, other
        link.close()


def test_a_link_sends_all_and_receives_the_available_bytes(peer: tuple[SocketLink, socket.socket]) -> None:
    link, other = peer
    link.send(b"question")
    assert other.recv(100) == b"question"
    other.sendall(b"an answer\nand more")
    assert link.receive(2) == b"an"
    with link.makefile("rb") as file:
        assert file.readline() == b" answer\n"
        other.shutdown(socket.SHUT_WR)
        assert file.read() == b"and more"


def test_a_link_that_is_closed_is_silent_at_both_ends(peer: tuple[SocketLink, socket.socket]) -> None:
    link, other = peer
    other.sendall(b"unread")
    other.shutdown(socket.SHUT_WR)
    link.close()
    assert other.recv(100) == b"", "and not reset, so that the last bytes that were sent arrive"
    for call in (lambda: link.send(b"x"), link.receive):
        with pytest.raises(DeviceFailure) as failed:
            call()
        assert failed.value.mode == "closed"
    link.close()


def test_a_link_that_exceeds_its_time_limit_reports_no_reply() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        link = SocketLink("127.0.0.1", port, 0.05)
        for _ in range(2):
            with pytest.raises(DeviceFailure, match=r"it did not finish within 0\.05 s") as failed:
                link.receive()
            assert failed.value.mode == "no-reply"
        link.close()
    with pytest.raises(DeviceFailure, match=f"127.0.0.1:{port}") as refused:
        SocketLink("127.0.0.1", port, 1.0)
    assert refused.value.mode == "no-service"
