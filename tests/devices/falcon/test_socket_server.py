"""The emulated Falcon on a socket, as a program of others uses it: byte by byte as documented, in real time."""

import os
import signal
import socket
import struct
import subprocess
import sys
import time
from contextlib import contextmanager

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)
if not hasattr(socket, "AF_UNIX"):
    pytest.skip("no Unix sockets here", allow_module_level=True)

from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.falcon import constants
from study_app.errors import DeviceError
from tests.devices.falcon.served.server import EmulatorServer, state_of

pytestmark = pytest.mark.slow

CONTROL, OUT, IN, DESCRIPTOR = 1, 2, 3, 4
PATIENCE_S = 60.0


def packet(torques=(0, 0, 0)):
    """Return the bytes that command three torques: nibbles from 'A' on, the least significant first."""
    nibbles = bytes(0x41 + ((torque >> shift) & 0xF) for torque in torques for shift in (0, 4, 8, 12))
    return b"<" + nibbles + b"AA>"


class Foreign:
    """A program that knows the framing and nothing of ours."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.settimeout(PATIENCE_S)
        self.socket.connect(str(path))

    def begin(self, kind, at, value=0, length=0, timeout_ms=0, data=b""):
        self.socket.sendall(struct.pack("<BBHHH", kind, at, value, length, timeout_ms) + data)

    def ask(self, *request):
        self.begin(*request)
        return self.answer()

    def answer(self):
        code, length = struct.unpack("<iI", self.receive(8))
        return code, self.receive(length)

    def receive(self, size):
        data = b""
        while len(data) < size:
            more = self.socket.recv(size - len(data))
            assert more
            data += more
        return data

    def out(self, data):
        return self.ask(OUT, 0x02, 0, len(data), 1000, data)

    def reply_to(self, data):
        assert self.out(data) == (0, b"")
        heard = b""
        while len(heard) < 16:
            code, more = self.ask(IN, 0x81, 0, 64, 1000)
            assert code == 0
            heard += more[2:]
        return heard

    def set_up(self, latency_ms=1):
        for request, value in ((3, 0x0002), (9, latency_ms)):  # 1.5 MBd; the latency timer
            assert self.ask(CONTROL, request, value) == (0, b"")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "falcon"


@pytest.fixture
def emulator():
    return Emulator(running=True, serial="Ñ7", tremor_m=0.0)


@pytest.fixture
def server(emulator, path):
    with EmulatorServer(emulator, path) as server:
        yield server


@contextmanager
def connected(path):
    foreign = Foreign(path)
    try:
        yield foreign
    finally:
        foreign.socket.close()


def test_it_says_who_it_is_carries_out_requests_and_answers_packets(server, emulator, path):
    with connected(path) as foreign:
        assert foreign.ask(DESCRIPTOR, 0) == (0, struct.pack("<HH", 0x0403, 0xCB48) + "Ñ7".encode())
        foreign.set_up()
        emulator.press(0b1010)
        assert foreign.reply_to(packet((10, -20, 30))) == b"<AAAAAAAAAAAAKA>"
        assert emulator.torques == (10, -20, 30)
        assert emulator.recorded == [(3, 2), (9, 1)]
        pieces = struct.pack("<BBHHH", OUT, 0x02, 0, 16, 1000) + packet((1, 2, 3))
        for k in range(len(pieces)):
            foreign.socket.sendall(pieces[k : k + 1])
        assert foreign.answer() == (0, b"")
        foreign.socket.sendall(struct.pack("<BBHHH", DESCRIPTOR, 0, 0, 0, 0) * 3)
        assert [foreign.answer()[0] for _ in range(3)] == [0, 0, 0]
        assert server.until(lambda: emulator.torques == (1, 2, 3), PATIENCE_S)


def test_a_packet_goes_out_while_a_transfer_in_is_pending(server, emulator, path):
    with connected(path) as foreign:
        foreign.set_up(latency_ms=255)
        foreign.ask(CONTROL, constants.REQUEST_EVENT_CHARACTER, constants.EVENT_ENABLED | constants.STOP)
        foreign.ask(IN, 0x81, 0, 64, 1000)
        began_s = time.monotonic()
        foreign.begin(IN, 0x81, 0, 64, 10_000)
        foreign.begin(OUT, 0x02, 0, 16, 1000, packet((6, 7, 8)))
        code, heard = foreign.answer()  # in the order of the requests: what the packet was answered with
        assert (code, heard[2:3], heard[17:]) == (0, b"<", b">")
        assert foreign.answer() == (0, b"")
        assert time.monotonic() - began_s < 0.2, "long before the bridge's timer would have ended the transfer in"
    assert emulator.torques == (6, 7, 8)


def test_a_tagged_request_is_answered_as_soon_as_it_is_done(server, emulator, path):
    with connected(path) as foreign:
        foreign.set_up(latency_ms=255)
        foreign.ask(IN, 0x81, 0, 64, 1000)
        foreign.begin(0x80 | IN, 0x81, 0, 64, 50)
        foreign.begin(0x80 | OUT, 0x02, 0, 16, 1000, packet((6, 7, 8)))
        assert (foreign.receive(1), foreign.answer()) == (b"\x82", (0, b""))
        assert server.until(lambda: emulator.torques == (6, 7, 8), PATIENCE_S)
        assert foreign.receive(1) == b"\x83"
        assert foreign.answer() == (constants.ERROR_TIMEOUT, b"")  # no event character: it would wait for the timer


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ((9, 0), constants.ERROR_NOT_SUPPORTED),
        ((IN, 0x83, 0, 64), constants.ERROR_NOT_FOUND),
        ((OUT, 0x81), constants.ERROR_NOT_FOUND),
    ],
)
def test_what_it_does_not_know_it_refuses_and_goes_on(server, path, request_, code):
    with connected(path) as foreign:
        assert foreign.ask(*request_) == (code, b"")
        assert foreign.ask(DESCRIPTOR, 0)[0] == 0


def test_a_second_program_is_told_busy_until_the_first_has_gone(server, emulator, path):
    with connected(path) as first, connected(path) as second:
        assert first.ask(DESCRIPTOR, 0)[0] == 0
        assert second.ask(DESCRIPTOR, 0) == (constants.ERROR_BUSY, b"")
        assert second.out(packet((9, 9, 9))) == (constants.ERROR_BUSY, b"")
        first.set_up()
        first.reply_to(packet((5, 5, 5)))
        first.socket.close()
        assert server.until(lambda: server.clients == 1, PATIENCE_S)
        assert emulator.torques == (5, 5, 5)  # as a Falcon's motors hold what they were told last
        assert second.ask(DESCRIPTOR, 0)[0] == 0
        second.reply_to(packet())
        assert emulator.torques == (0, 0, 0)


@pytest.mark.parametrize(
    ("fault", "code"),
    [
        ("access_denied", constants.ERROR_ACCESS),
        ("busy", constants.ERROR_BUSY),
        ("not_supported", constants.ERROR_NOT_SUPPORTED),
        ("kernel_driver", constants.ERROR_BUSY),
        ("unplugged", constants.ERROR_NO_DEVICE),
    ],
)
def test_it_may_be_refused(server, emulator, path, fault, code):
    emulator.faults.on(fault)
    with connected(path) as foreign:
        assert foreign.ask(DESCRIPTOR, 0) == (code, b"")
        emulator.faults.off(fault)
        assert foreign.ask(DESCRIPTOR, 0)[0] == 0
        emulator.faults.on("unplugged")  # in use
        for request in ((OUT, 0x02, 0, 16, 1000, packet()), (IN, 0x81, 0, 64, 10), (DESCRIPTOR, 0)):
            assert foreign.ask(*request) == (constants.ERROR_NO_DEVICE, b"")


def test_it_refuses_a_path_that_is_taken_or_where_no_socket_can_be(emulator, path, tmp_path):
    path.write_text("mine")
    for place, words in (
        (path, f"{path} exists already"),
        (tmp_path / "missing" / "falcon", "no socket can be made there"),
        (tmp_path / ("x" * 120), "short path"),
    ):
        with pytest.raises(DeviceError, match=words):
            EmulatorServer(emulator, place)
    assert path.read_text() == "mine"


def test_a_state_is_a_line(emulator):
    assert state_of(emulator) == "lights none | arms homed 0 of 3 | torques 0, 0, 0"
    emulator.power(False)
    assert state_of(emulator) == "no power"
    assert state_of(Emulator()) == "no program yet, 0 bytes of it"


def command(*words):
    return subprocess.Popen(
        [sys.executable, "-m", "tests.devices.falcon.served.server", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_command_serves_until_it_is_told_to_end_and_removes_its_socket(path, number):
    with command("--socket", path, "--running", "--serial", "S1", "--fault", "frozen") as served:
        assert str(path) in served.stdout.readline()
        with connected(path) as foreign:
            assert foreign.ask(DESCRIPTOR, 0)[1][4:] == b"S1"
            foreign.set_up()
            assert foreign.reply_to(packet())[13] == 0x41
        os.kill(served.pid, number)
        _, said = served.communicate(timeout=PATIENCE_S)
    assert (served.returncode, said) == (0, "")
    assert not path.exists()


def test_the_command_refuses_what_it_does_not_know_in_a_line(path):
    with command("--socket", path, "--geometry", "novint") as served:
        printed, said = served.communicate(timeout=PATIENCE_S)
    assert (served.returncode, printed, len(said.splitlines())) == (2, "", 1)
    assert "geometry 'novint'" in said
    assert not path.exists()
