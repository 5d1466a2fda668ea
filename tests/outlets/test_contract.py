"""Every kind of outlet: what the other end gets of a session's events, and how each is refused, lost and closed."""

import itertools
import json
import os
import re
import select
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from study_app.errors import OutletError
from study_app.outlets import sinks
from study_app.outlets.markers import CODES, HIGH_S, LOW_S, SinkThread, TriggerSink
from study_app.outlets.session_outlets import SINKS, is_port, open_sink, port_examples
from study_app.outlets.sinks import PPCLAIM, PPEXCL, PPRELEASE, PPWCONTROL, PPWDATA, ParallelPort
from tests.outlets.sinks import Recorder, marker
from tests.platforms import needs_posix

EVENTS = ("trial_started", "interval_started", "responses", "trial_ended")
PULSES = [0, 10, 0, 20, 0, 31, 0, 11, 0]


class Ioctl:
    """The calls that a parallel port gets; fails at a request."""

    def __init__(self, fails_at: int = 0) -> None:
        self.calls: list[tuple[int, ...]] = []
        self.fails_at = fails_at

    def __call__(self, _file: int, request: int, *value: bytes) -> None:
        if request == self.fails_at:
            raise OSError(6, "No such device or address")
        self.calls.append((request, *(element[0] for element in value)))


@pytest.fixture
def parport(tmp_path: Path) -> str:
    path = tmp_path / "parport0"
    path.write_bytes(b"")
    return str(path)


@contextmanager
def pseudo_terminal() -> Iterator[tuple[int, str]]:
    """Yield the other end of a serial port, and its name."""
    pytest.importorskip("serial", reason="pyserial is not installed: pip install 'liquid-study[triggers]'")
    if not hasattr(os, "openpty"):
        pytest.skip("this system has no virtual ports")
    import tty

    ours, theirs = os.openpty()
    tty.setraw(theirs)
    yield ours, os.ttyname(theirs)
    for file in (ours, theirs):
        with suppress(OSError):  # a test closed it
            os.close(file)


@contextmanager
def serial(_parport: str) -> Iterator[tuple[Any, str, Callable[[], list[int]]]]:
    import termios

    with pseudo_terminal() as (ours, name):

        def received() -> list[int]:
            came = b""
            while len(came) < len(PULSES):  # the kernel hands the last byte over a moment later
                assert select.select([ours], [], [], 5.0)[0], came
                came += os.read(ours, 64)
            return list(came)

        sink = open_sink(f"serial:{name}@9600", time.perf_counter_ns)
        assert termios.tcgetattr(ours)[4:6] == [termios.B9600, termios.B9600]
        yield sink, f"serial:{name}@9600", received


@contextmanager
def parallel(parport: str) -> Iterator[tuple[Any, str, Callable[[], list[int]]]]:
    ioctl = Ioctl()
    sink = TriggerSink(ParallelPort(parport, ioctl), time.perf_counter_ns)

    def received() -> list[int]:
        """Return the data lines at each strobe; check that they are set before it."""
        assert ioctl.calls[:2] == [(PPEXCL,), (PPCLAIM,)]
        assert ioctl.calls[-1] == (PPRELEASE,)
        calls = ioctl.calls[2:-1]
        strobed = [calls[at : at + 3] for at, call in enumerate(calls) if call[0] == PPWDATA and call[1]]
        assert all(after == [(PPWCONTROL, 1), (PPWCONTROL, 0)] for _, *after in strobed)
        return [call[1] for call in calls if call[0] == PPWDATA]

    yield sink, f"parallel:{parport}", received


@contextmanager
def lsl(_parport: str) -> Iterator[tuple[Any, str, Callable[[], list[int]]]]:
    pytest.importorskip("pylsl", reason="pylsl is not installed: pip install 'liquid-study[lsl]'")
    sink = open_sink("lsl", time.perf_counter_ns)
    assert sink.listens is False
    recorder = Recorder("liquid-study markers", len(EVENTS))
    assert sink.listens is True

    def received() -> list[int]:
        codes = [json.loads(texts[0])["trigger"] for texts, _ in recorder.found()["samples"]]
        return [0, *(part for code in codes for part in (code, 0))]

    yield sink, "lsl", received


