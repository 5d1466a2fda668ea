"""Trigger codes as another program reads them from a port: a byte per event, then 0."""

import os
import select
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from study_app.errors import OutletError
from study_app.outlets.marker import CODES
from study_app.outlets.session_outlets import open_sink, sink_kinds
from study_app.outlets.sink import SinkThread
from study_app.outlets.sinks import parallel_port
from study_app.outlets.sinks.parallel_port import PPCLAIM, PPEXCL, PPRELEASE, PPWCONTROL, PPWDATA, ParallelPort
from study_app.outlets.trigger_pulse import HIGH_S, LOW_S, TriggerSink
from tests.outlets.sinks import marker


class Port:
    """A port that keeps what is written, and when [s]."""

    title, address = "Test port", "test:port"

    def __init__(self) -> None:
        self.written: list[tuple[int, float]] = []
        self.closed = False

    def write(self, byte: int) -> None:
        self.written.append((byte, time.monotonic()))

    def close(self) -> None:
        self.closed = True


def test_an_event_is_a_pulse_of_its_code_and_two_are_two_pulses() -> None:
    port = Port()
    sink = TriggerSink(port, time.monotonic_ns)
    for event in ("trial_started", "target_reached", "force_stopped"):
        sink.send(marker(event=event))
    assert [byte for byte, _ in port.written] == [0, CODES["trial_started"], 0, CODES["force_stopped"], 0]
    times = [at for _, at in port.written]
    assert times[2] - times[1] >= HIGH_S
    assert times[3] - times[2] >= LOW_S
    assert times[4] - times[3] >= HIGH_S


def test_the_delay_of_each_code_is_kept() -> None:
    sink = TriggerSink(Port(), lambda: 1_000_250_000)
    sink.send(marker(time_s=1.0))
    assert sink.delays_ns == [250_000]


