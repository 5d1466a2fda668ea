import hashlib
import json
from itertools import product
from random import Random

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.falcon import device as driver
from study_app.devices.falcon import firmware
from study_app.devices.falcon.emulated import EmulatedFalcon
from study_app.devices.falcon.emulator.emulator import Emulator
from study_app.devices.falcon.failures import FalconLost, UsbFailure
from study_app.devices.falcon.homing import PULL_OUT, READY, STROKES, NotHomed
from study_app.devices.falcon.mechanics import calibration
from study_app.devices.falcon.mechanics.calibration import Calibration
from study_app.devices.falcon.mechanics.geometry import GEOMETRIES, SAFE_BOX_M
from study_app.devices.falcon.mechanics.kinematics import REACHED, inverse, new_mechanism
from study_app.devices.falcon.wire import constants
from study_app.devices.registry import open_device
from study_app.devices.scripted import STIFFNESS_NPM
from study_app.errors import DeviceError
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW, READ_NOTHING_NEW
from study_app.haptics.model.layout import BUTTON_STOP, new_reading
from tests.devices.contract import write
from tests.devices.falcon.test_firmware import stream

pytestmark = pytest.mark.slow

MS = 1_000_000


class Ticks:
    """Ticks an open device as the servo would."""

    def __init__(self, device, start_ns=5_000 * MS):
        self.device, self.now_ns = device, start_ns
        self.reading = new_reading()

    def after(self, ticks, force_n=(0.0, 0.0, 0.0)):
        """Return what the last of so many reads answered."""
        for _ in range(ticks):
            self.now_ns += MS
            answer = self.device.read.ctypes(self.device.context, self.now_ns, self.reading.ctypes.data)
            write(self.device, force_n)
        return answer

    @property
    def position_m(self):
        return self.reading[0].position_m.copy()


def still(**options):
    return Emulator(**{"tremor_m": 0.0, "running": True, **options})


class Guard:
    """Keeps what it was told."""

    def __init__(self):
        self.orders = []

    def stand_down(self):
        self.orders.append("stand_down")

    def release(self):
        self.orders.append("release")

    def leave(self):
        self.orders.append("leave")

    def recall(self):
        self.orders.append("recall")


def places_in_the_box(geometry):
    """Return places (x, y, z) [m] all over the safe box, but for corners beyond the encoders' known range."""
    mechanism, theta = new_mechanism(geometry, 1.0), np.zeros(3)
    for place in product(*(np.linspace(low, high, 4) for low, high in SAFE_BOX_M)):
        reached = inverse(mechanism, np.array(place), theta) == REACHED
        if reached and np.abs((theta - mechanism.zero_rad) / mechanism.rad_per_count).max() < 1600:
            yield place


@pytest.fixture
def told():
    return []


@pytest.fixture
def opened(told):
    with EmulatedFalcon(emulator=still(), progress=told.append) as device:
        yield device


