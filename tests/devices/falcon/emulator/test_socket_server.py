"""The emulated Falcon on a socket: a real-time bridge for one program at a time, byte by byte as documented."""

import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from contextlib import contextmanager

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)
if not hasattr(socket, "AF_UNIX"):
    pytest.skip("no Unix sockets here", allow_module_level=True)

from study_app.cli.devices import state_of
from study_app.devices.falcon.emulator.socket_server import EmulatorServer
from study_app.devices.falcon.wire import constants
from study_app.errors import DeviceError
from tests.devices.falcon.support.emulated_falcon import HOMING, packet, still

pytestmark = pytest.mark.slow

CONTROL, OUT, IN, DESCRIPTOR = 1, 2, 3, 4
PATIENCE_S = 60.0


class Foreign:
    """A program that knows the framing and nothing of ours."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.settimeout(PATIENCE_S)
        self.socket.connect(str(path))

    def ask(self, kind, at, value=0, length=0, timeout_ms=0, data=b""):
        self.socket.sendall(struct.pack("<BBHHH", kind, at, value, length, timeout_ms) + data)
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

    def set_up(self):
        for request, value in ((constants.REQUEST_BAUD, constants.BAUD_1500000), (constants.REQUEST_LATENCY, 1)):
            assert self.ask(CONTROL, request, value) == (0, b"")

    def close(self):
        self.socket.close()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "falcon"


@pytest.fixture
def emulator():
    return still(running=True, serial="Ñ7")


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
        foreign.close()


def test_it_tells_what_it_is(server, path):
    with connected(path) as foreign:
        assert foreign.ask(DESCRIPTOR, 0) == (0, struct.pack("<HH", 0x0403, 0xCB48) + "Ñ7".encode())


def test_packets_go_through_and_requests_are_carried_out(server, emulator, path):
    with connected(path) as foreign:
        foreign.set_up()
        reply = foreign.reply_to(packet((10, -20, 30)))
        assert (reply[:1], reply[15:]) == (b"<", b">")
    assert emulator.torques == (10, -20, 30)
    assert emulator.recorded == [(constants.REQUEST_BAUD, constants.BAUD_1500000), (constants.REQUEST_LATENCY, 1)]


def test_requests_may_come_in_pieces_or_several_at_once(server, emulator, path):
    with connected(path) as foreign:
        foreign.set_up()
        asked = struct.pack("<BBHHH", OUT, 0x02, 0, 16, 1000) + packet((1, 2, 3))
        for k in range(len(asked)):
            foreign.socket.sendall(asked[k : k + 1])
        assert foreign.answer() == (0, b"")
        foreign.socket.sendall(struct.pack("<BBHHH", DESCRIPTOR, 0, 0, 0, 0) * 3)
        assert [foreign.answer()[0] for _ in range(3)] == [0, 0, 0]
        assert len(foreign.reply_to(packet((4, 5, 6)))) >= 16  # it may be the reply to the packet before
        assert server.until(lambda: emulator.torques == (4, 5, 6), 30)


def test_a_packet_goes_out_while_a_transfer_in_is_pending(server, emulator, path):
    with connected(path) as foreign:
        foreign.ask(CONTROL, constants.REQUEST_BAUD, constants.BAUD_1500000)
        foreign.ask(CONTROL, constants.REQUEST_LATENCY, 255)
        foreign.ask(CONTROL, constants.REQUEST_EVENT_CHARACTER, constants.EVENT_ENABLED | constants.STOP)
        foreign.ask(IN, 0x81, 0, 64, 1000)
        began_s = time.monotonic()
        foreign.socket.sendall(struct.pack("<BBHHH", IN, 0x81, 0, 64, 10_000))
        foreign.socket.sendall(struct.pack("<BBHHH", OUT, 0x02, 0, 16, 1000) + packet((6, 7, 8)))
        code, heard = foreign.answer()  # in the order of the requests: what the packet was answered with
        assert (code, heard[2:3], heard[17:]) == (0, b"<", b">")
        assert foreign.answer() == (0, b"")
        assert time.monotonic() - began_s < 0.2, "long before the bridge's timer would have ended the transfer in"
    assert emulator.torques == (6, 7, 8)


def test_a_tagged_request_is_answered_as_soon_as_it_is_done(server, emulator, path):
    with connected(path) as foreign:
        foreign.set_up()
        foreign.ask(CONTROL, constants.REQUEST_LATENCY, 255)
        foreign.ask(IN, 0x81, 0, 64, 1000)
        foreign.socket.sendall(struct.pack("<BBHHH", 0x80 | IN, 0x81, 0, 64, 50))
        foreign.socket.sendall(struct.pack("<BBHHH", 0x80 | OUT, 0x02, 0, 16, 1000) + packet((6, 7, 8)))
        assert (foreign.receive(1), foreign.answer()) == (b"\x82", (0, b""))
        assert server.until(lambda: emulator.torques == (6, 7, 8), PATIENCE_S)
        assert foreign.receive(1) == b"\x83"
        assert foreign.answer() == (constants.ERROR_TIMEOUT, b"")  # no event character: it would wait for the timer


def test_nothing_is_compiled_once_a_client_can_connect(tmp_path):
    """In a program of its own: the first boot and homing through a socket must not wait for a compiler."""
    program = """
