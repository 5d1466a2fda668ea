"""The real driver with a stand-in library of our own, built by the C compiler: opening, ticks, faults, ends."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from study_app.devices.descriptor import NONE, NOT_AVAILABLE
from study_app.devices.doctor import DeviceFailure
from study_app.devices.force_dimension import library as library_module
from study_app.devices.force_dimension.library import LONGEST_WATCHDOG, VARIABLE, Library, probe
from study_app.devices.registry import doctor_of, open_device
from study_app.errors import DeviceError, DeviceNotFound, ServoFault
from study_app.haptics.model.device_dynamics import UNKNOWN
from study_app.haptics.model.layout import LIMITER_SATURATED
from study_app.store import workstation
from study_app.store.workstation import DeviceBench
from study_app.user_folder import FOLDER_VARIABLE
from tests.compiled import needs_servo
from tests.devices.force_dimension.standin import StandIn, build, needs_standin
from tests.devices.subjects import until, write

pytestmark = [needs_servo, *needs_standin]


def open_with_stand_in(standin: StandIn, name: str = "force-dimension", **limits: Any) -> Any:
    return open_device(name, options={"dhd-library": standin.path}, **limits)


def servo_in_stroke(device: Any) -> Any:
    """Return a servo in mid-stroke through honey; a reading of the stand-in is a millisecond."""
    from study_app.haptics.runtime.clocks import VirtualClock
    from study_app.haptics.runtime.servo import Servo
    from study_app.protocol.load import load

    servo = Servo(device, clock=VirtualClock())
    servo.load(load("rek2024").scene_for("honey"))
    servo.advance(1000)
    return servo


class RoundTripClock:
    """A clock that gives each round trip, one after every pause, the next of these durations [s]."""

    def __init__(self, durations_s: list[float]) -> None:
        self._durations_s, self._trip, self._has_begun = durations_s, -1, False

    def sleep(self, _seconds: float) -> None:
        self._trip, self._has_begun = self._trip + 1, False

    def perf_counter(self) -> float:
        duration_s = self._durations_s[self._trip] if self._has_begun else 0.0
        self._has_begun = True
        return self._trip + duration_s


class TestLibrary:
    def test_a_library_that_is_not_there_is_refused_with_the_cure(self, tmp_path: Path) -> None:
        with pytest.raises(DeviceNotFound, match=rf"cannot be loaded .*--dhd-library or {VARIABLE}$"):
            open_device("force-dimension", options={"dhd-library": tmp_path / "libdrd.so"})

    def test_a_library_without_a_function_is_refused_with_its_name(self, tmp_path: Path) -> None:
        with pytest.raises(DeviceFailure, match=r"\(dhdSetWatchdog, dhdGetWatchdog\): it is older") as refused:
            Library(build(tmp_path, "-DLACKS_WATCHDOG"))
        assert refused.value.mode == "old-library"

    def test_probe_finds_library_and_devices_without_opening(
        self, standin: StandIn, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv(VARIABLE, str(standin.path))
        assert probe().state == "connected: 1"
        standin.fault("no-device")
        assert probe().state == NONE
        monkeypatch.setenv(VARIABLE, str(standin.path.with_name("nowhere.so")))
        backend = probe()
        assert backend.state == NOT_AVAILABLE
        assert VARIABLE in backend.why
        assert standin.state["open"] == 0.0


class TestOpening:
    def test_safety_functions_stay_on_and_are_recorded(self, standin: StandIn) -> None:
        with open_with_stand_in(standin) as device:
            description = device.describe()
            state = standin.state
            assert (state["time_guard"], state["watchdog"], state["gravity"]) == (-1.0, LONGEST_WATCHDOG, 1.0)
            assert state["force_on"] == 1.0
            assert state["force_n"] == [0.0, 0.0, 0.0]
        assert description["velocity_threshold"] == 40
        assert description["watchdog_s"] == pytest.approx(0.031875)
        assert (description["sdk"], description["system"], description["serial"]) == (
            "3.17.5.0",
            "stand-in omega.7",
            "10233",
        )
        state = standin.state
        assert (state["stopped"], state["force_on"], state["closed"]) == (1.0, 0.0, 1.0)

    def test_delay_count_and_mass_are_measured_and_read(self, standin: StandIn) -> None:
        with open_with_stand_in(standin) as device:
            dynamics = device.dynamics
            assert device.describe()["com_mode"] == 1
        assert dynamics.unknown == ()
        assert 0.0 < dynamics.delay_s < 1e-3
        assert dynamics.count_m == pytest.approx(10e-6)
        assert dynamics.mass_kg == pytest.approx(0.2)

    @pytest.mark.parametrize(
        ("fault", "mode", "delay_s"), [("none", 1, 2 * 46e-5), ("guarded", 1, 2 * 45e-5), ("plain", 0, 46e-5)]
    )
    def test_the_delay_is_the_90th_percentile_of_new_positions_twice_if_exchanges_overlap(
        self, standin: StandIn, monkeypatch: pytest.MonkeyPatch, fault: str, mode: int, delay_s: float
    ) -> None:
        """Round trips last 10, 20 … 500 µs, or 10, 30 … 490 µs and every second one, without a new position, 9 ms."""
        steps = [1 + 22 * trip % 25 + 25 * (trip % 2) for trip in range(50)]
        if fault == "guarded":
            steps = [900 if trip % 2 else 1 + 14 * trip % 50 for trip in range(50)]
        monkeypatch.setattr(library_module, "time", RoundTripClock([1e-5 * step for step in steps]))
        standin.fault(fault)
        with open_with_stand_in(standin) as device:
            facts = device.describe()
            assert device.dynamics.delay_s == pytest.approx(delay_s)
        has_wrist = fault != "plain"
        expected = {
            "com_mode": mode, "system_type": 35, "wrist": has_wrist, "gripper": True, "active_wrist": False,
            "active_gripper": True, "gravity_compensation": True, "effector_mass_kg": 0.19, "max_force_n": None,
            "time_guard": "default",
        }  # fmt: skip
        assert {name: facts[name] for name in expected} == expected

    def test_values_missing_in_the_library_come_from_the_latest_bench_or_are_assumed(
        self, standin: StandIn, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
        standin.fault("unmodelled")
        with open_with_stand_in(standin) as device:
            assert device.dynamics.assumed == device.dynamics.unknown == ("count_m", "mass_kg")
            assert device.dynamics[1:3] == UNKNOWN[1:3]
        axes = (0.31, 0.22, 0.4)
        bench = DeviceBench(
            name="force-dimension", serial="10233", measured="2026-11-24", mass_kg=axes, damping_nspm=axes,
            friction_n=axes, delay_ms=axes, stable_nspm=axes, count_m=12e-6,
        )  # fmt: skip
        workstation.save_settings(workstation.DEFAULTS.with_bench(bench))
        with open_with_stand_in(standin) as device:
            assert device.dynamics.unknown == ()
            assert device.dynamics[1:3] == (12e-6, 0.22)
        workstation.save_settings(workstation.DEFAULTS.with_bench(bench.model_copy(update={"serial": "10234"})))
        with open_with_stand_in(standin) as device:  # another one's
            assert device.dynamics.assumed == ("count_m", "mass_kg")

    def test_a_serial_number_chooses_the_device(self, standin: StandIn) -> None:
        open_with_stand_in(standin, "force-dimension:10233").close()
        with pytest.raises(DeviceNotFound, match="the library cannot open the device"):
            open_with_stand_in(standin, "force-dimension:10234")
        with pytest.raises(DeviceError, match="'left' is not a Force Dimension serial number"):
            open_with_stand_in(standin, "force-dimension:left")


class TestTicks:
    def test_position_velocity_buttons_orientation_and_gripper_are_in_the_hand_frame(self, standin: StandIn) -> None:
        standin.rotate([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # 90 degrees about the maker's z: up
        standin.loaded.standin_press(0b101)
        with open_with_stand_in(standin) as device:
            from study_app.haptics.runtime.clocks import VirtualClock
            from study_app.haptics.runtime.servo import Servo

            servo = Servo(device, clock=VirtualClock())
            reader = servo.telemetry.reader()
            before = standin.state["readings"]
            servo.advance(500)
            rows = reader.read()[1:]
        t_s = 1e-3 * (before + np.arange(2, len(rows) + 2))
        assert rows.position_m[:, 0] == pytest.approx(0.03 * np.sin(2 * np.pi * t_s))
        assert (rows.position_m[:, 1] == 0.01).all()
        assert (rows.position_m[:, 2] == 0.0).all()
        assert rows.device_velocity_mps[:, 0] == pytest.approx(0.06 * np.pi * np.cos(2 * np.pi * t_s))
        half = math.sqrt(0.5)
        assert rows.orientation[-1] == pytest.approx([half, 0.0, half, 0.0])  # about the hand frame's y: up
        assert (rows.gripper_m == 0.012).all()
        assert (rows.buttons == 0b101).all()
        assert (rows.measured == 0b111).all()

    @pytest.mark.parametrize("axis", [(3, 2, 1), (-1, 3, 2), (2, 1, -3)])
    @pytest.mark.parametrize("angle", [0.3, 2.0, 3.1, -3.1])
    def test_an_orientation_about_any_axis_is_that_about_the_hand_frames(
        self, standin: StandIn, axis: tuple[float, float, float], angle: float
    ) -> None:
        from study_app.haptics.model.layout import new_reading

        rotation = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis))
        standin.rotate(rotation.as_matrix())
        with open_with_stand_in(standin) as device:
            reading = new_reading()
            assert device.read.ctypes(device.context, 1_000_000, reading.ctypes.data) == 0
        toward, right, up, w = rotation.as_quat()  # of the maker's axes
        assert abs(reading[0].orientation @ (w, right, up, toward)) == pytest.approx(1.0, abs=1e-12)

    def test_force_is_sent_in_the_makers_axes_and_not_to_the_wrist(self, standin: StandIn) -> None:
        with open_with_stand_in(standin, force_limit_n=4.0) as device:
            assert write(device, (1.0, 2.0, -3.0))[1].tolist() == [1.0, 2.0, -3.0]
            state = standin.state
            assert state["force_n"] == [-3.0, 1.0, 2.0]
            assert (state["torque"], state["grip"]) == ([0.0, 0.0, 0.0], 0.0)
            for refused in ((0.0, 5.0, 0.0), (math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0)):
                assert write(device, refused)[1].tolist() == [0.0, 0.0, 0.0]
                assert standin.state["force_n"] == [0.0, 0.0, 0.0]

    def test_readings_that_the_time_guard_answers_are_not_new(self, standin: StandIn) -> None:
        standin.fault("guarded")
        with open_with_stand_in(standin) as device:
            servo = servo_in_stroke(device)
            servo.check()
            assert device.counters["guarded"] == pytest.approx(500, abs=1)
            assert device.counters["fresh"] + device.counters["guarded"] == device.counters["ticks"]

    def test_forces_that_saturate_the_motors_are_counted_and_their_ticks_marked(self, standin: StandIn) -> None:
        standin.fault("saturated")
        with open_with_stand_in(standin) as device:
            servo = servo_in_stroke(device)
            servo.check()
            assert device.counters["saturated"] >= 1000
            reader = servo.telemetry.reader()
            standin.fault("none")
            servo.advance(10)
            standin.fault("saturated")
            servo.advance(10)
            marked = reader.read().limiters & LIMITER_SATURATED != 0
            assert marked[-20:].tolist() == [False] * 10 + [True] * 10


def test_a_device_in_order_has_no_finding(standin: StandIn) -> None:
    report = doctor_of("force-dimension").examine(
        "force-dimension", options={"dhd-library": standin.path}, progress=str
    )
    assert report.failure is None
    assert not [finding.id for finding in report.found if finding.id != "rate"]  # a loaded machine may be late
    assert standin.state["stopped"] == 1.0


def test_a_call_that_lasts_ends_the_servo_and_the_force_once_it_returns(standin: StandIn) -> None:
    from study_app.haptics.runtime.servo import Servo

    device = open_with_stand_in(standin)
    servo = Servo(device)
    servo.start()
    standin.fault("slow")
    until(lambda: servo.fault is not None, "the servo goes on")
    with pytest.raises(ServoFault, match="force-dimension"):
        servo.check()
    servo.stop()
    device.close()
    state = standin.state
    assert (state["stopped"], state["force_on"], state["force_n"]) == (1.0, 0.0, [0.0, 0.0, 0.0])
