"""A Falcon's failure modes: their symptoms, refusals of a faulty emulator, and findings of the doctor."""

import sys

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.doctor import DeviceFailure
from study_app.devices.driver import examine
from study_app.devices.emulators.falcon import EmulatedFalcon
from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.falcon.device import PULL_OUT
from study_app.devices.falcon.failures import FAILURES
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from tests.devices.falcon.support.firmware_stream import stream

pytestmark = pytest.mark.slow


@pytest.fixture
def firmware(tmp_path):
    file = tmp_path / "firmware.bin"
    file.write_bytes(stream())
    return file


def refused(emulator, *, firmware=None, progress=None):
    with pytest.raises(DeviceFailure) as caught:
        EmulatedFalcon(emulator=emulator, firmware=firmware, progress=progress, patience_s=3.0).open()
    assert emulator.highest_torque == 0
    assert "\n" not in str(caught.value)
    return caught.value


def has_words_of(failure, mode):
    assert failure.mode == mode
    assert str(failure).startswith(f"the Falcon cannot be used: {FAILURES.mode(mode).symptom}")
    assert FAILURES.mode(mode).cause in str(failure)
    assert str(failure).endswith(FAILURES.mode(mode).cure)


OPENING = {
    "unplugged": "not-connected",
    "access_denied": "permission",
    "not_supported": "driver",
    "busy": "busy",
    "kernel_driver_stays": "kernel-driver",
    "frozen": "frozen",
    "never_homes": "stroke-in",
}
HARMLESS = ("kernel_driver", "leading_zero", "status_noise", "forgets")


class TestFaultsOfTheEmulator:
    @pytest.mark.parametrize(("fault", "mode"), OPENING.items())
    @pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the modes are those of Linux")
    def test_one_that_cannot_be_opened_or_homed(self, fault, mode):
        emulator = Emulator(running=True)
        emulator.faults.on(fault)
        messages = []
        has_words_of(refused(emulator, progress=messages.append), mode)
        assert sum(line.startswith("Still homing") for line in messages) >= 4 * (mode in {"frozen", "stroke-in"})
        emulator.faults.off(fault)
        with EmulatedFalcon(emulator=emulator):  # it was let go of, and can be tried again
            assert emulator.homed == 0b111

    @pytest.mark.parametrize(
        ("at", "happens", "mode"),
        [
            (PULL_OUT, lambda emulator: emulator.hold(0.0, 0.0, 0.0), "stroke-out"),
            ("Homing", lambda emulator: emulator.power(False), "power"),
            ("Homing", lambda emulator: emulator.faults.on("unplugged"), "unplugged"),
        ],
    )
    def test_events_during_homing_end_in_their_failure(self, at, happens, mode):
        emulator = Emulator(running=True)
        failure = refused(emulator, progress=lambda line: happens(emulator) if line.startswith(at) else None)
        has_words_of(failure, mode)

    def test_missing_invalid_and_undelivered_firmware(self, firmware, tmp_path):
        has_words_of(refused(Emulator()), "firmware-file")
        page = tmp_path / "page.bin"
        page.write_text("<!DOCTYPE html><html>", encoding="utf-8", newline="\n")
        has_words_of(refused(Emulator(), firmware=page), "not-firmware")
        has_words_of(refused(Emulator(), firmware=tmp_path / "nowhere.bin"), "firmware-file")
        unpowered, garbling = Emulator(), Emulator()
        unpowered.power(False)
        failure = refused(unpowered, firmware=firmware)
        has_words_of(failure, "upload")
        assert "power adapter" in str(failure)
        garbling.faults.chance("echo", 0.1)
        failure = refused(garbling, firmware=firmware)
        has_words_of(failure, "upload")
        assert "byte" in str(failure)

    @pytest.mark.parametrize("fault", HARMLESS)
    def test_tolerable_faults_do_not_stop_the_servo(self, fault, firmware):
        emulator = Emulator()
        emulator.faults.on(fault)
        with EmulatedFalcon(emulator=emulator, firmware=firmware) as device:
            servo = Servo(device, clock=VirtualClock())
            servo.advance(200)
            servo.check()
            servo.stop()

    @pytest.mark.parametrize(
        ("unhomed", "read_errors", "cause"), [(1, 0, "no longer homed"), (0, 90, "did not complete")]
    )
    def test_lost_homing_and_failed_transfers_in_use_are_distinguished(self, unhomed, read_errors, cause):
        with EmulatedFalcon(emulator=Emulator(running=True)) as device:
            state = device.exchange
            state.apart, state.unhomed, state.read_errors, state.ticks = 100, unhomed, read_errors, 1
            assert device.failure is None
            state.fresh_ns = state.now_ns - 100_000_000
            assert cause in device.failure


class TestDoctor:
    @pytest.mark.parametrize(
        ("faults", "modes"),
        [
            ((), []),
            (("drop=0.02",), ["broken-packets"]),
            (("truncate=0.02",), ["broken-packets"]),
            (("corrupt=0.02",), ["broken-packets"]),
            (("stall=0.005",), ["broken-packets"]),
            (("duplicate=0.02",), []),
            (("delay=0.01",), []),
            (("never-homes",), ["stroke-in"]),
            (("busy",), ["busy"]),
            (("power-off",), ["firmware-file"]),
        ],
    )
    def test_the_doctor_finds_exactly_the_faults(self, faults, modes):
        examined = examine("falcon-emulated", faults=faults, progress=str)
        assert [finding.id for finding in examined.found] == modes
        assert (examined.failure is None) == (not modes or modes == ["broken-packets"])

    def test_the_doctor_reports_its_observations(self, firmware):
        messages = []
        examined = examine("falcon-emulated", options={"firmware": firmware}, progress=messages.append)
        assert any(line.startswith("round trip 0.") for line in examined.seen)
        assert "opened, serial number EMULATED" in examined.seen
        assert any(line.startswith("Homing") for line in messages)

    @pytest.mark.parametrize("fault", ["frozen", "unplugged"])
    def test_faults_after_homing_are_found(self, fault, monkeypatch):
        emulator = Emulator(running=True)
        device = EmulatedFalcon(emulator=emulator)
        monkeypatch.setattr(EmulatedFalcon, "of", lambda _request: device)
        examined = examine(
            "falcon-emulated", progress=lambda line: emulator.faults.on(fault) if line.startswith("Hold") else None
        )
        assert [finding.id for finding in examined.found] == [fault]
        assert fault == "frozen" or FAILURES.mode("unplugged").cure in examined.failure