import sys
from study_app.devices.falcon.emulator import arm, boot_loader, emulator, faults
from study_app.devices.falcon.emulator import firmware_loop, ftdi_bridge, host_interface
from study_app.devices.falcon.emulator.socket_server import EmulatorServer
from study_app.devices.simulated import hand
from study_app.haptics.kernels import plant
from tests.devices.falcon.emulator.test_socket_server import Foreign, packet, HOMING, constants, OUT, CONTROL
modules = (arm, boot_loader, emulator, faults, firmware_loop, ftdi_bridge, host_interface, hand, plant)
def compiled():
    return {(name, len(one.signatures)) for module in modules for name, one in vars(module).items()
            if hasattr(one, "signatures")}
with EmulatorServer(emulator.Emulator(), sys.argv[1]) as served:
    before = compiled()
    foreign = Foreign(sys.argv[1])
    foreign.ask(CONTROL, constants.REQUEST_MODEM, constants.DTR_LOW)
    foreign.ask(CONTROL, constants.REQUEST_MODEM, constants.DTR_HIGH)
    foreign.out(constants.PING)
    foreign.ask(3, 0x81, 0, 64, 100)
    foreign.set_up()
    foreign.out(packet((1, 2, 3), HOMING))
    foreign.ask(3, 0x81, 0, 64, 100)
    foreign.socket.close()
    served.until(lambda: served.clients == 0, 30)
    assert compiled() == before, compiled() - before
