"""The Falcon's driver beyond the contract: firmware, homing, calibration, and a guard that may die."""

import hashlib
import json
from itertools import product
from random import Random

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.emulators.falcon import EmulatedFalcon
from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.falcon import boot, calibration, constants
from study_app.devices.falcon import device as driver
from study_app.devices.falcon.calibration import Calibration, Grip
from study_app.devices.falcon.device import PULL_OUT, READY, STROKES, FalconDevice
from study_app.devices.falcon.failures import FalconLost
from study_app.devices.falcon.mechanics import GEOMETRIES, REACHED, SAFE_BOX_M, inverse, new_mechanism
from study_app.devices.registry import open_device
from study_app.devices.simulated import STIFFNESS_NPM
from study_app.errors import DeviceError, DeviceLost
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW
from study_app.haptics.model.layout import BUTTON_STOP
from tests.devices.falcon.support.firmware_stream import stream
from tests.devices.subjects import Ticks

pytestmark = pytest.mark.slow

NONE = (0, 0, 0)


def still(**options):
    return Emulator(**{"tremor_m": 0.0, "running": True, **options})


class Guard:
    """A guard that records its orders."""

    def __init__(self):
        self.orders = []

    def __getattr__(self, name):
        return lambda: self.orders.append(name)


@pytest.fixture
def messages():
    return []


@pytest.fixture
def falcon(messages):
    with EmulatedFalcon(emulator=still(), progress=messages.append) as device:
        yield device


class TestOpening:
    def test_it_is_homed_by_a_hand_that_follows_the_instructions(self, falcon, messages):
        assert messages == [STROKES, PULL_OUT, READY]
        assert (falcon.hand.homed, falcon.hand.lights) == (0b111, constants.FLAG_GREEN)
        assert falcon.hand.highest_torque == 0
        ticks = Ticks(falcon)
        assert ticks.after(2) == READ_NEW
        assert np.abs(ticks.position_m).max() < 1e-3
        described = falcon.describe()
        assert described["event_character"] is True
        assert described["round_trip_ms"]["with"] < 0.5 < described["round_trip_ms"]["without"]
        assert (described["serial"], described["firmware"]) == ("EMULATED", "already running")
        assert (described["geometry"], described["calibration"]) == ("libnifalcon", "none")
        assert described["units_per_nm"] == 6616.0

    def test_a_falcon_that_was_switched_on_is_given_its_program(self, tmp_path, messages, monkeypatch):
        file = tmp_path / "secret-folder-firmware.bin"
        file.write_bytes(stream())
        digest = hashlib.sha256(stream()).hexdigest()
        for name in (None, "nvent_firmware.bin"):
            if name is not None:
                monkeypatch.setitem(boot.KNOWN, (digest[:16], digest[-8:]), name)
            with open_device("falcon-emulated", options={"firmware": file}, progress=messages.append) as device:
                assert (device.hand.running, device.hand.homed) == (True, 0b111)
                described = json.dumps(device.describe())
            assert json.loads(described)["firmware"] == digest
            assert "secret" not in described
        loading = [line for line in messages if line.startswith("Loading")]
        assert len(loading) == 2
        assert f"an unrecognised version (SHA-256 {digest[:16]}…)" in loading[0]
        assert loading[1] == "Loading the Falcon's firmware, nvent_firmware.bin."

    def test_a_workspace_beyond_its_reach_is_refused(self):
        with pytest.raises(
            DeviceError,
            match=(
                r"200 x 60 x 60 mm exceeds a Falcon's reach \(about 100 x 60 x 60 "
                r"mm"
            ),
        ):
            EmulatedFalcon(workspace_m=(0.1, 0.03, 0.03))

    def test_it_can_be_given_up(self, messages):
        device = EmulatedFalcon(emulator=still(), progress=messages.append, cancelled=lambda: PULL_OUT in messages)
        with pytest.raises(DeviceError, match="cancelled"):
            device.open()
        assert READY not in messages