class TestOpening:
    def test_it_is_homed_by_a_hand_that_does_what_it_is_told(self, opened, told):
        assert told == [STROKES, PULL_OUT, READY]
        assert opened.hand.homed == 0b111
        assert opened.hand.lights == constants.FLAG_GREEN
        assert opened.hand.highest_torque == 0

    def test_the_grip_is_back_in_the_middle(self, opened):
        ticks = Ticks(opened)
        assert ticks.after(2) == READ_NEW
        assert np.abs(ticks.position_m).max() < 1e-3

    def test_the_quicker_way_of_the_bridge_is_kept_and_both_are_told(self, opened):
        described = opened.describe()
        assert described["event_character"] is True
        assert described["round_trip_ms"]["with"] < 0.5 < described["round_trip_ms"]["without"]

    def test_a_falcon_that_was_switched_on_is_given_its_program(self, tmp_path, told):
        file = tmp_path / "secret-folder-firmware.bin"
        file.write_bytes(stream())
        with open_device("falcon-emulated", options={"firmware": file}, progress=told.append) as device:
            assert device.hand.running
            assert device.hand.homed == 0b111
            described = json.dumps(device.describe())
        assert len(json.loads(described)["firmware"]) == 64
        assert "secret" not in described

    def test_a_firmware_that_nobody_knows_is_told_to_be_so(self, tmp_path, told, monkeypatch):
        file = tmp_path / "firmware.bin"
        file.write_bytes(stream())
        digest = hashlib.sha256(stream()).hexdigest()
        for name in (None, "nvent_firmware.bin"):
            if name is not None:
                monkeypatch.setitem(firmware.KNOWN, (digest[:16], digest[-8:]), name)
            with open_device("falcon-emulated", options={"firmware": file}, progress=told.append):
                loading = [line for line in told if line.startswith("Loading")]
        assert len(loading) == 2
        assert f"SHA-256 {digest[:16]}…, which is none of those that are known to work" in loading[0]
        assert loading[1] == "Loading the Falcon's firmware, nvent_firmware.bin."

    def test_without_its_program_it_says_what_to_give(self):
        emulator = still(running=False)
        device = EmulatedFalcon(emulator=emulator)
        with pytest.raises(DeviceError, match=r"--firmware PATH.*nvent_firmware\.bin"):
            device.open()
        emulator.take("power_off")
        with pytest.raises(DeviceError, match="power adapter"):
            device.open()

    def test_a_firmware_that_is_not_there_or_is_none_is_told(self, tmp_path, told):
        with pytest.raises(DeviceError, match=r"nowhere\.bin cannot be read"):
            open_device("falcon-emulated", options={"firmware": tmp_path / "nowhere.bin"})
        (tmp_path / "page.bin").write_text("<!DOCTYPE html><html>")
        with pytest.raises(DeviceError, match="web page"):
            open_device("falcon-emulated", options={"firmware": tmp_path / "page.bin"}, progress=told.append)
        assert told == []

    @pytest.mark.parametrize("fault", ["access_denied", "not_supported", "busy", "unplugged"])
    def test_a_bridge_that_cannot_be_had_is_told_and_can_be_tried_again(self, fault):
        emulator = still()
        emulator.faults.on(fault)
        device = EmulatedFalcon(emulator=emulator)
        with pytest.raises(UsbFailure):
            device.open()
        emulator.faults.off(fault)
        with device:
            assert emulator.homed == 0b111

    def test_a_workspace_beyond_its_reach_is_refused(self):
        with pytest.raises(DeviceError, match=r"200 x 60 x 60 mm is more than a Falcon reaches; 100 x 60 x 60 mm"):
            EmulatedFalcon(workspace_m=(0.1, 0.03, 0.03))

    def test_the_receipt_can_say_what_it_is(self, opened):
        described = opened.describe()
        assert json.loads(json.dumps(described)) == described
        assert described["name"] == "falcon-emulated"
        assert described["serial"] == "EMULATED"
        assert described["firmware"] == "already running"
        assert described["geometry"] == "libnifalcon"
        assert described["calibration"] == "none"
        assert described["units_per_nm"] == 6616.0


class TestHoming:
    @pytest.mark.parametrize(("fault", "kind"), [("never_homes", "not-pushed-in"), ("frozen", "limp")])
    def test_it_does_not_wait_for_ever(self, fault, kind, told):
        emulator = still()
        emulator.faults.on(fault)
        device = EmulatedFalcon(emulator=emulator, progress=told.append, patience_s=3.0)
        with pytest.raises(NotHomed) as caught:
            device.open()
        assert caught.value.kind == kind
        assert sum(line.startswith("Still homing") for line in told) >= 4
        emulator.faults.off(fault)
        with device:  # it was let go of, and can be homed
            assert emulator.homed == 0b111

    def test_a_grip_that_is_not_pulled_out_gets_no_force(self):
        emulator = still()

        def hinder(line):
            if line == PULL_OUT:
                emulator.hold(0.0, 0.0, 0.0)

        with pytest.raises(NotHomed, match="pull it fully out"):
            EmulatedFalcon(emulator=emulator, progress=hinder, patience_s=3.0).open()
        assert emulator.highest_torque == 0

    def test_a_power_failure_while_homing_is_told(self):
        emulator = still()

        def pull_the_plug(line):
            if line == STROKES:
                emulator.power(False)

        with pytest.raises(NotHomed) as caught:
            EmulatedFalcon(emulator=emulator, progress=pull_the_plug, patience_s=1.0).open()
        assert caught.value.kind == "silent"

    def test_a_cable_that_is_pulled_while_homing_is_told(self):
        emulator = still()

        def pull_the_cable(line):
            if line == PULL_OUT:
                emulator.faults.on("unplugged")

        with pytest.raises(UsbFailure, match="no longer there"):
            EmulatedFalcon(emulator=emulator, progress=pull_the_cable).open()

    def test_it_can_be_given_up(self):
        lines = []
        device = EmulatedFalcon(emulator=still(), progress=lines.append, cancelled=lambda: PULL_OUT in lines)
        with pytest.raises(DeviceError, match="cancelled"):
            device.open()
        assert READY not in lines


