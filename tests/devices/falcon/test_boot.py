"""Loading the Falcon's firmware: messages, attempts and requests to the bridge, as reviewed texts."""

from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numba
import pytest
from hypothesis import given
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

from study_app.devices.emulators.falcon import EmulatedBackend
from study_app.devices.emulators.falcon_emulator import ALL_HOMED, Emulator
from study_app.devices.falcon import constants
from study_app.devices.falcon.boot import (
    KNOWN,
    PINGS,
    PROBE_S,
    boot_falcon,
    check_firmware,
    configure,
    is_running,
    measure_round_trip,
    set_event_character,
)
from study_app.devices.falcon.failures import usb_failure
from study_app.devices.falcon.transport import PyUsbTransport
from study_app.errors import DeviceError
from tests.devices.falcon.support.firmware_stream import stream, words
from tests.golden import compare

GOLDEN = Path(__file__).parent / "golden"


class Wrong(PyUsbTransport):
    """A bridge that disobeys.

    ``bauds`` it takes for others; ``fails`` when it writes; of the firmware's bytes it spoils number ``spoils``, and
    after ``ends`` pieces of it the mains adapter is out.
    """

    bauds: tuple[tuple[int, int], ...] = ()
    fails: Any = None
    spoils = ends = -1
    reopen_count = sent = pieces = 0

    def reopen(self) -> None:
        self.reopen_count += 1
        super().reopen()

    def control(self, request: int, value: int) -> None:
        if request == constants.REQUEST_BAUD:
            value = dict(self.bauds).get(value, value)
        super().control(request, value)

    def write(self, data: bytes, timeout_s: float) -> None:
        if self.fails is not None:
            raise self.fails
        if data not in (constants.PING, constants.AUTOBAUD):
            if self.sent <= self.spoils < self.sent + len(data):
                at = self.spoils - self.sent
                data = data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1 :]
            self.sent += len(data)
            self.pieces += 1
            if self.pieces == self.ends:
                self._backend.emulators[0].power(False)
        super().write(data, timeout_s)


def falcon(**options: Any) -> tuple[Emulator, Wrong]:
    """Return an emulated Falcon, just switched on, and a bridge to it."""
    emulator = Emulator(tremor_m=0.0, **options)
    return emulator, Wrong(EmulatedBackend(emulator))


def bridge(**kept: Any) -> Callable[[Emulator, Wrong], None]:
    def change(_emulator: Emulator, transport: Wrong) -> None:
        for name, value in kept.items():
            setattr(transport, name, value)

    return change


def faulty(*faults: str) -> Callable[[Emulator, Wrong], None]:
    return lambda emulator, _transport: [emulator.set_fault(fault) for fault in faults] and None


def unpowered(emulator: Emulator, _transport: Wrong) -> None:
    emulator.power(False)


def replies_wait(emulator: Emulator, transport: Wrong) -> None:
    """Five replies wait in the bridge; then it is switched off and on."""
    configure(transport)
    for _ in range(5):
        transport.write(constants.quiet_packet(), 0.1)
    transport.pause(0.01)
    emulator.power(False)
    emulator.power(True)


def ignored(count: int, emulator: Emulator, _transport: Wrong) -> None:
    emulator.faults.ignore_pings(count)


