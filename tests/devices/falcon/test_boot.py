import itertools

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

from study_app.devices.emulators.falcon import EmulatedBackend
from study_app.devices.emulators.falcon_emulator import ALL_HOMED, Emulator
from study_app.devices.falcon import boot as booting
from study_app.devices.falcon import constants
from study_app.devices.falcon.boot import (
    ATTEMPTS,
    PINGS,
    BootFailure,
    boot,
    configure,
    is_running,
    measure_round_trip,
    set_event_character,
)
from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure, usb_failure
from study_app.devices.falcon.transport import PyUsbTransport
from tests.devices.falcon.support.firmware_stream import stream


class Wrong(PyUsbTransport):
    """A bridge that does not do all as it is told: ``bauds`` it takes for others, ``fails`` when it writes."""

    bauds = ()
    fails = None
    opened = 0

    def reopen(self):
        self.opened += 1
        super().reopen()

    def control(self, request, value):
        if request == constants.REQUEST_BAUD:
            value = dict(self.bauds).get(value, value)
        super().control(request, value)

    def write(self, data, timeout_s):
        if self.fails is not None:
            raise self.fails
        super().write(data, timeout_s)


def falcon(**options):
    """Return an emulated Falcon, just switched on, and a bridge to it."""
    emulator = Emulator(tremor_m=0.0, **options)
    return emulator, Wrong(EmulatedBackend(emulator))


def failing(transport, **options):
    """Return how booting fails, and what was told of the attempts before the last."""
    told = []
    with pytest.raises(BootFailure) as caught:
        boot(transport, stream(), progress=told.append, **options)
    return caught.value, told


def values(emulator, request):
    return [value for asked, value in emulator.recorded if asked == request]


