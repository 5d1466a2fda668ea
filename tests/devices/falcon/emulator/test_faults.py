"""Everything that can go wrong with the emulated Falcon, on purpose."""

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

from study_app.devices.falcon.emulator.faults import CHANCES, SWITCHES
from study_app.errors import DeviceError
from tests.devices.falcon.support.emulated_falcon import (
    HOMING,
    at_work,
    counts_in,
    exchanged,
    home,
    packet,
    still,
    stripped,
)


def replies_to(emulator, ticks):
    return [exchanged(emulator, flags=HOMING, patience=3) for _ in range(ticks)]


def test_a_dropped_reply_is_missing_but_its_torque_is_not():
    emulator = at_work()
    emulator.faults.once("drop", 2)
    assert exchanged(emulator, (7, 8, 9), patience=3) == b""
    assert emulator.torques == (7, 8, 9)
    assert exchanged(emulator, patience=3) == b""
    assert len(exchanged(emulator)) == 16
    assert emulator.faults.happened("drop") == 2


def test_a_truncated_reply_has_14_bytes_and_no_end():
    emulator = at_work()
    emulator.faults.once("truncate")
    reply = exchanged(emulator, patience=3)
    assert (len(reply), reply[:1]) == (14, b"<")
    assert b">" not in reply


def test_a_corrupt_reply_has_one_wrong_byte():
    emulator = at_work()
    good = exchanged(emulator)
    for _ in range(40):
        emulator.faults.once("corrupt")
        emulator.write(packet(), 10)
        emulator.pause(2e-3)
        assert sum(a != b for a, b in zip(good, stripped(emulator.read(64, 20)[1]), strict=True)) == 1


def test_a_duplicate_comes_twice():
    emulator = at_work()
    emulator.faults.once("duplicate")
    emulator.write(packet(), 10)
    emulator.pause(2e-3)
    heard = stripped(emulator.read(512, 20)[1])
    assert len(heard) == 32
    assert heard[:16] == heard[16:]


def test_a_delayed_reply_comes_late():
    emulator = at_work()
    emulator.faults.last(delay_s=0.007)
    emulator.faults.once("delay")
    emulator.write(packet(), 10)
    sent_ns = emulator.now_ns
    while not stripped(emulator.read(64, 20)[1]):
        pass
    assert emulator.now_ns - sent_ns == pytest.approx(7e6 + 2 * 16 * 6666 + 20_000, abs=1e5)


def test_stalled_it_hears_nothing_for_a_while():
    emulator = at_work()
    emulator.faults.last(stall_s=0.05)
    emulator.faults.once("stall")
    assert exchanged(emulator, (5, 5, 5), patience=2) == b""
    emulator.pause(0.02)
    assert exchanged(emulator, (5, 5, 5), patience=2) == b""
    assert emulator.torques == (0, 0, 0)
    emulator.pause(0.04)
    assert len(exchanged(emulator, (5, 5, 5))) == 16


def test_frozen_encoders_say_the_same_wherever_the_handle_goes():
    emulator = at_work()
    home(emulator)
    before = counts_in(exchanged(emulator, flags=HOMING))
    emulator.faults.on("frozen")
    emulator.hold(0.03, 0.02, 0.01)
    emulator.pause(0.5)
    assert counts_in(exchanged(emulator, flags=HOMING)) == before


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drop", "truncate", "stall"])
def test_chances_come_true_as_often_as_they_should(name):
    emulator = at_work()
    emulator.faults.last(stall_s=0.0)
    emulator.faults.chance(name, 0.1)
    whole = sum(len(reply) == 16 for reply in replies_to(emulator, 3000))
    happened = emulator.faults.happened(name)
    assert happened == pytest.approx(300, abs=60)
    assert whole <= 3000 - happened * 0.9
    emulator.faults.chance(name, 0.0)
    assert all(len(reply) == 16 for reply in replies_to(emulator, 50)[1:])


@pytest.mark.parametrize("name", SWITCHES)
def test_a_switch_is_off_until_it_is_switched_on(name):
    faults = still().faults
    assert not faults.is_on(name)
    faults.take(name.replace("_", "-"))
    assert faults.is_on(name)
    faults.off(name)
    assert not faults.is_on(name)


@pytest.mark.parametrize("name", CHANCES)
def test_a_fault_can_be_named_with_its_chance(name):
    emulator = still()
    emulator.take(f"{name}=0.25")
    assert emulator.state.faults.chance[CHANCES.index(name)] == 0.25


def test_the_power_can_be_taken_by_name():
    emulator = still(running=True)
    for word in ("power-off", "power_off"):
        emulator.power(True)
        emulator.take(word)
        assert not emulator.powered


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("dropp=0.1", "choose one of: drop, truncate"),
        ("drop=1.5", "must be 0 to 1, not 1.5"),
        ("drop", "not known; choose of: drop=CHANCE"),
        ("never", "never-homes, .*, power-off$"),
        ("frozen=1", "does not come by chance"),
        ("", "not known"),
    ],
)
def test_a_fault_that_is_none_is_refused(word, message):
    with pytest.raises(DeviceError, match=message):
        still().take(word)