SEEN = ("leading-zero", "glued=1", "echo-prefix=1", "status-noise")
"""How Falcons were seen to answer."""
SPEEDS = (
    (constants.BAUD_9600, constants.BAUD_142857),
    (constants.BAUD_142857, constants.BAUD_9600),
    (constants.BAUD_142857, constants.BAUD_1500000),
    (constants.BAUD_1500000, constants.BAUD_142857),
)
SIZES = (1, 16, 300, 4000, (constants.CHUNK * 10 - 30) // 2)
"""Words of a program; the last piece is short, and whole."""
CASES: dict[str, tuple[Callable[[Emulator, Wrong], None], int, bytes]] = {
    **{f"{size} words": (faulty(), 1, stream(((0x3F8000, size),))) for size in SIZES},
    **{
        f"{count} pings are ignored": (partial(ignored, count), 1, stream())
        for count in (1, 3, PINGS - 1)
    },
    **{f"{first}, {second}": (faulty(first, second), 1, stream()) for first in SEEN for second in SEEN[:3]},
    "replies wait": (replies_wait, 1, stream()),
    "no mains adapter": (unpowered, 10, stream()),
    **{
        f"speed {requested:#x} is {actual:#x}": (bridge(bauds=((requested, actual),)), 2, stream())
        for requested, actual in SPEEDS
    },
    **{f"echo of byte {at}": (bridge(spoils=at), 1, stream()) for at in (0, 1, 61, 62, 500)},
    "echo spoilt once": (lambda emulator, _: emulator.faults.schedule("echo"), 10, stream()),
    "echo ends": (bridge(ends=3), 1, stream()),
    "says nothing": (lambda emulator, _: emulator.faults.chance("drop", 1.0), 1, stream()),
    "gone": (bridge(fails=usb_failure(constants.ERROR_NO_DEVICE, "sending")), 10, stream()),
    "takes no bytes": (bridge(fails=usb_failure(constants.ERROR_TIMEOUT, "sending")), 2, stream()),
}  # fmt: skip


def test_loading_the_program(pytestconfig: pytest.Config) -> None:
    lines = list[str]()
    for name, (happens, attempts, data) in CASES.items():
        emulator, transport = falcon(running=happens is replies_wait)
        happens(emulator, transport)
        emulator.recorded.clear()
        transport.reopen_count = 0
        lines.append(f"== {name}")
        try:
            lines.append(f"loaded {boot_falcon(transport, data, progress=lines.append, attempts=attempts).size} bytes")
        except DeviceError as failure:
            lines.append(f"{type(failure).__name__} {getattr(failure, 'step', '')}: {failure}")
        requests = " ".join(f"{request}:{value:#x}" for request, value in emulator.recorded[:40])
        lines.append(
            f"{emulator.loaded} loaded, running {emulator.running}, opened {transport.reopen_count}: {requests}"
        )
    compare(GOLDEN / "boot.txt", lines, pytestconfig)


@pytest.mark.parametrize(("fault", "kind"), [("busy", "busy"), ("unplugged", "not-found")])
def test_a_busy_or_missing_bridge_ends_the_attempts(fault: str, kind: str) -> None:
    emulator, transport = falcon()
    emulator.power(False)
    with pytest.raises(DeviceError) as caught:
        boot_falcon(transport, stream(), progress=lambda _line: emulator.faults.on(fault))
    assert getattr(caught.value, "kind", "") == kind


@pytest.mark.parametrize(("turned_on", "runs"), [((True,), True), ((False,), False), ((False, True), False)])
def test_only_a_loss_of_power_loses_the_program(turned_on: tuple[bool, ...], *, runs: bool) -> None:
    emulator = Emulator(running=True)
    for on in turned_on:
        emulator.power(on)
    assert (emulator.powered, emulator.running) == (turned_on[-1], runs)


@pytest.mark.parametrize("switched_off", [True, False])
def test_a_program_that_is_loaded_again_keeps_nothing_of_the_earlier_one(*, switched_off: bool) -> None:
    """The earlier program hangs for a minute in the middle of a packet and of the hand's motion."""
    emulator, transport = falcon(running=True)
    configure(transport)
    emulator.faults.set_durations(stall_s=60.0)
    emulator.faults.schedule("stall")
    transport.write(constants.quiet_packet(), 0.1)
    transport.pause(0.01)
    assert not is_running(transport)
    run = emulator.state.run
    run.held, run.homed, run.homing, run.lights, run.stroke = 5, 0b101, 1, constants.FLAG_RED, 2
    run.torque, run.acting, run.shown = (7, -8, 9), (70.0, -80.0, 90.0), (11, -12, 13)
    if switched_off:
        emulator.power(False)
        emulator.power(True)
    else:
        emulator.control(constants.REQUEST_BAUD, constants.BAUD_9600)
        for value in (constants.DTR_LOW, constants.DTR_HIGH):
            emulator.control(constants.REQUEST_MODEM, value)
    assert not emulator.running
    numbers = (int(run.held), emulator.homed, int(run.homing), emulator.lights, int(run.stroke))
    assert (numbers, emulator.torques, run.acting.tolist()) == ((0, 0, 0, 0, 0), (0, 0, 0), [0.0, 0.0, 0.0])
    assert run.shown.tolist() == [0, 0, 0]
    boot_falcon(transport, stream())
    configure(transport)
    assert is_running(transport)


def test_asking_whether_it_runs_does_not_undo_its_homing() -> None:
    emulator, transport = falcon(running=True)
    configure(transport)
    assert constants.REQUEST_MODEM not in Counter(request for request, _ in emulator.recorded)
    assert emulator.highest_torque == 0
    while emulator.homed != ALL_HOMED or emulator.moving:
        assert is_running(transport)
        transport.pause(0.002)
    transport.reopen()
    configure(transport)
    assert is_running(transport)
    assert emulator.homed == ALL_HOMED
    transport.write(constants.quiet_packet(), 0.1)
    transport.pause(0.01)
    emulator.power(False)
    configure(transport)
    assert not is_running(transport)  # a reply that waits does not make a dead Falcon run


def test_the_hand_pulls_a_homed_grip_again_for_each_program_that_claims_the_bridge() -> None:
    emulator, transport = falcon(running=True)
    configure(transport)

    def moves_in_second() -> list[bool]:
        """Return whether the hand moves after each of ten packets, 0.1 s apart."""
        moves = []
        for _ in range(10):
            assert is_running(transport)
            transport.pause(0.1)
            moves.append(emulator.moving)
        return moves

    assert any(moves_in_second() + moves_in_second() + moves_in_second())
    assert (emulator.homed, any(moves_in_second())) == (ALL_HOMED, False)
    transport.reopen()
    configure(transport)
    assert any(moves_in_second())


def test_the_event_character_and_the_timer_are_the_round_trip() -> None:
    emulator, transport = falcon(running=True)
    configure(transport)
    set_event_character(transport, on=True)
    hastened_s = measure_round_trip(transport)
    set_event_character(transport, on=False)
    plain_s = measure_round_trip(transport)
    assert 2 * 16 * 10 / 1.5e6 <= hastened_s < 0.5e-3
    assert 0.5e-3 < plain_s < 2.5e-3
    assert emulator.highest_torque == 0
    emulator.power(False)
    assert measure_round_trip(transport) == PROBE_S


STREAMS = {
    "whole": stream(),
    **{f"cut at {cut}": stream()[:cut] for cut in (1, 21, 22, 23, 24, 30, 59, 300, 622, 624, 642, -1)},
    **{f"followed by {more!r}": stream() + more for more in (b"\0", b"\0\0", b"more")},
    "empty": b"",
    "web page": b"<!DOCTYPE html>\n<html><body>404: Not Found</body></html>",
    "another web page": b"\n  <HTML><head>",
    "XML": b"<?xml version='1.0'?><Error><Code>AccessDenied</Code></Error>",
    "LFS": b"version https://git-lfs.github.com/spec/v1\noid sha256:1119\nsize 8492\n",
    "Intel hex": b":10000000AA080000000000000000000000000000AB\n:00000001FF\n",
    "xxd": b"00000000: aa08 0000 0000 0000 0000 0000 0000 0000  ................\n",
    "C": b"0xAA, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,\n",
    "hex": b"aa 08 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 3f 00\n",
    "swapped": stream(key=0xAA08),
    "another key": stream(key=0x1234),
    "program": b"MZ\x90\x00" + bytes(100),
    "reserved words": stream(reserved=(0, 0, 0, 5, 0, 0, 0, 0)),
    "no block": stream(()),
}


def test_firmware_files_are_described(pytestconfig: pytest.Config) -> None:
    lines = list[str]()
    for name, data in STREAMS.items():
        try:
            firmware = check_firmware(data)
        except DeviceError as failure:
            lines.append(f"{name}: {failure}")
        else:
            lines.append(f"{name}: {firmware.name} {firmware.size} {firmware.entry:#x} {firmware.blocks}")
    assert len(lines) == len("\n".join(lines).splitlines())
    compare(GOLDEN / "firmware.txt", lines, pytestconfig, exact=True)
    published = "1119e39c39fab1f37678ea62dfc715b23dd86ee7f13d78f88f707d9f09b896a1"
    assert KNOWN[published[:16], published[-8:]] == "nvent_firmware.bin"


@given(st.binary(max_size=300), st.integers(0, len(stream()) - 1), st.integers(0, 255))
def test_no_bytes_make_it_fail_otherwise(data: bytes, at: int, byte: int) -> None:
    spoilt = bytearray(stream())
    spoilt[at] = byte
    for candidate in (data, stream()[:22] + data, words(0x08AA) + data, bytes(spoilt)):
        try:
            firmware = check_firmware(candidate)
        except DeviceError:
            continue
        assert firmware.size == len(candidate)
        assert (firmware.sha256 == check_firmware(stream()).sha256) == (candidate == stream())
        assert sum(2 * block.words + 6 for block in firmware.blocks) == len(candidate) - 24
