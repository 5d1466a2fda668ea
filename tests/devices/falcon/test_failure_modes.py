"""Every fault of the emulator, through the real driver, ends in the words of its failure mode."""

import re
import sys

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.falcon.doctor.examine import examine, ftdi_sees
from study_app.devices.falcon.emulated import EmulatedFalcon
from study_app.devices.falcon.emulator.emulator import Emulator
from study_app.devices.falcon.emulator.faults import CHANCES, SWITCHES
from study_app.devices.falcon.facts import OPEN, Facts
from study_app.devices.falcon.failure_modes import BY_ID, MODES, UDEV_RULE, diagnose, sentence
from study_app.devices.falcon.failures import FalconFailure, UsbFailure
from study_app.devices.falcon.homing import PULL_OUT, NotHomed
from study_app.devices.registry import doctor_of
from study_app.errors import DeviceError, DeviceLost, ServoFault
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo
from tests.devices.falcon.support.bridges import D2xx
from tests.devices.falcon.test_firmware import stream

pytestmark = pytest.mark.slow


def shown(**facts):
    return [mode.id for mode in diagnose(Facts(**facts))]


class TestModes:
    @pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.id)
    def test_each_says_symptom_cause_cure_and_how_it_is_known(self, mode):
        assert mode.tested
        assert mode.symptom
        assert mode.cause
        assert mode.detected
        applies = [p for p in ("linux", "win32", "darwin") if mode.cure(p)]
        assert applies
        assert "\n" not in mode.symptom + mode.cause + "".join(mode.cures.values())

    def test_all_that_is_in_order_shows_nothing(self):
        fine = Facts(
            platform="linux",
            usb=OPEN,
            listed=True,
            program="running",
            replies=True,
            homed=7,
            moved=True,
            pulled_out=True,
            round_trip_s=0.0003,
            broken_share=0.0,
            rate_hz=1000.0,
            step_n=0.1,
        )
        assert diagnose(fine) == []
        assert all(mode.shown_by(fine) is False for mode in MODES)
        assert sentence(fine) == ""

    def test_what_was_not_looked_at_is_left_open(self):
        nothing = Facts(platform="linux")
        assert diagnose(nothing) == []
        assert {mode.id for mode in MODES if mode.shown_by(nothing) is False} == {"two-drivers"}

    @pytest.mark.parametrize(
        ("facts", "modes"),
        [
            ({"usb": "access", "platform": "linux"}, ["permission"]),
            ({"usb": "access", "platform": "darwin"}, ["mac-driver"]),
            ({"usb": "access", "platform": "win32"}, ["busy"]),
            ({"usb": "not-supported", "platform": "win32"}, ["windows-driver"]),
            ({"usb": "not-supported", "platform": "win32", "listed": True, "ftdi_sees": False}, ["two-drivers"]),
            ({"usb": "busy", "platform": "win32", "listed": True, "ftdi_sees": False}, ["busy"]),
            ({"usb": "busy", "platform": "linux"}, ["busy"]),
            ({"usb": "no-backend"}, ["no-libusb"]),
            ({"usb": "no-ftd2xx"}, ["no-ftd2xx"]),
            ({"usb": "pipe"}, ["transfer"]),
            ({"usb": OPEN, "boot_step": "ping", "replies": False}, ["upload", "power"]),
            ({"usb": OPEN, "boot_step": "echo"}, ["upload"]),
            ({"replies": True, "homed": 0b011, "moved": True}, ["stroke-in"]),
            ({"replies": True, "homed": 0b111, "moved": True, "pulled_out": False}, ["stroke-out"]),
            ({"replies": True, "homed": 0b111, "moved": False, "pulled_out": True}, ["frozen"]),
            ({"replies": False}, ["power"]),
            ({"broken_share": 0.006}, ["broken-packets"]),
            ({"broken_share": 0.005}, []),
            ({"rate_hz": 799.0}, ["shaking"]),
            ({"rate_hz": 1000.0, "step_n": 0.6}, ["shaking"]),
            ({"round_trip_s": 0.016}, ["slow"]),
            ({"round_trip_s": 0.002}, ["slow"]),
            ({"round_trip_s": 0.001}, []),
        ],
    )
    def test_facts_name_their_mode(self, facts, modes):
        assert shown(**facts) == modes

    def test_the_rule_to_paste_is_whole(self):
        assert UDEV_RULE == 'SUBSYSTEM=="usb", ATTR{idVendor}=="0403", ATTR{idProduct}=="cb48", TAG+="uaccess"'
        assert UDEV_RULE in BY_ID["permission"].cure("linux")
        assert re.search(r"rules\.d/[0-6]\d-", BY_ID["permission"].cure("linux"))  # before 73, where uaccess is read