@pytest.mark.parametrize(
    "size", [1, 16, 300, 4000, (constants.CHUNK * 10 - 30) // 2]
)  # the last piece short, and whole
def test_a_falcon_just_switched_on_is_loaded_and_answers(size):
    emulator, transport = falcon()
    data = stream(((0x3F8000, size),))
    configure(transport)
    assert not is_running(transport)
    told = []
    found = boot(transport, data, progress=told.append)
    assert (found.size, emulator.loaded) == (len(data), len(data))
    assert emulator.running
    assert is_running(transport)
    assert told == []
    assert transport.opened == 1


def test_the_bridge_is_set_as_each_step_needs_it():
    emulator, transport = falcon()
    boot(transport, stream())
    assert values(emulator, constants.REQUEST_BAUD) == [
        constants.BAUD_9600,
        constants.BAUD_142857,
        constants.BAUD_1500000,
    ]
    assert values(emulator, constants.REQUEST_LATENCY) == [constants.LATENCY_BOOT_MS, constants.LATENCY_RUN_MS]
    modem = [constants.RTS_LOW, constants.DTR_LOW, constants.DTR_HIGH, constants.DTR_LOW]
    assert values(emulator, constants.REQUEST_MODEM) == modem
    assert set(values(emulator, constants.REQUEST_LINE)) == {constants.LINE_8N1}
    assert set(values(emulator, constants.REQUEST_FLOW)) == {0}
    order = [request for request, _ in itertools.groupby(request for request, _ in emulator.recorded)]
    assert order[0] == constants.REQUEST_RESET  # what was in the bridge is forgotten first
    assert constants.RESET_ALL not in values(emulator, constants.REQUEST_RESET)


def test_asking_whether_it_runs_does_not_undo_its_homing():
    emulator, transport = falcon(running=True)
    configure(transport)
    assert values(emulator, constants.REQUEST_MODEM) == []
    assert emulator.highest_torque == 0
    while emulator.homed != ALL_HOMED or emulator.moving:
        assert is_running(transport)
        transport.pause(0.002)
    transport.reopen()
    configure(transport)
    assert is_running(transport)
    assert emulator.homed == ALL_HOMED


@pytest.mark.parametrize("count", [1, 3, PINGS - 1])
def test_pings_that_were_ignored_are_said_again(count):
    emulator, transport = falcon()
    emulator.faults.ignore_pings(count)
    boot(transport, stream(), attempts=1)
    assert emulator.running


@pytest.mark.parametrize("variant", ["leading-zero", "glued=1", "echo-prefix=1", "status-noise"])
@pytest.mark.parametrize("other", ["leading-zero", "glued=1", "echo-prefix=1"])
def test_every_way_a_falcon_was_seen_to_answer_will_do(variant, other):
    emulator, transport = falcon()
    emulator.take(variant)
    emulator.take(other)
    boot(transport, stream(), attempts=1)
    assert emulator.running


def test_what_is_still_in_the_bridge_does_no_harm():
    emulator, transport = falcon(running=True)
    configure(transport)
    for _ in range(5):
        transport.write(constants.quiet_packet(), 0.1)
    transport.pause(0.01)  # five replies wait; then it is switched off and on
    emulator.power(False)
    emulator.power(True)
    boot(transport, stream(), attempts=1)
    assert emulator.running


def test_replies_that_wait_do_not_make_a_dead_falcon_run():
    emulator, transport = falcon(running=True)
    configure(transport)
    transport.write(constants.quiet_packet(), 0.1)
    transport.pause(0.01)
    emulator.power(False)
    configure(transport)
    assert not is_running(transport)


def test_without_its_mains_adapter_it_does_not_answer_a_ping():
    emulator, transport = falcon()
    emulator.power(False)
    failure, told = failing(transport)
    assert (failure.step, failure.attempt) == ("ping", ATTEMPTS)
    assert "does not answer" in str(failure)
    assert "power adapter is plugged in" in str(failure)
    assert len(told) == ATTEMPTS - 1
    assert told[0].startswith("Loading the firmware, attempt 1 of 10: its boot loader does not answer")
    assert transport.opened == ATTEMPTS


@pytest.mark.parametrize(
    ("taken", "given_", "step"),
    [
        (constants.BAUD_9600, constants.BAUD_142857, "ping"),
        (constants.BAUD_142857, constants.BAUD_9600, "autobaud"),
        (constants.BAUD_142857, constants.BAUD_1500000, "autobaud"),
        (constants.BAUD_1500000, constants.BAUD_142857, "start"),
    ],
)
def test_a_wrong_speed_ends_the_step_that_it_is_of(taken, given_, step):
    _, transport = falcon()
    transport.bauds = [(taken, given_)]
    failure, told = failing(transport, attempts=2)
    assert (failure.step, failure.attempt, len(told)) == (step, 2, 1)
    assert "in 2 attempts" in str(failure)


@pytest.mark.parametrize("at", [0, 1, 61, 62, 500])
def test_a_wrong_echo_is_told_by_the_number_of_its_byte(at, monkeypatch):
    _, transport = falcon()
    data = stream()
    before = PyUsbTransport.write
    sent = 0

    def write(self, chunk, timeout_s):
        nonlocal sent
        if chunk in (constants.PING, constants.AUTOBAUD):
            return before(self, chunk, timeout_s)
        if sent <= at < sent + len(chunk):  # all of the chunk up to the byte goes over, then its echo is spoilt
            spoilt = bytearray(chunk)
            spoilt[at - sent] ^= 0x10
            chunk = bytes(spoilt)
        sent += len(chunk)
        return before(self, chunk, timeout_s)

    monkeypatch.setattr(PyUsbTransport, "write", write)
    failure, told = failing(transport, attempts=1)
    assert (failure.step, told) == ("echo", [])
    assert f"byte {at} of the firmware came back as {data[at] ^ 0x10:02x}, not {data[at]:02x}" in str(failure)
    assert "in 1 attempt:" in str(failure)


def test_an_echo_spoilt_by_the_falcon_is_the_next_attempts():
    emulator, transport = falcon()
    emulator.faults.once("echo")
    told = []
    boot(transport, stream(), progress=told.append)
    assert emulator.running
    assert len(told) == 1
    assert "byte 0 of the firmware came back as ba, not aa" in told[0]
    assert transport.opened == 2


def test_an_echo_that_ends_is_told_by_the_byte_from_which_on_it_is_missing(monkeypatch):
    emulator, transport = falcon()
    before, chunks = PyUsbTransport.write, []

    def write(self, data, timeout_s):
        if len(data) == constants.CHUNK:
            chunks.append(data)
        if len(chunks) == 3:
            emulator.power(False)
        before(self, data, timeout_s)

    monkeypatch.setattr(PyUsbTransport, "write", write)
    failure, _ = failing(transport, attempts=1)
    assert (failure.step, failure.reason) == ("echo", "nothing came back from byte 124 of the firmware on")


def test_a_program_that_says_nothing_did_not_start():
    emulator, transport = falcon()
    data = stream()
    emulator.faults.chance("drop", 1.0)
    failure, _ = failing(transport, attempts=1)
    assert failure.step == "start"
    assert emulator.loaded == len(data)
    assert "check that the file is a Falcon's firmware" in str(failure)


def test_a_falcon_that_goes_is_not_waited_for_and_one_that_takes_no_bytes_is_tried_again():
    emulator, transport = falcon()
    transport.fails = usb_failure(constants.ERROR_NO_DEVICE, "sending")
    with pytest.raises(FalconLost):
        boot(transport, stream())
    with pytest.raises(FalconLost):
        is_running(transport)
    transport.fails = usb_failure(constants.ERROR_TIMEOUT, "sending")
    failure, _ = failing(transport, attempts=2)
    assert (failure.step, failure.reason) == ("ping", "the bridge does not accept the bytes")
    assert not is_running(transport)
    for fault, error in (("busy", UsbFailure), ("unplugged", FalconNotFound)):  # between attempts
        with pytest.raises(error):
            boot(transport, stream(), progress=lambda _line, fault=fault: emulator.faults.on(fault))
        emulator.faults.off(fault)
        transport.reopen()


def test_the_event_character_and_the_timer_are_the_round_trip():
    emulator, transport = falcon(running=True)
    configure(transport)
    set_event_character(transport, on=True)
    hastened_s = measure_round_trip(transport)
    set_event_character(transport, on=False)
    plain_s = measure_round_trip(transport)
    assert 2 * 16 * 10 / 1.5e6 <= hastened_s < 0.5e-3
    assert 0.5e-3 < plain_s < 2.5e-3
    assert emulator.highest_torque == 0
    expected = [constants.EVENT_ENABLED | constants.STOP, constants.STOP]
    assert values(emulator, constants.REQUEST_EVENT_CHARACTER) == expected


def test_without_any_reply_the_round_trip_is_all_the_time_there_was():
    emulator, transport = falcon(running=True)
    configure(transport)
    emulator.power(False)
    assert measure_round_trip(transport) == booting.PROBE_S