"""
    finished = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "falcon")], check=False, timeout=300, capture_output=True
    )
    assert finished.returncode == 0, finished.stderr.decode()


def test_an_answer_does_not_come_before_its_time(server, path):
    with connected(path) as foreign:
        foreign.ask(CONTROL, constants.REQUEST_LATENCY, 200)
        foreign.ask(IN, 0x81, 0, 64, 1000)
        began_s = time.monotonic()
        assert foreign.ask(IN, 0x81, 0, 64, 30) == (constants.ERROR_TIMEOUT, b"")
        assert time.monotonic() - began_s >= 0.03
        assert foreign.ask(IN, 0x81, 0, 64, 1000) == (0, b"\x01\x60")
        assert time.monotonic() - began_s >= 0.19


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
        first.close()
        assert server.until(lambda: server.clients == 1, PATIENCE_S)
        assert emulator.torques == (5, 5, 5)
        assert second.ask(DESCRIPTOR, 0)[0] == 0
        second.reply_to(packet())
        assert emulator.torques == (0, 0, 0)


def test_a_program_that_was_killed_leaves_its_torque_on(server, emulator, path):
    program = (
        "import os, signal, sys\n"
        "from tests.devices.falcon.emulator.test_socket_server import Foreign, packet\n"
        "foreign = Foreign(sys.argv[1]); foreign.set_up(); foreign.reply_to(packet((700, 0, 0)))\n"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    finished = subprocess.run([sys.executable, "-c", program, str(path)], check=False, timeout=120)
    assert finished.returncode == -signal.SIGKILL
    assert server.until(lambda: server.clients == 0, PATIENCE_S)
    assert emulator.torques == (700, 0, 0)
    with connected(path) as foreign:
        foreign.reply_to(packet())
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


def test_unplugged_while_in_use_nothing_goes_any_more(server, emulator, path):
    with connected(path) as foreign:
        assert foreign.ask(DESCRIPTOR, 0)[0] == 0
        emulator.faults.on("unplugged")
        assert foreign.out(packet()) == (constants.ERROR_NO_DEVICE, b"")
        assert foreign.ask(IN, 0x81, 0, 64, 10) == (constants.ERROR_NO_DEVICE, b"")
        assert foreign.ask(DESCRIPTOR, 0) == (constants.ERROR_NO_DEVICE, b"")


def test_the_hand_strokes_in_the_machines_time_while_homing_is_on(server, emulator, path):
    with connected(path) as foreign:
        foreign.set_up()
        began_s = time.monotonic()
        while emulator.homed != 0b111:
            foreign.reply_to(packet(flags=HOMING))
            assert time.monotonic() - began_s < PATIENCE_S
        assert time.monotonic() - began_s > 0.5


def test_it_refuses_a_path_that_is_taken(emulator, path):
    path.write_text("mine")
    with pytest.raises(DeviceError, match=f"{path} exists already"):
        EmulatorServer(emulator, path)
    assert path.read_text() == "mine"


def test_it_refuses_a_path_where_no_socket_can_be(emulator, tmp_path):
    with pytest.raises(DeviceError, match="no socket can be made there"):
        EmulatorServer(emulator, tmp_path / "missing" / "falcon")
    with pytest.raises(DeviceError, match="short path"):
        EmulatorServer(emulator, tmp_path / ("x" * 120))


def test_when_it_stops_nothing_stays_at_the_path(emulator, path):
    with EmulatorServer(emulator, path), connected(path) as foreign:
        assert foreign.ask(DESCRIPTOR, 0)[0] == 0
    assert not path.exists()
    with EmulatorServer(emulator, path), connected(path) as foreign:
        assert foreign.ask(DESCRIPTOR, 0)[0] == 0


def test_it_tells_how_it_goes(emulator, path):
    said, server = [], EmulatorServer(emulator, path)

    def tell():
        said.append(state_of(emulator))
        server.stop()

    thread = threading.Thread(target=server.serve, args=(tell, 0.0))
    thread.start()
    thread.join(PATIENCE_S)
    assert said[:1] == ["lights none | arms homed 0 of 3 | torques 0, 0, 0"]
    assert not path.exists()


def test_a_state_is_a_line():
    emulator = still()
    assert state_of(emulator) == "no program yet, 0 bytes of it"
    emulator.power(False)
    assert state_of(emulator) == "no power"


# the command


def command(*words):
    return subprocess.Popen(
        [sys.executable, "-m", "study_app", "emulate-falcon", *map(str, words)],
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
            assert foreign.reply_to(packet())[13] == constants.ZERO
        os.kill(served.pid, number)
        _, said = served.communicate(timeout=PATIENCE_S)
    assert (served.returncode, said) == (0, "")
    assert not path.exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [(("--fault", "froze"), "fault 'froze' is not known"), (("--geometry", "novint"), "geometry 'novint'")],
)
def test_the_command_refuses_what_it_does_not_know_in_a_line(path, words, message):
    with command("--socket", path, *words) as served:
        printed, said = served.communicate(timeout=PATIENCE_S)
    assert (served.returncode, printed) == (2, "")
    assert len(said.splitlines()) == 1
    assert message in said
    assert not path.exists()