def refused(emulator, *, firmware=None, progress=None):
    with pytest.raises(FalconFailure) as caught:
        EmulatedFalcon(emulator=emulator, firmware=firmware, progress=progress, patience_s=3.0).open()
    assert emulator.highest_torque == 0
    return caught.value


def has_words_of(failure, mode):
    assert mode in [shown.id for shown in diagnose(failure.facts)]
    assert "\n" not in str(failure)
    assert BY_ID[mode].cause in str(failure)
    assert BY_ID[mode].cure(failure.facts.platform) in str(failure)


@pytest.fixture
def firmware(tmp_path):
    file = tmp_path / "firmware.bin"
    file.write_bytes(stream())
    return file


OPENING = {
    "unplugged": "not-connected",
    "access_denied": "permission",
    "not_supported": "windows-driver",
    "busy": "busy",
    "kernel_driver_stays": "kernel-driver",
}
HOMING = {"frozen": "frozen", "never_homes": "stroke-in"}
HARMLESS = ("kernel_driver", "leading_zero", "status_noise", "forgets")
IN_USE = ("drop", "truncate", "corrupt", "duplicate", "delay", "stall")


def test_every_fault_there_is_has_its_test_here():
    assert sorted((*OPENING, *HOMING, *HARMLESS)) == sorted(SWITCHES)
    assert sorted((*IN_USE, "echo", "glued", "echo_prefix")) == sorted(CHANCES)


class TestFaultsOfTheEmulator:
    @pytest.mark.parametrize(("fault", "mode"), OPENING.items())
    def test_a_bridge_that_cannot_be_had(self, fault, mode, monkeypatch):
        emulator = Emulator(running=True)
        emulator.faults.on(fault)
        monkeypatch.setattr("sys.platform", "linux")
        has_words_of(refused(emulator), mode)

    @pytest.mark.parametrize(("fault", "mode"), HOMING.items())
    def test_one_that_does_not_home(self, fault, mode):
        emulator = Emulator(running=True)
        emulator.faults.on(fault)
        has_words_of(refused(emulator), mode)

    def test_one_that_is_homed_and_not_pulled_out(self):
        emulator = Emulator(running=True)
        hinder = {PULL_OUT: lambda: emulator.hold(0.0, 0.0, 0.0)}
        failure = refused(emulator, progress=lambda line: hinder.get(line, int)())
        assert isinstance(failure, NotHomed)
        has_words_of(failure, "stroke-out")

    def test_a_mains_adapter_that_is_pulled_while_homing(self):
        emulator = Emulator(running=True)
        failure = refused(emulator, progress=lambda line: emulator.power(False) if line.startswith("Homing") else None)
        has_words_of(failure, "power")

    def test_no_mains_adapter_while_its_firmware_is_loaded(self, firmware):
        emulator = Emulator()
        emulator.power(False)
        failure = refused(emulator, firmware=firmware)
        assert shown_ids(failure) == ["upload", "power"]
        assert "power adapter" in str(failure)

    def test_no_firmware_and_one_that_is_none(self, tmp_path):
        has_words_of(refused(Emulator()), "firmware-file")
        page = tmp_path / "page.bin"
        page.write_text("<!DOCTYPE html><html>")
        for file in (page, tmp_path / "nowhere.bin"):
            assert shown_ids(refused(Emulator(), firmware=file)) == ["firmware-file"]

    def test_an_echo_that_is_wrong(self, firmware):
        emulator = Emulator()
        emulator.faults.chance("echo", 0.1)
        failure = refused(emulator, firmware=firmware)
        assert shown_ids(failure) == ["upload"]
        assert "byte" in str(failure)
        assert BY_ID["upload"].cure(failure.facts.platform) in str(failure)

    def test_a_cable_that_is_pulled_while_homing(self):
        emulator = Emulator(running=True)
        failure = refused(
            emulator, progress=lambda line: emulator.faults.on("unplugged") if line.startswith("Homing") else None
        )
        assert isinstance(failure, UsbFailure)
        has_words_of(failure, "unplugged")

    @pytest.mark.parametrize("fault", HARMLESS)
    def test_what_a_driver_copes_with_is_no_failure(self, fault, firmware):
        emulator = Emulator()
        emulator.faults.on(fault)
        with EmulatedFalcon(emulator=emulator, firmware=firmware) as device, turning(device) as servo:
            servo.advance(200)
            servo.check()

    @pytest.mark.parametrize(
        ("fault", "error", "mode"),
        [("unplugged", DeviceLost, "unplugged"), ("power", ServoFault, "power"), ("drop", ServoFault, "power")],
    )
    def test_in_use_the_servo_names_cause_and_cure(self, fault, error, mode):
        with EmulatedFalcon(emulator=Emulator(running=True)) as device, turning(device) as servo:
            servo.advance(100)
            servo.check()
            assert device.failure is None
            if fault == "power":
                device.hand.power(False)
            elif fault == "drop":
                device.hand.faults.chance(fault, 1.0)
            else:
                device.hand.faults.on(fault)
            servo.advance(200)
            cause, cure = BY_ID[mode].cause, BY_ID[mode].cure(sys.platform)
            with pytest.raises(error, match=re.escape(f"stopped: {cause}: {cure}; the force is zero")):
                servo.check()

    @pytest.mark.parametrize(("unhomed", "read_errors", "cause"), [(1, 0, "no longer homed"), (0, 90, "not carry out")])
    def test_in_use_a_lost_homing_and_failed_transfers_are_told_apart(self, unhomed, read_errors, cause):
        with EmulatedFalcon(emulator=Emulator(running=True)) as device:
            device.falcon.apart, device.falcon.unhomed, device.falcon.read_errors = 100, unhomed, read_errors
            assert cause in device.failure


