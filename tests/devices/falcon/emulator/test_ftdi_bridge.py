"""The emulated bridge: when it hands over what, and what it loses."""

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

from study_app.devices.falcon.emulator.ftdi_bridge import byte_ns
from study_app.devices.falcon.wire import constants
from tests.devices.falcon.support.emulated_falcon import MS, at_work, exchanged, packet, still, stripped

STATUS = b"\x01\x60"
QUIET = packet()
ON_THE_WIRE_NS = 16 * 10e9 / 1.5e6


@pytest.mark.parametrize(
    ("divisor", "bits_per_s"),
    [
        (0x4138, 9600),
        (0x0015, 3e6 / 21),
        (0x0002, 1.5e6),
        (0, 3e6),
        (1, 2e6),
        (0xC003, 3e6 / 3.125),
        (0x8003, 3e6 / 3.25),
    ],
)
def test_a_divisor_is_a_speed(divisor, bits_per_s):
    assert byte_ns(divisor) == pytest.approx(10e9 / bits_per_s, abs=1)


def test_with_nothing_to_say_it_gives_its_status_whenever_the_latency_timer_runs_out():
    emulator = still()
    emulator.read(64, 100)
    for milliseconds in (16, 1, 40):
        emulator.control(constants.REQUEST_LATENCY, milliseconds)
        began_ns = emulator.now_ns
        emulator.read(64, 100)
        began_ns = emulator.now_ns
        assert emulator.read(64, 100) == (0, STATUS)
        assert emulator.now_ns - began_ns == milliseconds * MS


def test_a_read_gives_up_when_its_time_is_out_and_has_nothing_then():
    emulator = still()
    emulator.read(64, 100)
    began_ns = emulator.now_ns
    assert emulator.read(64, 5) == (constants.ERROR_TIMEOUT, b"")
    assert emulator.now_ns - began_ns == pytest.approx(5 * MS, abs=0.1 * MS)


def test_the_event_character_hands_a_reply_over_at_once():
    emulator = at_work()
    emulator.write(QUIET, 10)
    sent_ns = emulator.now_ns
    code, data = emulator.read(64, 10)
    assert (code, data[:3], data[-1:], len(data)) == (0, STATUS + b"<", b">", 18)
    assert emulator.now_ns - sent_ns == pytest.approx(2 * ON_THE_WIRE_NS, abs=30_000)


def test_without_it_a_reply_waits_for_the_latency_timer():
    emulator = at_work(event=False)
    emulator.control(constants.REQUEST_LATENCY, 16)
    emulator.read(64, 20)
    last_ns = emulator.now_ns
    emulator.write(QUIET, 10)
    code, data = emulator.read(64, 20)
    assert (code, len(data)) == (0, 18)
    assert emulator.now_ns - last_ns == 16 * MS


def test_the_event_character_does_not_count_as_the_first_byte():
    emulator = at_work()
    emulator.control(constants.REQUEST_LATENCY, 16)
    emulator.control(constants.REQUEST_EVENT_CHARACTER, constants.EVENT_ENABLED | constants.START)
    emulator.read(64, 20)
    last_ns = emulator.now_ns
    assert len(exchanged(emulator, patience=1)) == 16
    assert emulator.now_ns - last_ns == 16 * MS


def test_replies_that_nobody_fetched_come_glued_62_bytes_a_packet():
    emulator = at_work()
    for _ in range(5):
        emulator.write(QUIET, 10)
        emulator.pause(1e-3)
    code, data = emulator.read(512, 10)
    assert code == 0
    assert len(data) == 64 + 2 + 18
    assert (data[:2], data[64:66]) == (STATUS, STATUS)
    assert stripped(data)[::16] == b"<<<<<"


def test_a_read_that_is_too_small_for_a_packet_overflows():
    emulator = at_work()
    emulator.write(QUIET, 10)
    emulator.pause(1e-3)
    assert emulator.read(7, 10)[0] == constants.ERROR_OVERFLOW


def test_a_read_ends_with_a_full_buffer_or_a_short_packet():
    emulator = at_work()
    for _ in range(9):
        emulator.write(QUIET, 10)
        emulator.pause(1e-3)
    assert len(emulator.read(64, 10)[1]) == 64
    assert len(emulator.read(128, 10)[1]) == 64 + 2 + 9 * 16 - 2 * 62


def test_what_finds_the_chips_buffer_full_is_lost():
    emulator = at_work()
    for _ in range(20):
        emulator.write(QUIET, 10)
        emulator.pause(1e-3)
    code, data = emulator.read(1024, 10)
    assert (code, len(stripped(data))) == (0, 256)
    assert emulator.state.bridge.lost == 64
    assert len(exchanged(emulator)) == 16


