"""The emulated device: the program's list, the driver's ticks, its faults, and the Falcon through either driver."""

from typing import Any

import numpy as np
import pytest

from study_app.devices.descriptor import READY
from study_app.devices.force_dimension.failures import FAILURES, OPTION
from study_app.devices.registry import descriptor_of, doctor_of
from study_app.errors import DeviceError, DeviceLost, DeviceNotFound, ServoFault
from tests.compiled import needs_servo

STREAM = {"error": "error", "nan": "not-finite", "force-off": "force-off", "time-guard": "rate"}
PATH_S = np.arange(0.0, 4.0, 0.01)


class TestDescriptor:
    @pytest.mark.parametrize(
        ("name", "by_itself"),
        [("force-dimension", False), ("force-dimension:10233", False), ("force-dimension-emulated", True)],
    )
    def test_says_who_moves_the_handle_and_what_examines_it(self, name: str, by_itself: bool) -> None:
        device = descriptor_of(name)
        assert (device.moves_by_itself, device.simulated) == (by_itself, by_itself)
        assert device.doctor is not None
        assert len(device.doctor.findings()) == len(FAILURES.modes)
        assert [option.name for option in device.options] == ([] if by_itself else [OPTION])

    def test_the_emulated_one_is_ready_and_takes_no_argument(self) -> None:
        (backend,) = descriptor_of("force-dimension-emulated").probe()
        assert backend.state == READY
        with pytest.raises(DeviceNotFound):
            descriptor_of("force-dimension-emulated:x")

    def test_every_mode_has_a_cause_a_cure_and_a_sentence_in_one_line(self) -> None:
        assert len({mode.id for mode in FAILURES.modes}) == len(FAILURES.modes)
        for mode in FAILURES.modes:
            assert mode.cause
            assert mode.cure
            assert "\n" not in FAILURES.sentence(mode.id, "seen")
            assert str(FAILURES.failure(mode.id)).startswith("the Force Dimension device cannot be used: ")
        states = [one.state for one in FAILURES.findings("no-device", FAILURES.before("no-device"))]
        assert states[:4] == ["ok", "ok", "found", "not checked"]


def emulated(**settings: Any) -> Any:
    from study_app.devices.force_dimension.emulated import EmulatedForceDimension

    return EmulatedForceDimension(tremor_m=0.0, **settings)


def stroked(device: Any, clock: Any = None) -> tuple[Any, Any]:
    """Move a device's hand back and forth through honey; return the servo and its samples of the last 0.9 s."""
    from study_app.haptics.runtime.clocks.clock import VirtualClock
    from study_app.haptics.runtime.servo import Servo
    from study_app.protocol.load import load

    servo = Servo(device, clock=clock or VirtualClock())
    reader = servo.telemetry.reader()
    servo.load(load("rek2024").scene_for("honey"))
    path_m = np.zeros((PATH_S.size, 3))
    path_m[:, 0] = 0.02 * (1.0 - np.cos(2.0 * np.pi * PATH_S))
    device.hand.follow(PATH_S, path_m)
    servo.advance(3000)
    reader.read()
    servo.advance(900)
    return servo, reader.read()


@needs_servo
class TestEmulated:
    def test_readings_are_those_of_the_simulated_handle_and_force_acts_on_it(self) -> None:
        device = emulated()
        with device:
            servo, rows = stroked(device)
            servo.check()
            assert rows.fresh.all()
            assert np.ptp(rows.position_m[:, 0]) > 0.03
            assert np.ptp(rows.position_m[:, 1:], axis=0).max() < 1e-4
            moved_mps = np.gradient(rows.position_m[:, 0], 1e-3)
            assert np.abs(moved_mps - rows.device_velocity_mps[:, 0])[50:-1].max() < 0.05  # a count a millisecond
            assert device.hand.force_n == pytest.approx(rows.device_force_n[-1])
            assert np.abs(rows.device_force_n[:, 0]).max() > 1.0
        assert device.hand.force_n == (0.0, 0.0, 0.0)

    @pytest.mark.parametrize("fault", STREAM)
    def test_a_fault_in_a_stroke_ends_in_its_message_and_zero_force(self, fault: str) -> None:
        device = emulated()
        device.open()
        servo, _ = stroked(device)
        assert max(map(abs, device.hand.force_n)) > 0.5
        device.emulated.take(fault)
        assert servo.advance(100) < 60
        assert device.failure_mode == STREAM[fault]
        with pytest.raises((DeviceLost, ServoFault)) as stopped:
            servo.check()
        assert FAILURES.mode(STREAM[fault]).cure in str(stopped.value)
        assert device.hand.force_n == (0.0, 0.0, 0.0)
        servo.stop()
        device.close()
        assert device.hand.force_n == (0.0, 0.0, 0.0)

    def test_it_opens_again_after_a_fault(self) -> None:
        from study_app.haptics.runtime.clocks.clock import VirtualClock

        device, clock = emulated(), VirtualClock()
        device.open()
        servo, _ = stroked(device, clock)
        device.emulated.take("error")
        servo.advance(100)
        device.emulated.state.fault = 0
        device.close()
        device.open()
        servo, rows = stroked(device, clock)
        servo.check()
        assert np.abs(rows.device_force_n[:, 0]).max() > 1.0
        device.close()

    def test_an_unknown_fault_is_refused(self) -> None:
        with pytest.raises(DeviceError, match="fault 'thirst' is not known; choose of: error, "):
            emulated().emulated.take("thirst")


@needs_servo
class TestDoctor:
    def test_the_emulated_device_is_in_order(self) -> None:
        report = doctor_of("force-dimension-emulated").examine("force-dimension-emulated", options={}, progress=str)
        assert report.well, report
        assert "new positions per second: 1000" in " ".join(report.seen)

    @pytest.mark.parametrize(("fault", "mode"), STREAM.items())
    def test_a_fault_while_it_runs_is_the_finding(self, fault: str, mode: str) -> None:
        name = "force-dimension-emulated"
        report = doctor_of(name).examine(name, options={}, faults=[fault], progress=str)
        assert [one.id for one in report.found] == [mode]

    def test_only_the_emulated_one_takes_faults(self) -> None:
        with pytest.raises(DeviceError, match="'force-dimension' cannot be given faults"):
            doctor_of("force-dimension").examine("force-dimension", options={}, faults=["nan"], progress=str)


@pytest.mark.slow
@needs_servo
def test_the_same_handle_through_the_falcons_own_driver_has_the_same_force() -> None:
    """Emulated halves: the Falcon's own driver with its kinematics and motors, and the maker-library driver."""
    from study_app.devices.falcon.emulated import EmulatedFalcon
    from study_app.devices.falcon.emulator.emulator import Emulator

    falcon = EmulatedFalcon(emulator=Emulator(running=True, tremor_m=0.0, workspace_m=(0.05, 0.05, 0.05)))
    found = []
    for device in (emulated(), falcon):
        with device:
            servo, rows = stroked(device)
            servo.check()
            found.append(rows)
    through_library, own = found
    off_m = np.abs(through_library.position_m - own.position_m).max()
    mean_n = [float(np.abs(rows.device_force_n[:, 0]).mean()) for rows in found]
    print(f"positions within {1e6 * off_m:.0f} um, mean forces {mean_n[0]:.3f} and {mean_n[1]:.3f} N")  # noqa: T201
    assert mean_n[0] > 0.5
    assert off_m < 5e-4
    assert mean_n[0] == pytest.approx(mean_n[1], rel=0.05)