def shown_ids(failure):
    return [mode.id for mode in diagnose(failure.facts)]


def turning(device):
    return Servo(device, clock=VirtualClock())


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
    def test_it_finds_what_is_wrong_and_nothing_else(self, faults, modes):
        examined = examine("falcon-emulated", faults=faults, progress=str)
        assert [mode.id for mode in diagnose(examined.facts)] == modes
        assert (examined.failure is None) == (not modes or modes == ["broken-packets"])

    def test_it_says_what_it_saw(self, firmware):
        told = []
        examined = examine("falcon-emulated", firmware=firmware, progress=told.append)
        assert examined.facts.program == "loaded"
        assert any(line.startswith("round trip 0.") for line in examined.seen)
        assert "opened, serial number EMULATED" in examined.seen
        assert any(line.startswith("Homing") for line in told)

    def test_encoders_that_freeze_after_homing_are_found(self):
        emulator = Emulator(running=True)
        freeze = {"Hold": lambda: emulator.faults.on("frozen")}
        examined = examine(
            "falcon-emulated", emulator=emulator, progress=lambda line: freeze.get(line.split()[0], int)()
        )
        assert [mode.id for mode in diagnose(examined.facts)] == ["frozen"]

    def test_a_cable_pulled_during_it_is_found(self):
        emulator = Emulator(running=True)
        pull = {"Hold": lambda: emulator.faults.on("unplugged")}
        examined = examine("falcon-emulated", emulator=emulator, progress=lambda line: pull.get(line.split()[0], int)())
        assert "unplugged" in [mode.id for mode in diagnose(examined.facts)]
        assert BY_ID["unplugged"].cure(sys.platform) in examined.failure

    def test_only_falcons_are_looked_at_and_only_emulated_ones_are_given_faults(self):
        with pytest.raises(DeviceError, match="'mouse' is none"):
            doctor_of("mouse")
        with pytest.raises(DeviceError, match="falcon-emulated can"):
            examine("falcon", faults=("busy",), progress=str)

    def test_ftdis_driver_is_asked_whether_it_has_the_falcon(self):
        assert ftdi_sees(D2xx(("A1", "FALCON HAPTIC"))) is True
        assert ftdi_sees(D2xx(("B9", "USB SERIAL"))) is False