def test_purging_forgets_what_came_and_what_has_not_left():
    emulator = at_work()
    emulator.write(QUIET, 10)
    emulator.pause(1e-3)
    emulator.control(constants.REQUEST_RESET, constants.PURGE_RX)
    emulator.pause(2e-3)
    assert emulator.read(64, 10) == (0, STATUS)
    heard = emulator.packets
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_9600)
    emulator.write(b"\x55" * 100, 10)
    emulator.control(constants.REQUEST_RESET, constants.PURGE_TX)
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_1500000)
    emulator.pause(5e-3)
    assert len(exchanged(emulator)) == 16
    assert emulator.packets == heard + 1


def test_writing_waits_for_room_and_gives_up_when_its_time_is_out():
    emulator = still()
    code, taken = emulator.write(bytes(300), 100)
    assert code == constants.ERROR_TIMEOUT
    assert taken == 128 + 96  # what the buffer holds, and what leaves in 100 ms
    assert emulator.now_ns == pytest.approx(100 * MS, abs=0.2 * MS)


def test_time_goes_on_by_what_a_transfer_takes_and_by_pauses_alone():
    emulator = at_work()
    began_ns = emulator.now_ns
    emulator.pause(0.25)
    assert emulator.now_ns - began_ns == pytest.approx(250 * MS, abs=0.1 * MS)
    exchanged(emulator)
    exchanged(emulator)
    assert emulator.now_ns - began_ns < 251 * MS


def test_unplugged_it_is_gone_and_comes_back_as_after_power_up():
    emulator = at_work()
    exchanged(emulator, (50, 60, 70))
    emulator.faults.on("unplugged")
    assert emulator.write(QUIET, 10) == (constants.ERROR_NO_DEVICE, 0)
    assert emulator.read(64, 10) == (constants.ERROR_NO_DEVICE, b"")
    assert emulator.control(constants.REQUEST_LATENCY, 1) == constants.ERROR_NO_DEVICE
    emulator.faults.off("unplugged")
    assert exchanged(emulator) == b""
    assert emulator.torques == (50, 60, 70)
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_1500000)
    assert len(exchanged(emulator)) == 16
    assert emulator.torques == (0, 0, 0)


def test_an_endpoint_that_is_none_is_not_found():
    emulator = still()
    assert emulator.transfer(0x83, np.zeros(64, np.uint8), 64, 10) == (constants.ERROR_NOT_FOUND, 0)


def test_status_may_be_any_but_its_place():
    emulator = at_work()
    emulator.faults.on("status_noise")
    seen = {emulator.read(64, 10)[1] for _ in range(50)}
    assert all(len(status) == 2 for status in seen)
    assert len(seen) > 10
    assert len(exchanged(emulator)) == 16


def test_requests_are_recorded():
    emulator = still()
    emulator.control(constants.REQUEST_LATENCY, 16)
    emulator.control(constants.REQUEST_FLOW, 0)
    assert emulator.recorded == [(9, 16), (2, 0)]


# another clock


def follow(emulator, start_ns):
    clock = np.array([start_ns], np.int64)
    emulator.follow_clock(int(clock.ctypes.data))
    return clock


def test_on_a_clock_it_answers_by_that_clock_and_never_waits():
    emulator = at_work()
    clock = follow(emulator, 5_000 * MS)
    for tick in range(50):
        clock[0] = (5_000 + tick) * MS
        emulator.write(QUIET, 1)
        if tick:
            assert emulator.read(64, 0)[1][2:3] == b"<"
            assert emulator.now_ns - clock[0] in range(MS)


def test_on_a_clock_it_goes_ahead_of_it_by_no_more_than_a_time_out():
    emulator = at_work()
    emulator.control(constants.REQUEST_LATENCY, 16)
    clock = follow(emulator, 0)
    for tick in range(100):
        clock[0] = tick * MS
        for _ in range(5):
            emulator.read(64, 2)
        assert clock[0] <= emulator.now_ns <= clock[0] + 2 * MS


def test_what_is_on_its_way_moves_over_to_another_clock_and_back():
    for start_ns in (0, 10**18):
        emulator = at_work()
        emulator.pause(3.0)
        emulator.reach_to(0.02, 0.0, 0.0, duration_s=0.1)
        emulator.write(QUIET, 10)
        clock = follow(emulator, start_ns)
        assert stripped(emulator.read(64, 5)[1]) == b""
        assert len(stripped(emulator.read(64, 5)[1])) == 16
        assert start_ns <= emulator.now_ns < start_ns + 5 * MS
        for tick in range(150):
            clock[0] = start_ns + tick * MS
            emulator.write(QUIET, 1)
            emulator.read(512, 1)
        assert emulator.aim_m == pytest.approx((0.02, 0.0, 0.0))
        emulator.follow_clock(0)
        assert len(exchanged(emulator)) == 16
        assert emulator.now_ns >= start_ns + 149 * MS


def test_a_clock_that_begins_anew_takes_it_along():
    emulator = at_work()
    clock = follow(emulator, 60_000 * MS)
    assert len(exchanged(emulator)) == 16
    clock[0] = 0
    assert len(exchanged(emulator)) == 16
    assert emulator.now_ns < 20 * MS