KINDS = {"serial": serial, "parallel": parallel, "lsl": lsl}


def test_every_kind_is_tried_here() -> None:
    assert set(SINKS) == set(KINDS)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_receiver_gets_every_event_in_order(kind: str, parport: str) -> None:
    with KINDS[kind](parport) as (sink, address, received):
        thread = SinkThread(sink)
        for event in EVENTS:
            thread.mark(marker(event=event))
        description = json.loads(json.dumps(dict(thread.sink.described)))
        thread.close(5)  # the receiver still gets the last events
        assert received() == PULSES
        if kind != "lsl":
            assert description == {"address": address, "high_ms": 10.0, "codes": dict(CODES)}
        assert thread.lost == ""
        assert thread.sink.title in {"Serial port", "Parallel port", "LSL markers"}


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("serial:/nowhere/ttyUSB7", r"^serial:/nowhere/ttyUSB7 cannot be opened: [^()]+$"),
        ("serial:", "write serial:NAME or serial:NAME@BAUD"),
        ("serial:@9600", "write serial:NAME or serial:NAME@BAUD"),
        ("serial:/dev/ttyUSB0@fast", "write serial:NAME or serial:NAME@BAUD"),
        pytest.param(
            "serial:/dev/ptmx@99999999999999999999", "^serial:/dev/ptmx@9+ cannot be opened: ", marks=needs_posix
        ),
        ("parallel:/dev/\0x", r"^'parallel:/dev/\\x00x' is not a marker address: "),
        pytest.param("parallel:/nowhere/parport0", "parallel:/nowhere/parport0 cannot be opened: ", marks=needs_posix),
        ("usb:1", "'usb:1' is not a marker address: use one such as lsl, parallel:/dev/par"),
    ],
)
def test_an_address_without_a_server_is_refused_in_one_line(address: str, words: str) -> None:
    if address.startswith("serial"):
        pytest.importorskip("serial", reason="pyserial is not installed")
    with pytest.raises(OutletError, match=words) as error:
        open_sink(address, time.perf_counter_ns)
    assert "\n" not in str(error.value)


def test_a_port_has_a_kind_with_places_and_a_place() -> None:
    ports = [True, True, True, False, False, False, False, False, False]
    addresses = ["serial:COM3", "parallel:/dev/parport1", "serial:COM3@9600", "serial:", "serial", "lsl", "lsl:x"]
    assert [is_port(address) for address in (*addresses, "usb:1", "serial:COM\n3")] == ports
    assert port_examples() == ("parallel:/dev/parport0", "serial:/dev/ttyUSB0")


def test_a_serial_port_that_is_missing_on_windows_is_said_in_its_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """There, pyserial's exception has the text of the system's error instead of its number."""
    serial = pytest.importorskip("serial", reason="pyserial is not installed")
    message = "could not open port 'COM9': FileNotFoundError(2, 'The system cannot find the file specified.', None, 2)"
    monkeypatch.setattr(serial, "Serial", mock.Mock(side_effect=serial.SerialException(message)))
    with pytest.raises(OutletError) as error:
        open_sink("serial:COM9", time.perf_counter_ns)
    assert str(error.value) == "serial:COM9 cannot be opened: The system cannot find the file specified"


def test_each_byte_has_left_the_serial_port_before_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    serial = pytest.importorskip("serial", reason="pyserial is not installed")
    monkeypatch.setattr(serial, "Serial", mock.Mock())
    sink = open_sink("serial:COM9@57600", time.perf_counter_ns)
    assert (serial.Serial.call_args.args, serial.Serial.call_args.kwargs) == (("COM9", 57600), {"write_timeout": 0.5})
    sink.send(marker(event="responses"))
    sink.close()
    sent = [step for byte in (0, 31, 0) for step in (mock.call.write(bytes([byte])), mock.call.flush())]
    assert serial.Serial.return_value.mock_calls == [*sent, mock.call.close()]
    open_sink("serial:COM9", time.perf_counter_ns)
    assert serial.Serial.call_args.args == ("COM9", 115_200)


