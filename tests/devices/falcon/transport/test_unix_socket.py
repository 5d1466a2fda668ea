import os
import signal
import socket
import struct
import threading

import numpy as np
import pytest

if not hasattr(socket, "AF_UNIX"):
    pytest.skip("no Unix sockets here", allow_module_level=True)

from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure
from study_app.devices.falcon.transport import unix_socket
from study_app.devices.falcon.transport.socket_frames import BULK_IN, BULK_OUT, CONTROL, DESCRIPTOR
from study_app.devices.falcon.transport.transport import open_transport
from study_app.devices.falcon.transport.unix_socket import SocketTransport
from study_app.devices.falcon.wire import constants
from tests.devices.falcon.support.bridges import Compiled, Server, both, compiled, warm


@pytest.fixture
def path(tmp_path):
    return tmp_path / "falcon"


@pytest.fixture
def server(path):
    with Server(path) as server:
        yield server


def test_opening_asks_who_is_there(server, path):
    transport = open_transport(f"falcon-socket:{path}")
    assert isinstance(transport, SocketTransport)
    assert (transport.serial, transport.name) == ("FALC0001", f"falcon-socket:{path}")
    assert server.requests == [(DESCRIPTOR, 0, 0, 0, 0, b"")]
    transport.close()
    transport.close()
    with pytest.raises(FalconLost):
        transport.control(0, 0)
    transport.reopen()
    transport.control(0, 0)
    transport.close()


