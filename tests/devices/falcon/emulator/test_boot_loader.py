"""The emulated boot loader: what it takes, and its silence about everything else."""

import struct

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

from study_app.devices.falcon.wire import constants
from tests.devices.falcon.support.emulated_falcon import exchanged, still, stripped


def words(*values):
    return struct.pack(f"<{len(values)}H", *values)


def stream(blocks=(300, 7, 1), key=constants.BOOT_KEY):
    """Return a boot stream as a linker makes it: zeros and counted blocks."""
    body = b"".join(words(size, 0x003F, 0x8000, *((31 * k) & 0xFFFF for k in range(size))) for size in blocks)
    return words(key, *[0] * 8, 0x003F, 0x8002) + body + words(0)


def armed(emulator=None):
    """Return a Falcon that was reset by DTR at 9600 baud."""
    emulator = emulator if emulator is not None else still()
    emulator.control(constants.REQUEST_LATENCY, constants.LATENCY_BOOT_MS)
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_9600)
    for request in (constants.RTS_LOW, constants.DTR_LOW, constants.DTR_HIGH):
        emulator.control(constants.REQUEST_MODEM, request)
    return emulator


def said(emulator, data, seconds=0.1):
    """Send bytes; return all that comes back meanwhile."""
    emulator.write(data, 1000)
    emulator.pause(seconds)
    heard = b""
    while len(status := emulator.read(512, 100)[1]) > 2:
        heard += stripped(status)
    return heard


def timed(emulator):
    """Take it to the loader: ping, then 'A' at the next speed."""
    assert said(emulator, constants.PING) == constants.PONG
    emulator.control(constants.REQUEST_MODEM, constants.DTR_LOW)
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_142857)
    assert said(emulator, constants.AUTOBAUD) == constants.AUTOBAUD
    return emulator


def upload(emulator, data):
    """Send a stream in chunks; return its echo."""
    return b"".join(said(emulator, data[k : k + 62], 0.005) for k in range(0, len(data), 62))


def runs(emulator):
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_1500000)
    emulator.control(constants.REQUEST_LATENCY, constants.LATENCY_RUN_MS)
    return len(exchanged(emulator)) == 16


def test_a_stream_is_echoed_and_runs_after_its_last_word():
    emulator = timed(armed())
    data = stream()
    assert upload(emulator, data[:-2]) == data[:-2]
    assert not emulator.running
    assert said(emulator, data[-2:]) == data[-2:]
    assert emulator.running
    assert emulator.loaded == len(data)
    assert runs(emulator)


def test_uploading_takes_as_long_as_the_bits_do():
    emulator = timed(armed())
    data = stream((4000,))
    began_ns = emulator.now_ns
    echo = b""
    for k in range(0, len(data), 62):
        emulator.write(data[k : k + 62], 1000)
        chunk = b""
        while len(chunk) < len(data[k : k + 62]):
            chunk += stripped(emulator.read(64, 1000)[1])
        echo += chunk
    assert echo == data
    wire_s = len(data) * 10 / (3e6 / 21)
    assert wire_s < (emulator.now_ns - began_ns) * 1e-9 < 1.2 * wire_s


def test_before_its_reset_it_hears_no_ping():
    emulator = still()
    assert said(emulator, constants.PING) == b""


@pytest.mark.parametrize("divisor", [constants.BAUD_142857, constants.BAUD_1500000])
def test_a_ping_at_another_speed_is_not_understood(divisor):
    emulator = armed()
    emulator.control(constants.REQUEST_BAUD, divisor)
    assert said(emulator, constants.PING) == b""


def test_an_edge_of_dtr_at_another_speed_resets_nothing():
    emulator = still()
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_142857)
    emulator.control(constants.REQUEST_MODEM, constants.DTR_HIGH)
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_9600)
    assert said(emulator, constants.PING) == b""


def test_a_ping_is_found_among_other_bytes_and_may_be_ignored_at_first():
    emulator = armed()
    emulator.faults.ignore_pings(2)
    assert said(emulator, constants.PING) == b""
    assert said(emulator, b"\x0a\x0a\x43" + constants.PING) == b""
    assert said(emulator, b"\xff\x0a" + constants.PING) == constants.PONG


@pytest.mark.parametrize(
    ("fault", "pong"), [("leading-zero", b"\0" + constants.PONG), ("glued=1", constants.PONG + b"\x00\x0d")]
)
def test_answers_to_a_ping_come_in_variants(fault, pong):
    emulator = armed()
    emulator.take(fault)
    assert said(emulator, constants.PING) == pong


def test_the_echo_of_a_may_have_a_byte_before_it():
    emulator = armed()
    emulator.faults.once("echo_prefix")
    said(emulator, constants.PING)
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_142857)
    assert said(emulator, constants.AUTOBAUD) == b"\x13A"


def test_bytes_before_and_behind_answers_come_by_chance():
    emulator = still()
    emulator.take("glued=0.5")
    emulator.take("echo-prefix=0.5")
    for _ in range(60):
        armed(emulator)
        said(emulator, constants.PING)
        emulator.control(constants.REQUEST_BAUD, constants.BAUD_142857)
        said(emulator, constants.AUTOBAUD)
    assert 15 < emulator.faults.happened("glued") < 45
    assert 15 < emulator.faults.happened("echo_prefix") < 45


def test_a_byte_may_be_echoed_wrongly():
    emulator = timed(armed())
    emulator.faults.once("echo")
    data = stream()
    echo = upload(emulator, data)
    assert [k for k, (a, b) in enumerate(zip(data, echo, strict=True)) if a != b] == [0]
    assert emulator.faults.happened("echo") == 1


def test_a_wrong_key_is_met_with_silence_until_it_is_reset():
    emulator = timed(armed())
    wrong = stream(key=0x08AB)
    assert upload(emulator, wrong) == wrong[:2]
    assert said(emulator, constants.AUTOBAUD) == b""
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_9600)
    emulator.control(constants.REQUEST_MODEM, constants.DTR_HIGH)
    timed(emulator)
    assert upload(emulator, stream()) == stream()
    assert runs(emulator)


def test_what_follows_the_stream_does_no_harm():
    emulator = timed(armed())
    upload(emulator, stream() + b"\r\n")
    assert runs(emulator)


def test_the_program_outlives_the_cable_but_not_the_power():
    emulator = timed(armed())
    upload(emulator, stream())
    emulator.faults.on("unplugged")
    emulator.faults.off("unplugged")
    assert runs(emulator)
    emulator.power(False)
    assert not emulator.running
    assert exchanged(emulator) == b""
    assert said(emulator, constants.PING) == b""
    emulator.power(True)
    assert exchanged(emulator) == b""


def test_without_power_nothing_can_be_reset():
    emulator = still()
    emulator.power(False)
    emulator.control(constants.REQUEST_MODEM, constants.DTR_HIGH)
    emulator.power(True)
    assert said(emulator, constants.PING) == b""


def test_a_reset_makes_the_arms_limp():
    emulator = still(running=True)
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_1500000)
    exchanged(emulator, (500, 500, 500))
    assert emulator.torques == (500, 500, 500)
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_9600)
    emulator.control(constants.REQUEST_MODEM, constants.DTR_HIGH)
    assert emulator.torques == (0, 0, 0)
    assert emulator.force_n == (0.0, 0.0, 0.0)