class TestForce:
    def test_it_comes_in_over_half_a_second_and_is_never_there_before_homing(self, opened):
        ticks = Ticks(opened)
        pushes = []
        for _ in range(700):
            ticks.after(1, (0.0, 0.0, 2.0))
            pushes.append(opened.hand.force_n[2])
        assert np.diff(pushes).max() < 0.02
        assert pushes[249] == pytest.approx(1.0, abs=0.05)
        assert pushes[-1] == pytest.approx(2.0, rel=5e-3)
        assert opened.hand.highest_unhomed_torque == 0

    @pytest.mark.variants(1)
    @pytest.mark.parametrize("name", GEOMETRIES)
    def test_the_emulators_own_mechanics_make_of_it_what_was_asked_for(self, name):
        """Everywhere in the box that encoders are known to reach, in any direction, within half a percent."""
        centre = GEOMETRIES[name].centre_m
        random = Random(5)  # noqa: S311
        errors = []
        with EmulatedFalcon(emulator=still(geometry=name), geometry=name) as device:
            ticks = Ticks(device)
            ticks.after(600, (0.0, 0.0, 0.01))
            for x, y, z in places_in_the_box(GEOMETRIES[name]):
                push_n = np.array([random.uniform(-1, 1) for _ in range(3)])
                push_n *= random.uniform(1.0, 2.5) / np.linalg.norm(push_n)
                device.hand.reach_to(*(np.array([x, y, z - centre]) - push_n / STIFFNESS_NPM))
                ticks.after(1000, tuple(push_n))
                assert ticks.position_m == pytest.approx((x, y, z - centre), abs=5e-4)
                errors.append(np.linalg.norm(device.hand.force_n - push_n) / np.linalg.norm(push_n))
            assert device.counters["shortened"] == 0
        assert len(errors) > 40
        assert max(errors) < 0.005

    def test_closing_takes_it_away_for_good(self, opened):
        ticks = Ticks(opened)
        ticks.after(600, (1.0, 1.0, 1.0))
        assert opened.hand.torques != (0, 0, 0)
        opened.close()
        assert opened.hand.torques == (0, 0, 0)
        assert opened.hand.lights == 0
        assert opened.hand.homed == 0b111  # and stays so, for whoever opens it next
        assert ticks.after(1, (1.0, 1.0, 1.0)) == READ_LOST
        assert opened.hand.torques == (0, 0, 0)
        opened.close()

    @pytest.mark.parametrize("interrupted", ["quiet", "close"])
    def test_an_end_that_is_interrupted_leaves_the_rest_to_the_guard(self, opened, monkeypatch, interrupted):
        guard = Guard()
        opened.guard = guard
        transport = opened.transport
        ticks = Ticks(opened)
        ticks.after(600, (1.0, 1.0, 1.0))
        close = transport.close

        def interrupt(*_):
            close()
            raise KeyboardInterrupt

        if interrupted == "quiet":
            monkeypatch.setattr(driver, "quiet", lambda _: (_ for _ in ()).throw(KeyboardInterrupt))
        else:
            monkeypatch.setattr(transport, "close", interrupt)
        with pytest.raises(KeyboardInterrupt):
            opened.close()
        assert guard.orders == (["release"] if interrupted == "quiet" else ["stand_down"])
        with pytest.raises(FalconLost):
            transport.write(b"", 1.0)
        assert ticks.after(1) == READ_LOST

    def test_a_calibration_of_this_one_is_used_and_told(self):
        calibration.save("OWN", Calibration("zm-redux", 9000.0, 0.05, measured="2026-11-20"))
        emulator = still(geometry="zm-redux", serial="OWN", units_per_nm=9000.0, arm_offset_rad=(0.05, 0.05, 0.05))
        with EmulatedFalcon(emulator=emulator) as device:
            ticks = Ticks(device)
            ticks.after(700, (0.5, -1.0, 1.5))
            assert emulator.force_n == pytest.approx((0.5, -1.0, 1.5), abs=0.01)
            assert ticks.position_m == pytest.approx(emulator.position_m, abs=1e-4)
            described = device.describe()
        assert described["geometry"] == "zm-redux"
        assert described["calibration"]["measured"] == "2026-11-20"
        assert described["units_per_nm"] == 9000.0

    def test_a_calibration_does_not_outlive_what_it_was_measured_of(self):
        calibration.save("OWN", Calibration("zm-redux", 9000.0, 0.05))
        emulator = still(serial="OWN")
        device = EmulatedFalcon(emulator=emulator)
        before = {name: value for name, value in device.describe().items() if name != "dynamics"}  # measured anew
        with device:
            assert device.describe()["geometry"] == "zm-redux"
        emulator.serial = "ANOTHER"
        with device:
            described = device.describe()
        assert {name: described[name] for name in before} == before