def test_a_request_is_eight_bytes_and_what_is_sent(path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
        listener.bind(str(path))
        listener.listen()
        said = {}

        def serve():
            client, _ = listener.accept()
            with client, client.makefile("rb") as stream:
                for name, size, answer in (
                    ("descriptor", 8, struct.pack("<iIHH", 0, 6, 0x0403, 0xCB48) + b"N7"),
                    ("control", 8, struct.pack("<iI", 0, 0)),
                    ("out", 11, struct.pack("<iI", 0, 0)),
                    ("in", 8, struct.pack("<iI", 0, 3) + b"\x01\x60!"),
                ):
                    said[name] = stream.read(size)
                    client.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        transport = SocketTransport(str(path))
        transport.control(constants.REQUEST_BAUD, constants.BAUD_9600)
        transport.write(b"abc", 0.3)
        assert transport.read(128, 1.0) == b"\x01\x60!"
        transport.close()
        thread.join()
    assert transport.serial == "N7"
    assert said == {
        "descriptor": bytes([4, 0, 0, 0, 0, 0, 0, 0]),
        "control": bytes([1, 3, 0x38, 0x41, 0, 0, 0, 0]),
        "out": bytes([2, 0x02, 0, 0, 3, 0, 0x2C, 0x01]) + b"abc",
        "in": bytes([3, 0x81, 0, 0, 128, 0, 0xE8, 0x03]),
    }


@pytest.mark.slow
@both
def test_transfers_go_through(server, path, kind):
    transport = SocketTransport(str(path))
    way = kind(transport)
    way.write(constants.quiet_packet(), 0.02)
    assert server.requests[-1] == (BULK_OUT, constants.ENDPOINT_OUT, 0, 16, 20, constants.quiet_packet())
    server.incoming = [b"\x01\x60" + bytes(range(62)), b"\x01\x60"]
    assert way.read(0.005) == b"\x01\x60" + bytes(range(62))
    assert server.requests[-1] == (BULK_IN, constants.ENDPOINT_IN, 0, 64, 5, b"")
    assert way.read() == b"\x01\x60"
    assert way.read() == b""
    transport.close()


@both
@pytest.mark.parametrize(("code", "word"), [(-4, "no-device"), (-9, "pipe"), (-1, "io"), (-8, "overflow")])
def test_the_servers_errors_are_ours(server, path, kind, code, word):
    transport = SocketTransport(str(path))
    way = kind(transport)
    server.answers |= {BULK_IN: (code, b""), BULK_OUT: (code, b""), CONTROL: (code, b"")}
    for use in (way.read, lambda: way.write(b"abc"), lambda: transport.control(0, 0)):
        with pytest.raises(UsbFailure) as caught:
            use()
        assert (caught.value.kind, caught.value.code) == (word, code)
    transport.close()


@both
def test_what_came_before_the_time_was_out_is_given(server, path, kind):
    transport = SocketTransport(str(path))
    server.answers[BULK_IN] = (constants.ERROR_TIMEOUT, b"\x01\x60ab")
    assert kind(transport).read() == b"\x01\x60ab"
    transport.close()


@both
@pytest.mark.parametrize("at", [BULK_IN, BULK_OUT])
def test_a_server_that_goes_is_a_falcon_lost(server, path, kind, at):
    transport = SocketTransport(str(path))
    way = kind(transport)
    server.hang_up_at = at
    use = way.read if at == BULK_IN else lambda: way.write(b"abc")
    for _ in range(2):  # and stays lost: half an answer is in the stream
        with pytest.raises(FalconLost):
            use()
    transport.close()


@compiled
def test_an_answer_longer_than_asked_for_does_not_leave_its_memory(server, path):
    transport = SocketTransport(str(path))
    way = Compiled(transport)
    server.incoming = [bytes(200), b"\x01\x60next"]
    with pytest.raises(UsbFailure) as caught:
        way.read()
    assert caught.value.kind == "overflow"
    assert way.read() == b"\x01\x60next"
    transport.close()


@both
def test_signals_do_not_cut_a_transfer(server, path, kind):
    transport = SocketTransport(str(path))
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
    transport.close()


@pytest.mark.slow
def test_an_answer_that_is_late_is_not_taken_for_the_next(server, path, monkeypatch):
    monkeypatch.setattr(unix_socket, "_GRACE_S", 0)
    monkeypatch.setattr(unix_socket, "LONGEST_TIMEOUT_MS", 1000)  # then an answer has a second
    transport = SocketTransport(str(path))
    answer, given_up = server.answer, threading.Event()
    server.answer = lambda kind: (given_up.wait(30), answer(kind))[1]
    with pytest.raises(FalconLost):
        transport.control(0, 0)
    given_up.set()
    with pytest.raises(FalconLost):
        transport.control(0, 0)


def test_nobody_there(path):
    with pytest.raises(FalconNotFound, match="connecting to"):
        SocketTransport(str(path))
    path.write_text("no socket")
    with pytest.raises(FalconNotFound, match="connecting to"):
        SocketTransport(str(path))


def test_somebody_else_is_there(server, path):
    server.answers[DESCRIPTOR] = (constants.ERROR_BUSY, b"")
    with pytest.raises(UsbFailure) as caught:
        SocketTransport(str(path))
    assert caught.value.kind == "busy"


def test_something_else_is_there(path):
    with Server(path, product=0x6001), pytest.raises(FalconNotFound):
        SocketTransport(str(path))


def test_a_server_that_goes_while_asked_who_it_is(server, path):
    server.hang_up_at = DESCRIPTOR
    with pytest.raises(FalconLost):
        SocketTransport(str(path))


@compiled
def test_the_records_are_the_framing():
    from study_app.devices.falcon.transport.socket_bulk import CONNECTION
    from study_app.devices.falcon.transport.socket_frames import ANSWER, REQUEST

    record = np.zeros(1, CONNECTION["request"])
    record[0] = (2, 0x81, 0x1234, 0x5678, 0x9ABC)
    assert record.tobytes() == REQUEST.pack(2, 0x81, 0x1234, 0x5678, 0x9ABC)
    answer = np.zeros(1, CONNECTION["answer"])
    answer[0] = (-4, 7)
    assert answer.tobytes() == ANSWER.pack(-4, 7)


def test_a_read_of_other_than_whole_packets_is_refused(server, path):
    transport = SocketTransport(str(path))
    with pytest.raises(ValueError, match="multiple of 64"):
        transport.read(16, 1.0)
    transport.close()


@pytest.mark.slow
@compiled
def test_an_emulated_falcon_is_booted_and_answers_through_its_socket(path):
    from study_app.devices.falcon.boot import boot, configure, is_running, measure_round_trip, set_event_character
    from study_app.devices.falcon.emulator.emulator import Emulator
    from study_app.devices.falcon.emulator.socket_server import EmulatorServer
    from tests.devices.falcon.support.firmware_stream import stream

    emulator = warm(Emulator(tremor_m=0.0, serial="S17"))
    with EmulatorServer(emulator, path):
        transport = open_transport(f"falcon-socket:{path}")
        assert transport.serial == "S17"
        boot(transport, stream())
        assert emulator.running
        transport.reopen()
        configure(transport)
        assert is_running(transport)
        set_event_character(transport, on=True)
        assert 2 * 16 * 10 / 1.5e6 < measure_round_trip(transport) <= 0.05
        way = Compiled(transport)
        way.write(constants.quiet_packet())
        came = b""
        while len(came) < constants.PACKET:
            came += way.read(0.1)[constants.STATUS_BYTES :]
        assert (came[0], came[-1]) == (constants.START, constants.STOP)
        with pytest.raises(UsbFailure) as caught:
            SocketTransport(str(path))
        assert caught.value.kind == "busy"
        transport.close()