class TestForce:
    def test_it_comes_in_over_half_a_second_and_is_never_there_before_homing(self, falcon):
        ticks = Ticks(falcon)
        pushes = []
        for _ in range(700):
            ticks.after(1, (0.0, 0.0, 2.0))
            pushes.append(falcon.hand.force_n[2])
        assert np.diff(pushes).max() < 0.02
        assert pushes[249] == pytest.approx(1.0, abs=0.05)
        assert pushes[-1] == pytest.approx(2.0, rel=5e-3)
        assert falcon.hand.highest_unhomed_torque == 0

    @pytest.mark.variants(1)
    @pytest.mark.parametrize("name", GEOMETRIES)
    def test_the_emulated_mechanics_produce_the_requested_force(self, name):
        """This holds everywhere in the reachable box, in any direction, within half a percent."""
        geometry = GEOMETRIES[name]
        mechanism, theta = new_mechanism(geometry, 1.0), np.zeros(3)
        random = Random(5)  # noqa: S311
        errors = []
        with EmulatedFalcon(emulator=still(geometry=name), geometry=name) as device:
            ticks = Ticks(device)
            ticks.after(600, (0.0, 0.0, 0.01))
            for place in product(*(np.linspace(low, high, 4) for low, high in SAFE_BOX_M)):
                reached = inverse(mechanism, np.array(place), theta) == REACHED
                if not reached or np.abs((theta - mechanism.zero_rad) / mechanism.rad_per_count).max() >= 1600:
                    continue
                at_m = np.subtract(place, (0.0, 0.0, geometry.centre_m))
                push_n = np.array([random.uniform(-1, 1) for _ in range(3)])
                push_n *= random.uniform(1.0, 2.5) / np.linalg.norm(push_n)
                device.hand.reach_to(*(at_m - push_n / STIFFNESS_NPM))
                ticks.after(1000, tuple(push_n))
                assert ticks.position_m == pytest.approx(at_m, abs=5e-4)
                errors.append(np.linalg.norm(device.hand.force_n - push_n) / np.linalg.norm(push_n))
            assert device.counters["shortened"] == 0
        assert len(errors) > 40
        assert max(errors) < 0.005

    @pytest.mark.parametrize("interrupted", ["quiet", "close"])
    def test_an_end_that_is_interrupted_leaves_the_rest_to_the_guard(self, falcon, monkeypatch, interrupted):
        guard = falcon.guard = Guard()
        transport, close = falcon.connection, falcon.connection.close
        ticks = Ticks(falcon)
        ticks.after(600, (1.0, 1.0, 1.0))

        def interrupt(*_):
            close()
            raise KeyboardInterrupt

        if interrupted == "quiet":
            monkeypatch.setattr(driver, "send_zero_torque", lambda _: (_ for _ in ()).throw(KeyboardInterrupt))
        else:
            monkeypatch.setattr(transport, "close", interrupt)
        with pytest.raises(KeyboardInterrupt):
            falcon.close()
        assert guard.orders == (["release"] if interrupted == "quiet" else ["stand_down"])
        with pytest.raises(FalconLost):
            transport.write(b"", 1.0)
        assert ticks.after(1) == READ_LOST

    def test_a_calibration_of_this_device_is_used_reported_and_not_kept(self):
        calibration.save_calibration(
            "OWN", Calibration(geometry="zm-redux", units_per_nm=9000.0, arm_offset_rad=0.05, measured="2026-11-20")
        )
        emulator = still(geometry="zm-redux", serial="OWN", units_per_nm=9000.0, arm_offset_rad=(0.05, 0.05, 0.05))
        device = EmulatedFalcon(emulator=emulator)
        before = {name: value for name, value in device.describe().items() if name != "dynamics"}  # measured anew
        with device:
            ticks = Ticks(device)
            ticks.after(700, (0.5, -1.0, 1.5))
            assert emulator.force_n == pytest.approx((0.5, -1.0, 1.5), abs=0.01)
            assert ticks.position_m == pytest.approx(emulator.position_m, abs=1e-4)
            described = device.describe()
        assert (described["geometry"], described["units_per_nm"]) == ("zm-redux", 9000.0)
        assert described["calibration"]["measured"] == "2026-11-20"
        emulator.serial = "ANOTHER"
        with device:
            described = device.describe()
        assert {name: described[name] for name in before} == before


class TestInUse:
    def test_the_last_button_stops_the_force(self, falcon):
        ticks = Ticks(falcon)
        falcon.hand.press(0b1000)
        ticks.after(3)
        assert ticks.reading[0].buttons == BUTTON_STOP

    def test_after_closing_it_stays_homed_with_its_lights_off(self, falcon):
        Ticks(falcon).after(600, (1.0, 1.0, 1.0))
        falcon.close()
        assert (falcon.hand.torques, falcon.hand.lights, falcon.hand.homed) == (NONE, 0, 0b111)

    @pytest.mark.parametrize(("push_n", "order"), [(1.0, "leave"), (0.0, "stand_down")])
    def test_a_cable_pulled_while_it_pushes_leaves_the_guard_waiting_for_it(self, falcon, push_n, order):
        guard = falcon.guard = Guard()
        ticks = Ticks(falcon)
        ticks.after(600, (0.0, push_n, 0.0))
        falcon.hand.faults.on("unplugged")
        ticks.after(1)
        falcon.close()
        assert guard.orders == [order]
        with pytest.raises(DeviceError):
            falcon.open()
        falcon.hand.faults.off("unplugged")
        for _ in range(2):
            falcon.open()
            falcon.close()
        assert guard.orders == ([order, "recall"] if push_n else [order])


class TestGuard:
    """Without a guard nothing would end the torque, so the device gets none."""

    def test_without_its_guard_it_does_not_push(self):
        device = EmulatedFalcon(emulator=still())
        device.ends_force = FalconDevice.ends_force
        with device:
            ticks = Ticks(device)
            assert ticks.after(600, (1.0, 1.0, 1.0)) == READ_NEW
            assert device.hand.torques != NONE
            device.check()
            device.guard.child.kill()
            device.guard.listener.join()
            assert ticks.after(2, (1.0, 1.0, 1.0)) == READ_LOST  # a packet takes its time
            assert device.hand.torques == NONE
            with pytest.raises(DeviceLost, match="guard process has died"):
                device.check()
            with pytest.raises(DeviceLost, match="guard process has died"):
                Grip(device, virtual=True)
        with device:  # opened anew it has a guard again
            device.check()
            assert Ticks(device, ticks.now_ns).after(600, (1.0, 1.0, 1.0)) == READ_NEW
            assert device.hand.torques != NONE
        device.check()  # which was dismissed, and did not die

    def test_a_guard_that_dies_while_it_is_homed_ends_that(self):
        device = EmulatedFalcon(emulator=still(), progress=lambda line: kill() if line == PULL_OUT else None)
        device.ends_force = FalconDevice.ends_force

        def kill():
            device.guard.child.kill()
            device.guard.listener.join()

        with pytest.raises(DeviceLost, match="guard process has died"):
            device.open()
        assert device.hand.highest_torque == 0