def test_the_receipt_has_the_table_of_codes() -> None:
    described = TriggerSink(Port(), time.monotonic_ns).described
    assert described == {"address": "test:port", "high_ms": 10.0, "codes": dict(CODES)}


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no virtual ports")
class TestSerial:
    @pytest.fixture
    def pair(self) -> object:
        pytest.importorskip("serial", reason="pyserial is not installed: pip install 'liquid-study[triggers]'")
        import tty

        ours, theirs = os.openpty()
        tty.setraw(theirs)
        yield ours, os.ttyname(theirs)
        for file in (ours, theirs):
            os.close(file)

    def test_a_reader_of_the_other_end_gets_the_bytes(self, pair: tuple[int, str]) -> None:
        import termios

        ours, name = pair
        thread = SinkThread(open_sink(f"serial:{name}@9600", time.monotonic_ns))
        assert termios.tcgetattr(ours)[4:6] == [termios.B9600, termios.B9600]
        for event in ("trial_started", "interval_started", "responses", "trial_ended"):
            thread.mark(marker(event=event))
        thread.close(5)
        sent = bytes([0, 10, 0, 20, 0, 31, 0, 11, 0])
        came = b""
        while len(came) < len(sent):  # the kernel hands the last byte over a moment later
            assert select.select([ours], [], [], 5.0)[0], came
            came += os.read(ours, 64)
        assert came == sent
        assert thread.lost == ""
        assert thread.sink.title == "Serial port"
        assert thread.sink.described["address"] == f"serial:{name}@9600"

    def test_an_adapter_that_is_unplugged_is_lost_in_a_line(self, tmp_path: Path) -> None:
        pytest.importorskip("serial", reason="pyserial is not installed")
        import tty

        ours, theirs = os.openpty()
        tty.setraw(theirs)
        name = os.ttyname(theirs)
        thread = SinkThread(open_sink(f"serial:{name}", time.monotonic_ns))
        os.close(ours)
        thread.mark(marker())
        thread.close(5)
        os.close(theirs)
        assert thread.lost.startswith(f"serial:{name} failed: ")
        assert "\n" not in thread.lost

    def test_a_reader_that_stops_reading_is_lost_in_a_line(self, pair: tuple[int, str]) -> None:
        _, name = pair
        thread = SinkThread(open_sink(f"serial:{name}", time.monotonic_ns))
        full = os.open(name, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
        for _ in range(5):  # the kernel makes room for some more meanwhile
            with suppress(BlockingIOError):
                while os.write(full, bytes(4096)):
                    pass
            time.sleep(0.05)
        os.close(full)
        thread.mark(marker())
        thread.mark(marker(2))
        thread.close(5)
        assert thread.lost == f"serial:{name} failed: Write timeout"

    def test_a_port_that_is_not_there_is_named(self, tmp_path: Path) -> None:
        pytest.importorskip("serial", reason="pyserial is not installed")
        with pytest.raises(OutletError, match=r"^serial:/nowhere/ttyUSB7 cannot be opened: No such file or directory$"):
            open_sink("serial:/nowhere/ttyUSB7", time.monotonic_ns)

    @pytest.mark.parametrize("place", ["", "@9600", "/dev/ttyUSB0@fast"])
    def test_an_address_that_is_none_is_refused(self, place: str) -> None:
        pytest.importorskip("serial", reason="pyserial is not installed")
        with pytest.raises(OutletError, match="write serial:NAME or serial:NAME@BAUD"):
            open_sink(f"serial:{place}", time.monotonic_ns)


def test_an_unknown_kind_is_refused_with_examples() -> None:
    with pytest.raises(OutletError, match="'usb:1' is not an address of markers: use one like lsl, parallel:/dev/par"):
        open_sink("usb:1", time.monotonic_ns)
    assert set(sink_kinds()) == {"lsl", "serial", "parallel"}


def test_without_the_extra_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(OutletError, match=r"pip install 'liquid-study\[triggers\]'"):
        open_sink("serial:/dev/ttyUSB0", time.monotonic_ns)
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(OutletError, match=r"pip install 'liquid-study\[lsl\]'"):
        open_sink("lsl", time.monotonic_ns)


class Ioctl:
    """The calls that a parallel port gets; fails at a request."""

    def __init__(self, fails_at: int = 0) -> None:
        self.calls: list[tuple[int, ...]] = []
        self.fails_at = fails_at

    def __call__(self, _file: int, request: int, *value: bytes) -> None:
        if request == self.fails_at:
            raise OSError(6, "No such device or address")
        self.calls.append((request, *(one[0] for one in value)))


@pytest.fixture
def parport(tmp_path: Path) -> str:
    path = tmp_path / "parport0"
    path.write_bytes(b"")
    return str(path)


def test_a_parallel_port_sets_the_lines_before_the_strobe(parport: str) -> None:
    ioctl = Ioctl()
    port = ParallelPort(parport, ioctl)
    TriggerSink(port, time.monotonic_ns).send(marker(event="responses"))
    port.close()
    assert ioctl.calls == [
        (PPEXCL,),
        (PPCLAIM,),
        (PPWDATA, 0),
        (PPWDATA, 31),
        (PPWCONTROL, 1),
        (PPWCONTROL, 0),
        (PPWDATA, 0),
        (PPRELEASE,),
    ]


@pytest.mark.parametrize("fails_at", [PPCLAIM, PPWDATA])
def test_a_parallel_port_that_does_not_answer_is_named(parport: str, fails_at: int) -> None:
    with pytest.raises(OutletError, match=f"parallel:{parport} failed: No such device or address; is another"):
        ParallelPort(parport, Ioctl(fails_at)).write(1)


def test_a_parallel_port_that_accepts_no_byte_is_released(parport: str) -> None:
    ioctl = Ioctl(PPWDATA)
    with pytest.raises(OutletError, match="failed: No such device"):
        TriggerSink(ParallelPort(parport, ioctl), time.monotonic_ns)
    assert ioctl.calls[-1] == (PPRELEASE,)


def test_a_parallel_port_that_is_not_there_is_named() -> None:
    with pytest.raises(OutletError, match="parallel:/nowhere/parport0 cannot be opened: No such file"):
        ParallelPort("/nowhere/parport0", Ioctl())


@pytest.mark.skipif(sys.platform != "linux", reason="ppdev is Linux's")
def test_the_requests_are_those_of_the_kernel_header() -> None:
    header = Path("/usr/include/linux/ppdev.h")
    if not header.is_file():
        pytest.skip("the kernel's headers are not installed")
    text = header.read_text(encoding="utf-8")
    for name, number in (("PPCLAIM", 0x8B), ("PPRELEASE", 0x8C), ("PPEXCL", 0x8F)):
        assert f"#define {name}" in text
        assert f"_IO(PP_IOCTL, {number:#x})" in text
        assert getattr(parallel_port, name) == 0x7000 | number
    for name, number in (("PPWDATA", 0x86), ("PPWCONTROL", 0x84)):
        assert f"#define {name}\t\t_IOW(PP_IOCTL, {number:#x}, unsigned char)" in text.replace("L\t_IOW", "L\t\t_IOW")
        assert getattr(parallel_port, name) == 0x40017000 | number
