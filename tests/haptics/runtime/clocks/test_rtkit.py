"""The desktop's real-time service, played by a thread behind a socket."""

import socket
import struct
import sys
import threading

import pytest

if sys.platform != "linux":
    pytest.skip("a service of Linux", allow_module_level=True)

import resource

from study_app.haptics.runtime.clocks.linux import make_high_priority, make_real_time


class Service:
    """A bus with the service: parses calls by the specification, and answers each as configured."""

    def __init__(self, path, *, refuses=(), auth=b"OK 1234deadbeef\r\n"):
        self.calls = []
        self.heard = b""
        self._refuses, self._auth = refuses, auth
        self._server = socket.socket(socket.AF_UNIX)
        self._server.bind(str(path))
        self._server.listen(1)
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def end(self):
        self._thread.join()
        self._server.close()

    def _serve(self):
        connection, _ = self._server.accept()
        with connection, connection.makefile("rwb") as stream:
            self.heard = stream.readline()
            stream.write(self._auth)
            stream.flush()
            if stream.readline() != b"BEGIN\r\n":
                return
            while head := stream.read(16):
                endian, kind, _flags, version, length, serial, fields = struct.unpack("<cBBBIII", head)
                assert (endian, kind, version) == (b"l", 1, 1)
                named = self._fields(stream.read(fields))
                stream.read(-fields % 8)
                self.calls.append((named, stream.read(length)))
                self._answer(stream, serial, named[3])
                stream.flush()

    @staticmethod
    def _fields(data):
        at, named = 0, {}
        while at < len(data):
            at += -at % 8
            code, kind = data[at], data[at + 2 : at + 3]
            at += 4
            if kind == b"g":
                size, at = data[at], at + 1
            else:
                assert at % 4 == 0
                size, at = struct.unpack_from("<I", data, at)[0], at + 4
            named[code] = data[at : at + size].decode()
            assert data[at + size] == 0
            at += size + 1
        return named

    def _answer(self, stream, serial, member):
        signal = struct.pack("<cBBBIII", b"l", 4, 1, 1, 4, 7, 0) + b"news"
        stream.write(signal)
        body = b""
        if member == "Get":
            property_name = self.calls[-1][1].rstrip(b"\0").rsplit(b"\0", 1)[-1]
            if b"MaxRealtimePriority" in property_name:
                body = b"\x01i\0\0" + struct.pack("<i", 15)
            elif b"MinNiceLevel" in property_name:
                body = b"\x01i\0\0" + struct.pack("<i", -7)
            else:
                body = b"\x01x\0\0\0\0\0\0" + struct.pack("<q", 200_000)
        kind = 3 if member in self._refuses else 2
        fields = struct.pack("<BB2sI", 5, 1, b"u", serial)
        stream.write(struct.pack("<cBBBIII", b"l", kind, 1, 1, len(body), 9, len(fields)) + fields + body)


@pytest.fixture
def limits(monkeypatch):
    """Keep the limits of this process; return the requested ones."""
    requests = []
    monkeypatch.setattr(resource, "setrlimit", lambda kind, limit: requests.append((kind, limit)))
    return requests


@pytest.fixture
def serve(tmp_path):
    services = []

    def begin(**how):
        services.append(Service(tmp_path / "bus", **how))
        return services[-1], str(tmp_path / "bus")

    yield begin
    for service in services:
        service.end()


def test_the_highest_granted_priority_is_requested(serve, limits):
    service, path = serve()
    assert make_real_time(4711, path) == 15
    assert service.heard.startswith(b"\0AUTH EXTERNAL ")
    assert [named[3] for named, _ in service.calls] == ["Hello", "Get", "Get", "MakeThreadRealtime"]
    named, body = service.calls[-1]
    assert named == {
        1: "/org/freedesktop/RealtimeKit1",
        2: "org.freedesktop.RealtimeKit1",
        3: "MakeThreadRealtime",
        6: "org.freedesktop.RealtimeKit1",
        8: "tu",
    }
    assert struct.unpack("<QI", body) == (4711, 15)
    assert limits == [(resource.RLIMIT_RTTIME, (200_000, 200_000))]


def test_a_bus_without_the_service_changes_no_limit(serve, limits):
    _, path = serve(refuses=("Get",))
    with pytest.raises(PermissionError, match="rejected Get"):
        make_real_time(1, path)
    assert limits == []


def test_no_bus_is_an_os_error(tmp_path, monkeypatch):
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", f"unix:path={tmp_path / 'none'},guid=0")
    with pytest.raises(FileNotFoundError):
        make_real_time(1)


def test_a_thread_goes_before_others_as_far_as_the_service_grants_it(serve, limits):
    service, path = serve()
    assert make_high_priority(4711, -10, path) == -7
    named, body = service.calls[-1]
    assert (named[3], named[8]) == ("MakeThreadHighPriority", "ti")
    assert struct.unpack("<Qi", body) == (4711, -7)
    assert limits == [], "it may compute as long as it likes: it is not real-time"
