"""The Falcon behind a Unix socket: bytes of the requests, errors of the server, and an emulated Falcon at its end."""

import json
import os
import signal
import socket
import threading

import pytest

if not hasattr(socket, "AF_UNIX"):
    pytest.skip("no Unix sockets here", allow_module_level=True)

from study_app.devices.falcon import constants
from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure
from tests.devices.falcon.served import bridge
from tests.devices.falcon.served.bridge import BULK_IN, BULK_OUT, CONTROL, DESCRIPTOR, SocketTransport
from tests.devices.falcon.support.bridges import Compiled, Server, both, compiled, warm


@pytest.fixture
def path(tmp_path):
    return tmp_path / "falcon"


@pytest.fixture
def server(path):
    with Server(path) as server:
        yield server


@pytest.fixture
def transport(server, path):
    one = SocketTransport(str(path))
    yield one
    one.close()


def test_opening_asks_who_is_there_and_closed_it_is_lost(server, path):
    transport = SocketTransport(str(path))
    assert isinstance(transport, SocketTransport)
    assert (transport.serial, transport.name) == ("FALC0001", str(path))
    assert server.heard == [bytes([4, 0, 0, 0, 0, 0, 0, 0])]
    transport.close()
    transport.close()
    with pytest.raises(FalconLost):
        transport.control(0, 0)
    transport.reopen()
    transport.control(0, 0)
    transport.close()


@pytest.mark.slow
@both
def test_a_request_is_eight_bytes_and_what_is_sent(server, transport, kind):
    way = kind(transport)
    server.heard.clear()
    server.incoming = [b"\x01\x60" + bytes(range(62)), b"\x01\x60"]
    transport.control(constants.REQUEST_BAUD, constants.BAUD_9600)
    way.write(b"abc", 0.3)
    assert way.read(1.0) == b"\x01\x60" + bytes(range(62))
    assert way.read(0.005) == b"\x01\x60"
    assert way.read() == b""
    assert server.heard[:4] == [
        bytes([1, 3, 0x38, 0x41, 0, 0, 0, 0]),
        bytes([2, 0x02, 0, 0, 3, 0, 0x2C, 0x01]) + b"abc",
        bytes([3, 0x81, 0, 0, 64, 0, 0xE8, 0x03]),
        bytes([3, 0x81, 0, 0, 64, 0, 5, 0]),
    ]
    with pytest.raises(ValueError, match="multiple of 64"):
        transport.read(16, 1.0)


@both
@pytest.mark.parametrize(("code", "word"), [(-4, "no-device"), (-9, "pipe"), (-1, "io"), (-8, "overflow")])
def test_the_servers_errors_are_ours(server, transport, kind, code, word):
    way = kind(transport)
    server.answers |= {BULK_IN: (code, b""), BULK_OUT: (code, b""), CONTROL: (code, b"")}
    for use in (way.read, lambda: way.write(b"abc"), lambda: transport.control(0, 0)):
        with pytest.raises(UsbFailure) as caught:
            use()
        assert (caught.value.kind, caught.value.code) == (word, code)


@both
def test_what_came_before_the_time_was_out_is_given(server, transport, kind):
    server.answers[BULK_IN] = (constants.ERROR_TIMEOUT, b"\x01\x60ab")
    assert kind(transport).read() == b"\x01\x60ab"


@both
@pytest.mark.parametrize("at", [BULK_IN, BULK_OUT])
def test_a_server_that_goes_is_a_falcon_lost(server, transport, kind, at):
    way = kind(transport)
    server.hang_up_at = at
    use = way.read if at == BULK_IN else lambda: way.write(b"abc")
    for _ in range(2):  # and stays lost: half an answer is in the stream
        with pytest.raises(FalconLost):
            use()


@compiled
def test_an_answer_longer_than_asked_for_does_not_leave_its_memory(server, transport):
    way = Compiled(transport)
    server.incoming = [bytes(200), b"\x01\x60next"]
    with pytest.raises(UsbFailure) as caught:
        way.read()
    assert caught.value.kind == "overflow"
    assert way.read() == b"\x01\x60next"