class TestInUse:
    def test_buttons_are_those_of_the_grip_and_the_last_one_stops(self, opened):
        ticks = Ticks(opened)
        ticks.after(3)
        opened.hand.press(0b1000)
        ticks.after(3)
        assert ticks.reading[0].buttons == BUTTON_STOP
        opened.hand.release()
        ticks.after(3)
        assert ticks.reading[0].buttons == 0

    def test_a_cable_that_is_pulled_is_lost_until_it_is_opened_again(self, opened):
        ticks = Ticks(opened)
        ticks.after(600, (0.0, 1.0, 0.0))
        opened.hand.faults.on("unplugged")
        assert ticks.after(1) == READ_LOST
        assert write(opened)[0] == READ_LOST
        opened.close()
        opened.hand.faults.off("unplugged")
        opened.open()
        assert opened.hand.torques == (0, 0, 0)
        again = Ticks(opened, ticks.now_ns)
        assert again.after(3) == READ_NEW

    @pytest.mark.parametrize(("push_n", "order"), [(1.0, "leave"), (0.0, "stand_down")])
    def test_a_cable_pulled_while_it_pushes_leaves_the_guard_waiting_for_it(self, opened, push_n, order):
        guard = opened.guard = Guard()
        ticks = Ticks(opened)
        ticks.after(600, (0.0, push_n, 0.0))
        opened.hand.faults.on("unplugged")
        ticks.after(1)
        opened.close()
        assert guard.orders == [order]

    def test_a_falcon_that_is_opened_again_recalls_the_guard_that_waits_for_it(self, opened):
        guard = opened.guard = Guard()
        ticks = Ticks(opened)
        ticks.after(600, (0.0, 1.0, 0.0))
        opened.hand.faults.on("unplugged")
        ticks.after(1)
        opened.close()
        with pytest.raises(DeviceError):
            opened.open()
        assert guard.orders == ["leave"]
        opened.hand.faults.off("unplugged")
        for _ in range(2):
            opened.open()
            opened.close()
        assert guard.orders == ["leave", "recall"]

    def test_a_mains_adapter_that_fails_gives_no_more_positions(self, opened):
        ticks = Ticks(opened)
        assert ticks.after(3) == READ_NEW
        opened.hand.power(False)
        assert ticks.after(60, (1.0, 0.0, 0.0)) == READ_NOTHING_NEW
        opened.hand.power(True)
        assert ticks.after(60, (1.0, 0.0, 0.0)) == READ_NOTHING_NEW

    def test_ticks_without_faults_are_all_fresh(self, opened):
        ticks = Ticks(opened)
        ticks.after(1000)
        counters = opened.counters
        assert counters["ticks"] == 1000
        assert counters["fresh"] == 999
        assert counters["cut_short"] == counters["read_errors"] == counters["write_errors"] == 0