@pytest.mark.parametrize(
    ("module", "address", "extra"), [("serial", "serial:/dev/ttyUSB0", "triggers"), ("pylsl", "lsl", "lsl")]
)
def test_the_message_names_the_missing_extra(
    module: str, address: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(OutletError, match=rf"pip install 'liquid-study\[{extra}\]'"):
        open_sink(address, time.perf_counter_ns)


@pytest.mark.parametrize("how", ["unplugged", "not read"])
def test_a_serial_port_that_fails_is_lost_in_a_line(how: str) -> None:
    with pseudo_terminal() as (ours, name):
        thread = SinkThread(open_sink(f"serial:{name}", time.perf_counter_ns))
        if how == "unplugged":
            os.close(ours)
        else:
            full = os.open(name, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
            for _ in range(5):  # the kernel makes room for some more meanwhile
                with suppress(BlockingIOError):
                    while os.write(full, bytes(4096)):
                        pass
                time.sleep(0.05)
            os.close(full)
        for trial in (1, 2):
            thread.mark(marker(trial))
        thread.close(5)
        assert thread.lost.startswith(f"serial:{name} failed: ")
        assert how == "unplugged" or thread.lost.endswith(" failed: Write timeout")
        assert "\n" not in thread.lost


@pytest.mark.parametrize("fails_at", [PPCLAIM, PPWDATA])
def test_a_parallel_port_that_does_not_answer_is_named_and_released(parport: str, fails_at: int) -> None:
    ioctl = Ioctl(fails_at)
    with pytest.raises(OutletError, match=re.escape(f"parallel:{parport} failed: ")):
        TriggerSink(ParallelPort(parport, ioctl), time.perf_counter_ns)
    assert fails_at == PPCLAIM or ioctl.calls[-1] == (PPRELEASE,)


def test_an_event_is_a_pulse_of_its_code_for_long_enough_and_its_delay_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    steps = itertools.count()
    monkeypatch.setattr("time.monotonic", lambda: 0.0156 * next(steps))  # on Windows, each reading after a step

    class Port:
        title, address = "Test port", "test:port"

        def __init__(self) -> None:
            self.written: list[tuple[int, float]] = []

        def write(self, byte: int) -> None:
            self.written.append((byte, time.perf_counter()))

        def close(self) -> None:
            """Do nothing."""

    port = Port()
    sink = TriggerSink(port, lambda: 1_000_250_000)
    for event in ("trial_started", "target_reached", "force_stopped"):
        sink.send(marker(event=event, time_s=1.0))
    assert [byte for byte, _ in port.written] == [0, CODES["trial_started"], 0, CODES["force_stopped"], 0]
    times = [at for _, at in port.written]
    assert times[2] - times[1] >= HIGH_S
    assert times[3] - times[2] >= LOW_S
    assert times[4] - times[3] >= HIGH_S
    assert sink.delays_ns == [250_000, 250_000]


@pytest.mark.skipif(sys.platform != "linux", reason="ppdev is Linux's")
def test_the_requests_are_those_of_the_kernel_header() -> None:
    header = Path("/usr/include/linux/ppdev.h")
    if not header.is_file():
        pytest.skip("the kernel's headers are not installed")
    text = " ".join(header.read_text(encoding="utf-8").split())
    for name, number in (("PPCLAIM", 0x8B), ("PPRELEASE", 0x8C), ("PPEXCL", 0x8F)):
        assert f"#define {name} _IO(PP_IOCTL, {number:#x})" in text
        assert getattr(sinks, name) == 0x7000 | number
    for name, number in (("PPWDATA", 0x86), ("PPWCONTROL", 0x84)):
        assert f"#define {name} _IOW(PP_IOCTL, {number:#x}, unsigned char)" in text
        assert getattr(sinks, name) == 0x40017000 | number