@both
def test_signals_do_not_cut_a_transfer(server, transport, kind):
    way = kind(transport)
    way.read()
    this_thread, answer, silent = threading.get_ident(), server.answer, threading.Event()

    def interrupted(kind):
        for _ in range(50):
            signal.pthread_kill(this_thread, signal.SIGUSR1)
            os.sched_yield()
        silent.set()
        return answer(kind)

    server.answer = interrupted
    server.incoming = [b"\x01\x60ok"]
    before = signal.signal(signal.SIGUSR1, lambda _signal, _frame: None)
    try:
        assert way.read() == b"\x01\x60ok"
    finally:
        assert silent.wait(30)
        signal.signal(signal.SIGUSR1, before)


@pytest.mark.slow
def test_an_answer_that_is_late_is_not_taken_for_the_next(server, path, monkeypatch):
    monkeypatch.setattr(bridge, "_GRACE_S", 0)
    monkeypatch.setattr(bridge, "LONGEST_TIMEOUT_MS", 1000)  # then an answer has a second
    transport = SocketTransport(str(path))
    answer, given_up = server.answer, threading.Event()
    server.answer = lambda kind: (given_up.wait(30), answer(kind))[1]
    with pytest.raises(FalconLost):
        transport.control(0, 0)
    given_up.set()
    with pytest.raises(FalconLost):
        transport.control(0, 0)


def test_nobody_something_or_somebody_else_is_there(path):
    with pytest.raises(FalconNotFound, match="connecting to"):
        SocketTransport(str(path))
    path.write_text("no socket")
    with pytest.raises(FalconNotFound, match="connecting to"):
        SocketTransport(str(path))
    path.unlink()
    with Server(path, product=0x6001), pytest.raises(FalconNotFound):
        SocketTransport(str(path))
    path.unlink()
    with Server(path) as server:
        server.answers[DESCRIPTOR] = (constants.ERROR_BUSY, b"")
        with pytest.raises(UsbFailure) as caught:
            SocketTransport(str(path))
        assert caught.value.kind == "busy"
        server.hang_up_at = DESCRIPTOR
        with pytest.raises(FalconLost):
            SocketTransport(str(path))


@pytest.mark.slow
@compiled
@pytest.mark.usefixtures("falcon_socket")
def test_an_emulated_falcon_is_booted_answers_and_runs_in_the_servo_through_its_socket(path, tmp_path):
    from study_app.devices.emulators.falcon_emulator import Emulator
    from study_app.devices.registry import open_device
    from study_app.haptics.runtime.clocks.clock import VirtualClock
    from study_app.haptics.runtime.servo import Servo
    from tests.devices.falcon.served.server import EmulatorServer
    from tests.devices.falcon.support.firmware_stream import stream

    firmware = tmp_path / "firmware.bin"
    firmware.write_bytes(stream())
    emulator = warm(Emulator(tremor_m=0.0, serial="S17"))
    with EmulatorServer(emulator, path):
        with open_device(f"falcon-socket:{path}", options={"firmware": firmware}) as device:
            described = device.describe()
            assert emulator.running
            with pytest.raises(UsbFailure) as caught:
                SocketTransport(str(path))
            assert caught.value.kind == "busy"
            servo = Servo(device, clock=VirtualClock())  # as fast as replies come: none is late for a busy machine
            touch = servo.telemetry.reader()
            assert servo.advance(500) == 500
            assert servo.fault is None
            assert touch.read()["fresh"].sum() > 400
            servo.stop()
        assert (described["name"], described["serial"]) == ("falcon-socket", "S17")
        assert 0.2 < described["round_trip_ms"]["with"] <= 50.0
        assert str(path) not in json.dumps(described)
        assert (emulator.torques, emulator.lights) == ((0, 0, 0), 0)
